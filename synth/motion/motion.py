"""Where the finger is and how hard it presses, at every frame: from a scan, or from a hand.

Model   A motion holds, at each frame, speed u, du/dt, load w, dw/dt, d2w/dt2, and, where it is known, the position p.
        Constant: p = u t. Stroke: cruise at u between turns in which the velocity goes from u to -u as u (1 - 2 S(s)),
        S = 3 s^2 - 2 s^3. Trajectory: the curves of `recorded_motion`, which stay between the recorded points; before
        the first and after the last point the position goes on in a straight line and the finger lifts within
        LIFT_TIME.
Source  design, section 4.
Limits  a motion that gives no derivatives has them taken from the frame before (first order).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from synth.arrays import Array
from synth.kernels import signed_kernel, two_product
from synth.motion.recorded_motion import RecordedMotion
from synth.scene.scan_section import TURN_REACH
from synth.scene.scene import Scene, Stroke

LARGEST_LOAD = 1e3  # N: the end of the scene's range, which a hand may ask to pass
LIFT_TIME = 0.02  # s in which the finger comes down before a trajectory and leaves after it; shorter would click
SPEED, SPEED_RATE, LOAD, LOAD_RATE, LOAD_BEND = range(5)
NOWHERE: Array = np.empty(0)


@dataclass(frozen=True, slots=True)
class Motion:
    """What the hand does in a block.

    samples: float64 [5, frames]: speed (m/s), its rate (m/s^2), load (N), its rate (N/s) and second rate (N/s^2).
    position: float64 [frames] in metres, or empty where the speed alone is known: the phase then follows from the
    speed.
    complete: the derivatives are given; otherwise a voice takes them from the frame before.
    """

    samples: Array
    position: Array = field(default_factory=lambda: NOWHERE)
    complete: bool = True

    @property
    def frames(self) -> int:
        """Number of frames."""
        return int(self.samples.shape[1])

    @classmethod
    def of(
        cls,
        frames: int,
        *,
        load: Any,
        speed: Any = None,
        position: Any = None,
        speed_rate: Any = None,
        load_rate: Any = None,
        load_bend: Any = None,
        pulls: Any = False,
    ) -> Motion:
        """Return a motion from numbers or arrays of `frames` values in SI units.

        Give `speed` or `position` (or both, if they agree) and `load`; `speed_rate`, `load_rate` and `load_bend` are
        their time derivatives. pulls: loads below 0 are kept, for a voice with adhesion; otherwise they are no load.
        Raises ValueError where neither speed nor position is there, or a value is not finite.
        """
        if speed is None and position is None:
            raise ValueError("a motion needs speed=... (m/s) or position=... (m), a number or one value a frame")
        complete = all(given is not None for given in (speed, speed_rate, load_rate, load_bend))
        samples = np.zeros((5, frames))
        for row, values in enumerate((speed, speed_rate, load, load_rate, load_bend)):
            if values is not None:
                samples[row] = values
        places = NOWHERE if position is None else np.array(np.broadcast_to(position, frames), dtype=float)
        if not (np.isfinite(samples).all() and np.isfinite(places).all()):
            raise ValueError("a motion is made of finite numbers: speed and position in m, load in N")
        samples[LOAD] = np.clip(samples[LOAD], -LARGEST_LOAD if pulls else 0.0, LARGEST_LOAD)
        return cls(samples, places, complete)


class ScanMotion:
    """The motion of a scene's scan at any frame; rate: frames a second, those of the output unless given."""

    def __init__(self, scene: Scene, rate: float | None = None) -> None:
        self.rate = float(rate or scene.output.sample_rate)
        self.scan = scene.scan
        self._recorded = RecordedMotion.of(scene) if scene.scan.trajectory is not None else None

    def at(self, first: int, frames: int) -> Motion:
        """Return the motion of `frames` frames from frame `first` on; frame n is at t = n / rate."""
        if self.scan.stroke is not None:
            return stroke_motion(self.scan.stroke, first, frames, self.rate)
        t = np.arange(first, first + frames) / self.rate
        if self._recorded is not None:
            return self._along(self._recorded, t)
        constant = np.zeros((5, frames))
        constant[SPEED], constant[LOAD] = self.scan.speed, self.scan.load
        return Motion(constant, self.scan.speed * t)

    def load_range(self) -> tuple[float, float]:
        """Return the smallest and largest load (N) of the scan."""
        low, high = self.recorded_loads()
        return (low, high) if low == high and self.start <= 0.0 else (min(0.0, low), high)

    def recorded_loads(self) -> tuple[float, float]:
        """Return the smallest and largest load (N) between the ends of the scan: without the finger's lift."""
        if self._recorded is not None:
            return self._recorded.loads
        load = self.scan.stroke.load if self.scan.stroke is not None else self.scan.load
        return load, load

    def fastest(self) -> float:
        """Return the largest speed (m/s) of the scan, without its direction."""
        return abs(self.scan.speed) if self._recorded is None else self._recorded.fastest()

    def warnings(self) -> tuple[str, ...]:
        """Return what of a recording is rendered otherwise than it was recorded."""
        return () if self._recorded is None else self._recorded.warnings

    @property
    def start(self) -> float:
        """Time (s) at which the recording begins, 0 for a scan that is none."""
        return 0.0 if self._recorded is None else self._recorded.start

    @property
    def duration(self) -> float:
        """Seconds of the recording, infinite for a scan that never ends."""
        return np.inf if self._recorded is None else self._recorded.end

    def _along(self, recorded: RecordedMotion, t: Array) -> Motion:
        """Return a recorded motion at the times `t` (s)."""
        samples = np.zeros((5, len(t)))
        on = recorded.place.within(t)
        samples[SPEED], samples[SPEED_RATE] = recorded.place.slope(on), recorded.place.bend(on)
        places = recorded.place.value(on) + samples[SPEED] * (t - on)
        on = recorded.load.within(t)
        value = np.clip(recorded.load.value(on), *recorded.loads)  # which only rounding leaves
        slope, bend = recorded.load.slope(on), recorded.load.bend(on)
        beyond = t - on
        s = 1.0 - np.minimum(np.abs(beyond) / LIFT_TIME, 1.0)
        ds = -np.sign(beyond) / LIFT_TIME * (s > 0.0) * (s < 1.0)
        window = s**3 * (10.0 + s * (6.0 * s - 15.0))
        first = 30.0 * (s * (1.0 - s)) ** 2 * ds
        second = 60.0 * s * (1.0 - s) * (1.0 - 2.0 * s) * ds**2
        samples[LOAD] = value * window
        samples[LOAD_RATE] = slope * window + value * first
        samples[LOAD_BEND] = bend * window + 2.0 * slope * first + value * second
        return Motion(samples, places)


