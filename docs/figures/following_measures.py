"""What a smoother does to a hand: updates as a network brings them, ways to follow them, and figures of the outcome.

Model   A hand is a function of time. It is sampled at a rate, rounded as a mouse does, stamped with a rough clock, and
        arrives late by an exponential jitter, or never; the newest before a block is applied at its first frame.
        Alternatives to `synth.motion.update_smoothing` differ in the line that they aim at and in the curve that joins
        it.
Limits  the network's least delay is taken as none: every way pays it alike.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from numba import njit

from clients.figure_look import Real
from synth.kernels import Decorator
from synth.motion import update_timing
from synth.motion.motion import LOAD, SPEED, SPEED_RATE, Update
from synth.motion.update_smoothing import DELAY, QUICKEST, SLOWEST, TIGHTNESS, Follower
from synth.motion.update_timing import INTERVAL, new_track

RATE, BLOCK = 48000, 480  # frames a second; 10 ms, the service's own
PERIOD = 0.8e-3  # m: texture of the default scene
STEADY = 0.08  # m/s
LENGTH, STROKE_TIME, REST = 0.06, 0.4, 0.1  # m, s, s: of the strokes
ROUGH_HZ = 10.0  # slower changes of pitch are heard as such, not as roughness
LOADED = 0.5  # N: of the press

Hand = Callable[[Real], Real]
Moves = tuple[Real, Real, Real]
Arrivals = list[tuple[int, Update]]


@dataclass(frozen=True, slots=True)
class Network:
    """hz: of the updates; jitter: s, mean of the exponential; stamp: s either way; loss: share; grid: m of a mouse."""

    hz: float
    jitter: float = 3e-3
    stamp: float = 0.5e-3
    loss: float = 0.05
    grid: float = 1e-4
    block: int = BLOCK


def clean(hz: float) -> Network:
    """Return a network without faults; updates still land on blocks."""
    return Network(hz, 0.0, 0.0, 0.0, 0.0)


# -- parts of the method that other ways use: Python cannot call those of `update_timing`

for_python: Decorator = njit
_late_by, _slope_with = update_timing.late_by, update_timing.slope_with


@for_python
def late_by(track: Real, now: float, time: float, silent: bool) -> float:
    """See `synth.motion.update_timing`."""
    return float(_late_by(track, now, time, silent))


@for_python
def slope_with(track: Real, time: float, position: float) -> float:
    """See `synth.motion.update_timing`."""
    return float(_slope_with(track, time, position))


# -- hands


def smooth(s: Real) -> Real:
    """Return 10 s^3 - 15 s^4 + 6 s^5 within 0..1: a movement of minimum jerk (Flash and Hogan, 1985)."""
    s = np.clip(s, 0.0, 1.0)
    return np.asarray(s**3 * (10.0 - s * (15.0 - 6.0 * s)))


def steady(t: Real) -> Real:
    """Return the position of a hand at constant speed."""
    return STEADY * t


def strokes(t: Real) -> Real:
    """Return back-and-forth strokes of minimum jerk, with rests."""
    number, along = np.divmod(t, STROKE_TIME + REST)
    part = smooth(along / STROKE_TIME)
    return LENGTH * np.where(number % 2 == 0, part, 1.0 - part)


def pressed(t: Real) -> Real:
    """Return the load of a finger that stays down."""
    return np.full(len(t), LOADED)


def stopping(t: Real) -> Real:
    """Return a steady hand that stops within 100 ms after t = 1 s: speed 1 - S, S = 3 s^2 - 2 s^3."""
    s = np.clip((t - 1.0) / 0.1, 0.0, 1.0)
    return STEADY * (np.minimum(t, 1.0) + 0.1 * (s - s**3 + 0.5 * s**4))


def press(t: Real) -> Real:
    """Return the load of a touch and a lift, 150 ms each, 0.5 s apart."""
    beat = t % 1.0
    return LOADED * (smooth(beat / 0.15) - smooth((beat - 0.5) / 0.15))


# -- networks


def arrivals(hand: Hand, load: Hand, network: Network, seconds: float, seed: int) -> Arrivals:
    """Return the updates that are applied, each with its frame: the newest before each block."""
    random = np.random.default_rng(seed)
    count = round(seconds * network.hz)
    times = (np.arange(count) + random.uniform(0.0, 1.0) + random.uniform(-0.05, 0.05, count)) / network.hz
    places = hand(times)
    if network.grid:
        places = network.grid * np.round(places / network.grid)
    late = random.exponential(network.jitter, count) if network.jitter else np.zeros(count)
    stamps = times + (random.uniform(-network.stamp, network.stamp, count) if network.stamp else 0.0)
    come = random.uniform(size=count) >= network.loss
    frames = network.block * np.ceil((times + late) * RATE / network.block).astype(int)
    newest: dict[int, int] = {}
    for frame, number in zip(frames[come].tolist(), np.flatnonzero(come).tolist(), strict=True):
        newest[frame] = max(newest.get(frame, -1), number)
    loads, applied, last = load(times), [], -1
    for frame, number in sorted(newest.items()):
        if number > last:
            last = number
            one = Update(number, float(stamps[number]), float(places[number]), None, float(loads[number]))
            applied.append((frame, one))
    return applied


# -- ways to follow


Way = Callable[[Arrivals, int], Moves]


def chosen(applied: Arrivals, frames: int) -> Moves:
    """Return position, speed and acceleration of `synth.motion.update_smoothing`."""
    samples, position = followed(applied, frames)
    return position, samples[SPEED], samples[SPEED_RATE]


def followed(applied: Arrivals, frames: int) -> tuple[Real, Real]:
    """Return the rows and the positions that a `Follower` makes."""
    follower, samples, position = Follower(RATE), np.zeros((5, frames)), np.zeros(frames)
    begin = 0
    for frame, update in [*applied, (frames, None)]:
        end = min(frame, frames)
        row = np.empty((5, end - begin))
        follower.fill(row, position[begin:end])
        samples[:, begin:end], begin = row, end
        if update is not None:
            follower.apply(update)
    return samples, position


@dataclass(frozen=True, slots=True)
class Alternative:
    """held: aim at the position itself, standing. clocked: lateness is known. delay: s that the line is late.

    quintic: join by a polynomial of the fifth degree within two intervals, not by a decay. tightness: decays an
    interval. two_points: the speed is that between the last two updates. decay: 1/s, None: by the
    interval.
    """

    held: bool = False
    clocked: bool = True
    delay: float = 0.0
    quintic: bool = False
    tightness: float = TIGHTNESS
    two_points: bool = False
    decay: float | None = None

    def __call__(self, applied: Arrivals, frames: int) -> Moves:
        """Return position, speed and acceleration at every frame."""
        track, (x, v, a) = new_track(), (applied[0][1].position or 0.0, 0.0, 0.0)
        out = np.zeros((3, frames))
        out[0] = x
        before: tuple[float, float] | None = None
        for (frame, update), (end, _next) in _with_next(applied, frames):
            assert update.position is not None
            late = float(late_by(track, frame / RATE, update.time, False))
            slope = 0.0 if self.held else float(slope_with(track, update.time, update.position))
            if self.two_points:
                slope = 0.0 if before is None else (update.position - before[1]) / (update.time - before[0])
                before = update.time, update.position
            late = (late if self.clocked else 0.0) - self.delay
            level = update.position + slope * (0.0 if self.held else late)
            s = np.arange(end - frame + 1) / RATE
            e = (x - level, v - slope, a)
            moved = self._quintic(track[INTERVAL], s, *e) if self.quintic else self._decay(track[INTERVAL], s, *e)
            moved += np.array([level + slope * s, np.full(len(s), slope), np.zeros(len(s))])
            out[:, frame:end] = moved[:, :-1]
            x, v, a = moved[:, -1]
        return out[0], out[1], out[2]

    def _decay(self, interval: float, s: Real, e: float, e1: float, e2: float) -> Real:
        decay = self.decay or min(max(self.tightness / interval, SLOWEST), QUICKEST)
        b1, b2 = e1 + decay * e, 0.5 * (e2 + decay * (2.0 * e1 + decay * e))
        value, first = e + s * (b1 + s * b2), b1 + 2.0 * s * b2
        speed = first - decay * value
        return np.array([value, speed, 2.0 * b2 - decay * (first + speed)]) * np.exp(-decay * s)

    def _quintic(self, interval: float, s: Real, e: float, e1: float, e2: float) -> Real:
        h = max(2.0 * interval, 0.02)
        q, c1, c2 = np.minimum(s / h, 1.0), h * e1, 0.5 * h * h * e2
        c = (e, c1, c2, -10 * e - 6 * c1 - 3 * c2, 15 * e + 8 * c1 + 3 * c2, -6 * e - 3 * c1 - c2)
        curve = np.polynomial.Polynomial(c)
        return np.array([curve(q), curve.deriv()(q) / h, curve.deriv(2)(q) / h**2])


def _with_next(applied: Arrivals, frames: int) -> Iterator[tuple[tuple[int, Update], tuple[int, Update | None]]]:
    inside = [one for one in applied if one[0] < frames]
    yield from zip(inside, [*inside[1:], (frames, None)], strict=True)


WAYS: dict[str, Way] = {
    "low pass of the held position": Alternative(held=True),
    "line by arrival, no clock": Alternative(clocked=False, delay=DELAY),
    "line of the last two updates": Alternative(two_points=True, delay=DELAY),
    "quintic to the line": Alternative(quintic=True, delay=DELAY),
    "line without delay": Alternative(),
    "line 20 ms late": Alternative(delay=0.02),
    "chosen: line 10 ms late": chosen,
}
"""Name -> way. All but the chosen one carry their line on without end."""


# -- figures


@dataclass(frozen=True, slots=True)
class Figures:
    """lag: s; error: m rms about it; rough: dB below a texture tone; ripple: of the speed; overshoot at a stop and at
    the turns of strokes: m; step: m/s^2 between frames, strokes; still: s from the stop to 1 % of the speed.
    """

    lag: float
    error: float
    rough: float
    ripple: float
    stop: float
    turn: float
    step: float
    still: float


def figures(way: Way, network: Network, seeds: Iterable[int] = range(4), seconds: float = 3.0) -> Figures:
    """Return the figures of a way, over `seeds`: rms of what is noise, means of what is not, the largest step."""
    frames, found = round(seconds * RATE), []
    for seed in seeds:
        x, v, _a = way(arrivals(steady, pressed, network, seconds, seed), frames)
        rough, ripple = roughness(x[RATE:]), float(np.std(v[RATE:]) / STEADY)
        x, _v, a = way(arrivals(strokes, pressed, network, seconds, seed), frames)
        lag, error = lag_of(x)
        turn, step = float(max(x[RATE // 2 :].max() - LENGTH, -x[RATE // 2 :].min())), float(np.abs(np.diff(a)).max())
        x, v, _a = way(arrivals(stopping, pressed, network, 2.0, seed), 2 * RATE)
        end = stopping(np.array([2.0]))[0]
        moving = np.flatnonzero(np.abs(v) > 0.01 * STEADY)
        found.append((lag, error, rough, ripple, x.max() - end, turn, step, moving[-1] / RATE - 1.1))
    table = np.array(found)
    means, squares = table.mean(axis=0), np.sqrt(np.mean(table**2, axis=0))
    return Figures(
        means[0], squares[1], 20.0 * math.log10(squares[2]), squares[3], means[4], means[5], table[:, 6].max(), means[7]
    )


def roughness(x: Real) -> float:
    """Return the rms phase (rad) of a texture tone whose changes are faster than ROUGH_HZ: its sidebands' amplitude."""
    t = np.arange(len(x)) / RATE
    away = x - np.polyval(np.polyfit(t, x, 1), t)
    lines = np.fft.rfft(away * np.hanning(len(x)))
    lines[: math.ceil(ROUGH_HZ * len(x) / RATE)] = 0.0
    return float(2.0 * math.pi / PERIOD * np.sqrt(np.mean(np.fft.irfft(lines, len(x)) ** 2) / 0.375))


