"""Invalid scenes, as documents and as text: all faults are reported at once, each with its pointer and hint."""

from __future__ import annotations

import json
import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from synth.errors import Fault, SceneError, shown
from synth.scene.quantity import Dimension, parse_quantity
from synth.scene.rules import Quantity
from synth.scene.scene import Scene, parse_scene, parse_scene_text, scene_document
from synth.scene.section import inner_section
from tests.synth.scene.scene_cases import RISING, faults_of, nested, quantity_fields


@pytest.mark.parametrize(("path", "rule"), quantity_fields(), ids=lambda item: item if isinstance(item, str) else "")
def test_every_quantity_refuses_what_is_outside_or_no_quantity(path: str, rule: Quantity) -> None:
    """The next float beyond either end, NaN and infinity are in hard/test_boundaries.py."""
    pointer = "/" + path.replace(".", "/")
    outside: list[object] = [1e300, -1e300]
    garbage: list[object] = [True, False, "", "1", "1 parsec", [], {}, [1], 10**400]
    for value in outside + garbage:
        faults = [fault for fault in faults_of(nested(path, value)) if fault.pointer == pointer]
        assert faults, (path, value)
        assert faults[0].allowed == rule.allowed
        assert rule.unit in faults[0].hint or not rule.unit or str(rule.low) in faults[0].hint
        assert faults[0].hint
        assert faults[0].value


