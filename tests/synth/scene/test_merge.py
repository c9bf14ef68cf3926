"""Partial scenes: RFC 7396, and the fields that displace each other."""

from __future__ import annotations

import copy
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from synth.errors import SceneError
from synth.scene.merge import merge_patch
from synth.scene.scene import Scene, parse_scene, scene_document
from tests.synth.scene.scene_cases import RISING

STROKE = {"scan": {"stroke": {"length": 0.02, "load": 0.5}, "lift_load": 0.002}}
RECORDED = {"scan": {"trajectory": RISING, "lift_load": 0.002}}
STARTS: list[dict[str, Any]] = [{}, STROKE, RECORDED, {"output": {"channels": ["velocity"]}}]

RFC_7396_APPENDIX_A: list[tuple[dict[str, Any], dict[str, Any], dict[str, Any]]] = [
    ({"a": "b"}, {"a": "c"}, {"a": "c"}),
    ({"a": "b"}, {"b": "c"}, {"a": "b", "b": "c"}),
    ({"a": "b"}, {"a": None}, {}),
    ({"a": "b", "b": "c"}, {"a": None}, {"b": "c"}),
    ({"a": ["b"]}, {"a": "c"}, {"a": "c"}),
    ({"a": "c"}, {"a": ["b"]}, {"a": ["b"]}),
    ({"a": {"b": "c"}}, {"a": {"b": "d", "c": None}}, {"a": {"b": "d"}}),
    ({"a": [{"b": "c"}]}, {"a": [1]}, {"a": [1]}),
    ({"e": None}, {"a": 1}, {"e": None, "a": 1}),
    ({}, {"a": {"bb": {"ccc": None}}}, {"a": {"bb": {}}}),
]


@pytest.mark.parametrize(("document", "patch", "result"), RFC_7396_APPENDIX_A)
def test_a_patch_is_merged_as_in_appendix_a_of_the_rfc(document: Any, patch: Any, result: Any) -> None:
    assert merge_patch(document, patch) == result


