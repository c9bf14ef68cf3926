"""The kinds of finger in a scene: their defaults, documents and refusals."""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Any

import pytest

from synth import explain
from synth.errors import SceneError
from synth.scene.effects_section import effect_names
from synth.scene.finger_section import KINDS, PRINT, TIP, Finger
from synth.scene.rules import Quantity
from synth.scene.scene import parse_scene, scene_document
from synth.scene.section import rule_of

ROOT = Path(__file__).resolve().parents[3]


@pytest.mark.parametrize("kind", KINDS)
def test_a_kind_has_its_defaults_and_its_document_reads_back(kind: str) -> None:
    scene = parse_scene({"finger": {"kind": kind}})
    assert {name: getattr(scene.finger, name) for name in KINDS[kind].defaults} == KINDS[kind].defaults
    written = scene_document(scene)["finger"]
    assert set(written) <= set(KINDS[kind].fields)
    assert parse_scene({"finger": written}) == scene


def test_a_finger_without_a_kind_is_the_comb_of_the_paper() -> None:
    assert parse_scene({}) == parse_scene({"finger": {"kind": "comb"}})
    assert "kind" not in scene_document(parse_scene({}))["finger"]


@pytest.mark.parametrize("name", [*PRINT, *TIP])
def test_a_field_of_one_kind_has_both_ends_and_no_more(name: str) -> None:
    kind, rule = "probe" if name in TIP else "fingertip", rule_of(Finger, name)
    if not isinstance(rule, Quantity):
        return
    for end, beyond in ((rule.low, rule.low - max(abs(rule.low), 1.0)), (rule.high, 2.0 * rule.high + 1.0)):
        given = int(end) if rule.whole else end
        assert getattr(parse_scene({"finger": {"kind": kind, name: given}}).finger, name) == end
        for wrong in (beyond, math.nan, math.inf, "3 s"):
            with pytest.raises(SceneError) as refused:
                parse_scene({"finger": {"kind": kind, name: wrong}})
            assert [fault.pointer for fault in refused.value.faults] == [f"/finger/{name}"]


REFUSED: dict[str, tuple[dict[str, Any], str, str]] = {
    "seed of a comb": ({"seed": 3}, "/finger/seed", '"fingertip"'),
    "ridges of a probe": ({"kind": "probe", "ridge_period": 1e-3}, "/finger/ridge_period", '"comb" or "fingertip"'),
    "a tip of a fingertip": ({"kind": "fingertip", "tip_radius": 1e-3}, "/finger/tip_radius", '"probe"'),
    "a spread of 100 %": ({"kind": "fingertip", "spacing_spread": 1.0}, "/finger/spacing_spread", "at most 0.5"),
    "a seed beyond its range": ({"kind": "fingertip", "seed": 1_000_001}, "/finger/seed", "1000000"),
    "a broken seed": ({"kind": "fingertip", "seed": 0.5}, "/finger/seed", "whole number"),
    "a kind that does not exist": ({"kind": "fingertips"}, "/finger/kind", '"fingertip"'),
    "a kind that is a number": ({"kind": 3}, "/finger/kind", '"comb"'),
    "a pattern that does not exist": ({"kind": "fingertip", "pattern": "arch"}, "/finger/pattern", '"loop"'),
    "two amplitudes": ({"kind": "fingertip", "ridge_amplitude": 1e-5, "roughness": 1e-5}, "/finger/roughness", "one"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_a_finger_is_refused_with_what_to_write_instead(name: str) -> None:
    finger, pointer, hint = REFUSED[name]
    with pytest.raises(SceneError) as refused:
        parse_scene({"finger": finger})
    (fault,) = refused.value.faults
    assert fault.pointer == pointer and hint in fault.hint


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("effect", effect_names())
def test_an_effect_is_refused_with_a_finger_that_cannot_have_it(effect: str, kind: str) -> None:
    scene = {"finger": {"kind": kind}, "effects": {effect: {}}}
    if KINDS[kind].straight or effect not in ("contact_growth", "curvature"):
        parse_scene(scene)
        return
    with pytest.raises(SceneError) as refused:
        parse_scene(scene)
    (fault,) = refused.value.faults
    assert fault.pointer == f"/effects/{effect}" and "comb" in fault.hint and kind in fault.hint


def test_the_plan_warns_where_a_comb_cancels_the_fundamental_and_not_of_a_fingertip() -> None:
    texture = {"texture": {"kind": "grating-1mm-31um"}}
    (warning,) = [text for text in explain(texture).warnings if "u / lambda2" in text]
    assert "number 2" in warning and "near 2." in warning and '"fingertip"' in warning
    assert not [text for text in explain({}).warnings if "u / lambda2" in text]
    assert not [
        text for text in explain({**texture, "finger": {"kind": "fingertip"}}).warnings if "u / lambda2" in text
    ]


@pytest.mark.parametrize(
    "texture",
    [
        {"kind": "harmonics", "period": "1.6 mm", "amplitudes": [0.0, "20 um"]},  # the default texture, written twice
        {"kind": "rough", "period": "5 mm", "longest": "0.5 mm"},
    ],
)
def test_the_plan_blames_no_comb_for_a_line_that_the_texture_does_not_have(texture: dict[str, object]) -> None:
    assert not [text for text in explain({"texture": texture}).warnings if "u / lambda2" in text]


def test_two_files_know_the_kinds_of_finger_by_name() -> None:
    """Others ask for a trait of `FingerKind`, so that a new kind is complete with its declaration and its contact."""
    named = re.compile(rf'finger\.kind (==|!=|in|not in) .*"({"|".join(KINDS)})"')
    files = [path for folder in ("synth", "service", "clients") for path in (ROOT / folder).rglob("*.py")]
    knowing = {path.name for path in files if named.search(path.read_text("utf-8"))}
    assert knowing <= {"finger_section.py", "scene_contact.py"}