@pytest.mark.parametrize(
    ("document", "pointer", "words"),
    [
        ({"sacn": {}}, "/sacn", '"scan"'),
        ({"zzz": None}, "/zzz", "Leave it out"),
        ({"finger": {"poison_ratio": 0.5}}, "/finger/poison_ratio", '"poisson_ratio"'),
        ({"finger": {"amplitude": 1e-5}}, "/finger/amplitude", '"ridge_amplitude"'),
        ({"a/b~c": 1}, "/a~1b~0c", "Leave it out"),
        ({1: 2}, "/1", "Leave it out"),
        ({"finger": []}, "/finger", "ridge_period"),
        ({"finger": "mine"}, "/finger", "ridge_period"),
        ({"scan": {"stroke": 3}}, "/scan/stroke", "turn_time"),
        ({"texture": {"kind": "sinusod"}}, "/texture/kind", '"sinusoid"'),
        ({"texture": {"kind": "grating-1mm-32um"}}, "/texture/kind", '"grating-1mm-31um"'),
        ({"texture": {"kind": 7}}, "/texture/kind", '"sinusoid"'),
        ({"texture": {"period": 8}}, "/texture/period", "at most 1 m"),
        ({"texture": {"period": "0.8"}}, "/texture/period", '"0.8 mm"'),
        ({"texture": {"amplitude": 0, "roughness": 0}}, "/texture/roughness", "Leave one out"),
        ({"finger": {"ridge_amplitude": 0, "roughness": 0}}, "/finger/roughness", "Leave one out"),
        ({"scan": {"speed": 1, "stroke": {}}}, "/scan/speed", "inside the stroke"),
        ({"scan": {"load": 1, "stroke": {}}}, "/scan/load", "inside the stroke"),
        ({"scan": {"load": 1, "trajectory": RISING}}, "/scan/load", "Leave it out"),
        ({"scan": {"stroke": {}, "trajectory": RISING}}, "/scan/trajectory", "Leave one out"),
        ({"scan": {"stroke": {"length": "1 mm", "turn_time": "0.1 s"}}}, "/scan/stroke/turn_time", "shorter turn_time"),
        ({"scan": {"stroke": {"length": "0.1 mm", "speed": 9}}}, "/scan/stroke/length", "at least 5.63 mm"),
        ({"scan": {"trajectory": []}}, "/scan/trajectory", "list of points"),
        ({"scan": {"trajectory": RISING[:1]}}, "/scan/trajectory", "list of points"),
        ({"scan": {"trajectory": "RISING"}}, "/scan/trajectory", "list of points"),
        ({"scan": {"trajectory": {}}}, "/scan/trajectory", "list of points"),
        ({"scan": {"trajectory": [*RISING, [0.4, 0]]}}, "/scan/trajectory/4", "three numbers"),
        ({"scan": {"trajectory": [*RISING, 5]}}, "/scan/trajectory/4", "three numbers"),
        ({"scan": {"trajectory": [*RISING, [0.3, 0.02, 0.3]]}}, "/scan/trajectory/4/0", "Sort"),
        ({"scan": {"trajectory": [*RISING, [0.29, 0.02, 0.3]]}}, "/scan/trajectory/4/0", "Sort"),
        ({"scan": {"trajectory": [*RISING, [0.3000001, 0.02, 0.3]]}}, "/scan/trajectory/4/0", "Sort"),
        ({"scan": {"trajectory": [*RISING, [0.4, 1.1, 0.3]]}}, "/scan/trajectory/4/1", "units"),
        ({"scan": {"trajectory": [[-0.1, 0, 0.3], *RISING]}}, "/scan/trajectory/0/0", "at least 0 s"),
        ({"scan": {"trajectory": [*RISING, [0.4, 0.02, -0.3]]}}, "/scan/trajectory/4/2", "at least 0 N"),
        ({"scan": {"trajectory": [*RISING, [0.4, math.nan, 0.3]]}}, "/scan/trajectory/4/1", "finite"),
        ({"scan": {"trajectory": [*RISING, [math.inf, 0.02, 0.3]]}}, "/scan/trajectory/4/0", "finite"),
        ({"scan": {"trajectory": [*RISING, [0.4, "2 s", 0.3]]}}, "/scan/trajectory/4/1", '"0.8 mm"'),
        ({"scan": {"trajectory": [*RISING, [0.4, None, 0.3]]}}, "/scan/trajectory/4/1", '"0.8 mm"'),
        ({"effects": {"fluid": {}}}, "/effects/fluid", "Leave it out"),
        ({"effects": {"inertias": "auto"}}, "/effects/inertias", '"inertia"'),
        ({"effects": []}, "/effects", "{}"),
        ({"effects": {"inertia": "automatic"}}, "/effects/inertia", '"auto"'),
        ({"effects": {"inertia": {"mass": "5 N"}}}, "/effects/inertia/mass", "units: kg, g, mg"),
        ({"effects": {"inertia": {"mass": 2}}}, "/effects/inertia/mass", "at most 1 kg"),
        ({"effects": {"inertia": {"damping": "-1 N s/m"}}}, "/effects/inertia/damping", "at least 0 N s/m"),
        ({"effects": {"inertia": {"stiffness": -1}}}, "/effects/inertia/stiffness", "at least 0 N/m"),
        ({"effects": {"inertia": {"stiffness": "2 MN/m"}}}, "/effects/inertia/stiffness", "units: N/m, N/mm, kN/m"),
        ({"effects": {"inertia": {"stiffness": 2e6}}}, "/effects/inertia/stiffness", "at most 1000000 N/m"),
        ({"effects": {"inertia": {"stiffness": float("nan")}}}, "/effects/inertia/stiffness", "0 N/m"),
        ({"effects": {"inertia": {"mas": 1}}}, "/effects/inertia/mas", '"mass"'),
        ({"effects": {"tangential": "auto"}}, "/effects/tangential", "adds a channel"),
        ({"effects": {"contact_growth": {}, "curvature": {}}}, "/effects/curvature", '"contact_growth" replaces'),
        ({"effects": {"adhesion": {}, "viscous_skin": {}}}, "/effects/viscous_skin", '"adhesion" replaces'),
        (
            {"effects": {"tangential": {"pressure_exponent": 0.9}, "inertia": {}}},
            "/effects/tangential",
            "pressure_exponent of 1",
        ),
        (
            {"effects": {"contact_growth": {"shortest": "9 mm", "longest": "8 mm"}}},
            "/effects/contact_growth/longest",
            "longer",
        ),
        ({"effects": {"viscous_skin": {"short_time": "4 ms"}}}, "/effects/viscous_skin/short_time", "another model"),
        ({"effects": {"inertia": {}}, "scan": {"load": "-0.01 N"}}, "/scan/load", "at least 0 N"),
        ({"effects": {"adhesion": {}}, "scan": {"load": "-101 N"}}, "/scan/load", "at least -100 N"),
        ({"output": {"quantity": "aceleration"}}, "/output/quantity", '"acceleration"'),
        ({"output": {"quantity": 1}}, "/output/quantity", "displacement"),
        ({"output": {"quantity": "velocity", "channels": ["velocity"]}}, "/output/quantity", "inside the channel"),
        ({"output": {"full_scale": 1, "channels": ["velocity"]}}, "/output/full_scale", "inside the channel"),
        ({"output": {"channels": []}}, "/output/channels", "displacement"),
        ({"output": {"channels": ["velocity"] * 17}}, "/output/channels", "displacement"),
        ({"output": {"channels": "velocity"}}, "/output/channels", "displacement"),
        ({"output": {"channels": ["velocity", "velocty"]}}, "/output/channels/1", '"velocity"'),
        ({"output": {"channels": [7]}}, "/output/channels/0", "quantity"),
        ({"output": {"channels": [{"fullscale": 1}]}}, "/output/channels/0/fullscale", '"full_scale"'),
        (
            {"output": {"channels": [{"quantity": "displacement", "full_scale": "1 m/s"}]}},
            "/output/channels/0/full_scale",
            "units: m,",
        ),
        ({"output": {"full_scale": "1 um"}}, "/output/full_scale", "m/s^2"),
        ({"output": {"full_scale": 0}}, "/output/full_scale", "at least"),
        ({"output": {"full_scale": -1}}, "/output/full_scale", "at least"),
        ({"output": {"full_scale": math.inf}}, "/output/full_scale", "finite"),
        ({"output": {"sample_rate": 44100.5}}, "/output/sample_rate", "whole number such as 44100"),
        ({"output": {"duration": 1, "fade": 0.6}}, "/output/fade", "shorter fade"),
        ({"output": {"fade": "1.1 s"}}, "/output/fade", "shorter fade"),
        ({"output": {"bandwidth": "ful"}}, "/output/bandwidth", '"full"'),
        ({"output": {"bandwidth": "1 kN"}}, "/output/bandwidth", "units: Hz, kHz"),
        ({"output": {"bandwidth": "97 kHz"}}, "/output/bandwidth", "at most 96000 Hz"),
        ({"output": {"bandwidth": 0.5}}, "/output/bandwidth", "at least 1 Hz"),
        ({"output": {"bandwidth": math.inf}}, "/output/bandwidth", "finite"),
        ({"accuracy": {"tolerance": "exat"}}, "/accuracy/tolerance", '"exact"'),
        ({"accuracy": {"tolerance": "0.001"}}, "/accuracy/tolerance", "without quotes"),
        ({"accuracy": {"tolerance": 0.04}}, "/accuracy/tolerance", "at most 0.03"),
        ({"accuracy": {"tolerance": 9e-8}}, "/accuracy/tolerance", "at least 1e-7"),
        ({"accuracy": {"tolerance": True}}, "/accuracy/tolerance", "JSON number"),
        ({"accuracy": {"tolerance": math.nan}}, "/accuracy/tolerance", "JSON number"),
        (None, "", "{}"),
        ([], "", "{}"),
        (7, "", "{}"),
        ("grating-1mm", "/name", "grating-"),
    ],
)
def test_each_fault_names_its_field_and_what_to_write(document: object, pointer: str, words: str) -> None:
    faults = faults_of(document)
    assert [fault.pointer for fault in faults] == [pointer]
    assert words in faults[0].hint
    assert faults[0].allowed
    assert faults[0].value


