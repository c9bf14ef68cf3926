"""The messages of the live protocol, `ridgewave.v2` and `ridgewave.v1`, as docs/live.md defines them.

The functions make what the client sends: the text or bytes of one WebSocket message. `read_text`, `Ready` and `Applied`
read what the service sends; unknown fields are ignored.

Limits: a stream has at most 2**32 contact updates (49 days of a thousand per second); then `contact` raises
InvalidRequest.
"""

from __future__ import annotations

import base64
import json
import struct
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

from clients.client_errors import ProtocolError
from clients.scene_and_key import checked_key, json_text
from synth.errors import Fault, InvalidRequest, shown

FIRST, SECOND = "ridgewave.v1", "ridgewave.v2"
SUBPROTOCOLS = (SECOND, FIRST)  # the newest first
KEY_SUBPROTOCOL = "ridgewave.key."

CONTACT = struct.Struct("<BBHIddf")  # version, flags, contact, seq, time (s), position (m) or speed (m/s), load (N)
PLACE = struct.Struct("<BBHIdddff")  # version, flags, contact, seq, time (s), x (m), y (m), direction (rad), load (N)
CREDIT = struct.Struct("<I")  # frames; it follows either form, or is absent
CONTACT_VERSION, PLACE_VERSION = 1, 2
IS_SPEED = 1  # flag: the value is a speed, not a position
NO_LOAD = 2  # flag: the load is absent and stays what it was
NO_DIRECTION = 4  # flag: the direction is absent and stays what it was
SEQ_LIMIT = 2**32

# The bounds of the service. Wider ones here would only move the refusal to the service.
POSITION_LIMIT = 1e3  # m
SPEED_LIMIT = 10.0  # m/s
DIRECTION_LIMIT = 1e3  # rad
LOAD_LIMIT = 1e3  # N, in both directions: a finger may pull at a surface that attracts it

SceneDocument = Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class Contact:
    """One update of the hand.

    seq: number of the update. time: s, by the client's clock. value: position (m), or speed (m/s) if `is_speed`.
    load: N; None keeps the last load.
    """

    seq: int
    time: float
    value: float
    is_speed: bool
    load: float | None

    def message(self, credit: int = 0) -> bytes:
        """Return the binary form, 28 bytes, or 32 with `credit` in frames."""
        flags = IS_SPEED * self.is_speed | NO_LOAD * (self.load is None)
        load = 0.0 if self.load is None else self.load
        return CONTACT.pack(CONTACT_VERSION, flags, 0, self.seq, self.time, self.value, load) + _credit(credit)

    def completed(self, load: float | None, direction: float | None) -> Contact:
        """Return the update with `load` if it has none; it never has a direction."""
        return self if self.load is not None else replace(self, load=load)


@dataclass(frozen=True, slots=True)
class Place:
    """One update of a hand on a texture over an area, of version 2 of the protocol.

    seq, time, load: as of a `Contact`. x, y: place of the finger's middle on the surface, m.
    direction: angle of the finger's length from the x axis, rad, counter-clockwise; None keeps the last one.
    """

    seq: int
    time: float
    x: float
    y: float
    direction: float | None
    load: float | None

    def message(self, credit: int = 0) -> bytes:
        """Return the binary form, 40 bytes, or 44 with `credit` in frames."""
        flags = NO_LOAD * (self.load is None) | NO_DIRECTION * (self.direction is None)
        direction, load = (0.0 if value is None else value for value in (self.direction, self.load))
        packed = PLACE.pack(PLACE_VERSION, flags, 0, self.seq, self.time, self.x, self.y, direction, load)
        return packed + _credit(credit)

    def completed(self, load: float | None, direction: float | None) -> Place:
        """Return the update with `load` and `direction` where it has none."""
        load = load if self.load is None else self.load
        return replace(self, load=load, direction=direction if self.direction is None else self.direction)


def _credit(frames: int) -> bytes:
    return CREDIT.pack(frames) if frames else b""


def contact(seq: int, time: float, value: float, is_speed: bool, load: float | None) -> Contact:
    """Return a checked update; raises InvalidRequest for values that the service would refuse."""
    name, limit, unit = ("speed", SPEED_LIMIT, "m/s") if is_speed else ("position", POSITION_LIMIT, "m")
    _check(seq, (name, value, limit, unit), ("load", load, LOAD_LIMIT, "N"))
    return Contact(seq, time, float(value), is_speed, _float(load))


def place(seq: int, time: float, at: tuple[float, float], direction: float | None, load: float | None) -> Place:
    """Return a checked update at (x, y); raises InvalidRequest for values that the service would refuse."""
    x, y = at
    _check(
        seq,
        ("x", x, POSITION_LIMIT, "m"),
        ("y", y, POSITION_LIMIT, "m"),
        ("direction", direction, DIRECTION_LIMIT, "rad"),
        ("load", load, LOAD_LIMIT, "N"),
    )
    return Place(seq, time, float(x), float(y), _float(direction), _float(load))