def stroke_motion(stroke: Stroke, first: int, frames: int, rate: float) -> Motion:
    """Return the back-and-forth motion of `frames` frames from frame `first` on: at rest at position 0 at t = 0."""
    samples, position = np.zeros((5, frames)), np.empty(frames)
    samples[LOAD] = stroke.load
    fill_stroke(stroke.speed, stroke.turn_time, stroke.cruise_time, first, float(rate), samples, position)
    return Motion(samples, position)


@signed_kernel("void(f8, f8, f8, i8, f8, f8[:,::1], f8[::1])")
def fill_stroke(u: float, turn: float, cruise: float, first: int, rate: float, samples: Array, position: Array) -> None:
    """Write speed and its rate to `samples`, and `position`, of a stroke of speed `u` (m/s), turns and cruise in s."""
    half, reach = cruise + turn, TURN_REACH * u * turn
    half_rest = (cruise - (half - turn)) if cruise < turn else (turn - (half - cruise))
    length = 2.0 * reach + u * cruise
    for i in range(len(position)):
        t = (first + i) / rate
        turned = math.floor(t / half)
        # after hours the roundings of t and of the turns before it are 1e-11 s: they are taken off again
        frames, frames_rest = two_product(t, rate)
        t_rest = ((first + i - frames) - frames_rest) / rate
        before, before_rest = two_product(turned, half)
        local = (t - before) + (t_rest - before_rest - turned * half_rest)
        travel, speed, bend = reach + u * (local - 0.5 * turn), u, 0.0
        if local < 0.5 * turn or local > 0.5 * turn + cruise:
            leaving = local < 0.5 * turn
            s = 0.5 + local / turn if leaving else (local - 0.5 * turn - cruise) / turn
            area = u * turn * (s - 2.0 * s**3 + s**4)
            sign = -1.0 if leaving else 1.0
            travel = reach - area if leaving else reach + u * cruise + area
            speed = sign * u * (1.0 - 6.0 * s**2 + 4.0 * s**3)
            bend = sign * u * 12.0 * s * (s - 1.0) / turn
        back = turned % 2.0 != 0.0
        samples[SPEED, i], samples[SPEED_RATE, i] = (-speed, -bend) if back else (speed, bend)
        position[i] = length - travel if back else travel


def completed(motion: Motion, rate: int, before: Array) -> Motion:
    """Return `motion` with the derivatives that it lacks taken from the frame before.

    before: float64 [4], position (m), speed (m/s), load (N), load rate (N/s) of the last frame, NaN where it is not
    known; it is brought up to date. A derivative is 0 until the frames that it needs are known.
    """
    samples = motion.samples.copy()
    if len(motion.position):
        samples[0] = _rate_of(motion.position, before[0], rate)
        before[0] = motion.position[-1]
    samples[1] = _rate_of(samples[0], before[1], rate)
    samples[3] = _rate_of(samples[2], before[2], rate)
    samples[4] = _rate_of(samples[3], before[3], rate)
    before[1], before[2], before[3] = samples[0, -1], samples[2, -1], samples[3, -1]
    return Motion(np.nan_to_num(samples, copy=False), motion.position, True)


def _rate_of(values: Array, before: float, rate: int) -> Array:
    """Return the change from frame to frame, a second; NaN where the frame before is not known."""
    return np.asarray(np.diff(values, prepend=before) * rate)
