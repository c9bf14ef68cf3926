"""The kind `harmonics`: a sum of cosines with given amplitudes and phases.

Stage   SURFACES.
Model   h(x) = sum of A_n cos(n (2 pi x / period + phase) + p_n), n = 1 to 64 at most. A_n comes from `amplitudes` and
        p_n from `phases`; without `phases` every p_n is 0.
Source  Fourier; Fagiani & Barbieri (2016), eq. 2 is the case of one order.
Limits  As for `fourier`.
"""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from synth.scene.quantity import Dimension
from synth.scene.rules import Fields, Quantity, QuantityList, Refusal, refusal
from synth.scene.section import Section
from synth.scene.texture_registry import Kind
from synth.surfaces.fourier import FourierProfile
from synth.surfaces.profile import Array, Cosine

MOST_ORDERS = 64  # the largest number of orders in a live voice's table; for more, use `rough` or `profile`
LARGEST_SUM = 1e-3  # m: the largest permitted amplitude of a texture


@dataclass(frozen=True, eq=False)
class Harmonics(FourierProfile):
    """A sum of cosines.

    period: m.
    shift: rad.
    amplitudes: m, of orders 1, 2, ...
    phases: rad, of the same orders.
    """

    amplitudes: tuple[float, ...]
    phases: tuple[float, ...]
    kind = "harmonics"

    @property
    def key(self) -> Hashable:
        """Everything that decides the heights."""
        return self.kind, self.period, self.shift, self.amplitudes, self.phases

    @cached_property
    def orders(self) -> tuple[Array, Array]:
        """Amplitudes (m) and phases (rad) of the orders."""
        return np.array(self.amplitudes), np.array(self.phases)

    @property
    def cosine(self) -> Cosine | None:
        """The first order where it is the only one, else None."""
        if any(self.amplitudes[1:]):
            return None
        return Cosine(self.amplitudes[0], self.period, self.phases[0] + self.shift)


class HarmonicsFields(Section):
    """Amplitudes and phases of the orders."""

    amplitudes: Annotated[
        tuple[float, ...] | None, QuantityList(Quantity(Dimension.LENGTH, 0.0, LARGEST_SUM, usual=0.5e-3), 1, 64)
    ] = Field(
        default=(20e-6, 10e-6), description="harmonics: amplitudes of the orders 1, 2, ...; their sum is 1 mm at most."
    )
    phases: Annotated[
        tuple[float, ...] | None, QuantityList(Quantity(Dimension.ANGLE, -1000.0, 1000.0), 1, MOST_ORDERS)
    ] = Field(default=None, description="harmonics: phases of the orders, as many as amplitudes; null: all 0.")


def _made(values: Mapping[str, Any]) -> Harmonics:
    amplitudes = tuple(values["amplitudes"])
    phases = values["phases"] or (0.0,) * len(amplitudes)
    return Harmonics(values["period"], values["phase"], amplitudes, tuple(phases))


def _refusals(values: Mapping[str, Any], given: Fields) -> list[Refusal]:
    amplitudes, phases = values["amplitudes"], values["phases"]
    if phases is not None and len(phases) != len(amplitudes):
        hint = f"There are {len(amplitudes)} amplitudes and {len(phases)} phases. Leave phases out where all are 0."
        return [refusal(["phases"], given["phases"], f"as many phases as amplitudes, {len(amplitudes)}", hint)]
    if sum(amplitudes) > LARGEST_SUM * (1.0 + 1e-12):
        hint = f"Their sum is {sum(amplitudes) * 1e3:.4g} mm. Write smaller amplitudes."
        return [refusal(["amplitudes"], given["amplitudes"], "amplitudes whose sum is 1 mm at most", hint)]
    return []


KIND = Kind("harmonics", HarmonicsFields, _made, steep="amplitudes", refusals=_refusals)
