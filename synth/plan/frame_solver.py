"""The response solved along a scan, at equal steps of time: no table.

Stage   2, under `solved_frames`, which renders it, and `motion_peak`, which looks for its largest values.
Model   y = g(w) (z(p / lambda2, w) - mean of z over a period at w) is solved at equal steps of time: many in a frame,
        or, where the band is narrow, some in several frames. The band limit, the derivatives and the step to the frame
        rate are one product in the frequency domain: (2 pi i f)^k / 2 erfc((f - CUT rate) / (WIDTH rate)), chunk by
        chunk, with margins on both sides that are longer than the filter rings. The mean over a period is a spline
        over w^(1/3), in which it is smooth.
Source  design, section 4; eq. 1 (Fagiani & Barbieri, 2016) is solved by `contact.exact_solver`.
Limits  up to 0.40 of the rate the filter is 1 to 1e-9, above 0.49 below 1e-9 (in parts of the bandwidth where that is
        narrower). A solution costs a few microseconds.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from synth.arrays import Array
from synth.motion.motion import LOAD
from synth.motion.scan_motion import ScanMotion
from synth.response.mean_approach import Mean
from synth.scene.scene import Scene

Heights = Callable[[Array, Array], Array]

WITH_MEAN = -1  # the order that stands for z itself: the approach, where 0 is displacement, z about its mean
CUT, WIDTH = 0.445, 0.0105  # of the rate: half amplitude, and how steeply; 0.045 beside the cut 1e-9 is left
MARGIN = 192  # frames beside a chunk, at the full band: the filter rings by less than 1e-15 there
CHUNK = 4096  # frames of a chunk, where the filter does not ring for long
TOGETHER = 1 << 21  # solutions of a chunk and its margins at most: 200 MB of working memory; more where margins need it


class FrameSolver:
    """Solves chunks of frames of a scan; any chunk, in any order.

    heights: z (m) at each place (turns) and load (N, above 0). mean: of z over a period (m), over the cube root of the
    load (N^(1/3)). rate: frames a second. count, stride: so many solutions in so many frames. scale: of the filter's
    frequencies, as a part of those of the whole band. chunk: frames that are solved together.
    """

    def __init__(
        self, heights: Heights, scene: Scene, mean: Mean, rate: int, *, count: int, scale: float, stride: int = 1
    ) -> None:
        self._heights, self._scan, self._period = heights, scene.scan, scene.texture.period
        self._rate, self._count, self._stride, self._scale = rate, count, stride, scale
        self._motion, self._frames = ScanMotion(scene, rate * count / stride), ScanMotion(scene, rate)
        self._margin = _multiple(math.ceil(MARGIN / scale), stride)
        room = TOGETHER * stride // count - 2 * self._margin
        self.chunk = _multiple(max(2 * self._margin, min(room, max(CHUNK, 4 * self._margin))), stride)
        self._mean = mean

    @property
    def memory_bytes(self) -> int:
        """Bytes of the working memory of a chunk."""
        return 8 * 12 * self.solutions

    @property
    def solutions(self) -> int:
        """Solutions that a chunk takes."""
        return (self.chunk + 2 * self._margin) // self._stride * self._count

    def solved(self, number: int, orders: tuple[int, ...]) -> Array:
        """Return a chunk: float64 [orders, chunk], the time derivative of each of `orders` (0: m) at its frames.

        The order WITH_MEAN is z itself, with its mean.
        """
        frames, own = self.chunk + 2 * self._margin, slice(self._margin, self._margin + self.chunk)
        first = (number * self.chunk - self._margin) // self._stride * self._count
        motion = self._motion.at(first, self.solutions)
        value, mean = self._gated(motion.position / self._period, motion.samples[LOAD])
        touching = self._frames.at(number * self.chunk, self.chunk).samples[LOAD] > 0.0
        return np.array([
            self._limited(value + mean if order == WITH_MEAN else value, frames, max(order, 0))[own] * touching
            for order in orders
        ])  # fmt: skip

    def _gated(self, theta: Array, loads: Array) -> tuple[Array, Array]:
        """Return y, and the mean (m) that it is about, at each phase (turns) and load (N)."""
        value, means = np.zeros_like(loads), np.zeros_like(loads)
        touching = np.flatnonzero(loads > 0.0)
        if len(touching):
            some = loads[touching]
            height = self._heights(theta[touching], some)
            s = np.minimum(some / self._scan.lift_load, 1.0)
            faded, mean = s**3 * (10.0 + s * (6.0 * s - 15.0)), self._mean(np.cbrt(some))
            value[touching], means[touching] = faded * (height - mean), faded * mean
        return value, means

    def _limited(self, value: Array, frames: int, order: int) -> Array:
        """Return the derivative of `order` of `value`, band-limited, at the frames.

        A straight line from end to end is taken out first and put back: without it the ends would not meet.
        """
        from scipy.special import erfc

        rise = (value[-1] - value[0]) / (len(value) - 1)
        spectrum = np.fft.rfft(value - (value[0] + rise * np.arange(len(value)))) * (frames / len(value))
        spectrum = spectrum[: frames // 2 + 1]
        cycles = np.arange(len(spectrum)) / frames
        gain = 0.5 * erfc((cycles - CUT * self._scale) / (WIDTH * self._scale))
        spectrum *= gain * (2j * math.pi * self._rate * cycles) ** order
        found = np.fft.irfft(spectrum, frames)
        rise *= self._count / self._stride  # a frame
        if order == 0:
            found += value[0] + rise * np.arange(frames)
        elif order == 1:
            found += rise * self._rate
        return np.asarray(found)


def _multiple(least: int, stride: int) -> int:
    """Return the smallest multiple of `stride` from `least` on."""
    return -(-least // stride) * stride
