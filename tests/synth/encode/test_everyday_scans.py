"""Every entry of the catalogue is felt in its everyday scan, or says why not."""

from __future__ import annotations

import numpy as np
import pytest

from synth.encode.sound import render
from synth.scene.catalogue import CatalogueEntry, catalogue
from synth.scene.scene import parse_scene
from synth.surfaces import profile_of
from synth.surfaces.height_field import HeightField
from tests.few import few

QUIETEST, LOUDEST = 0.05, 5.0
"""m/s^2 rms below 1 kHz: where accelerations of everyday scans lie (general knowledge: 0.1 to 5 at the nail)."""
SMOOTH = {"window-glass"}
"""Smoother than that: glass does not vibrate by its contact."""
COARSE = {"accuracy": {"tolerance": 0.03}}
"""Of a texture over an area: the rms is the same to 1 in 1000, in less than half of the time."""


FELT_BY_FRICTION = [entry for entry in catalogue() if "effects" in entry.everyday]
OTHERS = [entry for entry in catalogue() if "effects" not in entry.everyday]


@pytest.mark.parametrize("entry", FELT_BY_FRICTION, ids=lambda entry: entry.name)
def test_a_surface_felt_by_its_friction_judders_by_a_tenth_of_its_force(entry: CatalogueEntry) -> None:
    sound = render({**entry.everyday, "accuracy": {"tolerance": 0.03}, "output": {"duration": 1.0}})
    force = np.asarray(sound.values, dtype=np.float64)[:, sound.quantities.index("friction_force")]
    settings = parse_scene(entry.everyday).effects["stick_slip"]
    static, kinetic, _ = settings.friction
    load = parse_scene(entry.everyday).scan.load
    assert kinetic * load < np.mean(force) < static * load
    assert np.std(force) > 0.05 * np.mean(force)
    assert np.max(force) <= static * load * (1.0 + 1e-9)


@pytest.mark.parametrize("entry", few(OTHERS, 3), ids=lambda entry: entry.name)
def test_an_everyday_scan_is_felt_or_has_a_note(entry: CatalogueEntry) -> None:
    over_area = isinstance(profile_of(parse_scene(entry.everyday)), HeightField)
    sound = render({**entry.everyday, **(COARSE if over_area else {}), "output": {"duration": 1.0}})
    rms = float(np.sqrt(np.mean(np.square(sound.values, dtype=np.float64))))
    if entry.name in SMOOTH:
        assert 0.0 < rms < QUIETEST
    else:
        assert QUIETEST <= rms <= LOUDEST
    assert sound.plan is not None
    warnings = sound.plan.warnings
    unfelt = [warning for warning in warnings if warning.startswith("This is not felt")]
    assert bool(unfelt) == bool(entry.note), "what is not felt has a note that says why"
    if len(warnings) > len(unfelt):  # very small cells would not fit: the plan tells the error that remains
        assert over_area or unfelt
        assert all(one in unfelt or one.startswith("The error of the acceleration is 0.0") for one in warnings)