@given(st.floats(1e-4, 10.0), st.floats(1e-6, 10.0))
def test_the_turn_and_the_length_that_a_refusal_advises_are_accepted(length: float, speed: float) -> None:
    stroke = {"length": length, "speed": speed, "turn_time": 10.0}
    for _ in range(2):
        try:
            parse_scene({"scan": {"stroke": stroke}})
            return
        except SceneError as refused:
            (fault,) = refused.faults
        if fault.pointer == "/scan/stroke/turn_time":
            stroke["turn_time"] = parse_quantity(fault.allowed.rpartition("here ")[2], Dimension.TIME)
        else:
            shortest = fault.hint.partition("at least ")[2].partition(",")[0]
            stroke = {"length": parse_quantity(shortest, Dimension.LENGTH), "speed": speed, "turn_time": 1e-3}
    assert parse_scene({"scan": {"stroke": stroke}})


@pytest.mark.parametrize("path", ["texture.perid", "scan.stroke.lenght", "output.channel", "accuracy.tolerence"])
def test_an_unknown_field_is_refused_even_if_null(path: str) -> None:
    assert [fault.pointer for fault in faults_of(nested(path, None))] == ["/" + path.replace(".", "/")]


def test_every_fault_of_a_document_is_reported_at_once() -> None:
    document = {
        "finger": {"ridge_amplitude": 0, "roughness": 0, "poisson_ratio": 0.6, "colour": "red"},
        "texture": {"period": "0.8", "kind": "sinusod"},
        "scan": {"speed": 11, "stroke": {"length": "1 kg", "speed": 20}, "lift_load": 0},
        "effects": {"inertia": {"mass": "1 s"}, "fluid": 1},
        "output": {"channels": ["x", {"full_scale": 0}], "sample_rate": 1.5, "fade": 3},
        "accuracy": {"tolerance": 1},
        "more": 1,
    }
    assert {fault.pointer for fault in faults_of(document)} == {
        "/finger/roughness", "/finger/poisson_ratio", "/finger/colour", "/texture/period", "/texture/kind",
        "/scan/speed", "/scan/stroke/length", "/scan/stroke/speed", "/scan/lift_load",
        "/effects/inertia/mass", "/effects/fluid",
        "/output/channels/0", "/output/channels/1/full_scale", "/output/sample_rate", "/output/fade",
        "/accuracy/tolerance", "/more",
    }  # fmt: skip


