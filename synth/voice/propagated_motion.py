"""The motion at a distance from the contact: the series of a constant scan with the gain of the way, or a filter.

Stage   3 (VOICE), used only by the effect `propagation`.
Model   In a constant scan of the contact each harmonic is multiplied by the gain of the way (`skin_wave`) at its
        frequency n u / lambda2, which is exact and begins at once. In all other motions, the causal
        filter of the way reads the samples of the scene's own channel.
        A filter begins at rest: before the first frame a displacement had its first value, and other quantities were 0.
        Within the contact the channel is a copy.
Limits  After a seek in a moving scan the filter begins anew. The error is that of the channel read, times the largest
        gain in the band, plus that of the filter at speeds from a quarter of the scan's up to the scan's. It does not
        cover the first arrival of a motion that begins with a step: a stroke at full acceleration.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from synth.arrays import Array, Block
from synth.effects.effect import AddedChannel, Passage
from synth.effects.simulation.running import Signal
from synth.plan.channels import PEAK, ROUNDING, STILL, ChannelPlan, spendable
from synth.plan.motion_peak import steady_peak
from synth.plan.preparation import Preparation
from synth.response.demand import Complex, Demand, curves, points_for
from synth.response.series_curve import SMALLEST, SeriesCurve
from synth.response.spectrum import solve_spectrum
from synth.response_cache import ResponseCache
from synth.voice.skin_wave import SkinFilter, SkinWave

SPEEDS = np.geomspace(0.25, 1.0, 25)  # over that of the scan, at which the error of a filter is computed
FADED = 1.225  # times the band, above which nothing is left: 0.49 over 0.40 of the rate
FINEST = 0.03  # least part of the tolerance to which a series is solved; a smaller one takes longer than it is worth


@dataclass(slots=True)
class FilterState:
    """The state of a voice.

    frame: the next frame, None before the first.
    past, state: of the filter, in units of the channel's full scale.
    """

    frame: int | None = None
    past: Array | None = None
    state: Array | None = None


@dataclass(frozen=True, slots=True)
class PropagatedStage:
    """The effect prepared for one scene.

    solved: the prepared scene.
    source: column that is read.
    filter: None within the contact.
    steady: reader of a constant scan, else None.
    fixed: whether the scene sets the full scale.
    channel: the channel that it adds.
    """

    solved: Preparation
    source: int
    filter: SkinFilter | None
    steady: SeriesCurve | None
    fixed: bool
    channel: AddedChannel

    @classmethod
    def of(
        cls,
        solved: Preparation,
        quantity: str,
        source: str,
        way: SkinWave,
        full_scale: float | None,
        cache: ResponseCache,
    ) -> PropagatedStage:
        """Return the stage of a prepared scene that is not silent.

        quantity, full_scale: of the added channel, SI or None.
        source: quantity of the channel that is read.
        """
        column = [channel.quantity for channel in solved.channels].index(source)
        read, output = solved.channels[column], solved.scene.output
        made, steady, filtered = None, None, solved.moving or solved.stepped
        if not way.inside and filtered:
            made = SkinFilter.of(way, output.sample_rate, output.band_limit)
        before, after = _curves(solved, read.order, way)
        extent, ratio = float(np.ptp(after)), _ratio(before, after)
        if (steady_extent := float(np.ptp(before))) > 0.0:  # a file may move further than its own speed does
            extent *= max(read.extent / steady_extent, 1.0)
        error, method = ratio * read.error, "copy of the contact"
        if made is not None:
            error = ratio * made.largest * read.error + _filter_error(solved, read.order, way, made)
            method = f"filter, {1e3 * way.delay:.3g} ms late"
        elif not filtered:
            steady, error = _steady(solved, read, way, ratio, cache)
            method = steady.name
        scale = full_scale or _scale(solved, column, before, after, steady)
        channel = AddedChannel(quantity, scale, extent, error + ROUNDING, method)
        return cls(solved, column, made, steady, full_scale is not None, channel)

    @property
    def channels(self) -> tuple[AddedChannel, ...]:
        """See `OutputStage`."""
        return (self.channel,)

    @property
    def signals(self) -> tuple[Signal, ...]:
        """See `OutputStage`."""
        return ()

    def louder(self, times: float, moved: tuple[float, ...]) -> PropagatedStage:
        """See `OutputStage`."""
        if self.fixed:
            return self
        raised = self.channel.full_scale * max(1.0, moved[self.source])
        return replace(self, channel=replace(self.channel, full_scale=raised))

    def start(self, phase: int) -> FilterState:
        """See `OutputStage`."""
        return FilterState()

    def begin_at(self, state: FilterState, phase: int) -> None:
        """See `OutputStage`."""
        state.frame = None

    def delay(self, state: FilterState) -> int:
        """See `OutputStage`."""
        return 0

    def step(self, state: FilterState, passage: Passage, block: Block) -> None:
        """See `OutputStage`."""
        scale, column = self.channel.full_scale, passage.column
        if self.steady is not None:
            self.steady.read(passage.phase, passage.step, 1.0 / scale, block, column)
            return
        values = block[:, self.source] * (passage.full_scale[self.source] / scale)
        if self.filter is not None:
            values = self._filtered(self.filter, state, passage, values.astype(np.float64))
        block[:, column] = np.where(np.abs(values) >= SMALLEST, values, 0.0)

    def _filtered(self, made: SkinFilter, state: FilterState, passage: Passage, values: Array) -> Array:
        """Return `values` at the place, both in units of the channel's full scale."""
        going_on = state.frame is not None and (passage.by_hand or passage.frame == state.frame)
        if not going_on and len(values):
            still = values.item(0) if self.solved.channels[self.source].order == 0 else 0.0
            state.past, state.state = made.start(still)
        if state.past is None or state.state is None:
            return values
        state.frame = passage.frame + len(values)
        return made.run(state.past, state.state, values)


