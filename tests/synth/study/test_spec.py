"""A study as it is written: its scenes, and what is refused before anything is computed."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest

import ridgewave as rw
from synth.study.spec import read_spec, scene_at

PERIOD = {"texture.period": {"from": "0.1 mm", "to": "10 mm", "count": 5, "spacing": "log"}}
LATIN = {"kind": "latin_hypercube", "count": 8, "seed": 4}
OPEN = {"texture.period": {"from": "0.1 mm", "to": "10 mm", "spacing": "log"}, "scan.load": {"from": 0.1, "to": 1.0}}


def test_ranges_lists_and_arrays_become_si_numbers() -> None:
    axes = PERIOD | {"scan.load": ["100 mN", "1 N"], "scan.speed": np.array([0.04, 0.08])}
    spec = read_spec({"axes": axes})
    assert spec.shape == (5, 2, 2) and spec.count == 20
    np.testing.assert_allclose(spec.axes[0].values, [1e-4, 10**-3.5, 1e-3, 10**-2.5, 1e-2])
    assert spec.axes[1].values == (0.1, 1.0)
    columns = spec.columns()
    assert columns["scan.speed"][:3] == [0.04, 0.08, 0.04], "the last axis changes first"


@pytest.mark.parametrize("kind", ["latin_hypercube", "sobol"])
def test_samples_lie_between_the_ends_and_repeat_with_their_seed(kind: str) -> None:
    spec, again, other = (
        read_spec({"axes": OPEN, "sample": LATIN | {"kind": kind, "seed": seed}}).columns() for seed in (4, 4, 5)
    )
    assert spec == again and spec != other
    logs = np.log10(spec["texture.period"])
    assert len(logs) == 8 and logs.min() >= -4.0 and logs.max() <= -2.0
    counts = np.histogram(logs, bins=np.linspace(-4.0, -2.0, 9))[0]
    assert kind == "sobol" or np.all(counts == 1), "one in each eighth"


def test_points_are_the_scenes_that_the_axes_list() -> None:
    axes = {"scan.load": [0.1, 0.2, 0.4], "texture.period": {"from": "1 mm", "to": "4 mm", "count": 3}}
    spec = read_spec({"axes": axes, "sample": {"kind": "points"}})
    assert spec.shape == (3,)
    assert spec.columns() == {"scan.load": [0.1, 0.2, 0.4], "texture.period": pytest.approx([1e-3, 2.5e-3, 4e-3])}
    assert read_spec(spec.document()) == spec
    found = rw.sweep({}, axes, sample={"kind": "points"}, phases=64, lines=1)
    assert found.rms.dims == ("sample", "quantity") and found["scan.load"].values.tolist() == [0.1, 0.2, 0.4]
    alone = rw.sweep({}, {"scan.load": [0.4], "texture.period": ["4 mm"]}, phases=64, lines=1)
    np.testing.assert_array_equal(found.rms.values[2], alone.rms.values[0, 0])


def test_a_scene_has_the_values_of_its_axes() -> None:
    spec = read_spec({"scene": "denim-72x56", "axes": {"scan.load": ["0.4 N"], "texture.kind": ["sinusoid"]}})
    scene = scene_at(spec.scene, {"scan.load": 0.4, "texture.kind": "sinusoid"}, {})
    assert (scene.scan.load, scene.texture.kind) == (0.4, "sinusoid")
    base = read_spec({"axes": PERIOD}).scene
    grown = scene_at(base, {"groups.period_ratio": 2.0, "finger.ridge_period": 4e-4}, {})
    assert grown.texture.period == 8e-4


def test_fields_that_change_together_are_an_axis_over_their_section() -> None:
    textures = [{"period": "0.4 mm", "amplitude": "4 um"}, {"kind": "grating", "period": "2 mm", "height": "30 um"}]
    spec = read_spec({"axes": {"texture": textures, "scan.load": [0.1, 0.2]}})
    columns = spec.columns()
    scenes = [
        scene_at(spec.scene, {name: columns[name][number] for name in columns}, {}) for number in range(spec.count)
    ]
    assert [one.texture.kind for one in scenes] == ["sinusoid"] * 2 + ["grating"] * 2
    assert [one.texture.period for one in scenes] == [4e-4, 4e-4, 2e-3, 2e-3]
    assert scenes[0].texture.amplitude == 4e-6 and spec.axes[0].values == tuple(textures), "the spec is unchanged"
    assert read_spec(spec.document()) == spec
    found = rw.sweep({}, {"texture": textures}, phases=64, lines=1)
    assert found.rms.dims == ("texture", "quantity") and "grating" in str(found.texture.values[1])
    both = scene_at(spec.scene, {"texture": textures[0], "texture.period": 1e-3}, {})
    assert (both.texture.period, both.texture.amplitude) == (1e-3, 4e-6)


def test_the_design_of_saltelli_changes_one_axis_at_a_time() -> None:
    spec = read_spec({"axes": OPEN, "sample": {"kind": "saltelli", "count": 16, "seed": 3}})
    assert spec.shape == (64,)
    columns = spec.columns()
    sets = np.array([columns[name] for name in OPEN]).reshape(2, 4, 16)
    first, second, period, load = np.moveaxis(sets, 1, 0)
    assert np.all(first != second)
    np.testing.assert_array_equal(period, [second[0], first[1]])
    np.testing.assert_array_equal(load, [first[0], second[1]])


def test_the_figure_changes_no_number() -> None:
    plain, drawn = (read_spec({"axes": PERIOD} | change) for change in ({}, {"figure": "curves"}))
    assert plain.key == drawn.key and drawn.figure == "curves"


REFUSED: dict[str, tuple[Any, str]] = {
    "no object": ([1], "axes"),
    "unknown key": ({"axes": PERIOD, "phase": 4}, "phases"),
    "no axes": ({}, "at least one field"),
    "unknown field": ({"axes": {"texture.perod": [1.0]}}, "a field that holds one value"),
    "an empty section": ({"axes": {"texture": [{}]}}, "an object with fields"),
    "a section of numbers": ({"axes": {"finger": [1.0]}}, "an object with fields"),
    "a field that the section has not": ({"axes": {"texture": [{"perod": 1e-3}]}}, "period"),
    "a range of sections": ({"axes": {"texture": {"from": 1, "to": 2, "count": 3}}}, "a list of values"),
    "saltelli of another number": ({"axes": OPEN, "sample": {"kind": "saltelli", "count": 6}}, "power of two"),
    "a field twice": ({"axes": {"texture": [{"period": 1e-3}], "texture.period": [1e-3]}}, "period is set twice"),
    "a field and its group": ({"axes": {"groups.load": [1.0], "scan.load": [0.1]}}, "scan.load is set twice"),
    "no name of a figure": ({"axes": PERIOD, "figure": 3}, "the name of a figure"),
    "unknown group": ({"axes": {"groups.tau": [1.0]}}, "groups.ridges"),
    "empty list": ({"axes": {"scan.load": []}}, "at least one value"),
    "empty range": ({"axes": {"scan.load": {"from": 2.0, "to": 1.0, "count": 3}}}, "smaller value to a larger"),
    "wrong unit": ({"axes": {"texture.period": ["1 N"]}}, "0.8 mm"),
    "mixed units": ({"axes": {"texture.period": [1e-3, "1 mm"]}}, "all text with units"),
    "mixed ends": ({"axes": {"scan.load": {"from": 0.1, "to": "1 N", "count": 3}}}, "all text with units"),
    "outside the range": ({"axes": {"scan.load": ["2000 N"]}}, "1000 N"),
    "nan": ({"axes": {"scan.load": [float("nan")]}}, "1000 N"),
    "log of zero": ({"axes": {"scan.load": {"from": 0.0, "to": 1.0, "count": 3, "spacing": "log"}}}, "above 0"),
    "unknown spacing": ({"axes": {"scan.load": {"from": 0.1, "to": 1.0, "count": 3, "spacing": "dB"}}}, "linear"),
    "no count": ({"axes": {"scan.load": {"from": 0.1, "to": 1.0}}}, "whole number"),
    "a million": (
        {"axes": {name: {"from": 0.1, "to": 1.0, "count": 1000} for name in ("scan.load", "scan.speed")}},
        "most_scenes 1000000",
    ),
    "a list of samples": ({"axes": {"scan.load": [0.1, 1.0]}, "sample": LATIN}, "from"),
    "points of unequal numbers": (
        {"axes": {"scan.load": [0.1, 1.0], "scan.speed": [0.1]}, "sample": {"kind": "points"}}, "scan.load",
    ),
    "points with a count": ({"axes": {"scan.load": [0.1]}, "sample": {"kind": "points", "count": 3}}, "count"),
    "unknown samples": ({"axes": OPEN, "sample": {"kind": "random", "count": 8}}, "latin_hypercube"),
    "phases": ({"axes": PERIOD, "phases": 100}, "power of two"),
    "too many lines": ({"axes": PERIOD, "lines": 5000}, "4096"),
    "unknown texture": ({"axes": {"texture.kind": ["denim-72x56", "denmi"]}}, "denim"),
    "too large": (
        {"axes": {"scan.load": {"from": 0.1, "to": 1.0, "count": 200_000}}, "lines": 4096}, "at most 8 GB",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", REFUSED)
def test_what_is_no_study_is_refused_with_what_to_write(name: str) -> None:
    document, word = REFUSED[name]
    with pytest.raises(rw.SceneError) as caught:
        read_spec(document)
    assert word in str(caught.value)


def test_every_fault_of_the_axes_is_told_at_once() -> None:
    with pytest.raises(rw.SceneError) as caught:
        read_spec({"axes": {"texture.perod": [1.0], "scan.load": ["1 m"]}})
    assert len(caught.value.faults) == 2


def test_a_study_has_names_of_its_own_for_textures() -> None:
    own = {"deep": {"kind": "grating", "period": "2 mm", "height": "50 um"}}
    axes = {"texture.kind": ["grating-800um-40um", "deep"], "texture.phase": [0.0, 1.0]}
    spec = read_spec({"axes": axes, "textures": own})
    columns = spec.columns()
    rows = [{name: columns[name][number] for name in columns} for number in range(spec.count)]
    kinds = [scene_at(spec.scene, row, spec.textures).texture for row in rows]
    assert [one.kind for one in kinds] == ["sinusoid"] * 2 + ["grating"] * 2
    assert [one.phase for one in kinds] == [0.0, 1.0] * 2 and kinds[2].period == 2e-3
    assert columns["texture.kind"] == ["grating-800um-40um"] * 2 + ["deep"] * 2
    assert read_spec(json.dumps(spec.document())).key == spec.key
    periods = scene_at(spec.scene, {"texture.period": 4e-3, "texture.kind": "deep"}, spec.textures).texture
    assert periods.period == 4e-3, "the value of an axis counts, in any order of the axes"
    for name, section, at in (("sinusoid", own["deep"], "/textures"), ("a/b", {"kind": "nope"}, "/textures/a~1b/kind")):
        with pytest.raises(rw.SceneError) as refused:
            read_spec({"axes": PERIOD, "textures": {name: section}})
        assert refused.value.faults[0].pointer == at
    with pytest.raises(rw.SceneError, match=r"axes.texture.kind.1.*'dep'"):
        read_spec({"axes": {"texture.kind": ["deep", "dep"]}, "textures": own})
