"""A fingertip that is dragged over a surface on which it sticks and slips: the reference of the solver of the motion.

Model   The lag d behind the hand, the speed v and the force f of the bristle:

            d' = u - v,    m v' = k d + c (u - v) - F,    f' = sigma0 b,    F = f + sigma1 A b / (A + sigma1 |v|)

        b = v (1 - alpha(r) r), r = f sign(v) / A, A = N (mu_d + (mu_s - mu_d) exp(-(v / v_s)^2)). alpha rises from 0 at
        r = 0.7 to 1 at r = 1 as 3 s^2 - 2 s^3.
Source  LuGre with the elastic range of Dupont et al.; the damper fades with speed.
Method  `exact`: SciPy's Radau (order 5, its own steps and Jacobian), tolerance 1e-10, with slips found as events.
        `stepped`: the twin of the compiled steps. The stages are one vector of 6 unknowns, solved by SciPy's hybrid
        method, without the elimination and the derivatives of the kernel. It also sums the energy of every step.
        `modes`: eigenvalues of sliding, from differences of the right-hand side.
Limits  Some 60 us per evaluation; loads above 0 only.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.integrate import solve_ivp
from scipy.optimize import fsolve

Floats = npt.NDArray[np.float64]
STAGES = np.array([[5.0, -1.0], [9.0, 3.0]]) / 12.0
WEIGHTS = np.array([0.75, 0.25])


@dataclass(frozen=True)
class Finger:
    """Parameters in SI units; friction in the order mu_s, mu_d, v_s."""

    mass: float = 1e-3
    damping: float = 1.0
    spring: float = 1e3
    bristle: float = 1e4
    bristle_damping: float = 3.0
    static: float = 0.9
    kinetic: float = 0.5
    stribeck: float = 0.01

    def sliding(self, load: float, v: float) -> float:
        """Return A, the friction of steady sliding (N)."""
        return load * (self.kinetic + (self.static - self.kinetic) * math.exp(-((v / self.stribeck) ** 2)))

    def friction(self, load: float, v: float, f: float) -> tuple[float, float]:
        """Return b (m/s) and F (N)."""
        most = self.sliding(load, v)
        r = max(0.0, f * math.copysign(1.0, v) / most)
        s = min(max((r - 0.7) / 0.3, 0.0), 1.0)
        bent = v * (1.0 - r * s * s * (3.0 - 2.0 * s))
        return bent, f + self.bristle_damping * most / (most + self.bristle_damping * abs(v)) * bent

    def rates(self, state: Any, u: float, load: float) -> Floats:
        """Return the time derivatives of d, v and f."""
        d, v, f = state
        bent, force = self.friction(load, v, f)
        return np.array([u - v, (self.spring * d + self.damping * (u - v) - force) / self.mass, self.bristle * bent])

    def energy(self, state: Any) -> float:
        """Return the kinetic and elastic energy (J)."""
        d, v, f = state
        return float(0.5 * (self.mass * v * v + self.spring * d * d + f * f / self.bristle))

    def modes(self, load: float, speed: float) -> npt.NDArray[np.complex128]:
        """Return the eigenvalues (1/s) of small motions about sliding at `speed`."""
        most = self.sliding(load, speed)
        at = np.array([most / self.spring, speed, most])
        steps = 1e-6 * np.array([1.0, speed, most])
        columns = [
            (self.rates(at + step * one, speed, load) - self.rates(at - step * one, speed, load)) / (2.0 * step)
            for step, one in zip(steps, np.eye(3), strict=True)
        ]
        return np.asarray(np.linalg.eigvals(np.array(columns).T), dtype=np.complex128)


def exact(
    finger: Finger, hand: Callable[[float], float], load: Callable[[float], float], seconds: float, above: float,
    tolerance: float = 1e-10,
) -> tuple[Any, Floats]:  # fmt: skip
    """Return the solution (its `sol` gives d, v and f at any time) and the moments at which v passes `above` (m/s)."""

    def passes(_t: float, state: Floats) -> float:
        return float(state[1] - above)

    passes.direction = 1.0  # type: ignore[attr-defined]
    begun = [0.0, hand(0.0), 0.0]
    found = solve_ivp(
        lambda t, y: finger.rates(y, hand(t), load(t)), (0.0, seconds), begun, method="Radau", rtol=tolerance,
        atol=1e-3 * tolerance, events=passes, dense_output=True,
    )  # fmt: skip
    return found, np.asarray(found.t_events[0])


def stepped(
    finger: Finger, speeds: Floats, load: float, rate: float, tolerance: float, shortest: int
) -> tuple[Floats, Floats]:
    """Return d, v and f at each frame [frames, 3], and the energy that each frame made beyond the work of the hand (J).

    speeds: of the hand at each frame (m/s), linear in between.
    tolerance, shortest: of the step, as of the kernel: relative to v_s and mu_s N, and in parts of a frame.
    """
    state, step, found, made = np.array([0.0, speeds[0], 0.0]), shortest, [np.array([0.0, speeds[0], 0.0])], [0.0]
    for before, after in itertools.pairwise(speeds):
        tick, surplus = 0, 0.0
        while tick < shortest:
            while step > 1 and tick % step:
                step //= 2
            h, nodes = step / shortest / rate, (tick + step * np.array([0.0, 1.0 / 3.0, 1.0])) / shortest
            hand = before + nodes * (after - before)
            stages = _stages(finger, state, hand[1:], load, h)
            rates = np.array([finger.rates(one, u, load) for one, u in zip(stages, hand[1:], strict=True)])
            wrong = _wrong(finger, h, [finger.rates(state, hand[0], load), *rates], state, hand[0], load) / tolerance
            if wrong > 1.0 and step > 1:
                step //= 2
                continue
            pushed = finger.spring * stages[:, 0] + finger.damping * (hand[1:] - stages[:, 1])
            surplus += finger.energy(stages[1]) - finger.energy(state) - h * float(WEIGHTS @ (pushed * hand[1:]))
            state = stages[1]
            tick += step
            if wrong < 0.05 and step < shortest:
                step *= 2
        found.append(state)
        made.append(surplus)
    return np.array(found), np.array(made)


def _stages(finger: Finger, state: Floats, hand: Floats, load: float, h: float) -> Floats:
    """Return both stages of a step [2, 3]; the second is its end."""
    size = np.array([finger.static * load / finger.spring, finger.stribeck, finger.static * load])

    def left(scaled: Floats) -> Floats:
        stages = scaled.reshape(2, 3) * size
        rates = np.array([finger.rates(one, u, load) for one, u in zip(stages, hand, strict=True)])
        return np.asarray((stages - state - h * STAGES @ rates) / size).ravel()

    found, _info, done, message = fsolve(left, np.tile(state / size, 2), xtol=1e-12, full_output=True)
    assert done == 1 or np.max(np.abs(left(found))) < 1e-9, message
    return np.asarray(found.reshape(2, 3) * size)


def _wrong(finger: Finger, h: float, rates: list[Floats], state: Floats, u: float, load: float) -> float:
    """Return the estimated error of a step: the second difference of its rates, damped by the slopes of friction."""
    second = h * np.abs(rates[0] - 1.5 * rates[1] + 0.5 * rates[2])
    v, f = state[1], state[2]
    dv, df = 1e-7 * finger.stribeck, 1e-7 * finger.static * load
    slope_v = (finger.friction(load, v + dv, f)[1] - finger.friction(load, v, f)[1]) / dv
    slope_f = (finger.friction(load, v, f + df)[0] - finger.friction(load, v, f)[0]) / df
    of_speed = second[1] / (1.0 + h / finger.mass * (finger.damping + max(slope_v, 0.0))) / (finger.stribeck + abs(v))
    of_force = second[2] / (1.0 - h * finger.bristle * slope_f) / (finger.static * load)
    return float(max(of_speed, of_force))
