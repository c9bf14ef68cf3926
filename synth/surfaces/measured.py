"""The kind `profile`: heights along a line, as they were measured or computed elsewhere.

Stage   SURFACES.
Model   heights at equal distances `spacing`, linear between two of them, and from the last back to the first: the
        period is their number times the spacing. The first height stands at x = 0 where the phase is 0.
Limits  the mean line is subtracted. What lies between two heights is not known, so a shape that matters needs several
        points; the corners between the straight pieces are heard where the band reaches them.
"""

from __future__ import annotations

import math
from collections.abc import Hashable, Mapping
from dataclasses import dataclass
from functools import cached_property
from hashlib import blake2b
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from synth.scene.quantity import Dimension
from synth.scene.rules import Fields, Quantity, QuantityList, Refusal, refusal
from synth.scene.section import Section
from synth.scene.texture_registry import STEEPEST, Kind
from synth.surfaces.height_file import LARGEST_HEIGHT, MOST_INLINE, HeightFile, Heights, heights_of_file, written
from synth.surfaces.profile import Array, Bounds, Profile, places_of, turns_of


@dataclass(frozen=True, eq=False)
class MeasuredProfile(Profile):
    """Straight lines between heights.

    points: heights in m, float64 [n], two or more; about any level. spacing: m from one to the next. phase: rad.
    """

    points: Array
    spacing: float
    phase: float = 0.0
    kind = "profile"

    @property
    def period(self) -> float:  # type: ignore[override]
        """Number of heights times their spacing (m)."""
        return len(self.points) * self.spacing

    @cached_property
    def key(self) -> Hashable:
        """A digest of the heights, the spacing and the phase."""
        digest = blake2b(np.ascontiguousarray(self.points, np.float64).tobytes(), digest_size=16).hexdigest()
        return self.kind, digest, len(self.points), self.spacing, self.phase

    @cached_property
    def about_mean(self) -> Array:
        """The heights (m) about their mean line, the first once more at the end: float64 [n + 1]."""
        level = np.asarray(self.points, np.float64) - np.mean(self.points)
        return np.append(level, level[0])

    def heights(self, places: Array) -> Array:
        """Return the heights (m) at `places` (m)."""
        count = len(self.points)
        at = turns_of(places, self.period, self.phase) * count
        before = np.minimum(at.astype(np.int64), count - 1)
        low, high = self.about_mean[before], self.about_mean[before + 1]
        return np.asarray(low + (at - before) * (high - low))

    @cached_property
    def _slopes(self) -> Array:
        return np.diff(self.about_mean) / self.spacing

    @property
    def bounds(self) -> Bounds:
        """Exact bounds; the curvature is infinite, unless the profile is flat."""
        slope = float(np.max(np.abs(self._slopes)))
        return Bounds(float(self.about_mean.min()), float(self.about_mean.max()), slope, math.inf if slope else 0.0)

    @cached_property
    def corners(self) -> Array:
        """Places (m) of the heights, since any may be a corner."""
        return places_of(np.arange(len(self.points)) / len(self.points), self.period, self.phase)

    @cached_property
    def rms(self) -> tuple[float, float]:
        """Rq (m) and rms slope of the straight pieces, in closed form."""
        low, high = self.about_mean[:-1], self.about_mean[1:]
        square = float(np.mean(low * low + low * high + high * high)) / 3.0
        return math.sqrt(square), math.sqrt(float(np.mean(self._slopes**2)))


class HeightList(QuantityList):
    """The heights, as a list or as they were read from a file."""

    def read(self, value: object) -> Heights:
        """Return the heights in m."""
        return value if isinstance(value, Heights) else Heights(super().read(value))

    def length_hint(self, count: int) -> str:
        """Return where more heights than a list holds go."""
        more = " On the command line texture.file takes up to 1000000." if count > self.most else ""
        return f"The list has {count}.{more}"


class MeasuredFields(Section):
    """Heights along a line."""

    heights: Annotated[
        tuple[float, ...] | None,
        HeightList(Quantity(Dimension.LENGTH, -LARGEST_HEIGHT, LARGEST_HEIGHT), 2, MOST_INLINE),
    ] = Field(default=None, description="profile: heights at equal distances; the last goes on to the first.")
    spacing: Annotated[float | None, Quantity(Dimension.LENGTH, 1e-9, 0.1, usual=1e-3)] = Field(
        default=10e-6, description="profile: distance from one height to the next."
    )
    file: Annotated[str | None, HeightFile()] = Field(
        default=None, description="profile: instead of heights, a file that holds them. Only the command line reads it."
    )


def _made(values: Mapping[str, Any]) -> MeasuredProfile:
    return MeasuredProfile(np.array(values["heights"]), values["spacing"], values["phase"])


def _refusals(values: Mapping[str, Any], given: Fields) -> list[Refusal]:
    if "file" in given:
        hint = "A service reads no files of its own machine. Write the heights, or use the command line."
        return [refusal(["file"], given["file"], "nothing here: only the command line and Python read files", hint)]
    if "heights" not in given:
        hint = 'Write a list such as [0, "20 um", 0, "-20 um"]; on the command line, file=PATH.'
        return [refusal(["heights"], None, "a list of heights", hint)]
    level, spacing = np.array(values["heights"]), values["spacing"]
    if not 1e-6 <= len(level) * spacing <= 1.0:
        allowed = "a period (heights times spacing) of 1 um to 1 m"
        return [refusal(["spacing"], given.get("spacing"), allowed, f"It is {len(level) * spacing:g} m.")]
    slopes = np.abs(np.append(level, level[0])[1:] - level) / spacing
    worst = int(np.argmax(slopes))
    if slopes[worst] <= STEEPEST:
        return []
    between = f"from height {worst} to {worst + 1}"
    hint = f"The slope {between} is {slopes[worst]:.4g}. Remove the step or the spike, or correct spacing."
    if worst == len(level) - 1:
        between = "from the last height back to the first"
        hint = f"The slope {between} is {slopes[worst]:.4g}: the period does not close. Remove the trend."
    return [refusal(["heights"], given["heights"], f"slopes of {STEEPEST:g} at most", hint)]


KIND = Kind(
    MeasuredFields,
    _made,
    shared=(),
    steep="heights",
    refusals=_refusals,
    pairs=(("heights", "file"),),
    local=heights_of_file,
    written=written,
)