def _gains(solved: Preparation, way: SkinWave, series: Complex) -> Complex:
    """Return the gain of each harmonic of a series of the steady scan."""
    return way.gain(solved.turns * np.arange(len(series), dtype=np.float64))


def _curves(solved: Preparation, order: int, way: SkinWave) -> tuple[Array, Array]:
    """Return a period of the steady scan at the contact and at the place, SI."""
    series = solved.series(order)
    points = 2 * points_for(len(series) - 1)
    return curves(series, 0, points), curves(series * _gains(solved, way, series), 0, points)


def _steady(
    solved: Preparation, read: ChannelPlan, way: SkinWave, ratio: float, cache: ResponseCache
) -> tuple[SeriesCurve, float]:
    """Return the reader of a constant scan and its error. Unless simulated, it is solved to the tolerance of the place.

    read: the channel that is read.
    ratio: of the peak-to-peak at the contact to that at the place.
    """
    order, series = read.order, solved.series(read.order)
    gains = _gains(solved, way, series)
    larger = ratio * float(np.max(np.abs(gains[1:]), initial=0.0))
    if solved.simulated:
        return SeriesCurve(series * gains), larger * read.error
    assert solved.contact is not None and solved.spectrum is not None
    if order not in solved.orders:  # a finger at rest
        return SeriesCurve(series), 0.0
    contact, spectrum, place = solved.contact, solved.spectrum, solved.orders.index(order)
    if larger * spectrum.errors[place] > solved.tolerance:
        scan = solved.scene.scan
        load = scan.load if scan.load > 0.0 else scan.lift_load  # as of `solved.spectrum`
        demand = Demand(solved.reach, solved.orders, max(1.0 / larger, FINEST) * spendable(solved.tolerance))
        key = ("spectrum", contact.key, load, demand, solved.reach)
        spectrum = cache.get(key, lambda: solve_spectrum(contact, load, demand, solved.reach))
    series = solved.steady.series(order, spectrum.harmonics)
    return SeriesCurve(series * gains), larger * spectrum.errors[place]


def _filter_error(solved: Preparation, order: int, way: SkinWave, made: SkinFilter) -> float:
    """Return the largest error by the filter at speeds up to that of the scan.

    The error at a speed is relative to the peak-to-peak at that speed or at the scan's, whichever is larger: at the
    scan's own speed the harmonics in the band may cancel. Harmonics fade out above the band.
    """
    assert solved.spectrum is not None
    rate, band = solved.scene.output.sample_rate, solved.scene.output.band_limit
    series = solved.spectrum.harmonics
    count, points = np.arange(len(series), dtype=np.float64), 2 * points_for(len(series) - 1)
    missed, extents = np.zeros((2, len(SPEEDS)))
    for index, speed in enumerate(SPEEDS):
        hertz = count * (speed * solved.turns)
        heard = np.clip((FADED - np.abs(hertz) / band) / (FADED - 1.0), 0.0, 1.0)
        moved = series * heard * (2j * math.pi * hertz) ** order
        moved[0] = 0.0
        exact = way.gain(hertz)
        missed[index] = np.max(np.abs(curves(moved * (made.gain(hertz / rate) - exact), 0, points)))
        extents[index] = np.ptp(curves(moved * exact, 0, points))
    extents = np.maximum(extents, extents[-1])
    return float(np.max(missed / np.where(extents > 0.0, extents, np.inf)))


def _ratio(before: Array, after: Array) -> float:
    """Return the peak-to-peak of `before` over that of `after`, or 0 if nothing moves."""
    extent = float(np.ptp(after))
    return float(np.ptp(before)) / extent if extent > 0.0 else 0.0


def _scale(solved: Preparation, column: int, before: Array, after: Array, steady: SeriesCurve | None) -> float:
    """Return the automatic full scale, SI: of the frames of a constant scan in a file, as that of z is.

    Otherwise it is that of the channel `column`, times the part of its peak that is left at the place.

    before, after: the steady scan at the contact and at the place, SI.
    steady: reader of a constant scan, SI.
    """
    peak, own = float(np.max(np.abs(before))), float(np.max(np.abs(after)))
    if steady is not None and not solved.live:
        own = steady_peak(steady, 0.0, solved.scene)
    elif solved.scene.output.channel_list[column].full_scale is None and peak > STILL:
        return solved.channels[column].full_scale * own / peak
    return own / PEAK if own > STILL else 1.0
