"""Says whether a dragged fingertip slides steadily or sticks and slips, and measures how.

Stage   MOTION, beside `skin_drag`, whose parameters it reads.
Model   Sliding at V is linear for small motions. Friction falls with speed by a = -dA/dV, and follows the speed after
        tau = A / (sigma0 V). The characteristic polynomial is

            m tau s^3 + (m + tau (c - a e)) s^2 + (c - a + k tau) s + k,    e = sigma1 V / (A + sigma1 V),

        so that sliding is stable (Routh-Hurwitz) if the middle coefficients are above 0 and their product is above
        m k tau. On a stiff bristle tau is small, and what remains is that sliding is unstable if

            c < a = N (mu_s - mu_d) (2 V / v_s^2) exp(-(V / v_s)^2).

        a is largest at V = v_s / sqrt(2), where it is 0.858 N (mu_s - mu_d) / v_s. With more damping than that, every
        speed slides, as tau only helps.
        What a finger does at a speed is measured: it starts stuck, and is dragged until SLIPS of its slips are over,
        and on until the force varies as much in the last quarter of the time as in the one before.
Source  Derived for this project. tests/synth/motion/test_skin_drag.py compares it with simulations.
Limits  Above the onset a finger that starts stuck may slip and stick on for ever, though sliding would be stable: the
        onset is for small motions. `dragged` measures which of the two occurs.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from synth.arrays import Array
from synth.motion.skin_drag import (
    BRISTLE,
    BRISTLE_DAMPING,
    DAMPING,
    KINETIC,
    MASS,
    SPRING,
    STATIC,
    STRIBECK,
    at_rest,
    drag,
)

STEEPEST = math.sqrt(2.0 / math.e)  # of N (mu_s - mu_d) / v_s: the largest fall of friction, 0.858
SLIPS = 8  # slips that are measured, after as many that are not
STILL = 0.1  # of the speed of the hand: a slower skin counts as stuck, since it creeps before it slips
LONGEST, FRAMES = 600.0, 1 << 15  # s and frames of a first measurement, at most; a longer one has longer frames
DOUBLINGS, SETTLED = 4, 0.02  # of the time, at most, until the peak-to-peak of the force changes by less than this part
FINER = 4  # times the steps, by which the error is measured
CHANGE = 2.0  # error over that change: 1.6 against steps of a twenty-fourth, since friction has kinks
RUBBED = 1e-3  # of the mean force: a force that varies by less is that of steady sliding


@dataclass(frozen=True, slots=True)
class Dragged:
    """What a finger does that is dragged at a constant speed and load.

    frequency: of stick-slip, Hz; 0 if it slides.
    slip_share: part of the time in which the skin slips; 1 if it slides.
    force: mean and peak-to-peak of the force of friction, N.
    error: of the frequency or of that peak-to-peak, whichever is larger, relative to it.
    force_error: largest error of the force at any time of the measurement, relative to that peak-to-peak.
    place_error: of the place of the skin, m.
    seconds: of the measurement. Slips drift: later, errors at a time grow with it.
    """

    frequency: float
    slip_share: float
    force: tuple[float, float]
    error: float = 0.0
    force_error: float = 0.0
    place_error: float = 0.0
    seconds: float = 0.0

    def after(self, seconds: float) -> Dragged:
        """Return this with the errors at any time of a motion of that length (s)."""
        drift = max(1.0, seconds / self.seconds) if self.seconds else 1.0
        return replace(self, force_error=min(drift * self.force_error, 1.0), place_error=drift * self.place_error)


def fall_of_friction(p: Array, load: float, speed: float) -> float:
    """Return a (N s/m) at a speed (m/s) and load (N)."""
    part = abs(speed) / float(p[STRIBECK])
    return load * float(p[STATIC] - p[KINETIC]) * 2.0 * part / float(p[STRIBECK]) * math.exp(-(part**2))


def most_damping(p: Array, load: float) -> float:
    """Return the damping (N s/m) above which every speed slides."""
    return STEEPEST * load * float(p[STATIC] - p[KINETIC]) / float(p[STRIBECK])


def unstable(p: Array, load: float, speed: float) -> bool:
    """Return whether sliding at a speed (m/s) under a load (N) is unstable."""
    v, fall, damping = abs(speed), fall_of_friction(p, load, speed), float(p[DAMPING])
    if not (v > 0.0 and fall > damping):
        return False
    friction = load * (p[KINETIC] + (p[STATIC] - p[KINETIC]) * math.exp(-((v / p[STRIBECK]) ** 2)))
    tau, fading = friction / (p[BRISTLE] * v), p[BRISTLE_DAMPING] * v / (friction + p[BRISTLE_DAMPING] * v)
    second, first = p[MASS] + tau * (damping - fall * fading), damping - fall + p[SPRING] * tau
    return not bool(second > 0.0 and first > 0.0 and second * first > p[MASS] * p[SPRING] * tau)


def sticks_and_slips(p: Array, load: float, speed: float, rate: float) -> bool:
    """Return whether a finger sticks and slips at a speed (m/s) under a load (N), from sliding or from rest."""
    return unstable(p, load, speed) or dragged(p, load, speed, rate).frequency > 0.0


def dragged(p: Array, load: float, speed: float, rate: float) -> Dragged:
    """Return what a finger does that starts stuck, at `rate` frames per second, and its errors, by finer steps."""
    if load <= 0.0 or speed == 0.0:
        return Dragged(0.0, 0.0, (0.0, 0.0))
    first = p[STATIC] * load / p[SPRING] / abs(speed)  # s: the spring reaches static friction
    seconds = min(2 * SLIPS * (first + 2.0 * math.pi * math.sqrt(p[MASS] / p[SPRING])), LONGEST)
    rate = min(rate, FRAMES / seconds)
    for doubling in range(DOUBLINGS + 1):
        frames = math.ceil(seconds * rate)
        usual = _rows(p, load, speed, rate, frames + 1)
        if doubling == DOUBLINGS or _settled(usual[2]):
            break
        seconds *= 2.0
    finer = _rows(p, load, speed, FINER * rate, FINER * frames + 1)
    found, other = _measured(usual, speed, rate), _measured(finer, speed, FINER * rate)
    place, force = (CHANGE * float(np.max(np.abs(usual[row] - finer[row, ::FINER]))) for row in (0, 2))
    extent = found.force[1] if found.frequency > 0.0 else float(np.ptp(usual[2]))
    found = replace(found, force_error=force / extent if extent > 0.0 else 0.0, place_error=place, seconds=seconds)
    if found.frequency == 0.0:
        return found
    of_frequency = abs(found.frequency / other.frequency - 1.0) if other.frequency else 1.0
    return replace(found, error=max(of_frequency, abs(found.force[1] / other.force[1] - 1.0)))


def _settled(force: Array) -> bool:
    """Return whether the force varies as much in its last quarter as in the quarter before, or hardly at all."""
    third, last = (float(np.ptp(part)) for part in np.array_split(force, 4)[2:])
    return abs(last - third) <= SETTLED * max(last, third) or max(last, third) <= RUBBED * float(np.mean(force))


def _rows(p: Array, load: float, speed: float, rate: float, frames: int) -> Array:
    """Return the rows of `drag` of a finger that starts stuck."""
    out, steady = np.zeros((3, frames)), np.full(frames, float(abs(speed)))
    drag(p, float(rate), at_rest(), steady / rate, steady, np.full(frames, float(load)), np.ones(frames), out)
    return out


def _measured(rows: Array, speed: float, rate: float) -> Dragged:
    """Return what the second half of the rows shows, without errors."""
    _lag, slip, force = rows[:, rows.shape[1] // 2 :]
    mean, varied = float(np.mean(force)), float(np.ptp(force))
    begun = np.flatnonzero((slip[1:] > abs(speed)) & (slip[:-1] <= abs(speed)))
    if varied <= RUBBED * mean or len(begun) < 2:
        return Dragged(0.0, float(np.mean(slip > STILL * abs(speed))), (mean, varied))
    share = float(np.mean(slip[begun[0] : begun[-1]] > STILL * abs(speed)))
    moments = begun + (abs(speed) - slip[begun]) / (slip[begun + 1] - slip[begun])
    return Dragged((len(begun) - 1) * rate / float(moments[-1] - moments[0]), share, (mean, varied))
