"""The energy table of a contact, against the exact contact and against its own definition."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from synth.contact.scene_contact import contact_of
from synth.effects.simulation import energy_table
from synth.effects.simulation.energy_table import EnergyTable
from synth.scene.scene import parse_scene
from tests.few import paired
from tests.synth.engine_cases import scene_of

SCENES: dict[str, dict[str, Any]] = {
    "default": {},
    "locked": {"texture": {"period": "0.5 mm"}},
    "large": {"texture": {"period": "20 mm", "amplitude": "200 um"}},
    "steep": {"texture": {"period": "0.3 mm", "amplitude": "80 um"}},
}


def bottom_of(table: EnergyTable, turns: float) -> float:
    """Return the lowest height of the cells at a phase (m). Below it l is constant."""
    heights = np.linspace(-300e-6, 0.0, 30001)
    slopes = table.read(np.full(len(heights), turns), heights)[1]
    return float(heights[np.argmax(np.abs(slopes - slopes[0]) > 1e-12)])


@pytest.mark.parametrize(
    ("name", "loads"), paired(SCENES, [(0.3, 0.3, 0.3), (0.3, 0.1, 1.0), (1e-3, 1e-3, 1e-3), (50.0, 50.0, 50.0)])
)
def test_quasi_static_heights_keep_the_tolerance(name: str, loads: tuple[float, float, float]) -> None:
    contact = contact_of(scene_of(**SCENES[name]))
    table = EnergyTable.of(contact, *loads, tolerance=1e-3)
    turns = np.random.default_rng(7).random(300)
    for load in {*loads}:
        heights, _slope = contact.approach(np.sort(turns), load)
        exact, touching = contact.measure(np.sort(turns), heights, load)
        wrong = np.abs(table.read(np.sort(turns), heights)[0] - exact) / touching
        assert np.max(wrong) <= 1e-3 * table.motion
    assert table.error <= 1e-3
    assert table.nbytes <= 16 << 20


def test_a_fingertip_keeps_the_tolerance_or_says_so_up_to_a_heavy_load() -> None:
    """A heavy load sinks it far below the lowest crest of a comb."""
    contact = contact_of(
        parse_scene({"finger": {"kind": "fingertip", "contact_length": "3 mm", "contact_width": "3 mm"}})
    )
    table = EnergyTable.of(contact, 0.3, 0.05, 5.0, tolerance=1e-2)
    turns = np.sort(np.random.default_rng(7).random(100))
    for load in (0.05, 0.3, 5.0):
        heights, _slope = contact.approach(turns, load)
        exact, touching = contact.measure(turns, heights, load)
        assert np.max(np.abs(table.read(turns, heights)[0] - exact) / touching) <= max(1e-2, table.error) * table.motion
    assert table.error < 0.05


def test_a_table_is_refined_where_half_the_nodes_would_err_more() -> None:
    """A fingertip is smooth over the phase: its hand's table needs fewer phases than a comb's, and keeps 1e-3."""
    length = {"contact_length": "3 mm"}
    tip, comb = (contact_of(parse_scene({"finger": {"kind": kind, **length}})) for kind in ("fingertip", "comb"))
    tables = [EnergyTable.of(contact, 0.3, 0.01, 5.0, live=True) for contact in (tip, comb)]
    phases = [table.nodes.shape[1] - 3 for table in tables]
    assert phases[0] < phases[1]
    assert tables[0].error <= 1e-3
    for table in tables:
        cells = len(table.nodes) - 1
        assert cells * (table.nodes.shape[1] - 3) <= energy_table.MOST_LIVE


def test_nodes_that_are_added_are_those_of_a_table_made_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    contact = contact_of(scene_of(finger={"contact_length": "3 mm"}))
    found = EnergyTable.of(contact, 0.3, 0.3, 0.3, tolerance=2e-4)
    rows, bits = found.nodes.shape[1] - 3, math.ceil(math.log2(len(found.nodes) - 1))
    assert rows > energy_table.FEWEST_ROWS
    monkeypatch.setattr(energy_table, "FEWEST_ROWS", rows)
    monkeypatch.setattr(energy_table, "FEWEST_CELLS", bits)
    monkeypatch.setattr(energy_table, "MOST_CELLS", bits)
    at_once = EnergyTable.of(contact, 0.3, 0.3, 0.3, tolerance=2e-4)
    assert found.nodes.shape == at_once.nodes.shape
    assert np.max(np.abs(found.nodes - at_once.nodes)) <= 1e-12 * np.max(np.abs(at_once.nodes))


def test_finer_tolerances_are_kept() -> None:
    contact = contact_of(scene_of(finger={"contact_length": "3 mm"}))
    errors = [EnergyTable.of(contact, 0.3, 0.3, 0.3, tolerance=tolerance).error for tolerance in (1e-2, 1e-3, 1e-4)]
    assert errors[0] <= 1e-2 and errors[1] <= 1e-3 and errors[2] <= 1e-4


def test_the_bound_on_bytes_holds_and_the_error_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(energy_table, "MOST_NODES", 40_000)
    table = EnergyTable.of(contact_of(scene_of()), 0.3, 0.3, 0.3, tolerance=1e-5)
    assert table.nbytes <= 24 * 42_000
    assert 1e-5 < table.error < 1.0


def test_what_is_read_is_the_slope_of_one_energy() -> None:
    table = EnergyTable.of(contact_of(scene_of()), 0.3, 0.1, 1.0)
    random = np.random.default_rng(3)
    turns = random.random(400)
    heights = 42e-6 + random.uniform(-30e-6, 20e-6, 400)  # in the cells, on the line below them, and above them
    depth, touching, drift, energy = table.read(turns, heights)
    assert np.count_nonzero(depth == 0.0) > 5
    z, turn = 1e-9, 1e-6
    up, down = table.read(turns, heights + z), table.read(turns, heights - z)
    on, back = table.read(turns + turn, heights), table.read(turns - turn, heights)
    largest = np.max(np.abs([depth, touching, drift, energy]), axis=1)
    assert np.max(np.abs((down[3] - up[3]) / (2 * z) - depth)) <= 1e-6 * largest[0]
    assert np.max(np.abs((down[0] - up[0]) / (2 * z) - touching)) <= 1e-3 * largest[1]
    assert np.max(np.abs((on[3] - back[3]) / (2 * turn) - drift)) <= 1e-5 * largest[2]
    assert np.all(energy[depth == 0.0] == 0.0)


def test_below_its_lowest_height_the_table_goes_on_as_a_line() -> None:
    contact = contact_of(scene_of())
    table = EnergyTable.of(contact, 0.3, 0.1, 1.0)
    edge = bottom_of(table, 0.3) - 1e-8
    heights = edge - np.array([0.0, 1e-6, 2e-6, 50e-6])
    depth = table.read(np.full(4, 0.3), heights)[0]
    touching = table.read(np.array([0.3]), heights[:1])[1, 0]
    assert depth == pytest.approx(depth[0] + touching * (edge - heights), rel=1e-12)


def test_full_contact_is_exact() -> None:
    contact = contact_of(scene_of())
    table = EnergyTable.of(contact, 50.0, 1.0, 50.0)
    turns = np.linspace(0.0, 1.0, 50)
    heights = np.linspace(-2e-3, -1e-4, 50)
    exact = contact.measure(turns, heights, 50.0)[0]
    assert table.read(turns, heights)[0] == pytest.approx(exact, abs=1e-12)
