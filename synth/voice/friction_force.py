"""The channels of the force of friction, where an effect moves the skin in place of the hand.

Stage   3 (VOICE), used by effects of kind MOTION.
Model   The force that moves the skin comes with its motion (`Motion.force`). Where "auto" leaves the effect out, the
        skin moves with the hand, and the force is that of sliding, mu(u) w tanh(u / (SMALL v_s)).
        Behind a hand it is delayed as the channels of z are.
        The direction of friction, also in `tangential_force`, is tanh(|u| / u0) u / |u|, with the velocity u of the
        surface under the finger. Along a path u is the difference of the places before and after a frame.
Limits  It is not limited to the band: a slip has steps in its slope. Near a stop the direction turns round within u0.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from synth.arrays import Array, Block
from synth.effects.effect import AddedChannel, Passage
from synth.effects.simulation.running import Signal
from synth.motion.motion import ACROSS, LOAD, SPEED, Motion
from synth.motion.scan_motion import ScanMotion
from synth.plan.channels import PEAK, ROUNDING
from synth.plan.motion_peak import MOST_FRAMES, TOGETHER
from synth.plan.preparation import Preparation
from synth.response.series_curve import SMALLEST
from synth.scene.line_scan import as_written
from synth.voice.table_reading import delayed

LATE = 0.1  # of the peak-to-peak: smaller errors, of the moments of slips, cause no warning (unverified default)
SMALL = 0.1  # of v_s: speed within which the force of sliding changes its sign; at once, it would click


def along_scan(own: ScanMotion, first: int, frames: int) -> Array:
    """Return the speed of the surface along x and y (m/s) at each frame of the scan itself [2, frames]."""
    motion = own.at(first - 1, frames + 2)
    if not motion.path.size:
        return np.stack([motion.samples[SPEED, 1:-1], np.zeros(frames)])
    places = np.stack([motion.position, motion.path[ACROSS]])
    return np.asarray((places[:, 2:] - places[:, :-2]) * (0.5 * own.rate))


def after_hand(motion: Motion, before: Array | None, rate: float) -> tuple[Array, Array | None]:
    """Return the speed of the surface along x and y (m/s) under a hand [2, frames], and its last place (m) on a path.

    before: the place at the frame before the first [2, 1]; None if it is unknown.
    """
    if not motion.path.size or not len(motion.position):
        return np.stack([motion.samples[SPEED], np.zeros(motion.frames)]), before
    places = np.stack([motion.position, motion.path[ACROSS]])
    first = places[:, :1] if before is None else before
    return np.asarray(np.diff(places, axis=1, prepend=first) * rate), places[:, -1:]


def directed(speeds: Array, reversal: float) -> Array:
    """Return the direction of friction at each of `speeds` [2, frames]: of length 1 but where it turns round.

    reversal: u0, m/s.
    """
    size = np.hypot(*speeds)
    return np.asarray(speeds * np.divide(np.tanh(size / reversal), size, out=np.zeros_like(size), where=size > 0.0))


def own_direction(scene: Any, law: Any) -> Array:
    """Return the direction of friction at the scan's own speed [2]."""
    scan = as_written(scene).scan
    speeds = scan.speed * np.array([[math.cos(scan.heading)], [math.sin(scan.heading)]])
    return directed(speeds, law.reversal_speed)[:, 0]


@dataclass(slots=True)
class FrictionState:
    """The state of a voice: the forces of the last frames of a hand [axes, frames], and its last place [2]."""

    past: Array | None = None
    place: Array | None = None


