"""The points of brute force for the finger of a scene, drawn and summed without the engine."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from synth.scene.scene import Scene
from tests.reference.fingertip_oracle import Print, footprint_depth
from tests.reference.moving_points_oracle import Points, growing_points, round_points
from tests.reference.shaped_contact_oracle import fitting_radius
from tests.reference.stiffness_oracle import Touch, stiffness
from tests.synth.engine_cases import touch_of

COLUMNS, WAVE, ROWS = 128, 64, 64  # of the points: per ridge, per wave of the texture, and per ridge across


def tip_points(scene: Scene, many: float = 1.0) -> Points:
    """Return the points of docs/scene.md, "A fingertip", that 1 N reaches on a sinusoid; the ridges are drawn anew.

    many: factor on the numbers of columns and rows.
    """
    finger, texture = scene.finger, scene.texture
    length, width = finger.contact_length, finger.width
    law = replace(touch_of(scene), texture_amplitude=0.0, texture_period=finger.ridge_period, load=1.0)
    depth = footprint_depth(finger.ridge_amplitude, stiffness(law).indentation)
    columns = math.ceil(many * 2 * length * max(COLUMNS / finger.ridge_period, WAVE / texture.period))
    rows = math.ceil(many * 2 * width * ROWS / finger.ridge_period)
    column = 2 * length / columns
    x, y = np.meshgrid(
        (np.arange(columns) + 0.5) * column - length,
        (np.arange(rows) + 0.5) * (2 * width / rows) - width,
        indexing="ij",
    )
    inside = (x / length) ** 2 + (y / width) ** 2 < 1.0
    x, y = x[inside], y[inside]
    drawn = Print(finger.ridge_period, finger.ridge_amplitude, "loop", 0.3, 0.3, 0.3, 0)
    heights = drawn.heights(x, y) - depth * ((2 * x / length) ** 2 + (2 * y / width) ** 2)
    cell = column * (2 * width / rows) / (length * width)
    deep = 2 * math.sqrt(8 / math.pi * stiffness(law).indentation * depth) + 2 * texture.amplitude
    able = heights > heights.max() - deep - 2 * finger.ridge_amplitude
    x, heights = x[able], heights[able]
    touch, count = touch_of(scene), float(len(x))

    def share(load: float) -> float:
        return stiffness(replace(touch, load=load)).k * cell

    return Points(x, heights, share, lambda _load: (0.0, count), texture.amplitude, texture.period, texture.phase)


def points_of(kind: str, scene: Scene, heaviest: float) -> Points:
    """Return the oracle's finger."""
    touch: Touch = touch_of(scene)
    if kind == "fingertip":
        return tip_points(scene)
    if kind == "contact_growth":
        return growing_points(touch, heaviest, 1.0 / 3.0)
    radius = 1e-3 if kind == "probe" else fitting_radius(touch)
    return round_points(touch, heaviest, radius)
