"""The JSON Schemas of all text messages of the live protocol, which are served, and check what clients send.

Model: a `Version` lists the fields of each message. In V2 a `contact` may have a place and a direction on a texture
    over an area, and `ready` and `scene` state whether the texture is one. The faults of a message have the form of a
    scene's faults (pointer, value, allowed, hint). Binary messages are contact updates (`contact_update`) and PCM.
Limits: the schema checks only that a scene is an object; `synth.scene.scene` reads the scene.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import jsonschema_rs

from service.sessions.session_ids import LONGEST_ID

FORMATS = ("f32le", "s16le")
PACINGS = ("pull", "realtime")
SMALLEST_BLOCK, LARGEST_BLOCK = 16, 48_000  # frames; a smaller block costs too much, a larger one feels like a stall
LARGEST_CREDIT = 10_000_000  # frames of one `more`
LARGEST_SEQ = 2**32 - 1  # the binary form's u32
LARGEST_POSITION = 1e3  # m
LARGEST_SPEED = 10.0  # m/s, as in a scene
LARGEST_DIRECTION = 1e3  # rad, as the phase of a scene
LARGEST_LOAD = 1e3  # N, as in a scene
LARGEST_FRAME = 2**63 - 1
LARGEST_TIME = 1.7976931348623157e308  # the largest finite float64: any clock
END_REASONS = (
    "stopped",
    "finished",
    "shutting down",
    "expired",
    "slow reader",
    "policy",
    "too long",
    "cannot render",
    "our mistake",
)

_TEXT: dict[str, Any] = {"type": "string"}
_OBJECT: dict[str, Any] = {"type": "object"}


def _whole(low: int, high: int, sentence: str, unit: str = "") -> dict[str, Any]:
    return {"type": "integer", "minimum": low, "maximum": high, "description": sentence} | _unit(unit)


def _number(low: float, high: float, sentence: str, unit: str) -> dict[str, Any]:
    return {"type": "number", "minimum": low, "maximum": high, "description": sentence} | _unit(unit)


def _unit(unit: str) -> dict[str, Any]:
    return {"x-unit": unit} if unit else {}


def _choice(names: tuple[str, ...], sentence: str, **rest: Any) -> dict[str, Any]:
    return {"enum": list(names), "description": sentence, **rest}


def _message(kind: str, sentence: str, fields: Mapping[str, Any], optional: tuple[str, ...] = ()) -> dict[str, Any]:
    return {
        "type": "object",
        "description": sentence,
        "properties": {"type": {"const": kind}, **fields},
        "required": ["type", *(name for name in fields if name not in optional)],
        "additionalProperties": False,
    }


_FRAME = _whole(0, LARGEST_FRAME, "Frame of the stream, from 0.", "frames")
_SEQ = _whole(0, LARGEST_SEQ, "Number of the update; one that does not rise is ignored.")
_RESUME: dict[str, Any] = {
    "type": "object",
    "description": "Continue a session whose connection broke, from a frame that the server still keeps.",
    "properties": {"session": {"type": "string", "maxLength": LONGEST_ID}, "frame": _FRAME},
    "required": ["session", "frame"],
    "additionalProperties": False,
}
_HELLO = {
    "scene": {"type": "object", "description": "A scene; {} is the default one.", "default": {}},
    "format": _choice(FORMATS, "Samples: float32 or int16, little-endian, interleaved.", default="f32le"),
    "block": _whole(SMALLEST_BLOCK, LARGEST_BLOCK, "Frames of one binary message; default 10 ms.", "frames"),
    "pacing": _choice(PACINGS, "Blocks are sent by the client's credit, or by the server's clock.", default="pull"),
    "record": {"type": "boolean", "description": "Keep a recording of the session.", "default": False},
    "before_limiter": {
        "type": "boolean",
        "description": "Send what the limiter reduced also as it was before the limiter.",
        "default": False,
    },
    "resume": _RESUME,
}
_CONTACT = {
    "seq": _SEQ,
    "time": _number(-LARGEST_TIME, LARGEST_TIME, "The client's clock, of any origin.", "s"),
    "position": _number(-LARGEST_POSITION, LARGEST_POSITION, "Position of the surface under the finger.", "m"),
    "speed": _number(-LARGEST_SPEED, LARGEST_SPEED, "Speed of the surface, if no position is known.", "m/s"),
    "load": _number(-LARGEST_LOAD, LARGEST_LOAD, "Force of the finger; below 0 only with adhesion.", "N"),
    "more": _whole(0, LARGEST_CREDIT, "Credit, as of `more`. Only with pacing `pull`.", "frames"),
}
AREA_FIELDS = {
    "x": _number(
        -LARGEST_POSITION,
        LARGEST_POSITION,
        "Place of the finger's middle on the surface, in the coordinates of its map; with y.",
        "m",
    ),
    "y": _number(-LARGEST_POSITION, LARGEST_POSITION, "The same across; with x.", "m"),
    "direction": _number(
        -LARGEST_DIRECTION,
        LARGEST_DIRECTION,
        "Angle of the finger's length from the x axis, counter-clockwise, with x and y.",
        "rad",
    ),
}
_OPTIONAL = ("position", "speed", "load", "more", *AREA_FIELDS)
_CLIENT: Mapping[str, dict[str, Any]] = {
    "hello": _message("hello", "The first message, once.", _HELLO, tuple(_HELLO))
    | {"dependentSchemas": {"resume": {"properties": {name: False for name in _HELLO if name != "resume"}}}},
    "more": _message(
        "more",
        "Grants credit, which adds up. Only with pacing `pull`.",
        {"frames": _whole(1, LARGEST_CREDIT, "Frames that may be sent.", "frames")},
    ),
    "contact": _message("contact", "The present motion of the hand.", _CONTACT, _OPTIONAL)
    | {"oneOf": [{"required": ["position"]}, {"required": ["speed"]}]},
    "scene": _message(
        "scene", "Change the scene.", {"scene": {"type": "object", "description": "A partial scene (RFC 7396)."}}
    ),
    "stop": _message("stop", "Fade out and end.", {}),
}
_CONTACT_OF_V2 = _message("contact", "The present motion of the hand.", _CONTACT | AREA_FIELDS, _OPTIONAL) | {
    "oneOf": [{"required": ["position"]}, {"required": ["speed"]}, {"required": ["x"]}],
    "dependentRequired": {"x": ["y"], "y": ["x"], "direction": ["x", "y"]},
}
_FAULT = {
    "type": "object",
    "properties": dict.fromkeys(("pointer", "value", "allowed", "hint"), _TEXT),
    "required": ["pointer", "value", "allowed", "hint"],
}
_READY = {
    "session": _TEXT | {"description": "128 random bits, after the node. Keep it secret."},
    "resume_url": _TEXT | {"description": "Where to connect to resume. A proxy can route it by the id."},
    "protocol": {},  # the name of the version
    "sample_rate": _whole(1, 192_000, "Frames per second.", "Hz"),
    "channels": _whole(1, 1024, "Samples per frame."),
    "quantities": {"type": "array", "items": _TEXT},
    "full_scale": {"type": "array", "items": {"type": "number"}, "description": "SI value of 1.0, per channel."},
    "format": _choice(FORMATS, "As requested."),
    "block": _whole(SMALLEST_BLOCK, LARGEST_BLOCK, "Frames of a binary message.", "frames"),
    "pacing": _choice(PACINGS, "As requested."),
    "recording": {"type": "boolean"},
    "frame": _FRAME | {"description": "Frame of the first sample that follows."},
    "max_silence_ms": {"type": "number", "description": "Time without a contact after which the load ramps to zero."},
    "motion_delay_ms": {"type": "number", "description": "Delay of the sound behind the updates."},
    "plan": _OBJECT | {"description": "The plan under a hand, as /v1/explain answers, without scene and cost."},
}
_PROBLEM = {
    "problem": _TEXT | {"description": "The `type` of the problem document over HTTP."},
    "title": _TEXT,
    "status": {"type": "integer"},
    "detail": _TEXT,
    "errors": {"type": "array", "items": _FAULT},
    "instance": _TEXT,
}
_SCENE = {"frame": _FRAME, "plan": _OBJECT}
_AREA_FIELDS = {
    "over_area": {
        "type": "boolean",
        "description": "Whether the texture is over an area: y has an effect, and a contact may have a direction.",
    }
}
_SERVER: Mapping[str, dict[str, Any]] = {
    "applied": _message("applied", "The update takes effect at the frame.", {"seq": _SEQ, "frame": _FRAME}),
    "limited": _message(
        "limited",
        "The safety limiter acted: the largest reduction since the last such message.",
        {"frame": _FRAME, "gain_reduction_db": {"type": "number", "minimum": 0.0}},
    ),
    "before_limiter": _message(
        "before_limiter",
        "Samples of the next block before the limiter, where it acted. Only if `hello` asked for them.",
        {"frame": _FRAME, "samples": _TEXT | {"description": "Base64 of float32, little-endian, interleaved."}},
    ),
    "skipped": _message(
        "skipped",
        "The service was late and sent nothing for this time. All later frames are due that much later.",
        {"frame": _FRAME, "seconds": {"type": "number", "minimum": 0.0}},
    ),
    "problem": _message("problem", "A message was refused, or an error occurred.", _PROBLEM, ("instance",)),
    "end": _message("end", "No sound follows.", {"reason": _choice(END_REASONS, "The reason."), "frame": _FRAME}),
}


@dataclass(frozen=True)
class Version:
    """One version of the protocol.

    name: the subprotocol.
    client: schema of each message of the client, by its type.
    """

    name: str
    client: Mapping[str, dict[str, Any]]

    @cached_property
    def has_area(self) -> bool:
        """Whether a contact may have x, y and a direction."""
        return "x" in self.client["contact"]["properties"]

    @property
    def server(self) -> Mapping[str, dict[str, Any]]:
        """Return the schema of each message of the server, by its type."""
        added = _AREA_FIELDS if self.has_area else {}
        ready = _message("ready", "The answer to hello.", _READY | {"protocol": {"const": self.name}} | added)
        scene = _message("scene", "The cross-fade to the changed scene begins.", _SCENE | added)
        return {"ready": ready, "applied": _SERVER["applied"], "scene": scene, **_SERVER}

    @cached_property
    def validators(self) -> Mapping[str, jsonschema_rs.Draft202012Validator]:
        """Return what checks each message of the client, by its type."""
        return {kind: jsonschema_rs.Draft202012Validator(made) for kind, made in self.client.items()}

    def schema(self) -> dict[str, Any]:
        """Return the JSON Schema (2020-12) of all text messages. `$defs` names them client.hello, server.ready, ..."""
        sides = {"client": self.client, "server": self.server}
        messages = {f"{side}.{kind}": made for side, table in sides.items() for kind, made in table.items()}
        groups = {
            side: {"oneOf": [{"$ref": f"#/$defs/{side}.{kind}"} for kind in table]} for side, table in sides.items()
        }
        return {
            "$schema": "https://json-schema.org/draft/2020-12/schema",
            "title": f"ridgewave live protocol, {self.name}",
            "description": "Text messages of the WebSocket /v1/live. Binary ones: contact updates in, PCM out.",
            "anyOf": [{"$ref": "#/$defs/client"}, {"$ref": "#/$defs/server"}],
            "$defs": groups | messages,
        }


V1 = Version("ridgewave.v1", _CLIENT)
V2 = Version("ridgewave.v2", {**_CLIENT, "contact": _CONTACT_OF_V2})
VERSIONS = (V2, V1)
"""The versions that the service speaks, the newest first."""


def newest_version(offered: Iterable[str]) -> Version | None:
    """Return the newest version among the `offered` subprotocols, None if there is none."""
    names = set(offered)
    return next((version for version in VERSIONS if version.name in names), None)
