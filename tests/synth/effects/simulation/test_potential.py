"""The table of the energy of a contact, against the exact contact and against its own definition."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from synth.contact.load_balance import Contact
from synth.effects.simulation import potential
from synth.effects.simulation.potential import PotentialTable
from synth.effects.simulation.potential_reading import CURVES, read_heights
from synth.response.phases import turns_to_phase
from tests.reference.slow_table_steps import SlowTable
from tests.synth.engine_cases import Real, contact_of, scene_of

SCENES: dict[str, dict[str, Any]] = {
    "default": {},
    "locked": {"texture": {"period": "0.5 mm"}},
    "large": {"texture": {"period": "20 mm", "amplitude": "200 um"}},
    "steep": {"texture": {"period": "0.3 mm", "amplitude": "80 um"}},
}


def read(table: PotentialTable, turns: Real, heights: Real) -> Real:
    return np.asarray(read_heights(table.pool, table.layout, turns_to_phase(turns), heights))


def base_of(table: PotentialTable, turns: float) -> float:
    """Return b (m) from its spline's coefficients."""
    row, t = divmod(turns * table.rows, 1.0)
    weights = (1 - t) ** 3 / 6, 2 / 3 - t**2 + t**3 / 2, 2 / 3 - (1 - t) ** 2 + (1 - t) ** 3 / 2, t**3 / 6
    first = int(table.layout[CURVES]) + int(row)
    return float(np.dot(weights, table.pool[first : first + 4]))


def slow_table(contact: Contact, table: PotentialTable) -> SlowTable:
    """Return the twin: exact values at the places of `table`, found anew."""
    turns = np.arange(table.rows) / table.rows
    base = np.array([base_of(table, turn) for turn in turns])
    edges = np.array(table.edges)
    heights = (base[:, None] + edges).ravel()
    depth, touching = contact.measure(np.repeat(turns, len(edges)), heights, table.load)
    depth, touching = depth.reshape(table.rows, -1), touching.reshape(table.rows, -1)
    depth[:, -1], touching[:, -1] = 0.0, 0.0
    return SlowTable(base, edges, depth, touching)


@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("loads", [(0.3, 0.3, 0.3), (0.3, 0.1, 1.0), (1e-3, 1e-3, 1e-3), (50.0, 50.0, 50.0)])
def test_quasi_static_heights_keep_the_tolerance(name: str, loads: tuple[float, float, float]) -> None:
    contact = contact_of(scene_of(**SCENES[name]))
    table = PotentialTable.of(contact, *loads, tolerance=1e-3)
    turns = np.random.default_rng(7).random(300)
    for load in {*loads}:
        heights, _slope = contact.approach(np.sort(turns), load)
        exact, touching = contact.measure(np.sort(turns), heights, load)
        wrong = np.abs(read(table, np.sort(turns), heights)[0] - exact) / touching
        assert np.max(wrong) <= 1e-3 * table.motion
    assert table.error <= 1e-3
    assert table.nbytes <= 8 << 20


def test_finer_tolerances_are_kept() -> None:
    contact = contact_of(scene_of())
    errors = [PotentialTable.of(contact, 0.3, 0.3, 0.3, tolerance=tolerance).error for tolerance in (1e-2, 1e-3, 1e-4)]
    assert errors[0] <= 1e-2 and errors[1] <= 1e-3 and errors[2] <= 1e-4


def test_the_bound_on_bytes_holds_and_the_error_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(potential, "MOST_BYTES", 200_000)
    table = PotentialTable.of(contact_of(scene_of()), 0.3, 0.3, 0.3, tolerance=1e-5)
    assert table.nbytes <= 220_000
    assert 1e-5 < table.error < 1.0


def test_what_is_read_is_the_slope_of_one_energy() -> None:
    table = PotentialTable.of(contact_of(scene_of()), 0.3, 0.1, 1.0)
    random = np.random.default_rng(3)
    turns = random.random(400)
    heights = 42e-6 + random.uniform(-30e-6, 20e-6, 400)  # cells, the line below them, and nothing above
    depth, touching, drift, energy = read(table, turns, heights)
    assert np.count_nonzero(depth == 0.0) > 5
    z, turn = 1e-9, 1e-6
    up, down = read(table, turns, heights + z), read(table, turns, heights - z)
    on, back = read(table, turns + turn, heights), read(table, turns - turn, heights)
    largest = np.max(np.abs([depth, touching, drift, energy]), axis=1)
    assert np.max(np.abs((down[3] - up[3]) / (2 * z) - depth)) <= 1e-6 * largest[0]
    assert np.max(np.abs((down[0] - up[0]) / (2 * z) - touching)) <= 1e-3 * largest[1]
    assert np.max(np.abs((on[3] - back[3]) / (2 * turn) - drift)) <= 1e-5 * largest[2]
    assert np.all(energy[depth == 0.0] == 0.0)


def test_below_its_lowest_height_the_table_goes_on_as_a_line() -> None:
    contact = contact_of(scene_of())
    table = PotentialTable.of(contact, 0.3, 0.1, 1.0)
    edge = base_of(table, 0.3) + float(table.edges[0])
    heights = edge - np.array([0.0, 1e-6, 2e-6, 50e-6])
    depth = read(table, np.full(4, 0.3), heights)[0]
    touching = read(table, np.array([0.3]), heights[:1])[1, 0]
    assert depth == pytest.approx(depth[0] + touching * (edge - heights), rel=1e-12)


def test_full_contact_is_exact() -> None:
    contact = contact_of(scene_of())
    table = PotentialTable.of(contact, 50.0, 1.0, 50.0)
    turns = np.linspace(0.0, 1.0, 50)
    heights = np.linspace(-2e-3, -1e-4, 50)
    exact = contact.measure(turns, heights, 50.0)[0]
    assert read(table, turns, heights)[0] == pytest.approx(exact, abs=1e-12)


def test_the_compiled_reader_agrees_with_its_slow_twin() -> None:
    contact = contact_of(scene_of())
    table = PotentialTable.of(contact, 0.3, 0.2, 0.4, tolerance=1e-2)
    slow = slow_table(contact, table)
    for turns in (0.0, 0.123456, 0.5, 0.98765):
        base, depth = slow.at(turns)
        assert base == pytest.approx(base_of(table, turns), abs=1e-18)
        d = np.linspace(table.edges[0] - 3e-6, table.edges[-1] + 1e-6, 60)
        found = read(table, np.full(60, turns), base + d)
        assert found[0] == pytest.approx(depth(d), abs=1e-18)
        energy = [float(depth.integrate(place, max(place, table.edges[-1]))) for place in d]
        assert found[3] == pytest.approx(energy, abs=1e-21)
