"""What the skin under the ridges feels, beside the same facts: `python -m tests.fidelity skin`.

Model   `synth.study.skin_outcome` at 80 mm/s and 0.3 N. Felt: the strongest line of RA or PC, or the strongest wave of
        SA1, is above its threshold.
Source  As of `facts`.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from functools import cache
from typing import Any

import numpy as np

from synth.scene.catalogue import catalogue
from synth.scene.scene import parse_scene
from synth.study.skin_outcome import skin_felt
from tests.fidelity.facts import FINGERS, Answer, Fact
from tests.fidelity.measures import FINE, STEPPED, decibels, rank_correlation, sinusoid

EDGE = {"kind": "grating", "period": "40 mm", "duty": 0.5, "ramp": "0.05 mm"}  # up or down every 20 mm


def felt(name: str, texture: dict[str, Any]) -> dict[str, Any]:
    """Return what is felt of `texture` by a finger of FINGERS."""
    return skin_felt(parse_scene({"finger": FINGERS[name], "texture": texture, "scan": {"load": 0.3}}))


def level_of(found: dict[str, Any]) -> float:
    """Return the level of the receptors that feel most, dB."""
    return max(-np.inf if one["level"] is None else one["level"] for one in found["receptors"])


def _felt(texture: dict[str, Any], expected: bool) -> Callable[[str], Answer]:
    def answer(name: str) -> Answer:
        level = level_of(felt(name, texture))
        return f"{level:+.0f} dB over the threshold", (level >= 0.0) == expected

    return answer


@cache
def _gratings(name: str) -> Answer:
    levels = [
        level_of(felt(name, entry.document["texture"]))
        for entry in catalogue()
        if re.fullmatch(r"grating-\d+[a-z]+-\d+um", entry.name)
    ]
    count = sum(level >= 0.0 for level in levels)
    return f"{count} of {len(levels)}, {min(levels):+.0f} to {max(levels):+.0f} dB", count == len(levels)


@cache
def _smooth(name: str) -> Answer:
    found = np.array([felt(name, dict(sinusoid(float(period))))["intensity"] for period in STEPPED])
    step = float(np.max(np.abs(np.diff(decibels(found)))))
    return f"{step:.1f} dB at most", step < 3.0


@cache
def _pacinian(name: str) -> Answer:
    found = [felt(name, dict(sinusoid(float(period))))["pacinian_power"] for period in FINE]
    power = np.asarray(10.0 * np.log10(found), np.float64)
    ranks = rank_correlation(power)
    return f"{power[:3].mean():.0f} to {power[-3:].mean():.0f} dB, rank correlation {ranks:.2f}", ranks >= 0.7


SKIN_FACTS = (
    Fact("every grating of the catalogue is felt", "general knowledge", _gratings, ("comb", "fingertip")),
    Fact(
        "a grating of 0.8 mm, 6.3 um high, is felt",
        "Miyaoka 1999",
        _felt(dict(sinusoid(0.8e-3, 3.15e-6)), True),
        ("comb", "fingertip"),
    ),
    Fact(
        "an edge of 3 um is felt by the skin",
        "Johansson & LaMotte 1983",
        _felt(EDGE | {"height": 3e-6}, True),
        ("comb", "fingertip"),
    ),
    Fact(
        "an edge of 0.3 um is not felt by the skin",
        "Johansson & LaMotte 1983",
        _felt(EDGE | {"height": 0.3e-6}, False),
        ("comb", "fingertip"),
    ),
    Fact("the intensity is smooth in the period, 0.1 to 5 mm", "Cesini 2018", _smooth, ()),
    Fact(
        "the Pacinian power rises with the period, 0.1 to 0.5 mm", "Bensmaia & Hollins 2003", _pacinian, ("fingertip",)
    ),
)


def table() -> Iterator[str]:
    """Yield one row per fact."""
    yield "| fact | source | comb | fingertip |"
    yield "| --- | --- | --- | --- |"
    for fact in SKIN_FACTS:
        answers = [fact.answer(name) for name in FINGERS]
        cells = [f"{told}: **{'pass' if agrees else 'fail'}**" for told, agrees in answers]
        yield f"| {fact.name} | {fact.source} | {' | '.join(cells)} |"
