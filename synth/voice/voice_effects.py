"""The effects of a voice: its simulation, and the stages that add channels.

Stage   3 (VOICE), loaded by `voice` for a scene with effects.
Model   A simulation that runs step by step fills the channels of z. One that repeats has series,
        which `voice` reads. The stages then write their own channels, in order.
Limits  Frames that follow a hand are `late` by the margin of the simulation's filters.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from synth.arrays import Array, Block
from synth.effects.effect import Passage
from synth.effects.simulation.hand_steps import phases_after
from synth.effects.simulation.running import WHOLE, Running, Signal
from synth.motion.motion import LOAD, Motion
from synth.plan.preparation import Preparation
from synth.response.series_curve import SMALLEST

PACED_SETTLING = 0.05  # s that a stream simulates before its first frame: more would take longer than a block


class VoiceEffects:
    """The running effects of one voice.

    solved: the prepared scene.
    paced: blocks have deadlines, so at most PACED_SETTLING is simulated before the first.
    place: phase of the texture at the next frame of a hand, uint64 [1].
    """

    def __init__(self, solved: Preparation, *, paced: bool) -> None:
        assert solved.effects is not None
        self.solved, self._effects = solved, solved.effects
        self.place = np.zeros(1, dtype=np.uint64)
        self._plan = self._effects.simulation
        self._simulation = None if self._plan is None else self._plan.simulation
        if paced and self._simulation is not None:
            settling = min(self._simulation.settling, PACED_SETTLING)
            self._simulation = replace(self._simulation, settling=settling)
        self._running = self._run_from(0)
        self._stages = [(stage, stage.start(0)) for stage in self._effects.stages]

    def _run_from(self, phase: int) -> Running | None:
        if self._simulation is None:
            return None
        wanted = tuple(signal for stage in self._effects.stages for signal in stage.signals)
        return Running(self._simulation, (*self._own, *wanted), phase) if self._own or wanted else None

    @property
    def _own(self) -> tuple[Signal, ...]:
        """The signals of the channels of z, if they are simulated step by step."""
        if self._plan is None or not self.solved.stepped:
            return ()
        asked = any(channel.is_approach for channel in self.solved.channels)
        return (*self._plan.signals, *((Signal(WHOLE, 0),) if asked else ()))

    def begin_at(self, phase: int) -> None:
        """Set the phase of the texture at frame 0, before the first block."""
        self.place[0] = phase
        self._running = self._run_from(phase)
        for stage, state in self._stages:
            stage.begin_at(state, phase)

    @property
    def late(self) -> int:
        """Frames by which the output is behind the motion of a hand."""
        simulated = 0 if self._running is None else self._running.margin
        return max([simulated, *(stage.delay(state) for stage, state in self._stages)])

    def along(self, frame: int, phase: int, step: int, motion: Motion | None, out: Block) -> None:
        """Apply the effects to a block of the scan's own motion, from `frame` on.

        phase, step: of a constant scan: phase at the first frame, turns per frame.
        motion: of a varying scan.
        """
        rows = None
        if self._running is not None:
            rows = self._running.along(frame, len(out))
            if motion is not None and not self._running.simulation.held:
                rows *= motion.samples[LOAD] > 0.0
            self._fill(rows, out)
        self._step(rows, out, 0, frame=frame, phase=phase, step=step, motion=motion, by_hand=False)

    def after(self, motion: Motion, out: Block, late: int) -> None:
        """Apply the effects to a block that follows a hand; late: delay of its channels (frames) if not simulated."""
        scene = self.solved.scene
        phases, place = phases_after(motion, int(self.place[0]), scene.output.sample_rate, scene.texture.period)
        rows = None
        if self._running is not None:
            rows = self._running.after(motion, phases)
            self._fill(rows, out)
        late = late if self._running is None else self._running.margin
        self._step(rows, out, late, frame=0, phase=int(self.place[0]), step=0, motion=motion, by_hand=True)
        self.place[0] = place

    def _fill(self, rows: Array, out: Block) -> None:
        """Write the channels of z that are simulated step by step."""
        if self._plan is None or not self._own:
            return
        for column, channel in enumerate(self.solved.channels):
            row = len(self._plan.orders) if channel.is_approach else self._plan.orders.index(channel.order)
            values = rows[row] / channel.full_scale
            out[:, column] = np.where(np.abs(values) >= SMALLEST, values, 0.0)

    def _step(self, rows: Array | None, out: Block, late: int, **fields: Any) -> None:
        column = len(self.solved.channels)
        row = len(self._own)
        scales = tuple(channel.full_scale for channel in self.solved.channels)
        for stage, state in self._stages:
            signals = None if rows is None else rows[row : row + len(stage.signals)]
            stage.step(state, Passage(signals=signals, late=late, column=column, full_scale=scales, **fields), out)
            column += len(stage.channels)
            row += len(stage.signals)
