"""The kind `rough`: a self-affine surface, such as paper, plaster, sanded wood or a fracture, from a seed.

Stage   SURFACES.
Model   h(x) = sum of A_n cos(2 pi n x / period + p_n) over the orders n whose wavelength period / n lies between
        `shortest` and `longest`. A_n^2 is proportional to n^-(1 + 2 H), the power spectrum of a self-affine profile
        with Hurst exponent H. A common factor gives exactly the required rms height or rms slope. The phases p_n are
        uniform, drawn in order of n from PCG64(seed), so a change of `shortest` keeps the longer waves.
Source  Persson et al. 2005 (J. Phys.: Condens. Matter 17, R1): C(q) of a profile falls as q^-(1 + 2H).
Limits  The spectrum has no plateau: waves longer than `longest` are absent. Heights are nearly Gaussian if many orders
        share the power. With H near 1 the few longest waves have most of it.
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
from synth.surfaces.fourier import FourierProfile
from synth.surfaces.profile import Array

MOST_ORDERS = 8192  # shortest waves per period; limits memory and time
USUAL_ORDERS = 256  # shortest waves per period where `shortest` is not given; a choice
ROUNDING = 1e-9  # of an order: tolerates rounding where period / longest is a whole number


@dataclass(frozen=True, eq=False)
class Rough(FourierProfile):
    """A self-affine surface.

    period: m.
    shift: rad.
    hurst: Hurst exponent, 0 to 1.
    rms_height: m, or None.
    rms_slope: or None; exactly one of the two is given.
    longest, shortest: wavelengths, m.
    seed: of the phases.
    """

    hurst: float
    rms_height: float | None
    rms_slope: float | None
    longest: float
    shortest: float
    seed: int
    kind = "rough"

    @property
    def key(self) -> Hashable:
        """Everything that decides the heights."""
        size = self.rms_height, self.rms_slope
        return self.kind, self.period, self.shift, self.hurst, *size, self.longest, self.shortest, self.seed

    @cached_property
    def orders(self) -> tuple[Array, Array]:
        """Amplitudes (m) and phases (rad) of the orders."""
        first, last = band_of(self.period, self.longest, self.shortest)
        numbers = np.arange(1.0, last + 1.0)
        amplitudes = np.where(numbers >= first, numbers ** -(0.5 + self.hurst), 0.0)
        if self.rms_height is not None:
            wanted, unit = self.rms_height, amplitudes
        else:
            assert self.rms_slope is not None
            wanted, unit = self.rms_slope, amplitudes * numbers * (2.0 * math.pi / self.period)
        amplitudes *= wanted * math.sqrt(2.0) / float(np.linalg.norm(unit))
        return amplitudes, 2.0 * math.pi * np.random.Generator(np.random.PCG64(self.seed)).random(last)


def band_of(period: float, longest: float, shortest: float) -> tuple[int, int]:
    """Return the first and the last order with a wavelength from `shortest` to `longest`; first > last for none."""
    return max(math.ceil(period / longest - ROUNDING), 1), math.floor(period / shortest + ROUNDING)


_LENGTH = Quantity(Dimension.LENGTH, 1e-6, 1.0)


class RoughFields(Section):
    """Size, spectrum and seed of a rough surface."""

    hurst: Annotated[float | None, Quantity(Dimension.NONE, 0.0, 1.0)] = Field(
        default=0.8,
        description="rough, rough_area: Hurst exponent; the spectrum of a line falls as q^-(1 + 2 hurst).",
    )
    rms_height: Annotated[float | None, Quantity(Dimension.LENGTH, 0.0, 0.5e-3, usual=0.25e-3)] = Field(
        default=10e-6, description="rough, rough_area: root mean square height Rq."
    )
    rms_slope: Annotated[float | None, Quantity(Dimension.NONE, 0.0, 5.0)] = Field(
        default=None, description="rough, rough_area: instead of rms_height, the root mean square slope along the scan."
    )
    longest: Annotated[float | None, _LENGTH] = Field(
        default=None, description="rough, rough_area: longest wave, at most the period; null: the period."
    )
    shortest: Annotated[float | None, _LENGTH] = Field(
        default=None,
        description="rough, rough_area: shortest wave; null: a 256th of the period, of a rough_area a 64th. "
        "The minimum is an 8192nd, of a rough_area a 512th.",
    )
    seed: Annotated[int | None, Quantity(Dimension.NONE, 0, 1_000_000, whole=True)] = Field(
        default=0, description="rough, rough_area: seed of the phases; the same seed gives the same surface."
    )


def _made(values: Mapping[str, Any]) -> Rough:
    period, slope = values["period"], values["rms_slope"]
    height = values["rms_height"] if slope is None else None
    longest, shortest = values["longest"] or period, values["shortest"] or period / USUAL_ORDERS
    return Rough(period, values["phase"], values["hurst"], height, slope, longest, shortest, int(values["seed"]))


def given_twice(given: Fields) -> list[Refusal]:
    """Refuse an rms slope beside an rms height."""
    if "rms_height" not in given or "rms_slope" not in given:
        return []
    hint = "Leave one out: for a given spectrum, each determines the other."
    return [refusal(["rms_slope"], given["rms_slope"], "rms_height or rms_slope, not both", hint)]


def _refusals(values: Mapping[str, Any], given: Fields) -> list[Refusal]:
    found = given_twice(given)
    period = values["period"]
    longest, shortest = values["longest"] or period, values["shortest"] or period / USUAL_ORDERS
    first, last = band_of(period, longest, shortest)
    field = "shortest" if "shortest" in given else "longest" if "longest" in given else "period"
    written, shown = given.get(field), show_quantity(period, Dimension.LENGTH)
    if longest > period * (1.0 + ROUNDING):
        found.append(refusal(["longest"], given["longest"], f"at most the period, {shown}", "Write a longer period."))
    elif last > MOST_ORDERS:
        least = show_quantity(period / MOST_ORDERS, Dimension.LENGTH)
        found.append(refusal([field], written, f"at least {least}", f"The period, {shown}, would have {last} waves."))
    elif longest < shortest or first > last:
        hint = f"No whole fraction of the period, {shown}, lies between shortest and longest. Write them further apart."
        found.append(refusal([field], written, "a shortest wave below the longest", hint))
    return found


PAIRS = (("rms_height", "rms_slope"),)
KIND = Kind(
    "rough", RoughFields, _made, defaults={"period": 20e-3}, steep="rms_height", refusals=_refusals, pairs=PAIRS
)