Part = dict[str, Any]
LIFTED = {"lift_load": 0.005}
DISPLACED: dict[str, tuple[str, Part, Part, Part]] = {
    "a kind replaces the texture": (
        "texture", {"period": 1e-3, "phase": 0}, {"kind": "sinusoid", "amplitude": 1e-5},
        {"kind": "sinusoid", "amplitude": 1e-5},
    ),
    "a kind replaces the finger": (
        "finger", {"kind": "fingertip", "seed": 4}, {"kind": "probe", "tip_radius": 2e-3},
        {"kind": "probe", "tip_radius": 2e-3},
    ),
    "a null kind replaces nothing": ("texture", {"kind": "sinusoid", "period": 1e-3}, {"kind": None}, {"period": 1e-3}),
    "a speed ends a stroke": ("scan", STROKE["scan"], {"speed": 0.1}, {"speed": 0.1}),
    "a load ends a trajectory": ("scan", RECORDED["scan"], {"load": 0.1}, {"load": 0.1}),
    "a null speed ends no stroke": ("scan", STROKE["scan"], {"speed": None, **LIFTED}, STROKE["scan"] | LIFTED),
    "a stroke replaces a stroke": ("scan", STROKE["scan"], {"stroke": {"speed": 0.2}}, {"stroke": {"speed": 0.2}}),
    "a trajectory replaces a stroke": ("scan", STROKE["scan"], {"trajectory": RISING}, {"trajectory": RISING}),
    "a stroke replaces a constant scan": (
        "scan", {"speed": 0.1, "load": 1, "lift_load": 0.002}, {"stroke": {}}, {"stroke": {}},
    ),
    "a null stroke in the document is no stroke": (
        "scan", {"speed": 0.1, "stroke": None}, {"load": 1}, {"speed": 0.1, "stroke": None, "load": 1},
    ),
    "constant, with the other kinds put out": (
        "scan", STROKE["scan"], {"stroke": None, "trajectory": None, "speed": 0.1}, {"speed": 0.1},
    ),
    "an amplitude displaces a roughness": (
        "texture", {"roughness": 1e-5, "period": 1e-3}, {"amplitude": 2e-5}, {"amplitude": 2e-5, "period": 1e-3},
    ),
    "a roughness displaces an amplitude": ("texture", {"amplitude": 2e-5}, {"roughness": 1e-5}, {"roughness": 1e-5}),
    "a roughness displaces a ridge amplitude": (
        "finger", {"ridge_amplitude": 2e-5}, {"roughness": 1e-5}, {"roughness": 1e-5},
    ),
    "a ridge amplitude displaces a roughness": (
        "finger", {"roughness": 1e-5}, {"ridge_amplitude": 2e-5}, {"ridge_amplitude": 2e-5},
    ),
    "a null roughness displaces nothing": ("texture", {"amplitude": 2e-5}, {"roughness": None}, {"amplitude": 2e-5}),
    "channels displace a quantity": (
        "output", {"quantity": "velocity", "full_scale": 1, "fade": 0.1}, {"channels": ["velocity"]},
        {"channels": ["velocity"], "fade": 0.1},
    ),
    "a quantity displaces channels": (
        "output", {"channels": ["velocity"], "fade": 0.1}, {"quantity": "velocity"},
        {"quantity": "velocity", "fade": 0.1},
    ),
    "another quantity displaces the full scale": (
        "output", {"quantity": "velocity", "full_scale": 1}, {"quantity": "displacement"}, {"quantity": "displacement"},
    ),
    "the same quantity keeps the full scale": (
        "output", {"quantity": "velocity", "full_scale": 1}, {"quantity": "velocity"},
        {"quantity": "velocity", "full_scale": 1},
    ),
    "the default quantity written out keeps it too": (
        "output", {"full_scale": 3.0}, {"quantity": "acceleration"}, {"quantity": "acceleration", "full_scale": 3.0},
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", DISPLACED)
def test_fields_displace_each_other(name: str) -> None:
    section, document, patch, result = DISPLACED[name]
    merged = merge_patch({section: document}, {section: patch})
    assert merged == {section: result}
    parse_scene(merged)


def test_a_patch_that_names_two_kinds_of_scan_is_left_for_the_scene_to_refuse() -> None:
    merged = merge_patch({}, {"scan": {"speed": 0.1, "stroke": {}}})
    with pytest.raises(SceneError):
        parse_scene(merged)


@pytest.mark.parametrize("start", STARTS)
def test_a_patch_on_a_complete_document_is_a_scene(start: dict[str, Any]) -> None:
    complete = scene_document(parse_scene(start))
    changed = parse_scene(merge_patch(complete, {"scan": {"speed": 0.1}, "texture": {"kind": "grating-5mm-200um"}}))
    assert (changed.scan.speed, changed.scan.stroke, changed.scan.trajectory) == (0.1, None, None)
    assert changed.texture.period == 0.005
    assert changed.output == parse_scene(start).output


@pytest.mark.parametrize("start", STARTS)
@pytest.mark.parametrize("other", STARTS)
def test_a_complete_document_as_a_patch_makes_its_own_scene(start: dict[str, Any], other: dict[str, Any]) -> None:
    complete = scene_document(parse_scene(other))
    assert parse_scene(merge_patch(scene_document(parse_scene(start)), complete)) == parse_scene(other)


def test_a_band_of_null_is_the_default_band_again() -> None:
    full = merge_patch(scene_document(Scene()), {"output": {"bandwidth": "full"}})
    assert parse_scene(full).output.bandwidth == "full"
    assert parse_scene(merge_patch(full, {"output": {"bandwidth": None}})) == Scene()
    assert parse_scene(merge_patch(full, {"output": {"bandwidth": "1 kHz"}})) == Scene()


def test_nothing_given_is_changed() -> None:
    document = scene_document(Scene())
    patch = {"texture": {"kind": "sinusoid", "roughness": 1e-5}, "scan": {"stroke": {"length": None}}, "finger": None}
    before = copy.deepcopy((document, patch))
    merge_patch(document, patch)
    assert (document, patch) == before


JSON_VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.text(),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(), inner, max_size=3),
    max_leaves=10,
)
SECTION = st.dictionaries(
    st.sampled_from(["kind", "amplitude", "roughness", "speed", "stroke", "channels", "quantity"]), JSON_VALUES
)
SECTIONS = st.sampled_from(["finger", "texture", "scan", "output"])
PARTIAL = st.dictionaries(SECTIONS | st.text(), JSON_VALUES | SECTION, max_size=5)


@settings(max_examples=40)
@given(PARTIAL, PARTIAL)
def test_merging_garbage_raises_nothing_and_leaves_no_null_of_the_patch(
    document: dict[str, Any], patch: dict[str, Any]
) -> None:
    merged = merge_patch(document, patch)
    for name, change in patch.items():
        assert (name in merged) == (change is not None)
    try:
        parse_scene(merged)
    except SceneError as refused:
        assert refused.faults


def test_a_patch_that_is_nested_without_end_is_refused() -> None:
    patch: dict[str, Any] = {}
    for _ in range(100_000):
        patch = {"scan": patch}
    with pytest.raises(SceneError):
        merge_patch({}, patch)


def test_a_patch_of_one_effect_leaves_the_others_auto() -> None:
    """As in a session, which keeps its scene with every effect by name."""
    patch = {"effects": {"inertia": {"mass": 1e-3}, "adhesion": None}}
    merged = merge_patch({"effects": "auto"}, patch)
    assert merged["effects"] == merge_patch(scene_document(parse_scene({"effects": "auto"})), patch)["effects"]
    kept = merged["effects"]
    assert isinstance(kept, dict) and kept.pop("inertia") == {"mass": 1e-3}
    assert "adhesion" not in kept and set(kept.values()) == {"auto"} and "viscous_skin" in kept
    assert merge_patch({"effects": {"inertia": {}}}, {"effects": "auto"}) == {"effects": "auto"}
