"""Reads a contact update, in binary or in JSON, and checks its ranges.

Model: little-endian, 28 bytes: u8 version, u8 flags, u16 contact, u32 seq, f64 time, f64 value, f32 load.
    flags bit 0: 1 = value is a speed (m/s), 0 = a position (m). bit 1: 1 = no load; the last one remains.
    Comparisons are written so that NaN fails them.
Limits: one finger, contact 0.
"""

from __future__ import annotations

import struct
from typing import Any

from service.live.messages import (
    CLIENT,
    LARGEST_LOAD,
    LARGEST_POSITION,
    LARGEST_SPEED,
    LARGEST_TIME,
    allowed_text,
    refused,
)
from service.problems import Problem
from synth.errors import shown
from synth.motion.motion import Update

LAYOUT = struct.Struct("<BBHIddf")
VERSION = 1
IS_SPEED, NO_LOAD = 1, 2
LARGEST = (LARGEST_POSITION, LARGEST_SPEED)  # by flag bit 0


def from_bytes(data: bytes, lowest_load: float) -> Update:
    """Return the update of a binary message; raises Problem (message-refused)."""
    if len(data) == LAYOUT.size:
        version, flags, contact, seq, time, value, load = LAYOUT.unpack(data)
        speed = flags & IS_SPEED
        if (
            version == VERSION
            and flags <= IS_SPEED | NO_LOAD
            and contact == 0
            and abs(value) <= LARGEST[speed]
            and abs(time) <= LARGEST_TIME
            and (flags & NO_LOAD or lowest_load <= load <= LARGEST_LOAD)
        ):
            given = None if flags & NO_LOAD else load
            return Update(seq, time, None, value, given) if speed else Update(seq, time, value, None, given)
    raise _fault(data, lowest_load)


def from_message(message: dict[str, Any], lowest_load: float) -> Update:
    """Return the update of a JSON message that fits the schema; raises Problem (message-refused)."""
    load = message.get("load")
    if load is not None and not lowest_load <= load:
        raise _load(load, lowest_load)
    given = {name: float(message[name]) for name in ("position", "speed", "load") if name in message}
    return Update(
        int(message["seq"]),
        float(message["time"]),
        given.get("position"),
        given.get("speed"),
        given.get("load"),
    )


def _fault(data: bytes, lowest_load: float) -> Problem:
    """Return the problem of a binary message; pointers name the fields as in JSON."""
    if len(data) != LAYOUT.size:
        hint = "Pack <BBHIddf: version, flags, contact, seq, time, value, load."
        return refused("", f"{len(data)} bytes", f"{LAYOUT.size} bytes", hint)
    version, flags, contact, _, time, value, load = LAYOUT.unpack(data)
    if version != VERSION:
        return refused("/version", str(version), str(VERSION), "Write 1 in the first byte.")
    if flags > IS_SPEED | NO_LOAD:
        return refused("/flags", str(flags), "0 to 3", "Use bit 0 (speed) and bit 1 (no load) only.")
    if contact != 0:
        return refused("/contact", str(contact), "0", "There is one finger: write 0.")
    name = "speed" if flags & IS_SPEED else "position"
    for field, number, largest in (("time", time, LARGEST_TIME), (name, value, LARGEST[flags & IS_SPEED])):
        if not abs(number) <= largest:
            allowed = allowed_text(CLIENT["contact"]["properties"][field])
            return refused(f"/{field}", shown(number), allowed, "Write a number in this range.")
    return _load(load, lowest_load)


def _load(load: float, lowest_load: float) -> Problem:
    return refused(
        "/load", shown(load), f"{lowest_load:g} to {LARGEST_LOAD:g} N", "Below 0 N the scene needs adhesion."
    )
