"""The channels of a scene: full scale, reader and error of each quantity at the scan's own speed and load.

Stage   2, the part of `prepare` that converts a series of z to the quantities of the output.
Model   quantity = sum over n of (2 pi i n u / lambda2)^k Z_n exp(2 pi i n theta), multiplied by the lift gate. An
        automatic full scale makes the peak 0.8. The peak is that of the steady scan, or the largest along a motion
        (`motion_peak`). The error is the sum of the measured error of the series and the rounding to float32. The
        error of the reader (`series_curve`) is smaller.
Source  design, section 4.
Limits  If the motion is below 1 nm, an automatic full scale gives silence, because it would only amplify rounding.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from synth.arrays import Array
from synth.plan.motion_peak import steady_peak
from synth.plan.request import RESTS, Request, beyond_band, harmonics_in_band
from synth.response.demand import Complex, curves, points_for
from synth.response.lift_gate import gate
from synth.response.reading_filter import ORDERS
from synth.response.series_curve import SeriesCurve
from synth.response.series_error import error_floor
from synth.response.spectrum import Spectrum
from synth.sampling.frame_solver import WITH_MEAN
from synth.scene.output_section import Channel

APPROACH = "approach"
NEARLY = 1.05  # times the tolerance: a smaller error causes no warning, because the error is itself an estimate
ROUNDING = 6e-8  # rounding to float32, relative to the peak
PEAK = 0.8  # steady peak with an automatic full scale, as a part of full scale
SMALLEST_MOTION = 1e-9  # m: for smaller motions an automatic full scale gives silence, not noise
CANCELLED = 1e-9  # of the amplitude of the texture: a finger that moves less is held by a cancellation, not by its load
STILL = 1e-30  # SI unit of any quantity: smaller peaks count as zero


@dataclass(frozen=True, slots=True)
class ChannelPlan:
    """One channel.

    quantity: its name.
    order: order of the time derivative of z.
    full_scale: SI value of a sample of 1.0.
    error: largest error, relative to `extent`.
    extent: peak-to-peak at the scan's speed and load, SI; of a moving file, that of its own motion where it is larger.
    reader: reader of the steady scan, in SI units; None for a moving scan.
    level: for the approach, the mean of z over a period at the scan's load, m, which is added to the displacement; 0
        for other quantities.
    """

    quantity: str
    order: int
    full_scale: float
    error: float
    extent: float
    reader: SeriesCurve | None
    level: float = 0.0

    def with_error(self, more: Array) -> ChannelPlan:
        """Return the channel with the value of `more` [orders] for its order added to its error, if it moves."""
        return self if self.extent == 0.0 else replace(self, error=self.error + float(more[self.order]))

    @property
    def is_approach(self) -> bool:
        """True if the samples are z itself. Otherwise they are z minus its mean, or a derivative of it."""
        return self.quantity == APPROACH


@dataclass(frozen=True, slots=True)
class SteadyScan(Request):
    """The scan's own speed and load, from which the channels are planned.

    spectrum: the series of z at the scan's load.
    """

    spectrum: Spectrum

    def series(self, order: int, harmonics: Complex | None = None) -> Complex:
        """Return the series of a quantity in SI units, multiplied by the lift gate.

        harmonics: harmonics of z; None for those of `spectrum`.
        """
        kept = self.held if harmonics is None else harmonics * self._gate
        kept = kept[: self.highest + 1]
        kept[0] = 0.0
        return kept * (2j * math.pi * np.arange(len(kept)) * self.turns) ** order if order else kept

    @property
    def held(self) -> Complex:
        """The series of z, multiplied by the lift gate, with all harmonics of a moving scan, also at lower speeds."""
        return np.asarray(self.spectrum.harmonics * self._gate)

    @property
    def _gate(self) -> float:
        scan = self.scene.scan  # the gate does not apply to a finger that pulls
        return float(gate(scan.load, scan.lift_load)) if scan.load >= 0.0 else 1.0

    def extent(self, order: int) -> float:
        """Return the peak-to-peak (SI) at the scan's own speed and load; 0 for a file that is above the band there."""
        above = self.moving and not self.live and not harmonics_in_band(self.scene, 1)
        return 0.0 if above else extent_and_peak(self.series(order))[0]

    def least(self, order: int) -> float:
        """Return the time derivative of SMALLEST_MOTION at the texture's own frequency, SI."""
        return SMALLEST_MOTION * (2.0 * math.pi * abs(self.turns)) ** order

    def planned(
        self, channel: Channel, peaks: Mapping[int, float], extents: Mapping[int, float], *, still: bool = False
    ) -> ChannelPlan:
        """Return the plan of one channel, with its reader and its total error.

        peaks, extents: peak and peak-to-peak of each order (SI) along the scan's own motion, where they are known.
        still: the finger moves too little for an automatic full scale. The full scale is then that of a finger that
            follows the texture exactly.
        """
        order = ORDERS[channel.quantity]
        series = self.series(order)
        extent, peak = extent_and_peak(series)
        peak = peaks.get(order, peak)
        if self.moving and not self.live:  # the steady motion may be no measure of the file
            extent = self.extent(order)
            unlike = self.over_area or extent <= self.least(order)
            extent = max(extent, extents.get(order, max(2.0 * peak, self.least(order)) if unlike else 0.0))
        if still and (self.by_hand or channel.quantity != APPROACH):
            peak = self.scene.texture.amplitude * (2.0 * math.pi * abs(self.turns)) ** order
        reader = None if self.moving else SeriesCurve(series)
        level = float(self.spectrum.harmonics[0].real) * self._gate if channel.quantity == APPROACH else 0.0
        if level:
            peak = peaks.get(WITH_MEAN, peak + abs(level))
        if reader is not None and not self.live and not still:
            peak = steady_peak(reader, level, self.scene)
        full_scale = channel.full_scale or (peak / PEAK if peak > STILL else 1.0)
        error = ROUNDING * max(1.0, abs(level) / extent) if extent > 0.0 else 0.0
        if extent > 0.0 and not self.moving and order in self.orders:
            error += self.spectrum.errors[self.orders.index(order)]
        return ChannelPlan(channel.quantity, order, full_scale, error, extent, reader, level)

    def peaks_over(self, heights: Array) -> dict[int, float]:
        """Return the peaks (m) of displacement and approach on a long surface.

        heights: z at places of the whole surface, m. The series is that of a stretch, without its longest waves.
        """
        moved = self._gate * float(np.max(np.abs(heights - np.mean(heights))))
        largest = self._gate * float(np.max(np.abs(heights)))
        return {0: max(moved, extent_and_peak(self.series(0))[1]), WITH_MEAN: largest}

    @property
    def _swing(self) -> float:
        """Peak of the displacement over a period (m); of a file that renders less, its peak-to-peak there."""
        series, turns = self.series(0), abs(self.turns) * self.scene.output.duration
        if self.moving or self.live or turns == 0.0 or turns >= 1.0:
            return extent_and_peak(series)[1]
        places = math.copysign(1.0, self.turns) * np.linspace(0.0, turns, points_for(len(series) - 1))
        return float(np.ptp(SeriesCurve(series).heights(places, places)))

    @property
    def _cancelled(self) -> bool:
        """Whether the ridges of a comb may cancel the lines of the texture: it spans a period, and moves."""
        scene, whole = self.scene, self.stretch is None and not self.spectrum.closed
        spans = scene.texture.period <= scene.finger.contact_length
        return whole and spans and scene.finger.traits.straight and scene.scan.speed != 0.0

    def warning(self, channel: ChannelPlan, tolerance: float) -> str:
        """Return a warning if a channel misses the tolerance by more than round-off, or ""."""
        height = self.scene.finger.ridge_amplitude + self.scene.texture.amplitude
        floor = error_floor(height, max(self.highest, 1), channel.order) * abs(self.turns) ** channel.order
        if (channel.error - tolerance) * channel.extent <= floor:
            return ""
        return (
            f"The error of the {channel.quantity} is {channel.error:.2g} of its peak-to-peak; the tolerance is "
            f"{tolerance:.2g}.{self._remaining(channel)}"
        )

    def _remaining(self, channel: ChannelPlan) -> str:
        """Return what most of the error of a channel is, as a sentence, or "" where it is not that of the series."""
        series, at = self.spectrum, self.orders.index(channel.order)
        if series.errors[at] < 0.5 * channel.error:
            return ""
        if series.discrete and series.discrete[at] > 0.5 * series.errors[at]:
            return f" Most of it is that of the {series.solver}, which is as fine as time and memory allow."
        return f" Most of it is that of {series.phases} phases of the texture, as many as time allows."

    def silence(self, peaks: Mapping[int, float]) -> str:
        """Return why an automatic full scale leaves this motion silent, or "". `peaks` are those of `planned`."""
        if self.moving and not self.by_hand and all(peaks.get(order, 1.0) == 0.0 for order in self.orders):
            return beyond_band(self) or RESTS
        swing = peaks.get(0, self._swing)
        if swing >= SMALLEST_MOTION or all(channel.full_scale for channel in self.scene.output.channel_list):
            return ""
        if self._cancelled and swing < CANCELLED * self.scene.texture.amplitude:
            return (
                f"The finger moves by {swing:.3g} m, less than 1 nm: the length and the equal ridges of a comb cancel "
                f"every line of the texture below {self.scene.output.band_limit:.4g} Hz. No measured finger does this. "
                'Write finger.kind "fingertip", another finger.ridge_period, or a larger output.bandwidth.'
            )
        return (
            f"The finger moves by {swing:.3g} m, less than 1 nm. An automatic full scale would only amplify rounding. "
            "Set output.full_scale to hear the motion."
        )


def spendable(tolerance: float) -> float:
    """Return the part of the tolerance that the series may use. The rounding to float32 uses the rest."""
    return max(tolerance - ROUNDING, 0.3 * tolerance)


def extent_and_peak(series: Complex) -> tuple[float, float]:
    """Return the peak-to-peak of a series, and its peak about the mean."""
    curve = curves(series, 0, 2 * points_for(len(series) - 1))
    above, below = _highest(curve), _highest(-curve)
    return above + below, max(above, below)


def _highest(curve: Array) -> float:
    """Return the largest value of a period between its points too: of the parabolas through its crests."""
    before, after = np.roll(curve, 1), np.roll(curve, -1)
    bend = 2.0 * curve - before - after
    crests = (curve >= before) & (curve >= after) & (bend > 0.0)
    tops = curve[crests] + (after - before)[crests] ** 2 / (8.0 * bend[crests])
    return float(np.max(tops, initial=np.max(curve)))
