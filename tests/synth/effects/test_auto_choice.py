""" "auto" is never refused: of two effects that replace the same thing one is taken, and the rest is left out."""

from __future__ import annotations

from typing import Any

import pytest

from synth import Voice, parse_scene
from synth.plan.prepare import prepare
from synth.scene.effects_section import declaration, effect_names
from synth.scene.merge import merge_patch
from synth.scene.scene import channel_count
from tests.few import paired, thorough

ALL = {name: "auto" for name in effect_names() if not declaration(name).without_auto}
FINGERS: dict[str, dict[str, Any]] = {
    "comb": {"contact_length": "2 mm"},
    "fingertip": {"kind": "fingertip", "contact_length": "2 mm"},
    "probe": {"kind": "probe"},
}
SCANS: dict[str, dict[str, Any]] = {
    "constant": {},
    "light": {"load": 0.03},
    "stroke": {"stroke": {"length": "5 mm"}},
    "recording": {"trajectory": [[0, 0, 0.1], [0.03, 0.002, 0.5], [0.05, 0.004, 0.2]]},
    "path": {"trajectory": [[0, 0, 0, 0, 0.1], [0.03, 0.002, 0.001, 0.1, 0.5], [0.05, 0.004, 0, 0.2, 0.2]]},
}
TEXTURES: dict[str, dict[str, Any]] = {"line": {}, "area": {"kind": "dots"}}


def plan_of(
    effects: dict[str, Any] | str, finger: str, texture: str, scan: str, *, paced: bool = False, tolerance: float = 0.03
) -> dict[str, Any]:
    """Return the plan as a document."""
    scene = parse_scene(
        {
            "finger": FINGERS[finger],
            "texture": TEXTURES[texture],
            "scan": SCANS[scan],
            "effects": effects,
            "output": {"quantity": "displacement", "sample_rate": 8000, "duration": 0.05},
            "accuracy": {"tolerance": tolerance},
        }
    )
    return Voice(prepare(scene, paced=paced), paced=paced).plan.document()


SLOWEST = "comb", "area", "recording"  # 20 s; another finger is pressed over the area, and another texture recorded


def places() -> list[Any]:
    """Return the scenes of every finger, texture and scan that a scene may have."""
    found = []
    for one in paired(FINGERS, TEXTURES, SCANS):
        finger, texture, scan = getattr(one, "values", one)
        if (finger, texture) != ("probe", "area") and (texture, scan) != ("line", "path"):
            found.append(one if (finger, texture, scan) != SLOWEST else thorough(finger, texture, scan))
    return found


@pytest.mark.parametrize(("finger", "texture", "scan"), places())
def test_all_effects_on_auto_are_never_refused_and_each_has_its_reason(finger: str, texture: str, scan: str) -> None:
    plan = plan_of(ALL, finger, texture, scan, paced=True)
    called = {one["name"] for one in plan["simulated"]} & set(ALL)
    spared = {one["name"]: one["reason"] for one in plan["left_out"] if one["name"] in ALL}
    assert called | set(spared) == set(ALL) and not called & set(spared)
    assert all(spared.values())
    replaced = [declaration(name).replaces for name in called]
    assert len(replaced) == len(set(replaced)), "two replace the same thing"


def test_auto_in_place_of_the_effects_is_auto_for_each_that_adds_no_channel() -> None:
    scene = parse_scene({"effects": "auto"})
    assert scene.document()["effects"] == {name: "auto" for name in ALL if name != "stick_slip"}
    assert parse_scene(scene.document()) == scene and channel_count(scene) == 1
    assert parse_scene({"effects": "auto", "scan": {"load": "-10 mN"}}).scan.load == -0.01, "adhesion may hold a pull"
    plan = plan_of("auto", "fingertip", "area", "stroke", paced=True)
    told = {one["name"] for one in (*plan["simulated"], *plan["left_out"])}
    assert set(scene.effects) <= told


def test_a_session_may_ask_for_auto_and_for_one_effect_after_it() -> None:
    merged = merge_patch({"effects": "auto"}, {"effects": {"inertia": {}}})
    effects = dict(parse_scene(merged).effects)
    assert effects.pop("inertia") != "auto" and effects and set(effects.values()) == {"auto"}
    assert set(parse_scene(merge_patch(merged, {"effects": "auto"})).effects.values()) == {"auto"}


def test_what_the_scene_sets_is_taken_before_what_is_on_auto() -> None:
    plan = plan_of({"adhesion": {}, "viscous_skin": "auto"}, "comb", "line", "constant", paced=True)
    (spared,) = [one for one in plan["left_out"] if one["name"] == "viscous_skin"]
    assert spared["reason"] == "It replaces the law of the pressure, as adhesion does, which the scene sets."


def test_of_two_on_auto_the_one_that_changes_more_is_taken() -> None:
    both = {"adhesion": "auto", "viscous_skin": "auto"}
    plan = plan_of(both, "comb", "line", "light", paced=True, tolerance=1e-3)
    assert [one["name"] for one in plan["simulated"] if one["name"] in ALL] == ["viscous_skin"]
    (spared,) = [one for one in plan["left_out"] if one["name"] == "adhesion"]
    assert spared["reason"].endswith("as viscous_skin does, which changes the output more.")
    assert 0.0 < spared["effect_on_output"] < 1.0


def test_an_effect_of_another_finger_or_texture_is_left_out_with_a_sentence() -> None:
    plan = plan_of({"contact_growth": "auto"}, "fingertip", "line", "constant")
    (spared,) = [one for one in plan["left_out"] if one["name"] == "contact_growth"]
    assert spared["reason"] == "It is an effect of a comb; this finger is a fingertip."
