"""The pressure under the ridges, against heights summed apart, and its places and phases, made closer."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import ridgewave as rw
from synth.contact.scene_contact import contact_of
from synth.study import skin_outcome
from synth.study.skin_outcome import phases_of, pressure_of, skin_felt
from tests.few import few

FINGERTIP = {"kind": "fingertip"}
SCENES: list[dict[str, Any]] = [
    {"finger": FINGERTIP, "texture": {"period": "0.11 mm", "amplitude": "4 um"}},
    {"finger": FINGERTIP, "texture": {"kind": "grating", "period": "1.3 mm", "height": "60 um"}},
    {"finger": FINGERTIP | {"pattern": "straight"}, "texture": {"period": "0.7 mm"}},
    {"texture": {"period": "0.11 mm", "amplitude": "4 um"}},
    {"texture": {"period": "1 mm", "amplitude": "3 um"}},
    {"texture": {"kind": "grating", "period": "1.3 mm", "height": "60 um"}, "effects": {"curvature": {}}},
    {"finger": {"kind": "probe"}, "texture": {"period": "0.5 mm"}},
]


@pytest.mark.parametrize("scene", SCENES, ids=str)
def test_the_pressure_carries_the_load_at_every_phase(scene: dict[str, Any]) -> None:
    parsed = rw.parse_scene(scene, scan={"load": 0.4})
    x, pressure = pressure_of(parsed, 256)
    contact = contact_of(parsed)
    carried = np.sum(pressure, axis=1) * (x[1] - x[0]) * contact.width_at(0.4)
    if "effects" in scene:  # its shape is that of the effect
        assert np.ptp(carried) < 4e-3 * np.mean(carried)
    else:
        np.testing.assert_allclose(carried, 0.4, rtol=7e-3)


def test_the_pressure_of_a_fingertip_is_that_of_heights_summed_across_the_scan() -> None:
    scene = rw.parse_scene(SCENES[0], scan={"load": 0.4})
    x, pressure = pressure_of(scene, 256)
    contact: Any = contact_of(scene)
    surface, phase = contact.surface, 37
    z = float(contact.approach(np.array([phase / 256]), 0.4)[0][0])
    some = np.arange(100, len(x) - 100, 97)
    y = np.linspace(-0.5, 0.5, 6001) * surface.footprint.reach[1]
    texture = 4e-6 * np.cos(2.0 * np.pi * (x[some] / 0.11e-3 - phase / 256) + scene.texture.phase)
    gaps = np.maximum(surface.heights(x[some], y) + texture[:, np.newaxis] - z, 0.0)
    area = contact.geometry_at(0.4).contact_length * contact.width_at(0.4)
    expected = contact.stiffness_at(0.4) / area * np.trapezoid(gaps, y, axis=1) / surface.footprint.width
    np.testing.assert_allclose(pressure[phase, some], expected, atol=5e-3 * np.max(pressure))


@pytest.mark.parametrize("scene", few(SCENES, 3), ids=str)
def test_levels_do_not_depend_on_places_and_phases(scene: dict[str, Any], monkeypatch: pytest.MonkeyPatch) -> None:
    parsed = rw.parse_scene(scene, scan={"load": 0.4})
    usual = skin_felt(parsed)
    for name, value in (("SAMPLES", 4 * skin_outcome.SAMPLES), ("A_HARMONIC", 16), ("PHASES", 1024)):
        monkeypatch.setattr(skin_outcome, name, value)
    close = skin_felt(parsed)
    assert phases_of(parsed) == 1024
    for one, other in zip(usual["receptors"], close["receptors"], strict=True):
        if one["level"] is None or other["level"] is None:
            assert max(one["level"] or -120.0, other["level"] or -120.0) < -110.0
        else:
            assert one["level"] == pytest.approx(other["level"], abs=0.3 if one["level"] > -60.0 else 3.0), one
    assert usual["intensity"] == pytest.approx(close["intensity"], rel=0.03)
    assert usual["felt_by"] == close["felt_by"]


def test_a_long_texture_has_phases_for_every_line_in_the_band() -> None:
    scene = rw.parse_scene({"texture": {"kind": "grating", "period": "40 mm", "height": "3 um"}})
    assert phases_of(scene) == 2048
    assert phases_of(rw.parse_scene(scene, scan={"speed": "1 mm/s"})) == skin_outcome.MOST_PHASES
    assert phases_of(rw.parse_scene(scene, scan={"speed": 0})) == skin_outcome.PHASES


def test_what_would_fill_the_memory_is_refused_before_it_is_solved() -> None:
    for change in ({"finger": {"contact_length": "100 mm", "ridge_period": "10 um"}}, {"texture": {"period": "1 um"}}):
        with pytest.raises(rw.SceneError, match="periods of the finer surface under the finger"):
            rw.analyze(change)
