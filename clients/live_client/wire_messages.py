"""The messages of the live protocol `ridgewave.v1` as they stand on the wire.

Model: what the client says, as the text or bytes of one WebSocket message; what the service says, as a dictionary
    (text) or as samples (bytes). The page on the live protocol defines the words.
Limits: a stream has 2**32 contact updates (49 days of a thousand a second): past them `contact` raises InvalidRequest.
"""

from __future__ import annotations

import base64
import json
import math
import re
import struct
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from clients.client_errors import ProtocolError
from synth.errors import Fault, InvalidRequest, shown

SUBPROTOCOL = "ridgewave.v1"
KEY_SUBPROTOCOL = "ridgewave.key."

CONTACT = struct.Struct("<BBHIddf")  # version, flags, contact, seq, time (s), position (m) or speed (m/s), load (N)
CONTACT_VERSION = 1
IS_SPEED = 1  # flag: the value is a speed, not a position
NO_LOAD = 2  # flag: the load is absent and stays what it was
SEQ_LIMIT = 2**32

# SI; what the service takes. Wider bounds here would only move the refusal to the service.
POSITION_LIMIT = 1e3  # m
SPEED_LIMIT = 10.0  # m/s
LOAD_LIMIT = 1e3  # N, either way: a surface that attracts the finger may be pulled at

SceneDocument = Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class Contact:
    """What the hand does: where it is (m) or how fast it moves (m/s), never both, and the load (N; None keeps it)."""

    seq: int
    time: float
    value: float
    is_speed: bool
    load: float | None

    def message(self) -> bytes:
        """Return the binary form, 28 bytes."""
        flags = IS_SPEED * self.is_speed | NO_LOAD * (self.load is None)
        load = 0.0 if self.load is None else self.load
        return CONTACT.pack(CONTACT_VERSION, flags, 0, self.seq, self.time, self.value, load)


def contact(seq: int, time: float, value: float, is_speed: bool, load: float | None) -> Contact:
    """Return a checked contact; raises InvalidRequest for what the service would refuse."""
    if seq >= SEQ_LIMIT:
        raise InvalidRequest([Fault("/seq", shown(seq), f"below {SEQ_LIMIT}", "Open another stream.")])
    name, limit, unit = ("speed", SPEED_LIMIT, "m/s") if is_speed else ("position", POSITION_LIMIT, "m")
    faults = [_fault(name, value, limit, unit)]
    if load is not None:
        faults.append(_fault("load", load, LOAD_LIMIT, "N"))
    found = [fault for fault in faults if fault is not None]
    if found:
        raise InvalidRequest(found)
    return Contact(seq, time, float(value), is_speed, None if load is None else float(load))


def hello(scene: SceneDocument, sample_format: str, pacing: str, block: int | None, record: bool) -> str:
    """Return the message that asks for a new session."""
    document: dict[str, Any] = {"type": "hello", "scene": scene, "format": sample_format, "pacing": pacing}
    if block is not None:
        document["block"] = block
    if record:
        document["record"] = True
    return text_of(document)


def hello_again(session: str, frame: int) -> str:
    """Return the message that asks for a session to go on from `frame`."""
    return text_of({"type": "hello", "resume": {"session": session, "frame": frame}})


def more(frames: int) -> str:
    """Return the message that grants credit."""
    return text_of({"type": "more", "frames": frames})


def scene_change(partial: SceneDocument) -> str:
    """Return the message that changes the scene."""
    return text_of({"type": "scene", "scene": partial})


def stop() -> str:
    """Return the message that ends the stream."""
    return text_of({"type": "stop"})


def text_of(document: Mapping[str, Any]) -> str:
    """Return the JSON text of a message; raises InvalidRequest where a scene in it is not JSON."""
    try:
        return json.dumps(document, allow_nan=False, separators=(",", ":"))
    except (TypeError, ValueError, RecursionError) as error:
        hint = 'Write finite numbers, or strings with a unit such as "0.8 mm".'
        raise InvalidRequest(
            [Fault("", "something that is not JSON", "JSON without NaN and infinity", hint)]
        ) from error


def read_text(text: str) -> dict[str, Any]:
    """Return the message that `text` holds; raises ProtocolError where it holds none."""
    try:
        message = json.loads(text)
    except ValueError as error:
        raise ProtocolError("the service sent text that is not JSON") from error
    if not isinstance(message, dict) or not isinstance(message.get("type"), str):
        raise ProtocolError("the service sent JSON that is not a message")
    return message


def subprotocols(key: str | None) -> tuple[str, ...]:
    """Return the subprotocols to offer: the protocol, and the key, in BASE64URL without padding, where there is one."""
    if key is None:
        return (SUBPROTOCOL,)
    encoded = base64.urlsafe_b64encode(checked_key(key).encode()).decode()
    return (SUBPROTOCOL, KEY_SUBPROTOCOL + encoded.rstrip("="))


def checked_key(key: str) -> str:
    """Return `key`, which goes into a header; raises InvalidRequest for what cannot, and does not show it."""
    if not re.fullmatch(r"[\x21-\x7e]+", key):
        raise InvalidRequest(
            [Fault("/key", "(not shown)", "visible ASCII characters", "Write one of the service's keys.")]
        )
    return key


def document_of(scene: Any) -> dict[str, Any]:
    """Return the JSON document of a scene: a mapping as it is (None is the default scene), a `synth.Scene` in SI."""
    if scene is None:
        return {}
    if isinstance(scene, Mapping):
        return dict(scene)
    from synth.scene.scene import Scene as CheckedScene
    from synth.scene.scene import scene_document

    if isinstance(scene, CheckedScene):
        return scene_document(scene)
    raise InvalidRequest([Fault("", shown(scene), "a scene", 'Write {} or {"texture": {"period": "1 mm"}}.')])


def _fault(name: str, value: float, limit: float, unit: str) -> Fault | None:
    if hasattr(value, "__float__") and math.isfinite(value) and -limit <= value <= limit:
        return None
    return Fault("/" + name, shown(value), f"-{limit:g} {unit} to {limit:g} {unit}", "Write a number in SI units.")