def hello(scene: SceneDocument, sample_format: str, pacing: str, block: int | None, record: bool) -> str:
    """Return the message that requests a new session."""
    document: dict[str, Any] = {"type": "hello", "scene": scene, "format": sample_format, "pacing": pacing}
    if block is not None:
        document["block"] = block
    if record:
        document["record"] = True
    return json_text(document)


def resume(session: str, frame: int) -> str:
    """Return the message that resumes a session at `frame`."""
    return json_text({"type": "hello", "resume": {"session": session, "frame": frame}})


def more(frames: int) -> str:
    """Return the message that grants credit."""
    return json_text({"type": "more", "frames": frames})


def scene_change(partial: SceneDocument) -> str:
    """Return the message that changes the scene."""
    return json_text({"type": "scene", "scene": partial})


def stop() -> str:
    """Return the message that ends the stream."""
    return json_text({"type": "stop"})


def read_text(text: str) -> dict[str, Any]:
    """Return the message in `text`; raises ProtocolError for text that is not a message."""
    try:
        message = json.loads(text)
    except ValueError as error:
        raise ProtocolError("the service sent text that is not JSON") from error
    if not isinstance(message, dict) or not isinstance(message.get("type"), str):
        raise ProtocolError("the service sent JSON that is not a message")
    return message


def subprotocols(key: str | None) -> tuple[str, ...]:
    """Return the subprotocols to offer: the versions, and the key, if any, as BASE64URL without padding."""
    if key is None:
        return SUBPROTOCOLS
    encoded = base64.urlsafe_b64encode(checked_key(key).encode()).decode()
    return (*SUBPROTOCOLS, KEY_SUBPROTOCOL + encoded.rstrip("="))


class Applied(NamedTuple):
    """The newest contact update that the sound follows, and the first frame that follows it."""

    seq: int
    frame: int


@dataclass(frozen=True, slots=True)
class Ready:
    """The `ready` message: a session that begins or is resumed.

    protocol: the version that the service has chosen, as its subprotocol.
    over_area: whether the texture is over an area; False in version 1, which does not state it.
    resume_url: path and query at which to resume the session; "" if any connection will do.
    full_scale: SI value of a sample of 1.0, per channel.
    block: frames per message of samples.
    frame: number of the first frame to come.
    max_silence: seconds without an update after which the service lifts the finger.
    motion_delay: seconds by which the sound follows the hand, because updates are smoothed.
    """

    session: str
    protocol: str
    over_area: bool
    resume_url: str
    sample_rate: int
    channels: int
    quantities: tuple[str, ...]
    full_scale: tuple[float, ...]
    block: int
    frame: int
    plan: Mapping[str, Any]
    max_silence: float
    motion_delay: float

    @classmethod
    def read(cls, message: Mapping[str, Any]) -> Ready:
        """Read a `ready` message; raises KeyError, TypeError or ValueError for an incomplete one."""
        return cls(
            session=str(message["session"]),
            protocol=str(message.get("protocol", FIRST)),
            over_area=message.get("over_area") is True,
            resume_url=str(message.get("resume_url", "")),
            sample_rate=int(message["sample_rate"]),
            channels=int(message["channels"]),
            quantities=tuple(str(quantity) for quantity in message["quantities"]),
            full_scale=tuple(float(value) for value in message["full_scale"]),
            block=int(message["block"]),
            frame=int(message["frame"]),
            plan=dict(message["plan"]),
            max_silence=float(message["max_silence_ms"]) / 1000.0,
            motion_delay=float(message["motion_delay_ms"]) / 1000.0,
        )

    def check_like(self, other: Ready) -> None:
        """Raise ProtocolError unless the samples of both have the same form: one device plays them in a row."""
        for name in ("sample_rate", "channels", "quantities", "full_scale"):
            if getattr(self, name) != getattr(other, name):
                raise ProtocolError(f"{name} was {getattr(other, name)} and is now {getattr(self, name)}")


Check = tuple[str, float | None, float, str]
"""Name, value, limit and unit of a number; None is not checked."""


def _check(seq: int, *numbers: Check) -> None:
    """Raise InvalidRequest for a number that the service would refuse."""
    if seq >= SEQ_LIMIT:
        raise InvalidRequest([Fault("/seq", shown(seq), f"below {SEQ_LIMIT}", "Open another stream.")])
    faults = [_fault(name, value, limit, unit) for name, value, limit, unit in numbers if value is not None]
    found = [fault for fault in faults if fault is not None]
    if found:
        raise InvalidRequest(found)


def _float(value: float | None) -> float | None:
    return None if value is None else float(value)


def _fault(name: str, value: float, limit: float, unit: str) -> Fault | None:
    if hasattr(value, "__float__") and -limit <= value <= limit:
        return None
    allowed = f"-{limit:g} {unit} to {limit:g} {unit}"
    if name == "load":
        allowed = f"0 N to {limit:g} N; below 0 N only with adhesion"
    return Fault("/" + name, shown(value), allowed, "Write a number in SI units.")