STRANGERS: dict[str, object] = {f"perio{index}": index for index in range(20_000)}


@pytest.mark.parametrize(
    "document",
    [
        STRANGERS,
        {"texture": STRANGERS},
        {"scan": {"stroke": STRANGERS}},
        {"effects": STRANGERS},
        {"effects": {"inertia": STRANGERS}},
        {"output": {"channels": [STRANGERS]}},
        {"scan": {"trajectory": [["x", "y", "z"]] * 5000}},
    ],
)
def test_the_checking_of_an_endless_list_of_faults_stops(
    document: dict[str, object], monkeypatch: pytest.MonkeyPatch
) -> None:
    names: list[str] = []
    for module in ("scene.section", "scene.effects_section"):
        monkeypatch.setattr(f"synth.{module}.nearest", lambda name, _known: names.append(name))
    faults = faults_of(document)
    assert len(faults) == 101 and len(names) <= 101
    assert (faults[-1].pointer, faults[-1].value) == ("", "more than 100 faults")


def test_fields_written_twice_are_told_up_to_a_hundred() -> None:
    text = "{" + ", ".join(f'"a{index // 2}": 1' for index in range(1000)) + "}"
    with pytest.raises(SceneError) as refused:
        parse_scene_text(text)
    assert len(refused.value.faults) == 100


class Written:
    """A value that counts how often it is converted to text."""

    def __init__(self) -> None:
        self.times = 0

    def __repr__(self) -> str:
        self.times += 1
        return "w"


def test_a_large_value_is_looked_at_as_far_as_it_is_shown() -> None:
    one = Written()
    assert shown([one] * 100_000) == "[" + "w, " * 18 + "w,..."
    assert shown({"a": {"b": [one] * 100_000}}).startswith("{'a': {'b': [w, w,")
    assert one.times < 100


@pytest.mark.parametrize("value", ["a", 'a"b', [], {}, [1, "a", {"b": 2}], {"a": ["c", 1.5]}, (1,), "é" * 70, 1e300])
def test_a_value_is_shown_as_python_writes_it(value: object) -> None:
    written = repr(value)
    assert shown(value) == (written if len(written) <= 60 else written[:57] + "...")


def test_the_words_of_a_scene_are_shown_as_a_scene_has_them() -> None:
    assert [shown(value) for value in (None, True, [False, {"a": None}])] == ["null", "true", "[false, {'a': null}]"]


@pytest.mark.parametrize("settings_of_effect", [3, "on", [], True, 0.5])
def test_settings_of_an_effect_are_an_object(settings_of_effect: object) -> None:
    (fault,) = faults_of({"effects": {"inertia": settings_of_effect}})
    assert fault.pointer == "/effects/inertia"


@pytest.mark.parametrize("value", [math.nan, math.inf, [1], {"g": 5}, True, "5", "NaN"])
def test_a_setting_of_an_effect_is_refused_as_any_field_is(value: object) -> None:
    (fault,) = faults_of({"effects": {"inertia": {"mass": value}}})
    assert fault.pointer == "/effects/inertia/mass"
    assert "units: kg, g, mg" in fault.hint


