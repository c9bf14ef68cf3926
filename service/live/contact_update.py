"""Reads a contact update, in binary or in JSON, and checks its ranges.

Model: little-endian. A position or a speed takes 28 bytes: u8 version = 1, u8 flags, u16 contact, u32 seq, f64 time,
    f64 value, f32 load. A place takes 40 bytes, in version 2 of the protocol only: u8 version = 2, u8 flags,
    u16 contact, u32 seq, f64 time, f64 x, f64 y, f32 direction, f32 load.
    flags bit 0: 1 = value is a speed (m/s), 0 = a position (m). bit 1: 1 = no load; the last one remains. bit 2, of a
    place: 1 = no direction; the last one remains.
    Either form may have four more bytes: u32 credit, the frames that `more` would grant.
    A position is how far the surface has moved under the finger (p in h2(x - p) of eq. 2). A place is where the finger
    is on the surface. Its x is therefore the negative of a position.
    Comparisons are written so that NaN fails them.
Limits: one finger, contact 0.
"""

from __future__ import annotations

import struct
from typing import Any, NamedTuple

from service.engine import HandVoice
from service.live.message_checks import allowed_text, refused
from service.live.messages import (
    LARGEST_DIRECTION,
    LARGEST_LOAD,
    LARGEST_POSITION,
    LARGEST_SPEED,
    LARGEST_TIME,
    V2,
    Version,
)
from service.problems import Problem
from synth.errors import shown
from synth.motion.motion import Update
from synth.scene.texture_registry import kinds

LAYOUT = struct.Struct("<BBHIddf")
PLACE_LAYOUT = struct.Struct("<BBHIdddff")
CREDIT = struct.Struct("<I")  # may follow
CREDIT_SIZES = (LAYOUT.size + CREDIT.size, PLACE_LAYOUT.size + CREDIT.size)
VERSION, PLACE_VERSION = 1, 2  # first byte
IS_SPEED, NO_LOAD, NO_DIRECTION = 1, 2, 4
LARGEST = (LARGEST_POSITION, LARGEST_SPEED)  # by flag bit 0
ALONG_A_LINE = "An effect of this scene is simulated along the line y = 0. Leave the effect out to move over the area."
ALONG_X = "An effect of this scene is simulated along x. Leave the effect out to turn the finger."
OPTIONAL = ("position", "speed", "x", "y", "direction", "load")  # fields of a JSON message beside seq and time


class Hand(NamedTuple):
    """What a scene allows a contact.

    lowest_load: N; below 0 with adhesion.
    over_area: whether the finger may go anywhere over an area, and turn.
    simulated: whether the texture is over an area, but an effect is simulated along its line y = 0.
    may_turn: whether the texture is a line on which the finger turns after a change of `scan.direction`.
    round: whether a direction changes nothing, since the finger is a probe.
    """

    lowest_load: float
    over_area: bool
    simulated: bool
    may_turn: bool = False
    round: bool = False

    @classmethod
    def of(cls, voice: HandVoice) -> Hand:
        """Return what the scene of `voice` allows."""
        from synth.plan.direct_plan import may_turn

        scene, over_area = voice.scene, voice.over_area
        simulated = kinds()[scene.texture.kind].of_area and not over_area
        turns = may_turn(scene) and not over_area
        return cls(voice.lowest_load, over_area, simulated, turns, scene.finger.traits.round)


def split(data: bytes) -> tuple[bytes, int]:
    """Return the update in a binary message, and its credit in frames: 0 for none."""
    if len(data) not in CREDIT_SIZES:
        return data, 0
    (credit,) = CREDIT.unpack_from(data, len(data) - CREDIT.size)
    return data[: -CREDIT.size], credit


def from_bytes(data: bytes, version: Version, hand: Hand) -> Update:
    """Return the update of a binary message without its credit; raises Problem (message-refused)."""
    if len(data) == LAYOUT.size:
        layout, flags, contact, seq, time, value, load = LAYOUT.unpack(data)
        speed = flags & IS_SPEED
        if (
            layout == VERSION
            and flags <= IS_SPEED | NO_LOAD
            and contact == 0
            and abs(value) <= LARGEST[speed]
            and abs(time) <= LARGEST_TIME
            and (flags & NO_LOAD or hand.lowest_load <= load <= LARGEST_LOAD)
        ):
            given = None if flags & NO_LOAD else load
            return Update(seq, time, None, value, given) if speed else Update(seq, time, value, None, given)
    elif len(data) == PLACE_LAYOUT.size and version.has_area:
        return _place_from_bytes(data, hand)
    raise _fault(data, version, hand)


