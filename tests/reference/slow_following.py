"""A remote hand, followed one frame at a time in plain Python: the twin of the engine's closed forms.

Model   The error e of the position about its line obeys (d/dt + k)^3 e = 0; the exponential of the companion matrix
        advances it by a frame. A glide does the same with (d/dt + k)^2 of the speed. The load is the requested load
        after three equal first-order low passes. `numpy.polyfit` fits the line.
Source  docs/live-motion.md.
Limits  float64. The engine's curves end where e is below 1e-13, which is below the differences compared here.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from statistics import median_high

import numpy as np
import numpy.typing as npt
from scipy.linalg import expm

Real = npt.NDArray[np.float64]
Frame = tuple[float, float, float, float, float, float]


@dataclass(frozen=True)
class Numbers:
    """The constants of the engine: s, 1/s, m/s, and counts."""

    delay: float
    load_decay: float
    tightness: float
    quickest: float
    slowest: float
    horizon: float
    spare: float
    leap_speed: float
    least_leap: float
    catch_up: float
    faster: float
    least_catch_up: float
    kept: int
    changed: int
    paced: int
    window: float
    shortest_span: float
    pause: float
    longest_stall: float
    first_interval: float
    creep: float
    back: float
    haste: float
    hurry: float
    latest: float
    fastest: float
    settled: float
    largest_load: float


@dataclass
class SlowFollower:
    """A hand. `apply` and `release` take effect at the next `step`, which returns one frame."""

    rate: float
    numbers: Numbers
    lowest: float = 0.0
    frame: int = 0
    place: Real = field(default_factory=lambda: np.zeros(3))
    line: tuple[float, float] = (0.0, 0.0)  # level at the last frame, slope
    steps: Real = field(default_factory=lambda: np.eye(3))
    stages: list[float] = field(default_factory=lambda: [0.0, 0.0, 0.0])
    asked: float = 0.0
    goal: float = 0.0
    going: int = 1 << 60  # frames since the last change of the target load
    gives: str = ""
    until: float = math.inf
    found: int = -1
    points: list[tuple[float, float]] = field(default_factory=list)
    lateness: list[float] = field(default_factory=list)
    intervals: list[float] = field(default_factory=list)
    clock: float = 0.0
    time: float | None = None
    slope: float = 0.0

    def begin(self, position: float, speed: float, load: float) -> None:
        """Begin with a hand that already moves at this speed and load."""
        self.asked = self.goal = min(max(load, self.lowest), self.numbers.largest_load)
        self.stages = [self.goal] * 3
        self._stand(position - speed / self.rate, speed)
        self.gives, self.until, self.found, self.time, self.slope = "position", math.inf, -1, None, speed
        self.points, self.lateness, self.intervals = [], [], []

    @property
    def interval(self) -> float:
        """Return the interval of the updates (s)."""
        recent = self.intervals[-self.numbers.paced :]
        return median_high(recent) if recent else self.numbers.first_interval

    @property
    def silent(self) -> bool:
        """Return whether nothing can sound."""
        return self.gives == "" or (self.lowest == 0.0 and self.stages == [0.0, 0.0, 0.0])

    def apply(self, time: float, value: float, by_speed: bool, load: float | None) -> bool:
        """Follow an update; return whether it is a jump."""
        silent = self.silent
        late = self._late(time, silent)
        if load is not None:
            self.asked = min(max(load, self.lowest), self.numbers.largest_load)
        self._press(self.asked)
        if by_speed:
            if silent:
                self._stand(self.place[0], value)
            else:
                self._glide(value)
            self.points, self.slope, self.gives, self.until = [], value, "speed", math.inf
            return False
        return self._go_to(time, value, late, silent)

    def release(self) -> None:
        """Lift the finger and bring it to rest."""
        self._press(max(0.0, self.lowest))
        self._glide(0.0)
        self.until = self.frame - 1

    def step(self) -> Frame:
        """Return position, speed, its rate, load, its rate and second rate of the next frame."""
        level, slope = self.line
        self.line = level + slope / self.rate, slope
        error = self.steps @ (self.place - (level, slope, 0.0))
        self.place = error + np.array([*self.line, 0.0])
        if self.until == self.frame:
            self._glide(0.0)
        load = self._load()
        self.frame += 1
        return (*map(float, self.place), *load)  # type: ignore[return-value]

    def _load(self) -> tuple[float, float, float]:
        k = self.numbers.load_decay
        q, s = k / self.rate, math.exp(-k / self.rate)
        a, b, c = (stage - self.goal for stage in self.stages)
        self.going += 1
        if self.going >= math.ceil(self.numbers.settled * self.rate / k):
            a = b = c = 0.0
        a, b, c = s * a, s * (b + q * a), s * (c + q * b + 0.5 * q * q * a)
        self.stages = [self.goal + a, self.goal + b, self.goal + c]
        return max(self.goal + c, self.lowest), k * (b - c), k * k * (a - 2.0 * b + c)

    def _press(self, goal: float) -> None:
        if goal != self.goal:
            self.goal, self.going = goal, 0

    def _stand(self, level: float, slope: float) -> None:
        self.place, self.line, self.steps = np.array([level, slope, 0.0]), (level, slope), np.eye(3)

    def _glide(self, slope: float) -> None:
        k = 2.0 / self.numbers.delay
        self.line = float(self.place[0]), slope
        self.steps = expm(np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, -k * k, -2.0 * k]]) / self.rate)

    def _go_to(self, time: float, position: float, late: float, silent: bool) -> bool:
        n = self.numbers
        usual = abs(self.slope)
        self._fit(time, position)
        level = position + self.slope * (late - n.delay - 1.0 / self.rate)
        k = min(max(n.tightness / self.interval, n.slowest), n.quickest)
        error = abs(self.place[0] - level)
        far = error >= n.leap_speed * max(self.interval, n.least_leap)
        fastest = error * k * 2.0**2 / 2.0 * math.exp(-2.0)  # of (1 + k t + (k t)^2 / 2) exp(-k t), at k t = 2
        behind = fastest >= max(n.catch_up * abs(self.slope), n.least_catch_up)
        self.found = self.frame if self.until < self.frame else self.found
        like_before = not far or abs(self.slope) <= n.faster * usual
        unseen = bool(not silent and behind and like_before and self.gives == "position" and self.found == self.frame)
        jumped = bool(not silent and not unseen and (self.gives == "speed" or far))
        if jumped:
            level = position
            if self.gives == "position":
                self.points, self.slope, self.place[1:] = [(time, position)], 0.0, 0.0
            self.place[0] = level
        if silent or unseen:
            self._stand(level, self.slope)
        else:
            self.line = level, self.slope
            self.steps = expm(np.array([[0, 1, 0], [0, 0, 1], [-(k**3), -3 * k * k, -3 * k]]) / self.rate)
        self.gives, self.until = "position", math.inf
        if self.slope != 0.0:
            left = n.horizon * self.interval + n.spare - late
            self.until = self.frame + max(0, math.ceil(left * self.rate))
        return jumped or unseen

    def _fit(self, time: float, position: float) -> None:
        n = self.numbers
        self.points = [(t - time, p) for t, p in self.points]  # times are kept relative to the newest
        near = [point for point in self.points if point[0] >= -n.window] or self.points[-1:]
        self.points = [(t + time, p) for t, p in self.points] + [(time, position)]
        if near and -near[0][0] >= n.shortest_span:
            t, p = zip(*near, (0.0, position), strict=True)
            slope = float(np.polyfit(t, np.array(p) - position, 1)[0])
            self.slope = 0.0 if len(set(p)) == 1 else min(max(slope, -n.fastest), n.fastest)

    def _late(self, time: float, silent: bool) -> float:
        n, passed = self.numbers, 0.0
        if self.time is not None:
            passed = time - self.time
            if passed <= 0.0:
                self.points, self.lateness, self.intervals = [], [], []
            elif passed > n.pause:
                if silent or passed > n.longest_stall:
                    self.points, self.slope = [], 0.0
            else:
                self.intervals.append(passed)
        now, first = self.frame / self.rate, not self.lateness
        self.lateness.append(now - time)
        recent = min(self.lateness[-n.changed :])
        if len(self.lateness) >= n.changed and recent - self.clock >= n.latest:
            self.lateness = [recent]
        least = min(self.lateness[-n.kept :])
        gap, passed = least - self.clock, min(max(passed, 0.0), n.pause)
        before = self.clock
        if first or silent or abs(gap) >= n.latest:
            self.clock = least
        elif gap < 0.0:
            self.clock = max(least, self.clock - (n.back if gap > -n.hurry else n.haste) * passed)
        else:
            self.clock = min(least, self.clock + (n.creep if gap < n.hurry else n.haste) * passed)
        if self.time is not None and abs(self.clock - before) >= n.latest:
            self.found = self.frame
        self.time = time
        return min(max(now - time - self.clock, -n.latest), n.latest)