def lag_of(x: Real) -> tuple[float, float]:
    """Return the lag (s) at which `x` fits the strokes best, and the rms error (m) then."""
    t, x = np.arange(len(x))[RATE // 2 :: 24] / RATE, x[RATE // 2 :: 24]
    tried = [(float(np.sqrt(np.mean((x - strokes(t - lag)) ** 2))), lag) for lag in np.arange(-0.01, 0.13, 0.0005)]
    error, lag = min(tried)
    return float(lag), error


def load_figures(hz: float, decay: float, seeds: Iterable[int] = range(4)) -> tuple[float, float, float]:
    """Return lag (s) of the load in presses, rms error (N) about it, and rms of its rate beyond the press's own (N/s).

    decay: 1/s, of the low pass of third order.
    """
    found = []
    for seed in seeds:
        applied = arrivals(steady, press, Network(hz), 3.0, seed)
        load, rate = low_passed(applied, 3 * RATE, decay)
        t = np.arange(len(load))[::24] / RATE
        tried = [(float(np.sqrt(np.mean((load[::24] - press(t - lag)) ** 2))), lag) for lag in np.arange(0, 0.08, 5e-4)]
        error, lag = min(tried)
        own = np.gradient(press(t - lag), t)
        found.append((lag, error, float(np.sqrt(np.mean((rate[::24] - own) ** 2)))))
    lag, error, ripple = np.mean(found, axis=0)
    return float(lag), float(error), float(ripple)


def low_passed(applied: Arrivals, frames: int, decay: float) -> tuple[Real, Real]:
    """Return the load of updates and its rate, held and low-passed; `update_smoothing` does it at LOAD_DECAY."""
    way = Alternative(held=True, decay=decay)
    load, rate, _bend = way([(frame, one._replace(position=one.load)) for frame, one in applied], frames)
    return load, rate


def silence_after_lift() -> tuple[float, float]:
    """Return s from a sudden lift to a load below 1 mN, and to exactly none."""
    touched = [(0, Update(0, 0.0, 0.0, None, LOADED)), (RATE, Update(1, 1.0, 0.0, None, 0.0))]
    load = followed(touched, 2 * RATE)[0][LOAD, RATE:]
    return float(np.argmax(load < 1e-3)) / RATE, float(np.argmax(load == 0.0)) / RATE


TROUBLES: dict[str, Callable[[float], Network]] = {
    "none but blocks of 10 ms": clean,
    "jitter of 3 ms": lambda hz: replace(clean(hz), jitter=3e-3),
    "loss of 5 %": lambda hz: replace(clean(hz), loss=0.05),
    "time stamps ± 0.5 ms": lambda hz: replace(clean(hz), stamp=0.5e-3),
    "mouse of 0.1 mm": lambda hz: replace(clean(hz), grid=1e-4),
    "all of them": Network,
    "all, but frames, not blocks": lambda hz: Network(hz, block=1),
}
"""Name -> network of a rate."""
