"""From the rate of the steps to the rate of the frames: the band limit and the time derivatives, in one filter.

Model   A frame is the sum over the steps near it of (y - y at the frame) times the taps: a Kaiser-windowed sinc,
        convolved with the k-th central difference; and, of k = 0, y at the frame. So what stands still is exactly
        still, and its derivatives exactly 0. Steps of a mass follow a fast force less than the mass would; the filter
        makes up for it.
Source  Kaiser (1974), for the length of the window that a transition and an attenuation take; Fornberg (1988).
Limits  linear phase: a frame needs the steps of `margin` frames on both sides. In the pass band the gain is that of the
        derivative to the attenuation, of itself; beyond the stop band what is left is below it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from synth.arrays import Array
from synth.kernels import signed_kernel, summing

LONGEST = 1024  # frames on one side of a frame: narrower bands have a wider transition
SPARE = 3.0  # dB beyond what is asked for: Kaiser's fit is up to 2 dB short
REACH = 12  # steps on each side of a difference: at 0.225 of the rate of the steps it errs by 1e-7, less below


@dataclass(frozen=True, slots=True)
class Decimator:
    """Filters of one change of rate: taps float64 [orders, 2 margin steps_a_frame + 1], of d^k/dt^k in units of s^-k.

    margin: frames on both sides. steps: of a frame. orders: the derivatives of the rows.
    """

    taps: Array
    orders: tuple[int, ...]
    margin: int
    steps: int

    @classmethod
    def of(
        cls,
        orders: tuple[int, ...],
        rate: int,
        steps: int,
        band: tuple[float, float],
        attenuation: float,
        *,
        of_mass: bool = False,
    ) -> Decimator:
        """Return the filters of `orders`.

        rate: frames a second. steps: of a frame. band: ends of the pass band and beginning of the stop band, as parts
        of the rate. attenuation: dB. of_mass: the steps are those of a mass, and what they lose is made up for.
        """
        passing, stopping = band
        asked = attenuation + SPARE
        margin = min(LONGEST, math.ceil((asked - 8.0) / (2.285 * 2.0 * math.pi * (stopping - passing)) / 2.0) + 1)
        beta = 0.1102 * (asked - 8.7)  # Kaiser's fit, for 50 dB and more
        assert steps >= 2, "differences of steps that are too far apart"
        before = np.arange(margin * steps, -margin * steps - 1, -1) / steps  # frames by which a step is earlier
        low = np.sinc((passing + stopping) * before) * np.kaiser(len(before), beta)
        if of_mass:
            low = _made_up(low, math.pi * min(1.2 * stopping / steps, 0.5))
        low /= np.sum(low)
        taps = np.stack([np.convolve(low, _difference(order)) * (float(rate) * steps) ** order for order in orders])
        margin += math.ceil(REACH / steps)
        spare = (taps.shape[1] - 1) // 2 - margin * steps
        taps = np.pad(taps, ((0, 0), (-spare, -spare)))
        return cls(taps, orders, margin, steps)

    @property
    def nbytes(self) -> int:
        """Bytes of the taps."""
        return int(self.taps.nbytes)

    def read(self, values: Array, row: int, frames: int) -> Array:
        """Return `frames` frames of order `orders[row]` from the steps `values`.

        The first step stands `margin` frames before the first frame; there are (frames - 1 + 2 margin) steps + 1.
        """
        out = np.empty(frames)
        filter_frames(values, self.taps[row], self.steps, self.orders[row] == 0, out)
        return out


def _made_up(taps: Array, highest: float) -> Array:
    """Return taps that make up for what the steps of a mass lose: x^2 cos(x / 2) / (4 sin^2(x / 2)), x = 2 pi f step.

    A mass that a force of frequency f drives by the midpoint rule moves by that part of what it should. highest: x / 2
    beyond which nothing more is made up for: the filter lets nothing through there.
    """
    size = 8 << len(taps).bit_length()
    half = np.maximum(np.minimum(math.pi * np.arange(size // 2 + 1) / size, highest), 1e-9)
    gain = np.sin(half) ** 2 / (half**2 * np.cos(half))
    return np.asarray(np.fft.irfft(np.fft.rfft(taps, size) * gain, size)[: len(taps)])


def _difference(order: int) -> Array:
    """Return the central difference of `order` (0, 1, 2) over REACH steps on each side, to be convolved with.

    Its error is of the order 2 REACH in the frequency, so that slow motion keeps all its digits (Fornberg, 1988).
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
    """Write each frame of `out`: the weighted steps round it; keep: the value itself is added."""
    middle = len(taps) // 2
    for i in range(len(out)):
        near = values[i * steps : i * steps + len(taps)]
        base = near[middle]
        total = weighted(near, taps, base)
        out[i] = base + total if keep else total
