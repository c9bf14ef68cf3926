"""Every reader makes the samples of the vectors, to 1e-6 of full scale: that of docs/table.md, and the engine's."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from synth.response.table_file import read_table
from synth.response.table_reader import TableReader
from tests.conformance.make import hand_on
from tests.conformance.numpy_reader import read

HERE = Path(__file__).parent
HAND: dict[str, Any] = json.loads((HERE / "hand.json").read_text("utf-8"))
TABLE = HERE / HAND["table"]
PLACES, SPEEDS, LOADS = (np.array(HAND[name]) for name in ("places", "speeds", "loads"))
CLOSE = 1e-6  # of full scale


@pytest.mark.parametrize("quantity", HAND["expected"])
def test_a_reader_written_from_the_page_makes_the_samples(quantity: str) -> None:
    expected = HAND["expected"][quantity]
    found = read(TABLE, quantity, HAND["rate"], PLACES, SPEEDS, LOADS)
    assert np.max(np.abs(found - np.array(expected["samples"]))) <= CLOSE * expected["full_scale"]


@pytest.mark.parametrize("quantity", HAND["expected"])
def test_the_engine_makes_the_samples_from_the_file(quantity: str) -> None:
    expected, table = HAND["expected"][quantity], read_table(TABLE)
    motion = np.zeros((5, len(PLACES)))
    motion[0], motion[2] = SPEEDS, LOADS
    reader, out = TableReader.of(table, quantity, HAND["rate"]), np.empty((len(PLACES), 1), np.float32)
    reader.read(reader.start(), motion, PLACES, 0, out, 0)
    assert np.max(np.abs(out[:, 0] - np.array(expected["samples"]))) <= CLOSE * expected["full_scale"]


def test_the_samples_are_those_that_make_writes() -> None:
    made = hand_on(read_table(TABLE))
    for name in ("places", "speeds", "loads"):
        assert made[name] == pytest.approx(HAND[name], abs=1e-12)
    for quantity, expected in HAND["expected"].items():
        found = made["expected"][quantity]
        assert found["full_scale"] == pytest.approx(expected["full_scale"], rel=CLOSE)
        assert found["samples"] == pytest.approx(expected["samples"], abs=CLOSE * expected["full_scale"])


def test_the_motion_lifts_touches_lightly_presses_flat_turns_and_passes_the_levels() -> None:
    table = read_table(TABLE)
    turns = np.abs(SPEEDS) / (table.period * table.band)
    assert LOADS.min() == 0.0 and LOADS.max() > table.loads[-1]
    assert np.sum((LOADS > 0.0) & (table.lift_load > LOADS)) > 10  # within the gate
    assert SPEEDS.min() < 0.0 < SPEEDS.max()
    assert turns.min() < 0.1 and turns.max() > 1.2
    assert np.all(np.isfinite([HAND["expected"][one]["samples"] for one in HAND["expected"]]))


def test_the_vectors_are_small() -> None:
    assert sum(path.stat().st_size for path in HERE.iterdir() if path.is_file()) < 300_000
