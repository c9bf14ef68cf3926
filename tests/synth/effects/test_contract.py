"""The contract of every effect in the registry, alone and in the largest combinations.

A finger at rest is exact silence. Block splits do not matter. The same scene gives the same samples. The output is
finite and, live, limited. Effects that a scene does not name are not loaded.
"""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from synth import LiveVoice, open_voice, parse_scene
from synth.effects.effect import Effect, Kind
from synth.encode.sound_metadata import Metadata
from synth.errors import SceneError
from synth.response_cache import ResponseCache
from synth.scene.effects_section import declaration, effect_names
from synth.scene.section import rule_of
from tests.few import few, paired, thorough
from tests.synth.effects.effect_cases import (
    ALONE,
    LARGEST_SETS,
    QUICK,
    TOGETHER,
    covering,
    hand,
    quick_scene,
    scene_with,
)
from tests.synth.effects.plain_renders import digest

ROOT = Path(__file__).resolve().parents[3]
SHAPED: list[tuple[str, ...]] = [("contact_growth", "inertia", "tangential"), ("curvature", "inertia", "tangential")]
"""Sets that a hand may press: the largest sets also have an effect that needs a contact of one shape."""
CHANNELS = {"output": QUICK["output"] | {"quantity": None, "channels": ["displacement", "velocity", "acceleration"]}}

SCANS: tuple[dict[str, Any], ...] = (
    {"load": "50 N"},
    {"load": "1 mN"},
    {"stroke": {}},
    {"speed": "-5 mm/s"},
    {"speed": "2 m/s"},
)

CACHE = ResponseCache()
"""Responses shared by voices of one scene. The test of equal samples prepares its second voice anew."""

SHOWN = [names if names in covering(LARGEST_SETS) else thorough(names) for names in LARGEST_SETS]
every = pytest.mark.parametrize("names", [*((name,) for name in ALONE), *SHOWN], ids="+".join)


def test_the_registry_is_the_folder() -> None:
    files = {path.stem for path in (ROOT / "synth" / "effects").glob("*.py")} - {"__init__", "effect"}
    assert set(effect_names()) == files
    assert {"contact_growth", "curvature", "inertia", "viscous_skin", "adhesion", "tangential", "propagation"} <= files


@pytest.mark.parametrize("name", ALONE)
def test_an_effect_declares_itself(name: str) -> None:
    effect = declaration(name)
    assert isinstance(effect, Effect)
    assert effect.name == name
    assert effect.summary.endswith(".")
    assert effect.kind in Kind
    assert effect.price.ns_per_frame > 0.0 and effect.price.memory_bytes > 0
    assert type(effect).__doc__ and sys.modules[f"synth.effects.{name}"].__doc__
    told = sys.modules[f"synth.effects.{name}"].__doc__ or ""
    assert all(f"\n{word}" in told for word in ("Kind ", "Model ", "Source ", "Limits "))
    for field, declared in effect.settings.model_fields.items():
        assert declared.description and declared.description.endswith("."), field
        assert rule_of(effect.settings, field).allowed, field
    reason = effect.reason(parse_scene({}), effect.settings())
    assert reason.endswith(".") and reason[0].isupper()


@every
def test_nothing_moving_is_exact_silence(names: tuple[str, ...]) -> None:
    voice = open_voice(parse_scene(scene_with(*names, scan={"speed": 0.0}, **CHANNELS)), cache=CACHE)
    block = np.concatenate([voice.render(300), voice.render(500)])
    assert np.all(block[:, 1:3] == 0.0)
    assert np.all(block[:, 0] == block[0, 0])
    assert np.all(block == block[0])


@pytest.mark.parametrize("name", ["inertia", "viscous_skin"])
def test_a_light_load_is_faded_by_the_gate(name: str) -> None:
    """Below the lift load w0, z is that at w0 times the gate 10 s^3 - 15 s^4 + 6 s^5 with s = w / w0."""
    channels = [{"quantity": quantity, "full_scale": 1.0} for quantity in ("displacement", "approach")]
    output = {"channels": channels, "sample_rate": 8000}
    light, full = (
        open_voice(parse_scene(scene_with(name, scan={"load": load}, output=output)), cache=CACHE).render(400)
        for load in (2e-4, 1e-3)
    )
    gate = 10 * 0.2**3 - 15 * 0.2**4 + 6 * 0.2**5
    assert np.max(np.abs(light - gate * full)) <= 1e-3 * gate * np.max(np.abs(full))


