"""The kind `dots`: raised dots or dimples on a flat surface, in rows, such as Braille, embossed patterns, golf balls.

Stage   SURFACES.
Model   A dot is round, with a flat top: h = H up to the radius of the top, and from there half a cosine down to 0 at
        the radius of the dot. H below 0 makes a dimple. Dots stand `period` apart along x, in rows `row_distance`
        apart. With `stagger` s, every second row is moved by s periods along x, and the pattern repeats after two rows.
Source  The form of the flank is a choice. Braille dots are about 0.5 mm high and 2.3 to 2.5 mm apart. Experiments on
        roughness use dots of 0.3 to 0.7 mm, 1 to 6 mm apart (Connor et al., 1990).
Limits  Dots do not overlap.
"""

from __future__ import annotations

import math
from collections.abc import Hashable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from synth.scene.quantity import Dimension, show_quantity
from synth.scene.rules import Fields, Quantity, Refusal, refusal
from synth.scene.section import Section
from synth.scene.texture_registry import Kind
from synth.surfaces.height_field import HeightField
from synth.surfaces.profile import Array, Bounds

RINGS = 4096  # radii over which the flank is integrated; the mean and the rms values have an error of 1e-7


@dataclass(frozen=True, eq=False)
class Dots(HeightField):
    """Round dots in rows.

    period: along x, m.
    row_distance: across, m.
    stagger: shift of every second row along x, in periods, 0 to 1.
    height: m; below 0 for dimples.
    diameter, top: of the dot and of its flat top, m.
    phase: rad.
    """

    period: float
    row_distance: float
    stagger: float
    height: float
    diameter: float
    top: float
    phase: float = 0.0
    kind = "dots"

    @property
    def key(self) -> Hashable:
        """Everything that decides the heights."""
        pattern = self.period, self.row_distance, self.stagger
        return self.kind, *pattern, self.height, self.diameter, self.top, self.phase

    @property
    def rows(self) -> int:
        """Number of rows in a period across: two if every second row is moved, else one."""
        return 2 if self.stagger % 1.0 else 1

    @property
    def across(self) -> float:  # type: ignore[override]
        """Period in y (m)."""
        return self.rows * self.row_distance

    def area(self, x: Array, y: Array) -> Array:
        """Return the heights (m) at every pair of `x` and `y` (m)."""
        nearest = np.round(np.asarray(y) / self.row_distance)
        found = np.full((len(y), len(x)), -self._mean)
        for row in (nearest - 1.0, nearest, nearest + 1.0):  # a dot may reach over half of the distance between rows
            from_row = np.abs(y - row * self.row_distance)
            near = np.flatnonzero(from_row < 0.5 * self.diameter)
            moved = np.where(row[near] % 2.0, self.stagger, 0.0)[:, np.newaxis] if self.rows == 2 else 0.0
            turns = np.asarray(x) / self.period + self.phase / (2.0 * math.pi) - moved
            from_dot = np.abs(turns - np.round(turns)) * self.period
            found[near] += self._at(np.hypot(from_dot, from_row[near, np.newaxis]))
        return found

    def _at(self, radius: Array) -> Array:
        """Return the height (m) above the surface between dots, at `radius` (m) from the middle of a dot."""
        inner, outer = 0.5 * self.top, 0.5 * self.diameter
        along = np.clip((radius - inner) / (outer - inner), 0.0, 1.0)
        return np.asarray(0.5 * self.height * (1.0 + np.cos(math.pi * along)))

    @cached_property
    def _moments(self) -> tuple[float, float, float]:
        """Mean of h above the surface (m), of its square (m^2), and of (dh/dx)^2, over a period."""
        inner, outer = 0.5 * self.top, 0.5 * self.diameter
        width = (outer - inner) / RINGS
        radius = inner + (np.arange(RINGS) + 0.5) * width
        ring = 2.0 * math.pi * radius * width / (self.period * self.row_distance)
        flat = math.pi * inner**2 / (self.period * self.row_distance)
        height = self._at(np.asarray(radius))
        slope = 0.5 * math.pi * self.height / (outer - inner) * np.sin(math.pi * (radius - inner) / (outer - inner))
        mean, square = float(np.sum(ring * height)), float(np.sum(ring * height**2))
        return flat * self.height + mean, flat * self.height**2 + square, 0.5 * float(np.sum(ring * slope**2))

    @property
    def _mean(self) -> float:
        return self._moments[0]

    @property
    def bounds(self) -> Bounds:
        """Exact bounds; the flank is steepest at half height and most curved at its ends."""
        low, high = sorted((-self._mean, self.height - self._mean))
        steep = math.pi / (self.diameter - self.top)
        return Bounds(low, high, abs(self.height) * steep, 2.0 * abs(self.height) * steep**2)

    @property
    def slope_across(self) -> float:
        """Bound of |dh/dy|: dots are round."""
        return self.bounds.slope

    @property
    def rms(self) -> tuple[float, float]:
        """Rq (m) and rms slope along x, over the area."""
        mean, square, slope = self._moments
        return math.sqrt(max(square - mean**2, 0.0)), math.sqrt(slope)


