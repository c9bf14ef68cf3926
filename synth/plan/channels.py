"""The channels of a scene: full scale, reader and error of each quantity at the scan's own speed and load.

Stage   2, the part of `preparation` that makes a series into what is heard.
Model   quantity = sum over n of (2 pi i n u / lambda2)^k Z_n exp(2 pi i n theta), times the lift gate; full_scale,
        where it is left to us, makes the peak 0.8: that of the steady scan, or along a motion (`motion_peak`). The
        error adds what was measured of the series and the rounding to float32. The reader (`series_curve`) errs by
        less.
Source  design, section 4.
Limits  below 1 nm of motion an automatic full scale gives silence: it would only amplify rounding.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from synth.plan.frame_solver import WITH_MEAN
from synth.plan.request import Request
from synth.response.lift_gate import gate
from synth.response.reading_filter import ORDERS
from synth.response.series_curve import SeriesCurve
from synth.response.spectrum import Complex, Spectrum, curves, error_floor, points_for
from synth.scene.output_section import Channel

APPROACH = "approach"
UNITS = {APPROACH: "m", "displacement": "m", "velocity": "m/s", "acceleration": "m/s^2"}
NEARLY = 1.05  # times the tolerance: less than this is not worth a warning, since the error is itself an estimate
ROUNDING = 6e-8  # of the peak: float32
PEAK = 0.8  # of full scale: the steady peak when full_scale is left to us
SMALLEST_MOTION = 1e-9  # m: below it an automatic gain gives silence, not noise
STILL = 1e-30  # of any quantity in SI units: what is below is nothing


@dataclass(frozen=True, slots=True)
class ChannelPlan:
    """One channel.

    quantity, order: its name and how many times it is a time derivative of z. full_scale, extent: SI value of 1.0, and
    peak-to-peak at the scan's speed and load. level: what is added to displacement, m: the mean of z over a period at
    that load for the approach, else 0. error: largest error relative to that peak-to-peak. reader: of the steady
    scan, in SI units; None for a moving scan.
    """

    quantity: str
    order: int
    full_scale: float
    error: float
    extent: float
    reader: SeriesCurve | None
    level: float = 0.0

    @property
    def is_approach(self) -> bool:
        """True where the samples are z itself, not z about its mean."""
        return self.quantity == APPROACH


@dataclass(frozen=True, slots=True)
class SteadyScan(Request):
    """The scan's own speed and load: what a channel is planned from. spectrum: the series at the scan's load."""

    spectrum: Spectrum

    def series(self, order: int, harmonics: Complex | None = None) -> Complex:
        """Return the series of a quantity in SI units, the lift gate included; harmonics: of z, or those it has."""
        kept = (self.spectrum.harmonics if harmonics is None else harmonics)[: self.highest + 1] * self._gate
        kept[0] = 0.0
        return kept * (2j * math.pi * np.arange(len(kept)) * self.turns) ** order if order else kept

    @property
    def _gate(self) -> float:
        scan = self.scene.scan  # what holds a finger that pulls is no affair of the gate
        return float(gate(scan.load, scan.lift_load)) if scan.load >= 0.0 else 1.0

    def planned(self, channel: Channel, peaks: Mapping[int, float], *, still: bool = False) -> ChannelPlan:
        """Return one channel, its reader made and its error added up.

        peaks: of each order along the scan's own motion, where that is not steady.
        still: the scan moves by too little for an automatic full scale; it is then that of a finger that follows the
        texture.
        """
        order = ORDERS[channel.quantity]
        series = self.series(order)
        extent, peak = extent_and_peak(series)
        peak = peaks.get(order, peak)
        if still:
            peak = self.scene.texture.amplitude * (2.0 * math.pi * abs(self.turns)) ** order
        level = float(self.spectrum.harmonics[0].real) * self._gate if channel.quantity == APPROACH else 0.0
        if level:
            peak = peaks.get(WITH_MEAN, peak + abs(level))
        full_scale = channel.full_scale or (peak / PEAK if peak > STILL else 1.0)
        error = ROUNDING * max(1.0, abs(level) / extent) if extent > 0.0 else 0.0
        if extent > 0.0 and not self.moving and order in self.orders:
            error += self.spectrum.errors[self.orders.index(order)]
        reader = None if self.moving else SeriesCurve(series)
        return ChannelPlan(channel.quantity, order, full_scale, error, extent, reader, level)

    def warning(self, channel: ChannelPlan, tolerance: float) -> str:
        """Return what to tell where a channel misses the tolerance by more than round-off, or ""."""
        height = self.scene.finger.ridge_amplitude + self.scene.texture.amplitude
        floor = error_floor(height, max(self.highest, 1), channel.order) * abs(self.turns) ** channel.order
        if (channel.error - tolerance) * channel.extent <= floor:
            return ""
        return (
            f"The {channel.quantity} reaches an error of {channel.error:.2g} of its peak-to-peak, not the "
            f"{tolerance:.2g} asked for."
        )

    def silence(self, peaks: Mapping[int, float]) -> str:
        """Return why an automatic full scale leaves this motion silent, or ""; peaks: as of `planned`."""
        swing = peaks.get(0, extent_and_peak(self.series(0))[1])
        if swing >= SMALLEST_MOTION or all(channel.full_scale for channel in self.scene.output.channel_list):
            return ""
        return (
            f"The finger moves by {swing:.3g} m, less than 1 nm: an automatic full scale would only amplify rounding. "
            "Set output.full_scale to hear it."
        )


def spendable(tolerance: float) -> float:
    """Return what of the tolerance the series may use: the rounding to float32 comes on top."""
    return max(tolerance - ROUNDING, 0.3 * tolerance)


def extent_and_peak(series: Complex) -> tuple[float, float]:
    """Return peak-to-peak and peak of a series about its mean."""
    curve = curves(series, 0, 2 * points_for(len(series) - 1))
    return float(np.ptp(curve)), float(np.max(np.abs(curve)))
