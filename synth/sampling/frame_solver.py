"""Solves chunks of frames of a scan, in any order: z at equal steps of time, then one filter in the frequency domain.

Stage   SAMPLING, for files. `plan.frame_plan` chooses the steps; `voice.solved_frames` renders the frames.
Model   y = g(w) (z(p / lambda2, w) - mean of z over a period at w) is solved at equal steps of time: several per frame,
        or, for a narrow band, `count` per `stride` frames. One product in the frequency domain limits the band, takes
        the derivatives and reduces the rate to the frame rate:

            (2 pi i f)^k times the gain of the band's edge

        At a band B below that of the rate, a frequency f has the gain erfc((f / B - HALF) / WIDTH) / 2. It is 1 to 1e-3
        up to 0.92 B, and below 1e-3 from B on. In time the filter is a sinc under the window exp(-(pi WIDTH B t)^2).
        Where only the rate limits the band, at B = 0.40 of it, the gain is that of FULL_HALF and FULL_WIDTH: 1 to 1e-9
        up to 0.40 of the rate, and below 1e-9 above 0.49.
        This is done chunk by chunk, with margins on both sides that are longer than the filter's ringing. The mean
        over a period is a spline over w^(1/3), because it is smooth in w^(1/3). Neighbouring chunks share the solutions
        of their margins. Where the load changes quickly there are more steps (`landing`).
Source  design, sections 4 (`"exact"`) and 8: a constant scan has no component at B or above, so no other source may
        have one either. HALF and WIDTH are this project's choice: a steeper edge rings longer, 2 / (WIDTH B) ahead and
        back. `contact.exact_solver` solves eq. 1 (Fagiani & Barbieri, 2016).
Limits  What lies above half the rate of the steps folds into the band; `plan.frame_plan` measures it. The series of a
        constant scan ends at B abruptly: it keeps in full what lies between 0.92 B and B.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any

import numpy as np

from synth.arrays import Array
from synth.motion.motion import LOAD, Motion
from synth.motion.scan_motion import ScanMotion
from synth.response.lift_gate import gates
from synth.response.mean_approach import Mean
from synth.sampling.landing import low_pass, solved_again, windows
from synth.scene.output_section import BAND
from synth.scene.scene import Scene

HALF, WIDTH = 0.96, 0.018  # of the band: half amplitude, and width of the edge
FULL_HALF, FULL_WIDTH = 0.445, 0.0105  # parts of the rate, where it limits the band
WHOLE_TO = 0.92  # of the band: up to here the gain is 1 to 1e-3
Heights = Callable[..., Array]
WITH_MEAN = -1  # order of the approach, which is z itself; order 0 is displacement, z minus its mean
REMOVED = 0.49  # part of the rate from which on nothing is left, at the full band
MARGIN = 280  # frames on each side of a chunk at the full band: the ringing of the filter is below 1e-15 there
CHUNK = 4096  # frames of a chunk, unless the filter rings for long
TOGETHER = 1 << 21  # largest number of solutions of a chunk and its margins (200 MB), unless the margins need more
MOST_TOGETHER = 1 << 23  # solutions of the smallest chunk, which is as long as its margins: 800 MB of working memory
Solve = Callable[[int], Any]
"""Returns the frames of a chunk by its number: [chunk, channels], or [chunk] of one channel."""


def edge_of(scale: float) -> tuple[float, float]:
    """Return half amplitude and width of the edge, as parts of the rate.

    scale: the band, as a part of the whole band of the rate.
    """
    return (FULL_HALF, FULL_WIDTH) if scale >= 1.0 else (HALF * BAND * scale, WIDTH * BAND * scale)


class FrameSolver:
    """Solves chunks of frames of a scan, in any order.

    heights: function that returns z (m) at each phase (turns) and load (N, above 0), and along the path of a motion
        that has one.
    mean: mean of z over a period (m), as a function of the cube root of the load (N^(1/3)).
    rate: frames per second.
    count: number of solutions per `stride` frames.
    scale: the kept band, as a part of the whole band.
    whole: as of `ScanMotion`.
    margin: frames on each side of a chunk at the full band.
    landings: largest error (SI) of each order of the time derivatives that a landing may leave.
    finer: largest number of solutions in a landing for each usual one.
    chunk: number of frames that are solved together; `longest` at most, but no shorter than the margins.
    """

    def __init__(
        self,
        heights: Heights,
        scene: Scene,
        mean: Mean,
        rate: int,
        *,
        count: int,
        scale: float,
        stride: int = 1,
        longest: int = MOST_TOGETHER,
        margin: int = MARGIN,
        whole: bool = False,
        landings: Mapping[int, float] = MappingProxyType({}),
        finer: int = 1,
    ) -> None:
        self._heights, self._scene, self._whole = heights, scene, whole
        self._scan, self._period = scene.scan, scene.texture.period
        self._landings, self._finer = landings, finer
        self._rate, self._count, self._stride, self._scale = rate, count, stride, scale
        self._motion = ScanMotion(scene, rate * count / stride, whole=whole)
        self._frames = ScanMotion(scene, rate, whole=whole)
        self._margin = -(-math.ceil(margin / scale) // stride) * stride
        room = min(TOGETHER * stride // count - 2 * self._margin, longest)
        self._parts = max(2, min(room, max(CHUNK, 4 * self._margin)) // self._margin)
        self.chunk = self._parts * self._margin
        self._mean = mean
        self._shared: dict[int, Array] = {}  # parts of a chunk that the next one shares, by number

    @property
    def memory_bytes(self) -> int:
        """Working memory of a chunk with its margins, in bytes."""
        return 8 * 12 * (self._parts + 2) * self._steps

    @property
    def solutions(self) -> int:
        """Number of solutions of a chunk that follows the one before."""
        return self._parts * self._steps

    def solved(self, number: int, orders: tuple[int, ...]) -> Array:
        """Return the frames of chunk `number`: the time derivative of each of `orders`, SI, float64 [orders, chunk].

        The order WITH_MEAN is z itself, with its mean.
        """
        return self.solved_with_error(number, orders)[0]

    def solved_with_error(self, number: int, orders: tuple[int, ...]) -> tuple[Array, Array]:
        """Return the frames as `solved` does, and the error (SI) of each of `landings` by the landings of the chunk."""
        rows, left, _landed = self._landed(number)
        return self._quantities(rows, orders) * self._touching(number), left

    def folded(self, number: int, orders: tuple[int, ...]) -> tuple[Array, Array, Array]:
        """Return the frames of a chunk from half of its solutions, and the error (SI) of each order that this leaves.

        The first error is the change by the other half, the second that of the landings. In a landing both have the
        same solutions, since there are as many as it requires. The count must be even.
        """
        rows, left, landed = self._landed(number)
        weights = low_pass(2, 2.0 * self._top)
        windowed = np.lib.stride_tricks.sliding_window_view(rows, len(weights), axis=1)[:, ::2]
        half, first = rows[:, ::2].copy(), len(weights) // 4
        inner = half[:, first : first + windowed.shape[1]]
        inner[:] = np.where(landed[::2][first : first + windowed.shape[1]], windowed @ weights, inner)
        few, many = (self._quantities(some, orders) * self._touching(number) for some in (half, rows))
        return few, np.max(np.abs(many - few), axis=1), left

    def _touching(self, number: int) -> Array:
        """Return whether the finger touches, at each frame of a chunk."""
        return np.asarray(self._frames.at(number * self.chunk, self.chunk).samples[LOAD] > 0.0)

    @property
    def _top(self) -> float:
        """Highest frequency that counts, cycles per usual step."""
        return REMOVED * self._scale * self._stride / self._count

    def _landed(self, number: int) -> tuple[Array, Array, Array]:
        """Return the rows of `_gated` at the usual steps of a chunk with its margins, solved again in its landings.

        The error (SI) of each of `landings` follows, and where landings are [steps].
        """
        *rows, loads = self._solutions(number)
        found, left, landed = np.array(rows), np.zeros(len(self._landings)), np.zeros(len(loads), bool)
        if self._finer == 1:
            return found, left, landed
        parts = windows(loads, self._stride / (self._rate * self._count), 2)
        for first, last in parts:
            landed[first : last + 1] = True
        begin, known = self._first(number), tuple(self._landings)

        def again(first: int, count: int, finer: int) -> Array:
            return self._gated(self._motion_of(finer).at(begin * finer + first, count))

        def quantities(some: Array) -> Array:
            return self._quantities(some, known)

        allowed = np.array(list(self._landings.values()))
        return *solved_again(found, parts, again, quantities, allowed, self._top, self._finer), landed

    def _quantities(self, rows: Array, orders: tuple[int, ...]) -> Array:
        """Return each of `orders` at the frames of a chunk, SI; rows: of `_gated`."""
        frames, own = self.chunk + 2 * self._margin, slice(self._margin, self._margin + self.chunk)
        value, mean = rows
        return np.array([
            self._limited(value + mean if order == WITH_MEAN else value, frames, max(order, 0))[own]
            for order in orders
        ])  # fmt: skip

    def _first(self, number: int) -> int:
        """Return the first usual step of chunk `number`, with its margins."""
        return (number * self.chunk - self._margin) // self._stride * self._count

    @property
    def _steps(self) -> int:
        """Usual steps of a part, which is as long as a margin."""
        return self._margin // self._stride * self._count

    def _solutions(self, number: int) -> Array:
        """Return both rows of `_gated`, and the load (N), at the usual steps of a chunk with its margins [3, steps].

        It is solved part by part, so that a chunk need not solve again what it shares with the one before, and is the
        same in any order.
        """
        first = number * self._parts - 1
        parts = {one: self._part(one) for one in range(first, first + self._parts + 2)}
        self._shared = {one: parts[one] for one in (first + self._parts, first + self._parts + 1)}
        return np.concatenate(list(parts.values()), axis=1)

    def _part(self, number: int) -> Array:
        """Return the rows of `_solutions` of one part."""
        if number in self._shared:
            return self._shared[number]
        motion = self._motion.at(number * self._steps, self._steps)
        return np.vstack([self._gated(motion), motion.samples[LOAD]])

    def _motion_of(self, finer: int) -> ScanMotion:
        """Return the motion at `finer` times the usual steps."""
        rate = self._rate * self._count * finer / self._stride
        return self._motion if finer == 1 else ScanMotion(self._scene, rate, whole=self._whole)

    def _gated(self, motion: Motion) -> Array:
        """Return y and the mean that is subtracted from z (both m, gated), at each step of a motion [2, steps]."""
        theta, loads, path = motion.position / self._period, motion.samples[LOAD], motion.path
        rows = np.zeros((2, len(loads)))
        touching = np.flatnonzero(loads > 0.0)
        if len(touching):
            some = loads[touching]
            along = (path[:, touching],) if path.size else ()
            height = self._heights(theta[touching], some, *along)
            faded, mean = gates(some, self._scan.lift_load), self._mean(np.cbrt(some))
            rows[:, touching] = faded * (height - mean), faded * mean
        return rows

    def _limited(self, value: Array, frames: int, order: int) -> Array:
        """Return the time derivative of `value`, of order `order`, band-limited, at the frames.

        A straight line from end to end is subtracted first and added back at the end, so that the ends meet.
        """
        from scipy.special import erfc

        rise = (value[-1] - value[0]) / (len(value) - 1)
        spectrum = np.fft.rfft(value - (value[0] + rise * np.arange(len(value)))) * (frames / len(value))
        spectrum = spectrum[: frames // 2 + 1]
        cycles = np.arange(len(spectrum)) / frames
        half, width = edge_of(self._scale)
        gain = 0.5 * erfc((cycles - half) / width)
        spectrum *= gain * (2j * math.pi * self._rate * cycles) ** order
        found = np.fft.irfft(spectrum, frames)
        rise *= len(value) / frames
        if order == 0:
            found += value[0] + rise * np.arange(frames)
        elif order == 1:
            found += rise * self._rate
        return np.asarray(found)


class Chunks:
    """The chunks of `solve`, each of `chunk` frames."""

    def __init__(self, solve: Solve, chunk: int) -> None:
        self._solve, self._chunk = solve, chunk
        self._number = -1
        self._kept: Any = None

    def read(self, first: int, out: Any) -> None:
        """Write the frames from `first` on to `out`: [frames, channels], or [frames]."""
        done = 0
        while done < len(out):
            number, place = divmod(first + done, self._chunk)
            if self._kept is None or self._number != number:
                self._number, self._kept = number, self._solve(number)
            part = self._kept[place : place + len(out) - done]
            out[done : done + len(part)] = part
            done += len(part)