def from_message(message: dict[str, Any], hand: Hand) -> Update:
    """Return the update of a JSON message that fits the schema; raises Problem (message-refused)."""
    load = message.get("load")
    if load is not None and not hand.lowest_load <= load:
        raise _load(load, hand)
    given = {name: float(message[name]) for name in OPTIONAL if name in message}
    seq, time, load = int(message["seq"]), float(message["time"]), given.get("load")
    if "x" in given:
        return _place(seq, time, (given["x"], given["y"]), given.get("direction"), load, hand)
    return Update(seq, time, given.get("position"), given.get("speed"), load)


def _place(
    seq: int, time: float, place: tuple[float, float], direction: float | None, load: float | None, hand: Hand
) -> Update:
    """Return the update of a finger at `place` (x and y, m); raises Problem for a direction that has no effect."""
    if direction and not (hand.over_area or hand.may_turn or hand.round):
        hint = ALONG_A_LINE if hand.simulated else ALONG_X
        raise refused("/direction", f"{shown(direction)} rad", "0 rad", hint)
    x, y = place
    if y and hand.simulated:
        raise refused("/y", f"{shown(y)} m", "0 m", ALONG_A_LINE)
    return Update(seq, time, 0.0 - x, None, load, 0.0 - y, direction)  # a difference, because -x would make -0.0 of 0


def _place_from_bytes(data: bytes, hand: Hand) -> Update:
    """Return the update of a message of 40 bytes; raises Problem (message-refused)."""
    layout, flags, contact, seq, time, x, y, direction, load = PLACE_LAYOUT.unpack(data)
    if layout != PLACE_VERSION:
        raise refused("/version", str(layout), str(PLACE_VERSION), "Write 2 in the first byte of 40.")
    if flags & ~(NO_LOAD | NO_DIRECTION):
        raise refused("/flags", str(flags), "0, 2, 4 or 6", "Use bit 1 (no load) and bit 2 (no direction) only.")
    if contact != 0:
        raise _contact(contact)
    turned, pressed = None if flags & NO_DIRECTION else direction, None if flags & NO_LOAD else load
    _check("time", time, LARGEST_TIME)
    _check("x", x, LARGEST_POSITION)
    _check("y", y, LARGEST_POSITION)
    _check("direction", turned or 0.0, LARGEST_DIRECTION)
    if pressed is not None and not hand.lowest_load <= pressed <= LARGEST_LOAD:
        raise _load(pressed, hand)
    return _place(seq, time, (x, y), turned, pressed, hand)


def _fault(data: bytes, version: Version, hand: Hand) -> Problem:
    """Return the problem of a message that is no update of 28 bytes; pointers name the fields as in JSON."""
    if len(data) != LAYOUT.size:
        return _size(data, version)
    layout, flags, contact, _, time, value, load = LAYOUT.unpack(data)
    if layout != VERSION:
        return refused("/version", str(layout), str(VERSION), "Write 1 in the first byte.")
    if flags > IS_SPEED | NO_LOAD:
        return refused("/flags", str(flags), "0 to 3", "Use bit 0 (speed) and bit 1 (no load) only.")
    if contact != 0:
        return _contact(contact)
    try:
        _check("time", time, LARGEST_TIME)
        _check("speed" if flags & IS_SPEED else "position", value, LARGEST[flags & IS_SPEED])
    except Problem as problem:
        return problem
    return _load(load, hand)


def _size(data: bytes, version: Version) -> Problem:
    hint = "Pack <BBHIddf: version, flags, contact, seq, time, value, load."
    allowed = f"{LAYOUT.size} bytes"
    if version.has_area:
        allowed = f"{LAYOUT.size} or {PLACE_LAYOUT.size} bytes"
        hint += " Or <BBHIdddff, with x, y and direction in place of value."
    elif len(data) == PLACE_LAYOUT.size:
        hint = f"Offer the subprotocol {V2.name}, which has messages of {PLACE_LAYOUT.size} bytes."
    allowed += f", and {CREDIT.size} more with credit"
    return refused("", f"{len(data)} bytes", allowed, hint)


def _contact(number: int) -> Problem:
    return refused("/contact", str(number), "0", "There is one finger: write 0.")


def _check(field: str, number: float, largest: float) -> None:
    """Raise Problem unless the `number` is within -largest to largest."""
    if not abs(number) <= largest:
        allowed = allowed_text(V2.client["contact"]["properties"][field])
        raise refused(f"/{field}", shown(number), allowed, "Write a number in this range.")


def _load(load: float, hand: Hand) -> Problem:
    allowed = f"{hand.lowest_load:g} to {LARGEST_LOAD:g} N"
    hint = "Below 0 N the scene needs adhesion." if load < 0.0 else "Write a number in this range."
    return refused("/load", shown(load), allowed, hint)
