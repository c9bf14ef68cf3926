"""The motion of a scene's own scan, at any frame.

Model   Constant scan: p = u t. Stroke: see `stroke_motion`. Trajectory: the curves of `recorded_motion`. Over an area
        the surface moves by p along a line at the angle `heading`, or along the recorded places. Before the first and
        after the last point of a trajectory, the position continues in a straight line and the load stays. Where the
        output lasts longer than the trajectory, the load falls to zero within LIFT_TIME after the last point.
        Where an effect moves the skin, the motion is that of the skin (`moved_skin`).
Source  design, section 4.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from synth.arrays import Array
from synth.motion.motion import ACROSS, DIRECTION, LOAD, LOAD_BEND, LOAD_RATE, NO_PATH, SPEED, SPEED_RATE, Motion
from synth.motion.moved_skin import LOOKED, SETTLING, SkinAlongScan, mover_of
from synth.motion.recorded_motion import Curve, RecordedMotion
from synth.scene.line_scan import as_written
from synth.scene.scene import Scene

LIFT_TIME = 0.02  # s, duration of lifting after a trajectory; a shorter one clicks


class ScanMotion:
    """The motion of a scene's scan at any frame.

    rate: frames per second; by default that of the output.
    whole: for a voice that may play longer than `output.duration`, and lifts in any case.
    hand: whether it is the motion of the hand, also where an effect moves the skin otherwise.
    duration: time at which a recording ends, s; infinite for any other scan.
    lifts: whether the finger lifts after a recording.
    moved: whether the skin does not move with the hand.
    """

    def __init__(self, scene: Scene, rate: float | None = None, *, whole: bool = False, hand: bool = False) -> None:
        self.rate = float(rate or scene.output.sample_rate)
        self.scan = scene.scan
        recorded = scene.scan.trajectory is not None
        self._recorded = RecordedMotion.of(scene) if recorded else None
        self._stroke: Callable[..., Motion] | None = None
        if scene.scan.stroke is not None:  # only a stroke imports the module
            from synth.motion.stroke_motion import stroke_motion

            self._stroke = stroke_motion
        self.duration = np.inf if self._recorded is None else self._recorded.end
        self.lifts = recorded and (whole or scene.output.duration > self.duration + 0.5 / scene.output.sample_rate)
        self._frames = scene.output.sample_rate
        self._skin: SkinAlongScan | None = None
        mover = None if hand else mover_of(scene)
        if mover is not None:
            led = ScanMotion(as_written(scene), self._frames, whole=whole, hand=True)
            settling = LIFT_TIME if recorded else 0.0 if self._stroke is not None else SETTLING
            self._skin = SkinAlongScan(mover, led.at, led.rate, settling)
        self.moved = mover is not None

    def at(self, first: int, frames: int) -> Motion:
        """Return the motion of `frames` frames from frame `first`; frame n is at t = n / rate."""
        hand = self.of_hand(first, frames)
        if self._skin is None or not frames:
            return hand
        return self._skin.at(hand, np.arange(first, first + frames) * (self._frames / self.rate))

    def of_hand(self, first: int, frames: int) -> Motion:
        """Return the motion of the hand, as `at` does."""
        if self._stroke is not None:
            return self._on_line(self._stroke(self.scan.stroke, first, frames, self.rate))
        t = np.arange(first, first + frames) / self.rate
        if self._recorded is not None:
            return self._on_line(self._along(self._recorded, t))
        constant = np.zeros((5, frames))
        constant[SPEED], constant[LOAD] = self.scan.speed, self.scan.load
        return self._on_line(Motion(constant, self.scan.speed * t))

    def _on_line(self, motion: Motion) -> Motion:
        """Return a motion along x as one along the line of the scan."""
        scan = self.scan
        if scan.heading == 0.0:
            return motion
        path = np.empty((2, motion.frames))
        path[ACROSS] = motion.position * math.sin(scan.heading) - scan.y
        path[DIRECTION] = scan.direction
        return Motion(motion.samples, motion.position * math.cos(scan.heading), path)

    def load_range(self) -> tuple[float, float]:
        """Return the smallest and largest load (N) of the scan."""
        low, high = self.recorded_loads()
        return (min(0.0, low), high) if self.lifts else (low, high)

    def recorded_loads(self) -> tuple[float, float]:
        """Return the smallest and largest load (N) between the ends of the scan, without the lift."""
        if self._recorded is not None:
            return self._recorded.loads
        load = self.scan.stroke.load if self.scan.stroke is not None else self.scan.load
        return load, load

    def fastest(self) -> float:
        """Return the largest absolute speed (m/s) of the scan: that of the skin, where it was looked for, if higher."""
        fastest = abs(self.scan.speed) if self._recorded is None else self._recorded.fastest()
        if self._skin is None:
            return fastest
        return max(fastest, self._skin.fastest(self.looked))

    @property
    def looked(self) -> float:
        """Time of the scan that is looked at for its extremes, s."""
        lasting = LOOKED if self.scan.stroke is None else self.scan.stroke.period
        return lasting if self._recorded is None else self.duration

    def warnings(self) -> tuple[str, ...]:
        """Return the warnings about changes to the recorded points."""
        return () if self._recorded is None else self._recorded.warnings

    def _along(self, recorded: RecordedMotion, t: Array) -> Motion:
        """Return a recorded motion at the times `t` (s)."""
        samples = np.zeros((5, len(t)))
        on = recorded.place.within(t)
        samples[SPEED], samples[SPEED_RATE] = recorded.place.slope(on), recorded.place.bend(on)
        places, path = recorded.place.value(on) + samples[SPEED] * (t - on), NO_PATH
        if recorded.area is not None:
            path = self._over_area(recorded.area, samples, t, on)
        on = recorded.load.within(t)
        value = np.clip(recorded.load.value(on), *recorded.loads)  # only rounding can exceed this range
        slope, bend = recorded.load.slope(on), recorded.load.bend(on)
        beyond = np.maximum(t - on, 0.0) if self.lifts else np.zeros(len(t))
        s = 1.0 - np.minimum(np.abs(beyond) / LIFT_TIME, 1.0)
        ds = -np.sign(beyond) / LIFT_TIME * (s > 0.0) * (s < 1.0)
        window = s**3 * (10.0 + s * (6.0 * s - 15.0))
        first = 30.0 * (s * (1.0 - s)) ** 2 * ds
        second = 60.0 * s * (1.0 - s) * (1.0 - 2.0 * s) * ds**2
        samples[LOAD] = value * window
        samples[LOAD_RATE] = slope * window + value * first
        samples[LOAD_BEND] = bend * window + 2.0 * slope * first + value * second
        return Motion(samples, places, path)

    def _over_area(self, area: tuple[Curve, Curve], samples: Array, t: Array, on: Array) -> Array:
        """Return the path of a recorded motion, and change the speed in `samples` to that along the path.

        samples: with the speed along x and its rate.
        on: `t` (s), limited to the recording. Beyond it the finger continues straight and does not turn.
        """
        across, direction = area
        speed, bend = across.slope(on), across.bend(on)
        along = np.hypot(samples[SPEED], speed)
        pull = samples[SPEED] * samples[SPEED_RATE] + speed * bend
        samples[SPEED], samples[SPEED_RATE] = along, np.divide(pull, along, out=np.zeros_like(pull), where=along > 0.0)
        return np.stack([across.value(on) + speed * (t - on), direction.value(on)])