@every
@pytest.mark.parametrize("sections", [{"scan": {"load": 0}}, {"texture": {"amplitude": 0}}], ids=["no load", "smooth"])
def test_no_load_and_no_texture_are_exact_zeros(names: tuple[str, ...], sections: dict[str, Any]) -> None:
    voice = open_voice(parse_scene(scene_with(*names, **sections)), cache=CACHE)
    rubbed = voice.render(500)
    if "texture" in sections:  # smooth glass moves no finger up and down, but it has friction
        kept = [effect_of(name).units for name in names if effect_of(name).kind == Kind.MOTION]
        rubbed = rubbed[:, [not any(one in units for units in kept) for one in voice.quantities]]
    assert not np.any(rubbed)
    assert voice.plan.document()["left_out"]


@every
def test_block_splits_do_not_matter(names: tuple[str, ...]) -> None:
    scene = parse_scene(scene_with(*names, **CHANNELS))
    whole = open_voice(scene, cache=CACHE).render(700)
    voice = open_voice(scene, cache=CACHE)
    sizes = np.random.default_rng(7).multinomial(700, np.ones(11) / 11)
    assert np.array_equal(np.concatenate([voice.render(int(size)) for size in sizes]), whole)
    assert np.any(whole[:, :3])


@pytest.mark.parametrize("names", [*((name,) for name in ALONE), *SHOWN, *SHAPED], ids="+".join)
def test_block_splits_do_not_matter_under_a_hand(names: tuple[str, ...]) -> None:
    scene = parse_scene(scene_with(*names, **CHANNELS))
    voice = open_voice(scene, cache=CACHE)
    if shaped_and_simulated(names):
        with pytest.raises(SceneError, match="only at a constant load"):
            voice.render(10, hand(10, 8000))
        return
    whole = voice.render(600, hand(600, 8000))
    again = open_voice(scene, cache=CACHE)
    parts, begin = [], 0
    for size in (1, 99, 7, 193, 300):
        parts.append(again.render(size, hand(size, 8000, begin)))
        begin += size
    assert np.array_equal(np.concatenate(parts), whole)
    assert np.any(whole)


@pytest.mark.parametrize("names", [*((name,) for name in ALONE), *few(LARGEST_SETS, 1)], ids="+".join)
def test_the_same_scene_gives_the_same_samples(names: tuple[str, ...]) -> None:
    scene = parse_scene(scene_with(*names, **CHANNELS))
    first, second = (open_voice(scene, cache=cache).render(400) for cache in (CACHE, ResponseCache()))
    assert np.array_equal(first, second)


@pytest.mark.parametrize(
    ("names", "scan"),
    [
        *paired([*((name,) for name in ALONE), LARGEST_SETS[0]], SCANS),
        *(thorough(names, scan) for names in LARGEST_SETS[1:] for scan in SCANS),
    ],
    ids=str,
)
def test_output_is_finite_and_limited(names: tuple[str, ...], scan: dict[str, Any]) -> None:
    scene = parse_scene(scene_with(*names, scan=scan))
    assert np.all(np.isfinite(open_voice(scene, cache=CACHE).render(600)))
    live = LiveVoice(scene, cache=CACHE)
    blocks = [live.render(80) for _ in range(10)]
    assert np.max(np.abs(blocks)) <= 1.0
    live.release()
    while not live.finished:
        live.render(80)
    assert not np.any(live.render(80))


@pytest.mark.parametrize("name", ALONE)
def test_a_sound_is_saved_with_the_unit_of_every_channel(name: str) -> None:
    scene = parse_scene(scene_with(name, **CHANNELS))
    voice = open_voice(scene, cache=CACHE)
    metadata = Metadata(voice.full_scale, voice.quantities, {})
    channels = json.loads(metadata.text())["channels"]
    assert [one["quantity"] for one in channels] == list(voice.quantities)
    added = {quantity: unit for quantity, unit in declaration(name).units.items() if quantity in voice.quantities}
    assert {one["quantity"]: one["unit"] for one in channels}.items() >= added.items()
    assert len(added) == len(voice.quantities) - 3