class DotFields(Section):
    """Size and arrangement of dots."""

    dot_height: Annotated[float | None, Quantity(Dimension.LENGTH, -1e-3, 1e-3, usual=0.7e-3)] = Field(
        default=40e-6, description="dots: height of a dot; below 0 for dimples."
    )
    dot_diameter: Annotated[float | None, Quantity(Dimension.LENGTH, 10e-6, 20e-3)] = Field(
        default=None, description="dots: diameter of a dot at its foot; null: half of the smaller of both distances."
    )
    dot_top: Annotated[float | None, Quantity(Dimension.LENGTH, 0.0, 20e-3)] = Field(
        default=None, description="dots: diameter of the flat top; null: half of the diameter."
    )
    row_distance: Annotated[float | None, Quantity(Dimension.LENGTH, 10e-6, 0.1, usual=0.05)] = Field(
        default=None, description="dots: distance between rows, across the scan; null: the period."
    )
    stagger: Annotated[float | None, Quantity(Dimension.NONE, 0.0, 1.0)] = Field(
        default=0.0, description="dots: shift of every second row along the scan, as a part of the period."
    )


def _sizes(values: Mapping[str, Any]) -> tuple[float, float, float]:
    """Return row distance, diameter and top (m)."""
    rows = values["row_distance"] or values["period"]
    diameter = values["dot_diameter"] or 0.5 * min(rows, values["period"])
    return rows, diameter, 0.5 * diameter if values["dot_top"] is None else values["dot_top"]


def _made(values: Mapping[str, Any]) -> Dots:
    rows, diameter, top = _sizes(values)
    return Dots(values["period"], rows, values["stagger"], values["dot_height"], diameter, top, values["phase"])


def _refusals(values: Mapping[str, Any], given: Fields) -> list[Refusal]:
    rows, diameter, top = _sizes(values)
    most = values["period"]
    if values["stagger"] % 1.0:
        shift = min(values["stagger"], 1.0 - values["stagger"]) * values["period"]
        most = min(most, math.hypot(shift, rows), 2.0 * rows)
    else:
        most = min(most, rows)
    if diameter > most:
        allowed = f"at most {show_quantity(most, Dimension.LENGTH)}, the distance between dots"
        return [refusal(["dot_diameter"], given.get("dot_diameter"), allowed, "Dots must not overlap.")]
    if not top < diameter:
        allowed = f"below the diameter, {show_quantity(diameter, Dimension.LENGTH)}"
        return [refusal(["dot_top"], given.get("dot_top"), allowed, "The flank needs room.")]
    return []


KIND = Kind("dots", DotFields, _made, defaults={"period": 2e-3}, steep="dot_height", refusals=_refusals, of_area=True)