def test_values_in_faults_are_spelt_as_in_json_and_kept_short() -> None:
    assert faults_of({"texture": {"period": True}})[0].value == "true"
    assert faults_of({"texture": {"period": math.nan}})[0].value == "nan"
    assert faults_of(None)[0].value == "null"
    assert len(faults_of({"texture": {"period": "x" * 10000}})[0].value) <= 60
    assert len(faults_of({"x" * 10000: 1})[0].pointer) <= 101


JSON_VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(),
    lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner),
    max_leaves=20,
)
SECTIONS: dict[str, list[str]] = {
    name: list(inner.model_fields) if (inner := inner_section(Scene, name)) else [] for name in Scene.model_fields
}
SCENE_LIKE = st.fixed_dictionaries(
    {},
    optional={
        section: JSON_VALUES | st.fixed_dictionaries({}, optional=dict.fromkeys(names, JSON_VALUES))
        for section, names in SECTIONS.items()
    },
)


@settings(max_examples=30)
@given(JSON_VALUES | SCENE_LIKE)
def test_garbage_raises_nothing_but_scene_error(document: object) -> None:
    try:
        scene = parse_scene(document)
    except SceneError as refused:
        assert refused.faults
        assert all(fault.allowed and fault.hint and fault.value for fault in refused.faults)
        json.dumps([fault.pointer for fault in refused.faults]).encode()
        "".join(fault.pointer for fault in refused.faults).encode()
    else:
        assert parse_scene(scene_document(scene)) == scene


def test_python_objects_that_are_nested_without_end_are_refused() -> None:
    endless: list[object] = []
    deep = endless
    for _ in range(100_000):
        deep.append([])
        deep = deep[0]  # type: ignore[assignment]
    for section in SECTIONS:
        assert faults_of({section: endless})
    assert faults_of({"texture": {"period": 10**5000, "kind": endless}})


def text_faults_of(text: str | bytes) -> tuple[Fault, ...]:
    with pytest.raises(SceneError) as refused:
        parse_scene_text(text)
    return refused.value.faults


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "Write {}"),
        (b"", "Write {}"),
        (" \n\t", "Write {}"),
        ("\ufeff", "Write {}"),
        ("{", "Correct the text"),
        ("{'finger': {}}", "Correct the text"),
        ('{"finger": {},}', "Correct the text"),
        ("{} {}", "Correct the text"),
        ("RIFF\x00\x00", "Correct the text"),
        ("[]", "Write an object"),
        ("null", "Write an object"),
        ("3", "Write an object"),
        ("true", "Write an object"),
        ("NaN", "Write an object"),
        ('"grating-1mm-31um"', "Write an object"),
        (b"\xff\xfe{\x00}\x00", "UTF-8"),
        ("[" * 200_000, "levels"),
        ('{"a":' * 100_000, "levels"),
    ],
)
def test_text_that_is_not_one_json_object_is_refused(text: str | bytes, words: str) -> None:
    faults = text_faults_of(text)
    assert [fault.pointer for fault in faults] == [""]
    assert words in faults[0].hint


@pytest.mark.parametrize("number", ["NaN", "Infinity", "-Infinity", "1e999", "-1e999", "1" + "0" * 400, "9" * 5000])
def test_numbers_that_are_not_finite_are_refused_at_their_field(number: str) -> None:
    faults = text_faults_of(f'{{"texture": {{"period": {number}}}}}')
    assert [fault.pointer for fault in faults] == ["/texture/period"]
    assert "finite" in faults[0].hint


def test_a_field_written_twice_is_refused_at_its_place() -> None:
    text = (
        '{"texture": {"period": 1, "period": 1}, "scan": {}, "scan": {},'
        ' "output": {"channels": [{}, {"a": 1, "a": 2}]}}'
    )
    assert [fault.pointer for fault in text_faults_of(text)] == ["/scan", "/texture/period", "/output/channels/1/a"]


def test_a_byte_order_mark_is_passed_over() -> None:
    assert parse_scene_text(b"\xef\xbb\xbf{}") == Scene()
    assert parse_scene_text("\ufeff{}") == Scene()


@given(st.text() | st.binary())
def test_garbage_text_raises_nothing_but_scene_error(text: str | bytes) -> None:
    try:
        parse_scene_text(text)
    except SceneError as refused:
        assert refused.faults
