"""From the rate of steps to the rate of frames: the band limit and the time derivatives, in one filter.

Model   y is the value at a step. A frame is the sum over the steps near it of (y - y at the frame) times the taps. For
        order 0, y at the frame is added back. Motion at rest therefore gives exactly y, and derivatives of exactly 0.
        The taps are a windowed sinc, convolved with the central difference of the order. The window is Kaiser's or, for
        a file, that of `frame_solver`.
        Values that belong to a time before their step, such as a pressure in the middle of a step, have taps of their
        own: the same filter, shifted by that part of a step.
        The simulated steps of a mass follow a fast force with too small an amplitude; the filter compensates for that.
Source  Kaiser (1974): length of the window for a transition and an attenuation. Fornberg (1988): differences.
Limits  Linear phase: a frame needs the steps of `margin` frames on both sides. In the pass band the gain is that of the
        derivative, with a relative error below the attenuation. In the stop band less than the attenuation is left.
        A band that needs too many frames gets a wider transition, which reaches into the pass band (`droop`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from synth.arrays import Array
from synth.kernels import signed_kernel, summing

LONGEST = 1024  # frames on one side of a frame, behind a hand and where blocks have deadlines
MOST_TAPS = 1 << 16  # steps on one side of a frame in a file, if these are more frames: 40 us per frame
SPARE = 3.0  # dB added to the requested attenuation: Kaiser's fit is up to 2 dB short
LOOKS = 200  # frequencies at which the gain of a filter that is too short is looked at
REACH = 12  # steps on each side of a difference: its error is 1e-7 at 0.225 of the step rate, less below


@dataclass(frozen=True, slots=True)
class Decimator:
    """Filters from one rate of steps to one rate of frames.

    taps: float64 [orders + 1, 2 margin steps + 1], of d^k/dt^k in s^-k. The last row has order 0, of late values.
    orders: order k of the derivative in each other row of `taps`.
    margin: frames on each side of a frame.
    steps: steps per frame.
    droop: error of the gain at the end of the pass band; where `frame_solver` gives the gain, what a filter that is too
        short for it misses.
    """

    taps: Array
    orders: tuple[int, ...]
    margin: int
    steps: int
    droop: float

    @classmethod
    def of(
        cls,
        orders: tuple[int, ...],
        rate: int,
        steps: int,
        band: tuple[float, float],
        attenuation: float,
        *,
        width: float = 0.0,
        of_mass: bool = False,
        late: float = 0.0,
        live: bool = True,
    ) -> Decimator:
        """Return the filters of `orders`.

        rate: frames per second.
        steps: steps per frame.
        band: end of the pass band and start of the stop band, as parts of the rate.
        attenuation: dB.
        width: of the edge of `frame_solver` in the middle of `band`, as a part of the rate; 0: Kaiser's window.
        of_mass: compensate for the amplitude that the steps of a mass lose.
        late: time between a late value and the end of its step, as a part of the step.
        live: whether the filter reaches over LONGEST frames at most.
        """
        passing, stopping = band
        asked = attenuation + SPARE
        longest = LONGEST if live else max(LONGEST, MOST_TAPS // steps)
        reach = (asked - 8.0) / (2.285 * 2.0 * math.pi * (stopping - passing)) / 2.0
        if width:
            reach = math.sqrt(asked / 20.0 * math.log(10.0)) / (math.pi * width)
        margin = min(longest, math.ceil(reach) + 1)
        assert steps >= 2, "the differences need at least two steps per frame"
        before = (
            np.arange(margin * steps, -margin * steps - 1, -1) / steps
        )  # time of each step before the frame, in frames
        beta = 0.1102 * (asked - 8.7)  # Kaiser's fit, for 50 dB and more
        window = np.exp(-((math.pi * width * before) ** 2)) if width else np.kaiser(len(before), beta)
        lows = [np.sinc((passing + stopping) * (before + one / steps)) * window for one in (0.0, late)]
        droop = abs(1.0 - _gain(lows[0], passing * before))
        if width:  # then `frame_solver` is the gain
            droop = 0.0 if margin > reach else _missed(lows[0], before, 0.5 * (passing + stopping), width)
        if of_mass:
            lows = [_made_up(low, math.pi * min(1.2 * stopping / steps, 0.5)) for low in lows]
        low, shifted = (one / np.sum(one) for one in lows)
        rows = [np.convolve(low, _difference(order)) * (float(rate) * steps) ** order for order in orders]
        taps = np.stack([*rows, np.pad(shifted, REACH)])
        margin += math.ceil(REACH / steps)
        spare = (taps.shape[1] - 1) // 2 - margin * steps
        taps = np.pad(taps, ((0, 0), (-spare, -spare)))
        return cls(taps, orders, margin, steps, droop)

    @property
    def late_row(self) -> int:
        """Index of the row of `taps` for late values."""
        return len(self.orders)

    def read(self, values: Array, row: int, frames: int) -> Array:
        """Return `frames` frames of order `orders[row]`, or of late values.

        values: float64 [(frames - 1 + 2 margin) steps + 1], from `margin` frames before the first frame on.
        """
        out = np.empty(frames)
        keep = row == self.late_row or self.orders[row] == 0
        filter_frames(values, self.taps[row], self.steps, keep, out)
        return out


def narrowest(attenuation: float) -> float:
    """Return the narrowest transition of Kaiser's window over LONGEST frames, as a part of the rate."""
    return (attenuation + SPARE - 8.0) / (2.285 * 2.0 * math.pi * 2.0 * (LONGEST - 1))


