"""Shared by the tests of effects: scenes with each effect, and with every combination of effects."""

from __future__ import annotations

from itertools import combinations
from typing import Any

import numpy as np

from synth import Motion, parse_scene
from synth.errors import SceneError
from synth.scene.effects_section import effect_names
from synth.scene.scene import Scene

ALONE = effect_names()
"""Every effect of the registry."""

QUICK: dict[str, Any] = {
    "finger": {"contact_length": "1.5 mm"},
    "output": {"quantity": "displacement", "sample_rate": 8000, "bandwidth": "full", "duration": "0.2 s"},
    "accuracy": {"tolerance": 1e-2},
}
"""Sections that make a scene quick to prepare: few ridges, displacement, a low rate, a loose tolerance, 0.2 s."""


def scene_with(*names: str, **sections: Any) -> dict[str, Any]:
    """Return a document with the effects `names` at their default settings."""
    return QUICK | sections | {"effects": {name: {} for name in names}}


def together() -> list[tuple[str, ...]]:
    """Return every set of two or more effects that a scene may have."""
    found = []
    for count in range(2, len(ALONE) + 1):
        for names in combinations(ALONE, count):
            try:
                parse_scene(scene_with(*names))
            except SceneError:
                continue
            found.append(names)
    return found


TOGETHER = together()
LARGEST_SETS: list[tuple[str, ...]] = [
    names for names in TOGETHER if not any(set(names) < set(other) for other in TOGETHER)
]


def covering(sets: list[tuple[str, ...]]) -> list[tuple[str, ...]]:
    """Return some of the sets, so that every effect is in one of them."""
    found: list[tuple[str, ...]] = []
    while lacking := {name for names in sets for name in names}.difference(*found):
        found.append(max(sets, key=lambda names: len(lacking.intersection(names))))
    return found


def hand(frames: int, rate: int, begin: int = 0) -> Motion:
    """Return frames of a hand that speeds up, slows down and presses."""
    t = (begin + np.arange(frames)) / rate
    return Motion.of(
        frames,
        speed=0.06 + 0.03 * np.sin(40.0 * t),
        speed_rate=1.2 * np.cos(40.0 * t),
        load=0.3 + 0.05 * np.sin(25.0 * t),
        load_rate=1.25 * np.cos(25.0 * t),
        load_bend=-31.25 * np.sin(25.0 * t),
    )


def quick_scene(**sections: Any) -> Scene:
    """Return a scene without effects that is quick to prepare."""
    return parse_scene(QUICK | sections)
