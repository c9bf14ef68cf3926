"""A finger with mass, damping or adhesion on a tabulated contact, step by step in plain Python: the twin of the engine.

Model   I(d) at the rows of a table is the cubic Hermite of its values and slopes at the edges of d, a line below them
        and zero above; over the phase it is SciPy's periodic cubic spline, and so is the curve b that d is measured
        from. The energy is the integral of I from d upwards. R(z) = k I(z) - (P / r) (I(z - r) - I(z)).
        A step with mass m or damping c, from z over s in the time h, solves
        2 m (s - h v) / h^2 + c s / h + w = (mean of R from z to z + s), at the phase and the load of its middle.
        Without both z goes in small strides, up where R > w and down where R < w, until that changes.
Source  Gonzalez (1996); the adhesive law is that of the engine's module `table_steps`.
Limits  one solution a step: too slow for more than a few hundred steps. Strides may pass over two near equilibria.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.interpolate import CubicHermiteSpline, CubicSpline, PPoly
from scipy.optimize import brentq

Real = npt.NDArray[np.float64]

LINE = 1e-3  # m: how far the table goes on beyond its edges


@dataclass(frozen=True)
class SlowTable:
    """Exact values at rows of phase and edges of d: base [rows], depth and touching [rows, edges]."""

    base: Real
    edges: Real
    depth: Real
    touching: Real

    def at(self, turns: float) -> tuple[float, PPoly]:
        """Return b (m) and I as a function of d, at a phase in turns."""
        rows = np.arange(len(self.base) + 1) / len(self.base)

        def read(values: Real) -> Any:
            return CubicSpline(rows, np.concatenate([values, values[:1]]), bc_type="periodic")(turns % 1.0)

        values, slopes = read(self.depth), -read(self.touching)
        inner = CubicHermiteSpline(self.edges, values, slopes)
        ends = np.array([self.edges[0] - LINE, *self.edges, self.edges[-1] + LINE])
        line = np.array([[0.0], [0.0], [slopes[0]], [values[0] - slopes[0] * LINE]])
        return float(read(self.base)), PPoly(np.hstack([line, inner.c, np.zeros((4, 1))]), ends)


@dataclass
class SlowFinger:
    """A finger: mass (kg), damping (N s/m), pull (N) and its range (m), step (s); then z (m) and velocity (m/s)."""

    mass: float
    damping: float
    pull: float
    reach: float
    step: float
    z: float
    velocity: float

    def reaction(self, depth: PPoly, stiffness: float, d: float) -> float:
        """Return R (N)."""
        near, far = float(depth(d)), float(depth(d - self.reach)) if self.pull else 0.0
        return stiffness * near - (self.pull / self.reach * (far - near) if self.pull else 0.0)

    def mean_reaction(self, depth: PPoly, stiffness: float, d: float, s: float) -> float:
        """Return the mean of R (N) from d to d + s."""
        if abs(s) < 1e-16:
            return self.reaction(depth, stiffness, d)
        near = float(depth.integrate(d, d + s)) / s
        far = float(depth.integrate(d - self.reach, d - self.reach + s)) / s if self.pull else 0.0
        return stiffness * near - (self.pull / self.reach * (far - near) if self.pull else 0.0)

    def move(self, table: SlowTable, turns: float, load: float, stiffness: float) -> None:
        """Go one step, whose middle stands at `turns` and `load` (N)."""
        base, depth = table.at(turns)
        h, d = self.step, self.z - base

        def left(s: float) -> float:
            resisting = 2.0 * self.mass * (s - h * self.velocity) / h**2 + self.damping * s / h
            return resisting + load - self.mean_reaction(depth, stiffness, d, s)

        s = _root_beside(left, h * self.velocity if self.mass else 0.0)
        self.velocity = 2.0 * s / h - self.velocity if self.mass else s / h
        self.z += s

    def settle(self, table: SlowTable, turns: float, load: float, stiffness: float, stride: float) -> bool:
        """Go downhill to the nearest equilibrium; return whether there is one below the top of the table."""
        base, depth = table.at(turns)
        d, top = self.z - base, table.edges[-1] + self.reach

        def excess(place: float) -> float:
            return self.reaction(depth, stiffness, place) - load

        sign = 1.0 if excess(d) > 0.0 else -1.0
        while excess(d) * sign > 0.0:
            if sign > 0.0 and d > top:
                return False
            d += sign * stride
        self.z = base + brentq(excess, d - sign * stride, d, xtol=1e-18, rtol=1e-15)
        return True


def _root_beside(function: Callable[[float], float], guess: float) -> float:
    """Return the root of a rising function, looked for from `guess` outwards."""
    width = 1e-9
    while function(guess - width) > 0.0 or function(guess + width) < 0.0:
        width *= 4.0
    return float(brentq(function, guess - width, guess + width, xtol=1e-20, rtol=1e-15))