def _gain(taps: Array, turns: Array) -> float:
    """Return the gain of even taps at a frequency of which each tap sees `turns`."""
    return float(taps @ np.cos(2.0 * math.pi * turns) / np.sum(taps))


def _missed(taps: Array, before: Array, half: float, width: float) -> float:
    """Return the largest difference between the gain of even taps and that of `frame_solver`.

    before: time of each tap, in frames.
    half, width: of the edge, as parts of the rate.
    """
    places = np.linspace(0.75, 1.15, LOOKS) * half  # it misses most beside the edge
    return max(abs(_gain(taps, one * before) - 0.5 * math.erfc((one - half) / width)) for one in places.tolist())


def lost_amplitude(half: Array) -> Array:
    """Return the part of the exact amplitude that the steps of a mass keep.

    A force of frequency f moves a mass, by the midpoint rule, by only x^2 cos(x / 2) / (4 sin^2(x / 2)) of it, with
    x = 2 pi f step; half: x / 2, above 0.
    """
    return np.asarray(half**2 * np.cos(half) / np.sin(half) ** 2)


def _made_up(taps: Array, highest: float) -> Array:
    """Return taps that compensate for the amplitude that the steps of a mass lose.

    highest: x / 2 of `lost_amplitude` above which the compensation is constant, since the filter passes nothing there.
    """
    size = 8 << len(taps).bit_length()
    half = np.maximum(np.minimum(math.pi * np.arange(size // 2 + 1) / size, highest), 1e-9)
    return np.asarray(np.fft.irfft(np.fft.rfft(taps, size) / lost_amplitude(half), size)[: len(taps)])


def _difference(order: int) -> Array:
    """Return the central difference of `order` (0, 1 or 2) over REACH steps on each side.

    Its error is of order 2 REACH in the frequency, so slow motion keeps all its digits (Fornberg, 1988).
    """
    if order == 0:
        return np.pad(np.ones(1), REACH)
    j = np.arange(1, REACH + 1)
    sizes = -np.cumprod((j - 1.0 - REACH) / (j + REACH)) / j
    if order == 1:
        return np.concatenate([-sizes[::-1], [0.0], sizes])
    sizes = 2.0 * sizes / j
    return np.concatenate([sizes[::-1], [-2.0 * np.sum(sizes)], sizes])


@summing
def weighted(values, taps, base):
    """Return the sum of taps times (values - base)."""
    total = 0.0
    for j in range(len(taps)):
        total += taps[j] * (values[j] - base)
    return total


@signed_kernel("void(f8[::1], f8[::1], i8, b1, f8[::1])")
def filter_frames(values, taps, steps, keep, out):
    """Write each frame of `out`, the weighted sum of the steps near it.

    keep: add the value at the frame.
    """
    middle = len(taps) // 2
    for i in range(len(out)):
        near = values[i * steps : i * steps + len(taps)]
        base = near[middle]
        total = weighted(near, taps, base)
        out[i] = base + total if keep else total
