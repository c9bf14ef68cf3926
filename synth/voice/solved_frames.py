"""Renders files whose speed or load varies, from the response solved along their scan.

Stage   3 (VOICE); the alternative is `table_reading`.
Model   The chunks of `frame_solver`, divided by the full scale of each channel. Where the search for the full scale has
        solved the whole file, its frames are taken.
Source  design, section 4.
Limits  Those of `frame_solver`.
"""

from __future__ import annotations

import numpy as np

from synth.arrays import Array, Block
from synth.plan.frame_plan import FramePlan
from synth.plan.mean_choice import own_mean
from synth.plan.motion_peak import frames_key, searched_orders
from synth.plan.preparation import Preparation
from synth.response.series_curve import SMALLEST, SeriesCurve
from synth.response_cache import PARTS
from synth.sampling.frame_solver import WITH_MEAN, Chunks, FrameSolver, Heights


class SolvedFrames:
    """Renders the frames of one preparation by solving them, in any order. Only the last chunk is kept.

    plan: how the frames are solved.
    heights: z (m) at places (turns) and loads (N); by default that of the scene, or its series where the load is
        constant.
    chunk: number of frames solved together.
    """

    def __init__(self, solved: Preparation, plan: FramePlan, heights: Heights | None = None) -> None:
        assert solved.contact is not None and solved.spectrum is not None
        self.solved, self.plan = solved, plan
        rate, mean = solved.scene.output.sample_rate, solved.mean
        if mean is None:
            mean = own_mean(solved.steady, solved.contact, solved.tolerance)
        self._kept: Array | None = None
        if heights is None:
            series = solved.reads_series
            self._kept = PARTS.find(frames_key(solved, solved.whole, plan))
            heights = SeriesCurve(solved.spectrum.harmonics).heights if series else solved.whole.heights
        self._solver = FrameSolver(
            heights, solved.scene, mean, rate, count=plan.count, stride=plan.stride, scale=plan.scale,
            landings=plan.landings(solved.orders), finer=plan.finer,
            longest=max(1, round(solved.scene.output.duration * rate)),
        )  # fmt: skip
        self.chunk = self._solver.chunk
        self._chunks = Chunks(self._solved_chunk, self.chunk)

    @property
    def memory_bytes(self) -> int:
        """Working memory of a chunk in bytes."""
        return self._solver.memory_bytes

    @property
    def solutions(self) -> int:
        """Number of solutions of a chunk, without those of landings."""
        return self._solver.solutions

    def read(self, first: int, out: Block) -> None:
        """Write the frames from `first` on to `out`, float32 [frames, channels], value / full_scale."""
        self._chunks.read(first, out)

    def _solved_chunk(self, number: int) -> Block:
        orders = tuple(WITH_MEAN if channel.is_approach else channel.order for channel in self.solved.channels)
        own = slice(number * self.chunk, (number + 1) * self.chunk)
        if self._kept is not None and own.stop <= self._kept.shape[1]:
            known = searched_orders(self.solved)
            found = self._kept[[known.index(order) for order in orders], own]
        else:
            found = self._solver.solved(number, orders)
        found = found.T / [channel.full_scale for channel in self.solved.channels]
        return np.where(np.abs(found) >= SMALLEST, found, 0.0).astype(np.float32)
