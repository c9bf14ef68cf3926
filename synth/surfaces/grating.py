"""The kind `grating`: straight ridges with a flat top, machined, etched or printed.

Stage   SURFACES.
Model   At phase 0 a ridge is centred on x = 0. At half height it is duty x period wide. There are two forms of flank:
        - A straight flank is `ramp` wide; the ridge is a trapezoid.
        - A round flank consists of two arcs of radius r = `edge_radius` that meet at half height, convex above and
          concave below. It is 2 sqrt(r height - height^2 / 4) wide, and the profile has no corners.
Source  Geometry. The mean line of either form is height (duty - 1/2) above half height.
Limits  A wall steeper than the slope limit of `texture_section` is refused, so each place has one height.
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
from synth.surfaces.profile import NO_CORNERS, Array, Bounds, Profile, places_of, turns_of

USUAL_RAMP = 0.25  # default ramp, relative to the narrower of top and groove at half height; a choice
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(48)  # over an arc's angle; the error of Rq is 1e-14


@dataclass(frozen=True)
class Grating(Profile):
    """Straight ridges.

    period, height: m.
    duty: 0 to 1.
    ramp: m; None: the flanks are arcs.
    radius: of the arcs, m.
    phase: rad.
    """

    period: float
    height: float
    duty: float
    ramp: float | None
    radius: float = 0.0
    phase: float = 0.0
    kind = "grating"

    @property
    def key(self) -> Hashable:
        """Everything that decides the heights."""
        return self.kind, self.period, self.height, self.duty, self.ramp, self.radius, self.phase

    @property
    def flank(self) -> float:
        """Width of a flank (m)."""
        return flank_of(self.height, self.radius) if self.ramp is None else self.ramp

    @property
    def _mean(self) -> float:
        return self.height * (self.duty - 0.5)

    def heights(self, places: Array) -> Array:
        """Return the heights (m) at `places` (m)."""
        turns = turns_of(places, self.period, self.phase)
        inward = 0.5 * self.duty * self.period - np.minimum(turns, 1.0 - turns) * self.period
        half = 0.5 * self.flank
        if self.ramp is not None:
            return np.asarray(self.height * np.clip(inward / self.ramp, -0.5, 0.5) - self._mean)
        short = np.maximum(half - np.abs(inward), 0.0)  # distance from the flat part
        drop = short**2 / (self.radius + np.sqrt(self.radius**2 - np.minimum(short, self.radius) ** 2))
        return np.asarray(np.copysign(0.5 * self.height - drop, inward) - self._mean)

    @property
    def bounds(self) -> Bounds:
        """Exact bounds. Arcs are steepest and most curved at half height. A ramp has corners: infinite curvature."""
        slope, bend = 0.0, 0.0
        if self.height and self.ramp is not None:
            slope, bend = self.height / self.ramp, math.inf
        elif self.height:
            slope = 0.5 * self.flank / (self.radius - 0.5 * self.height)
            bend = (1.0 + slope**2) ** 1.5 / self.radius
        return Bounds(-0.5 * self.height - self._mean, 0.5 * self.height - self._mean, slope, bend)

    @property
    def straight(self) -> bool:  # type: ignore[override]
        """True where the flanks are straight."""
        return self.ramp is not None

    @property
    def corners(self) -> Array:
        """Ends of the straight flanks (m)."""
        if self.ramp is None:
            return NO_CORNERS
        outer, inner = (0.5 * (self.duty * self.period + sign * self.ramp) / self.period for sign in (1.0, -1.0))
        return places_of(np.array([inner, outer, 1.0 - outer, 1.0 - inner]), self.period, self.phase)

    @cached_property
    def rms(self) -> tuple[float, float]:
        """Rq (m) and rms slope: in closed form for a ramp, by quadrature over the angle for arcs."""
        flank = self.flank
        if self.ramp is not None:
            square, slope = flank / 12.0 * self.height**2, self.height**2 / flank
        else:
            steepest = math.atan(self.slope_bound)
            angles, widths = 0.5 * steepest * (1.0 + _NODES), 0.5 * steepest * _WEIGHTS
            above = 0.5 * self.height - 2.0 * self.radius * np.sin(0.5 * angles) ** 2
            square = 2.0 * self.radius * float(np.sum(widths * np.cos(angles) * above**2))
            if steepest < 1.0:  # rad: for smaller angles the closed form loses digits, for larger ones the quadrature
                slope = 2.0 * self.radius * float(np.sum(widths * np.sin(angles) ** 2 / np.cos(angles)))
            else:
                slope = 2.0 * self.radius * (math.atanh(math.sin(steepest)) - math.sin(steepest))
        flat = 0.25 * self.height**2 * (self.period - 2.0 * flank)
        mean_square = (flat + 2.0 * square) / self.period - self._mean**2
        return math.sqrt(max(mean_square, 0.0)), math.sqrt(2.0 * slope / self.period)


def flank_of(height: float, radius: float) -> float:
    """Return the width (m) of a flank of two arcs of `radius` (m) that meet at half of `height` (m)."""
    return 2.0 * math.sqrt(max(radius * height - 0.25 * height**2, 0.0))


class GratingFields(Section):
    """Height, width and flanks of the ridges."""

    height: Annotated[float | None, Quantity(Dimension.LENGTH, 0.0, 2e-3, usual=1e-3)] = Field(
        default=40e-6, description="grating: height of the ridges from groove to top."
    )
    duty: Annotated[float | None, Quantity(Dimension.NONE, 0.01, 0.99)] = Field(
        default=0.5, description="grating: width of a ridge at half height, as a part of the period."
    )
    ramp: Annotated[float | None, Quantity(Dimension.LENGTH, 1e-9, 1.0)] = Field(
        default=None,
        description="grating: width of a straight flank; null: a quarter of the narrower of ridge and groove.",
    )
    edge_radius: Annotated[float | None, Quantity(Dimension.LENGTH, 1e-9, 1.0)] = Field(
        default=None, description="grating: instead of ramp, the radius of rounded edges that meet at half height."
    )


def _made(values: Mapping[str, Any]) -> Grating:
    period, height, duty, ramp, radius = (values[n] for n in ("period", "height", "duty", "ramp", "edge_radius"))
    if radius is None:
        ramp = ramp or USUAL_RAMP * min(duty, 1.0 - duty) * period
    return Grating(period, height, duty, ramp, radius or 0.0, values["phase"])


def _refusals(values: Mapping[str, Any], given: Fields) -> list[Refusal]:
    if "ramp" in given and "edge_radius" in given:
        hint = "Leave one out: flanks are straight or rounded."
        return [refusal(["edge_radius"], given["edge_radius"], "ramp or edge_radius, not both", hint)]
    height, radius = values["height"], values["edge_radius"]
    room = min(values["duty"], 1.0 - values["duty"]) * values["period"]
    if values["ramp"] is not None and values["ramp"] > room:
        hint = f"The narrower of ridge and groove is {show_quantity(room, Dimension.LENGTH)} at half height."
        return [refusal(["ramp"], given["ramp"], f"at most {show_quantity(room, Dimension.LENGTH)}", hint)]
    if radius is None or not height:
        return []
    if radius <= 0.5 * height:
        hint = "Arcs that meet at half height need more than half the height; write ramp for sharper edges."
        return [refusal(["edge_radius"], given["edge_radius"], "more than height / 2", hint)]
    if flank_of(height, radius) > room:
        most = (room**2 / 4.0 + height**2 / 4.0) / height
        hint = "Wider arcs would leave no flat top or no groove."
        return [refusal(["edge_radius"], given["edge_radius"], f"at most {most * 1e6:.6g} um", hint)]
    return []


KIND = Kind("grating", GratingFields, _made, steep="height", refusals=_refusals, pairs=(("ramp", "edge_radius"),))