@every
def test_the_plan_names_what_runs_and_what_it_costs(names: tuple[str, ...]) -> None:
    document = open_voice(parse_scene(scene_with(*names, **CHANNELS)), cache=CACHE).plan.document()
    listed = [part["name"] for part in document["simulated"]]
    order = sorted(names, key=lambda name: (declaration(name).kind, name))  # type: ignore[attr-defined]
    assert [name for name in listed if name in names] == order
    assert all(part["reason"] for part in document["simulated"])
    assert set(document["estimated_error"]) >= {"displacement"}
    told = {part["name"]: part["price"] for part in document["simulated"] if "price" in part}
    assert told == {name: asdict(declaration(name).price) for name in names}  # type: ignore[attr-defined]


def test_effects_on_one_thing_are_refused_together_and_all_others_combine() -> None:
    for first, second in ((a, b) for a in ALONE for b in ALONE if a < b):
        same = declaration(first).replaces == declaration(second).replaces != ""
        assert ((first, second) in TOGETHER) != same
        if same:
            with pytest.raises(SceneError) as refused:
                parse_scene(scene_with(first, second))
            (fault,) = refused.value.faults
            assert fault.pointer == f"/effects/{second}"
            assert first in fault.hint and declaration(first).replaces in fault.allowed


def effect_of(name: str) -> Effect:
    """Return the effect called `name`."""
    effect = declaration(name)
    assert isinstance(effect, Effect)
    return effect


def shaped_and_simulated(names: tuple[str, ...]) -> bool:
    """Return whether one of the effects moves the ends of the contact, and another needs ends that stay."""
    effects = [declaration(name) for name in names]
    moving = any(getattr(effect, "moves_ends", False) for effect in effects)
    return moving and any(getattr(effect, "needs_fixed_ends", False) for effect in effects)


LOADED = """
import sys
from synth import Motion, explain, open_voice, parse_scene
finger, output = {"contact_length": "2 mm"}, {"sample_rate": 8000, "quantity": "displacement"}
scene = parse_scene({"finger": finger, "output": output, "effects": {"contact_growth": {}}})
voice = open_voice(scene)
voice.render(1000)
voice.render(100, Motion.of(100, speed=0.05, load=0.2))
explain(scene)
print(*(name for name in sys.modules if name.startswith(("synth.effects.", "synth.voice.voice_effects"))))
"""


def test_only_the_effects_that_are_called_for_are_loaded() -> None:
    """The modules of simulation come with the first effect of any kind."""
    done = subprocess.run([sys.executable, "-c", LOADED], cwd=ROOT, capture_output=True, text=True, check=True)
    loaded = {one for one in done.stdout.split() if not one.startswith("synth.effects.simulation")}
    assert loaded == {"synth.effects.effect", "synth.effects.contact_growth", "synth.voice.voice_effects"}


WITHOUT = """
import sys

class Gone:
    \"\"\"Hides the effects and the modules that only they use.\"\"\"

    def find_spec(self, name, path=None, target=None):
        own = ("voice_effects", "tangential_force", "propagated_motion", "skin_wave")
        served = tuple(f"synth.voice.{name}" for name in own)
        interface = {f"synth.effects.{name}" for name in ("effect", "simulation", "simulation.terms")}
        named = name.startswith(("synth.effects.", "synth.plan.plan.simulation_")) and name not in interface
        if named or name in served:
            raise ModuleNotFoundError(name)

sys.meta_path.insert(0, Gone())
sys.path.insert(0, "tests/synth/effects")
import plain_renders
print(plain_renders.digest())
"""


def test_without_effects_the_output_is_that_of_a_build_that_has_none() -> None:
    """The output is equal bit for bit with the modules of effects hidden and with all of them there."""
    done = subprocess.run([sys.executable, "-c", WITHOUT], cwd=ROOT, capture_output=True, text=True, check=True)
    assert all(f"synth.effects.{name}" in sys.modules for name in ALONE)
    assert done.stdout.strip() == digest()


@pytest.mark.parametrize("name", ALONE)
def test_null_is_the_scene_without_the_effect(name: str) -> None:
    plain = quick_scene()
    assert parse_scene(scene_with() | {"effects": {name: None}}) == plain