@dataclass(frozen=True, slots=True)
class FrictionStage:
    """The effect prepared for one scene; frozen.

    own: motion of the scan.
    law: mu_s, mu_d and v_s (m/s).
    given: whether the scene sets the full scale.
    channels: the channels that it adds.
    """

    own: ScanMotion
    law: tuple[float, float, float]
    given: bool
    channels: tuple[AddedChannel, ...]

    @property
    def signals(self) -> tuple[Signal, ...]:
        """See `OutputStage`."""
        return ()

    @classmethod
    def of(
        cls,
        solved: Preparation,
        law: tuple[float, float, float],
        rise: float,
        scales: tuple[float | None, ...],
        quantities: tuple[str, ...],
        found: tuple[float, float],
    ) -> FrictionStage:
        """Return the stage of a prepared scene.

        rise: largest factor on friction by the state of the contact.
        scales: full scale of each channel, SI or None.
        found: peak-to-peak of the force at the scan's own speed and load (N), and its error relative to that.
        """
        own = ScanMotion(as_written(solved.scene), whole=solved.live)
        load = max(solved.scene.scan.load if solved.by_hand else own.recorded_loads()[1], 0.0)
        slips, scan = rise * law[0] * load, solved.scene.scan
        method = "motion of the skin" if own.moved else "sliding"
        channels = tuple(
            AddedChannel(quantity, scale or 1.0, found[0], found[1] + ROUNDING, method, LATE)
            for quantity, scale in zip(quantities, scales, strict=False)
        )
        stage = cls(own, law, scales[0] is not None, channels)
        if not solved.by_hand:
            forces = stage.along(math.inf if solved.live else solved.scene.output.duration)
            # a stiff damper of the bristle adds to the force at which it slips
            slips = max(slips, float(np.max(np.hypot.reduce(forces))))
            if scan.stroke is not None or scan.trajectory is not None:
                channels = tuple(map(_as_moved, channels, np.ptp(forces, axis=1).tolist()))
        if scales[0] is None:
            channels = tuple(replace(one, full_scale=slips / PEAK if slips > 0.0 else 1.0) for one in channels)
        return replace(stage, channels=channels)

    def along(self, seconds: float) -> Array:
        """Return the force (N) along the scan's own motion, as far as it is looked at [axes, frames]."""
        frames = max(1, min(math.ceil(min(seconds, self.own.looked) * self.own.rate), MOST_FRAMES))
        state, found = FrictionState(), np.zeros((len(self.channels), frames))
        for first in range(0, frames, TOGETHER):
            part = found[:, first : first + TOGETHER]
            motion = self.own.at(first, part.shape[1])
            passage = Passage(first, 0, 0, motion, False, None, 0, 0, ())
            force = self._force(state, passage, motion.frames)[: len(part)]
            part[: len(force)] = force
        return found

    def louder(self, times: float, moved: tuple[float, ...]) -> FrictionStage:
        """See `OutputStage`."""
        if self.given:
            return self
        return replace(self, channels=tuple(replace(one, full_scale=one.full_scale * times) for one in self.channels))

    def start(self, phase: int) -> FrictionState:
        """See `OutputStage`."""
        return FrictionState()

    def begin_at(self, state: FrictionState, phase: int) -> None:
        """See `OutputStage`."""

    def delay(self, state: FrictionState) -> int:
        """See `OutputStage`."""
        return 0

    def step(self, state: FrictionState, passage: Passage, block: Block) -> None:
        """See `OutputStage`."""
        rows = np.zeros((len(self.channels), len(block)))
        force = self._force(state, passage, len(block))[: len(rows)]
        rows[: len(force)] = force
        if passage.late:
            if state.past is None:
                state.past = np.repeat(rows[:, :1], passage.late, axis=1)
            rows = delayed(rows, state.past)
        for column, (row, channel) in enumerate(zip(rows, self.channels, strict=True), passage.column):
            values = row / channel.full_scale
            block[:, column] = np.where(np.abs(values) >= SMALLEST, values, 0.0)

    def _force(self, state: FrictionState, passage: Passage, frames: int) -> Array:
        """Return the force (N) along x, and across where it is known [axes, frames]."""
        motion = passage.motion
        if motion is not None and motion.force.size:
            return motion.force
        if passage.by_hand:
            assert motion is not None
            speeds, state.place = after_hand(motion, state.place, self.own.rate)
        else:
            speeds, motion = along_scan(self.own, passage.frame, frames), self.own.at(passage.frame, frames)
        static, kinetic, slow = self.law
        size = kinetic + (static - kinetic) * np.exp(-np.sum(speeds**2, axis=0) / slow**2)
        return np.asarray(size * np.maximum(motion.samples[LOAD], 0.0) * directed(speeds, SMALL * slow))


def _as_moved(channel: AddedChannel, extent: float) -> AddedChannel:
    """Return a channel with the peak-to-peak `extent` (N) of its own motion, to which its error is relative."""
    if extent == 0.0:
        return channel
    part = min(channel.extent / extent, 1.0) if channel.extent > 0.0 else 1.0
    return replace(channel, extent=extent, error=channel.error * part)
