"""What the tests of a table's reader share: a table, motions, and a read from the beginning to the end."""

from __future__ import annotations

from functools import cache

import numpy as np

from synth.response.table import ResponseTable
from synth.response.table_reader import TableReader
from tests.synth.engine_cases import Real, scene_of
from tests.synth.response.table_study import table_of

RATE = 48000
QUANTITIES = ("displacement", "velocity", "acceleration", "approach")
Moves = tuple[Real, Real]  # places (m), motion


@cache
def table() -> ResponseTable:
    """Return the table of the default scene."""
    return table_of(scene_of())


def moves(speed: Real | float, load: Real | float, frames: int, start: float = 0.0) -> Moves:
    """Return the places and the motion of a speed (m/s) and a load (N), numbers or [frames], on the default texture."""
    motion = np.zeros((5, frames))
    motion[0], motion[2] = speed, load
    places = start + np.concatenate([[0.0], np.cumsum(0.5 * (motion[0, 1:] + motion[0, :-1]))]) / RATE
    return places, motion


def wild(frames: int) -> Moves:
    """Return a motion that turns, passes the levels, lifts, and presses flat."""
    t = np.arange(frames) / RATE
    speed = 0.08 + 0.3 * np.sin(2 * np.pi * 30 * t)
    load = np.abs(1.5 + 4.5 * np.sin(2 * np.pi * 20 * t)) + 0.02 * np.sin(2 * np.pi * 400 * t) - 0.01
    return moves(speed, load, frames)


def read(quantity: str, moved: Moves, rate: int = RATE, table_of_it: ResponseTable | None = None) -> Real:
    """Return the quantity of a whole motion in one block, behind by the reader's delay."""
    reader = TableReader.of(table_of_it or table(), quantity, rate)
    places, motion = moved
    out = np.empty((len(places), 1), np.float32)
    reader.read(reader.start(), motion, places, 0, out, 0)
    return out[:, 0].astype(float)
