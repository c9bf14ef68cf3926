"""The response solved at every frame, oversampled: no table and no rows, for recordings whose load varies.

Stage   3 (VOICE), beside `moving`; `frame_plan` is its part of stage 2.
Model   y = g(w) (z(p / lambda2, w) - mean of z over a period at w) is solved at the times of a multiple of the frame
        rate. The band limit, the derivatives and the step down to the frame rate are one product in the frequency
        domain: (2 pi i f)^k / 2 erfc((f - CUT rate) / (WIDTH rate)), chunk by chunk, with margins on both sides that
        are longer than the filter rings. The mean over a period is a spline over w^(1/3), in which it is smooth.
Source  design, section 4; eq. 1 (Fagiani & Barbieri, 2016) is solved by `contact.exact`.
Limits  up to 0.40 of the rate the filter is 1 to 1e-9, above 0.49 below 1e-9 (in parts of the bandwidth where that is
        narrower). What folds is held by the phases a period that steady series of the recorded loads take for the
        tolerance. Costs a solution an oversampled frame: tens of microseconds.
"""

from __future__ import annotations

import math

import numpy as np

from synth.contact.evaluation import SMALLEST
from synth.contact.exact import Array
from synth.contact.mean import mean_curve
from synth.frame_plan import MARGIN, FramePlan
from synth.motion import LOAD, ScanMotion
from synth.output import Block
from synth.preparation import Preparation

CUT, WIDTH = 0.445, 0.0105  # of the rate: half amplitude, and how steeply; 0.045 beside the cut 1e-9 is left
CHUNK = 4096  # frames of a chunk, where the filter does not ring for long
TOGETHER = 1 << 21  # solutions of a chunk and its margins at most: 200 MB of working memory; more where margins need it


class SolvedFrames:
    """Renders frames of one preparation by solving them; any frame, in any order.

    plan: how. Nothing but the last chunk is kept, so a voice may seek. chunk: frames that are solved together.
    """

    def __init__(self, solved: Preparation, plan: FramePlan) -> None:
        assert solved.contact is not None and solved.spectrum is not None
        self.solved, self.plan = solved, plan
        self._contact, self._scan = solved.contact, solved.scene.scan
        self._rate = solved.scene.output.sample_rate
        self._motion = ScanMotion(solved.scene, self._rate * plan.oversampling)
        self._margin = math.ceil(MARGIN / plan.scale)
        room = TOGETHER // plan.oversampling - 2 * self._margin
        self.chunk = max(2 * self._margin, min(room, max(CHUNK, 4 * self._margin)))
        loads = self._motion.load_range()
        self._mean = mean_curve(solved.contact, loads, self._scan.load, solved.tolerance)
        self._kept: tuple[int, Block] = (-1, np.empty((0, 0), np.float32))

    @property
    def memory_bytes(self) -> int:
        """Bytes of the working memory of a chunk."""
        return 8 * 12 * (self.chunk + 2 * self._margin) * self.plan.oversampling

    def read(self, first: int, out: Block) -> None:
        """Write the frames from `first` on to `out`, float32 [frames, channels], value / full_scale."""
        done = 0
        while done < len(out):
            number, place = divmod(first + done, self.chunk)
            if self._kept[0] != number:
                self._kept = number, self._solved_chunk(number)
            part = self._kept[1][place : place + len(out) - done]
            out[done : done + len(part)] = part
            done += len(part)

    def forget(self) -> None:
        """Keep no chunk: the next frames are solved, whatever was."""
        self._kept = (-1, self._kept[1])

    def _solved_chunk(self, number: int) -> Block:
        count, frames = self.plan.oversampling, self.chunk + 2 * self._margin
        first = number * self.chunk - self._margin
        motion = self._motion.at(first * count, frames * count)
        loads = motion.samples[LOAD]
        value = self._gated(motion.position / self.solved.scene.texture.period, loads)
        own = slice(self._margin, self._margin + self.chunk)
        touching = loads[::count][own] > 0.0
        block = np.empty((self.chunk, len(self.solved.channels)), np.float32)
        for column, channel in enumerate(self.solved.channels):
            found = self._limited(value, frames, channel.order)[own] * touching / channel.full_scale
            block[:, column] = np.where(np.abs(found) >= SMALLEST, found, 0.0)
        return block

    def _gated(self, theta: Array, loads: Array) -> Array:
        """Return y (m) at each phase (turns) and load (N)."""
        value = np.zeros_like(loads)
        touching = np.flatnonzero(loads > 0.0)
        if len(touching):
            some = loads[touching]
            height = self._contact.heights(theta[touching], some)
            s = np.minimum(some / self._scan.lift_load, 1.0)
            value[touching] = s**3 * (10.0 + s * (6.0 * s - 15.0)) * (height - self._mean(np.cbrt(some)))
        return value

    def _limited(self, value: Array, frames: int, order: int) -> Array:
        """Return the derivative of `order` of `value`, band-limited, at the frames.

        A straight line from end to end is taken out first and put back: without it the ends would not meet.
        """
        from scipy.special import erfc

        rise = (value[-1] - value[0]) / (len(value) - 1)
        line = value[0] + rise * np.arange(len(value))
        spectrum = np.fft.rfft(value - line)[: frames // 2 + 1] / self.plan.oversampling
        cycles = np.arange(frames // 2 + 1) / frames
        width = WIDTH * self.plan.scale
        gain = 0.5 * erfc((cycles - CUT * self.plan.scale) / width)
        spectrum *= gain * (2j * math.pi * self._rate * cycles) ** order
        found = np.fft.irfft(spectrum, frames)
        if order == 0:
            found += line[:: self.plan.oversampling]
        elif order == 1:
            found += rise * self._rate * self.plan.oversampling
        return np.asarray(found)
