"""Shared by the tests of the scene: paths of fields, refusals, and documents of random scenes."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import strategies as st

from synth.errors import Fault, SceneError
from synth.scene.output_section import Output
from synth.scene.rules import Quantity, QuantityOrName
from synth.scene.scene import Scene, parse_scene
from synth.scene.section import Section, inner_section, rule_of

RISING = [[0, 0, 0.3], [0.1, 0.008, 0.3], [0.2, 0.016, 0.4], [0.3, 0.02, 0.2]]


def faults_of(document: object) -> tuple[Fault, ...]:
    with pytest.raises(SceneError) as refused:
        parse_scene(document)
    return refused.value.faults


def nested(path: str, value: object) -> dict[str, Any]:
    """Return the document in which the field at the dotted `path` is `value`."""
    first, _, rest = path.partition(".")
    return {first: nested(rest, value) if rest else value}


def at(scene: Scene, path: str) -> object:
    found: object = scene
    for name in path.split("."):
        found = getattr(found, name)
    return found


def quantity_fields(section: type[Section] = Scene, above: str = "") -> list[tuple[str, Quantity]]:
    """Return the dotted path and the rule of every field of a scene that is a quantity."""
    found: list[tuple[str, Quantity]] = []
    for name in section.model_fields:
        inner = inner_section(section, name)
        if inner is not None:
            found += quantity_fields(inner, f"{above}{name}.")
        elif isinstance(rule := rule_of(section, name), Quantity):
            found.append((above + name, rule))
    return found


def _bandwidth() -> Quantity:
    """Return the rule of the bandwidths that are numbers."""
    rule = rule_of(Output, "bandwidth")
    assert isinstance(rule, QuantityOrName)
    return rule.quantity


RULES = {**dict(quantity_fields()), "output.bandwidth": _bandwidth()}


def _in_range(rule: Quantity) -> st.SearchStrategy[Any]:
    if rule.whole:
        return st.integers(int(rule.low), int(rule.high))
    return st.floats(rule.low, rule.high, allow_subnormal=False)


@st.composite
def scenes(draw: st.DrawFn) -> dict[str, Any]:
    """A document of a valid scene: any subset of the fields, in range, as numbers or as text."""

    def fields(*paths: str) -> dict[str, Any]:
        chosen: dict[str, Any] = {}
        for path in paths:
            if draw(st.booleans()):
                number = draw(_in_range(RULES[path]))
                as_text = RULES[path].unit and draw(st.booleans())
                chosen[path.rpartition(".")[2]] = RULES[path].show(number) if as_text else number
        return chosen

    finger = fields("finger.ridge_period", "finger.contact_length", "finger.youngs_modulus", "finger.poisson_ratio")
    finger |= fields(draw(st.sampled_from(["finger.ridge_amplitude", "finger.roughness"])))
    texture = fields("texture.period", "texture.phase", "texture.youngs_modulus", "texture.poisson_ratio")
    texture |= fields(draw(st.sampled_from(["texture.amplitude", "texture.roughness"])))
    texture |= draw(st.sampled_from([{}, {"kind": "sinusoid"}, {"kind": "grating-2mm-157um"}]))
    scan = fields("scan.lift_load")
    match draw(st.sampled_from(["constant", "stroke", "trajectory"])):
        case "constant":
            scan |= fields("scan.speed", "scan.load")
        case "stroke":
            scan["stroke"] = {"length": draw(st.floats(0.01, 10.0)), **fields("scan.stroke.load")}
        case _:
            steps = draw(st.lists(st.tuples(st.floats(1e-3, 1.0), st.floats(-9, 9), st.floats(0, 1e3)), min_size=4))
            points, t, position = [], 0.0, 0.0
            for duration, speed, load in steps:
                t, position = t + duration, position + speed * duration
                points.append([t, position, load])
            scan["trajectory"] = points
    output = fields("output.sample_rate", "output.duration", "output.bandwidth")
    if draw(st.booleans()):
        output["bandwidth"] = "full"
    names = st.sampled_from(["displacement", "velocity", "acceleration"])
    if draw(st.booleans()):
        full_scale = st.none() | st.floats(1e-9, 1e3)
        channel = names | st.fixed_dictionaries({"quantity": names, "full_scale": full_scale})
        output["channels"] = draw(st.lists(channel, min_size=1, max_size=16))
    else:
        output |= {"quantity": draw(names), "full_scale": draw(st.none() | st.floats(1e-9, 1e3))}
    tolerance = draw(st.sampled_from(["exact", "imperceptible", None]) | st.floats(1e-7, 3e-2))
    return {"finger": finger, "texture": texture, "scan": scan, "output": output, "accuracy": {"tolerance": tolerance}}
