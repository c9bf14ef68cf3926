"""An effect is one file: one of each kind, in `added`, works with the fingers, the textures and the other effects."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import synth.effects
from synth import Motion, explain, open_voice, parse_scene
from synth.contact.stiffness import Stiffness
from synth.errors import SceneError
from synth.scene.effects_section import effect_names
from tests.few import thorough
from tests.synth.effects.effect_cases import QUICK
from tests.synth.engine_cases import Real, physical

ADDED = str(Path(__file__).parent / "added")
SOFT, LOAD = 101.2e3, 0.3  # Pa, N: Young's modulus and load of the default scene


@pytest.fixture(scope="module", autouse=True)
def _added() -> Iterator[None]:
    """Put the effects of the folder into the registry."""
    synth.effects.__path__.append(ADDED)
    effect_names.cache_clear()
    yield
    synth.effects.__path__.remove(ADDED)
    effect_names.cache_clear()
    for name in ("contact_load", "damper", "sliding_skin", "stiffening"):
        sys.modules.pop(f"synth.effects.{name}", None)


def rendered(effects: dict[str, Any], frames: int = 400, **sections: Any) -> Real:
    """Return the channels (SI) of a quick scene [frames, channels]."""
    return physical(open_voice(parse_scene(QUICK | {"effects": effects} | sections)), frames)


COMB = {"contact_length": "2.5 mm"}
TIP = {"kind": "probe", "poisson_ratio": 0.5}
SHAPES: dict[str, tuple[dict[str, Any], dict[str, Any], dict[str, Any]]] = {
    "comb": (COMB, {}, {}),
    "comb in full contact": (COMB, {"amplitude": "1 um"}, {}),
    "comb on dots": (COMB, {"kind": "dots"}, {}),
    "growing": (COMB, {"kind": "grating"}, {"contact_growth": {}}),
    "round": (COMB, {}, {"curvature": {"radius": "20 mm"}}),
    "probe": (TIP, {}, {}),
    "probe on dots": (TIP, {"kind": "dots"}, {}),
}


@pytest.mark.parametrize("name", SHAPES)
def test_a_law_of_the_stiffness_is_that_of_another_modulus(name: str) -> None:
    """By eqs 4-5, k grows with the power 3/2 of the modulus of a finger on a rigid texture."""
    finger, texture, others = SHAPES[name]
    sections = {"texture": texture, "output": QUICK["output"] | {"quantity": "approach"}}
    law = {"power": 0.3, "reference_load": 0.1}
    found = rendered(others | {"stiffening": law}, finger=finger | {"youngs_modulus": SOFT}, **sections)
    stiffer = SOFT * (LOAD / 0.1) ** (0.3 / 1.5)
    wanted = rendered(others, finger=finger | {"youngs_modulus": stiffer}, **sections)
    softer = rendered(others, finger=finger | {"youngs_modulus": SOFT}, **sections)
    assert np.max(np.abs(found - wanted)) < 1e-3 * np.max(np.abs(softer - wanted))


def test_a_fingertip_keeps_its_surface_under_another_law() -> None:
    finger, texture = {"kind": "fingertip", "contact_length": "3 mm"}, {"kind": "grating"}
    plain = rendered({}, finger=finger, texture=texture)
    stiffer = rendered({"stiffening": {"power": 0.5}}, finger=finger, texture=texture)
    assert np.ptp(stiffer - plain) > 0.1 * np.ptp(plain)


def test_a_law_that_is_no_power_of_the_load_is_no_law() -> None:
    class Saturating(Stiffness):
        def indentation(self, load: float) -> float:
            return Stiffness.indentation(self, load) / (1.0 + load)

    with pytest.raises(ValueError, match=r"Saturating: .* load\*\*1.5"):
        Saturating(SOFT, 1e-3, 1e-3, 1e-2)


def test_dampers_add_up_whichever_comes_first() -> None:
    both = rendered({"damper": {"damping": 3.0}, "inertia": {"damping": 2.0}})
    assert np.array_equal(both, rendered({"inertia": {"damping": 5.0}}))
    alone = rendered({"damper": {"damping": 3.0}})
    assert np.array_equal(alone, rendered({"inertia": {"mass": 1e-4, "damping": 3.0, "stiffness": 0.0}}))


def test_a_power_of_the_pressure_is_refused_with_any_simulation() -> None:
    scene = {"effects": {"tangential": {"pressure_exponent": 0.85}, "damper": {}}}
    with pytest.raises(SceneError, match="pressure_exponent 1 with damper"):
        parse_scene(scene)
    reasons = [one.reason for one in explain({"effects": scene["effects"] | {"damper": "auto"}}).left_out]
    assert any("tangential does not allow it" in reason for reason in reasons)


@pytest.mark.parametrize("others", [{}, {"inertia": {}}, {"propagation": {}}, {"tangential": {}}], ids=str)
def test_a_channel_of_the_motion_is_in_time_with_the_others(others: dict[str, Any]) -> None:
    frames = 800
    load = np.where(np.arange(frames) < 400, 0.3, 0.6)
    voice = open_voice(parse_scene(QUICK | {"effects": others | {"contact_load": {}}}), live=True)
    found = voice.render(frames, Motion.of(frames, speed=0.08, load=load))[:, 1] * voice.full_scale[1]
    assert voice.late > 0
    assert found == pytest.approx(np.r_[np.full(voice.late, 0.3), load[: -voice.late]], rel=1e-6)


@pytest.mark.parametrize("others", [{}, {"inertia": {}}, {"contact_growth": {}}], ids=str)
def test_a_skin_that_lags_meets_the_texture_where_it_is(others: dict[str, Any]) -> None:
    """On a constant scan a lag of n frames is the sound n frames later; a stroke turns before its skin does."""
    frames = 40
    plain = rendered(others, 800)
    late = rendered(others | {"sliding_skin": {"time": frames / 8000}}, 800)
    assert late[frames:] == pytest.approx(plain[:-frames], abs=float(0.02 * np.ptp(plain)))
    voice = open_voice(parse_scene(QUICK | {"effects": others | {"sliding_skin": {}}}), live=True)
    t = np.arange(800) / 8000
    speed, bend = 0.08 + 0.02 * np.sin(40.0 * t), 0.8 * np.cos(40.0 * t)
    place = 0.08 * t - 0.0005 * np.cos(40.0 * t)
    motion = Motion.of(800, position=place, speed=speed, speed_rate=bend, load=LOAD, load_rate=0.0, load_bend=0.0)
    led = voice.render(800, motion)[:, 0] * voice.full_scale[0]
    other = open_voice(parse_scene(QUICK | {"effects": others}), live=True)
    behind = Motion.of(
        800, position=place - 5e-3 * speed, speed=speed - 5e-3 * bend, speed_rate=0.0, load=LOAD, load_rate=0.0,
        load_bend=0.0,
    )  # fmt: skip
    moved = other.render(800, behind)[:, 0] * other.full_scale[0]
    assert led[100:] == pytest.approx(moved[100:], abs=float(0.02 * np.ptp(moved)))


def test_a_skin_that_lags_follows_a_hand_of_which_only_the_speed_is_known() -> None:
    voices = [open_voice(parse_scene(QUICK | {"effects": {"sliding_skin": {}}}), live=True) for _ in range(2)]
    places = 0.08 * np.arange(800) / 8000
    known = Motion.of(800, position=places, speed=0.08, speed_rate=0.0, load=LOAD, load_rate=0.0, load_bend=0.0)
    led, alone = (
        voice.render(800, motion)[:, 0]
        for voice, motion in zip(voices, (known, Motion.of(800, speed=0.08, load=LOAD)), strict=True)
    )
    assert np.any(led) and alone[200:] == pytest.approx(led[200:], abs=float(0.01 * np.ptp(led)))


STRAIGHT = [[0, 0, 0, 0, 0.3], [0.1, 0.008, 0.004, 0.2, 0.3]]
PATHS: dict[str, dict[str, Any]] = {
    "heading": {"scan": {"heading": "30 deg"}},
    "path": {
        "scan": {"trajectory": [[0, 0, 0, 0, 0.3], [0.05, 0.004, 0.002, 0.2, 0.3], [0.1, 0.008, 0.004, 0.2, 0.3]]}
    },
    "path over dots": {"scan": {"trajectory": STRAIGHT}, "texture": {"kind": "dots"}},
}


@pytest.mark.parametrize("name", [thorough(name) if name == "path" else name for name in PATHS])
def test_a_skin_that_lags_leaves_its_line_with_the_hand(name: str) -> None:
    """Along a straight path a lag of n frames is the sound n frames later, once it has begun."""
    sections = PATHS[name] | {"finger": {"contact_length": "1.5 mm"}, "accuracy": {"tolerance": 1e-2}}
    plain, late = (rendered({"sliding_skin": {"time": frames / 8000}}, 600, **sections) for frames in (0, 40))
    assert np.all(np.isfinite(late)) and np.any(late)
    straight = slice(440, 600) if name == "path" else slice(100, 600)
    shifted = slice(straight.start - 40, straight.stop - 40)
    assert late[straight] == pytest.approx(plain[shifted], abs=float(0.05 * np.ptp(plain)))
