"""A finger of points with a mass, under a load that varies, by SciPy's integrator: the reference for shapes that move.

Model   m z'' + c z' + k_p (z - z_w) = F(z, p, w) - w. F is a plain sum over points of the finger, of share(w)
        max(h - z, 0), where h = finger + a2 cos(2 pi (x - p) / lambda2 + phi), and share is the force of a point per
        metre. Of a row of equal cells only those between two ends are in contact; the cells at the ends count in part.
        z_w is the mean of the z at which F = w, over MEANS phases, as a cubic spline over the cube root of the load.
        Growing: the ends are (L0 -/+ L) / 2 with L = L0 w^p, and share is k(L) / L dx.
        Round: the parabola (x - xc)^2 / (2 R) is subtracted, and share is kappa dx with kappa = k(2 b) / (2 b).
Source  Fagiani & Barbieri (2016), eqs 1-5; Johnson, Contact Mechanics (1985), sec. 4.3.
Method  LSODA, with share and z_w read from tables. F = w by Newton's method from below, which never overshoots.
Limits  The sum is of second order in the distance of points. Compiled, without any part of the engine.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numba
import numpy as np
import numpy.typing as npt
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline

from tests.reference.shaped_contact_oracle import grown_length, smooth_half_length
from tests.reference.stiffness_oracle import Touch, stiffness

Real = npt.NDArray[np.float64]
OfLoad = Callable[[float], float]
Motion = Callable[[float], tuple[float, float]]
"""Place of the texture (m) and load (N) at a time (s)."""

CELLS_A_PERIOD = 250  # of the shorter period; a cell that an end cuts errs by its width squared
MEANS = 128  # phases of z_w
SHARES = 65  # loads between which the share of a point is a cubic spline
LONGEST_STEP = 1e-3  # s
LOADS = 1024  # between which share and z_w are read linearly over the cube root: 5e-6 of their extent at most


@numba.njit(cache=True, fastmath={"reassoc", "nsz", "contract"})
def pressed(z, finger, cosine, sine, angle, begin, end):
    """Return the sum of max(h - z, 0) over the cells from `begin` to `end`, and the number of those above z."""
    total = count = 0.0
    c, s = math.cos(angle), math.sin(angle)
    first, last = int(begin), min(math.ceil(end), len(finger))
    for i in range(first, last):
        over = finger[i] + c * cosine[i] + s * sine[i] - z
        total += max(over, 0.0)
        count += 1.0 if over > 0.0 else 0.0
    for i, outside in ((first, begin - first), (last - 1, last - end)):
        over = finger[i] + c * cosine[i] + s * sine[i] - z
        if over > 0.0 and outside > 0.0:
            total -= outside * over
            count -= outside
    return total, count


@numba.njit(cache=True)
def balanced(target, finger, cosine, sine, angle, begin, end, start):
    """Return the z at which the sum of `pressed` is `target`; start: near it, or above every height."""
    z, drop = start, 1e-6
    while pressed(z, finger, cosine, sine, angle, begin, end)[0] < target:
        z, drop = start - drop, 2.0 * drop
    for _ in range(200):
        area, count = pressed(z, finger, cosine, sine, angle, begin, end)
        step = (area - target) / count
        z += step
        if abs(step) < 1e-15:
            break
    return z


@dataclass(frozen=True)
class Points:
    """A finger of points.

    places, finger: x and height of every point, m.
    share: force of a point per metre of depth (N/m) at a load (N).
    ends: cells in contact at a load (N): the first, and the one after the last; both may be fractions.
    amplitude, period, phase: of the texture, m, m and rad.
    """

    places: Real
    finger: Real
    share: OfLoad
    ends: Callable[[float], tuple[float, float]]
    amplitude: float
    period: float
    phase: float

    def waves(self) -> tuple[Real, Real, Real]:
        """Return the heights of the finger, and of the texture at phase 0 and a quarter period on."""
        angle = 2 * math.pi * self.places / self.period + self.phase
        return self.finger, self.amplitude * np.cos(angle), self.amplitude * np.sin(angle)

    def resting(self, load: float, places: Real) -> Real:
        """Return z (m) without a mass at each of `places` (m) of the texture, at `load` (N)."""
        contact = (load / self.share(load), *self.waves())
        z, ends, found = float(np.max(self.finger)) + self.amplitude, self.ends(load), []
        for angle in 2 * math.pi * np.fmod(places / self.period, 1.0):
            z = balanced(*contact, float(angle), *ends, z)
            found.append(z)
        return np.array(found)

    def means(self, lightest: float, heaviest: float, loads: int) -> Callable[[Real | float], Real]:
        """Return the mean of z without a mass over a period (m) as a function of the load (N), solved at some loads."""
        roots, places = np.linspace(np.cbrt(lightest), np.cbrt(heaviest), loads), np.arange(MEANS) / MEANS * self.period
        spline = CubicSpline(roots, [float(np.mean(self.resting(float(root) ** 3, places))) for root in roots])
        return lambda load: np.asarray(spline(np.cbrt(load)))


@dataclass(frozen=True)
class Pulp:
    """m, c and k_p: kg, N s/m, N/m."""

    mass: float = 1e-4
    damping: float = 2.4
    spring: float = 1e3

    def moved(
        self, points: Points, motion: Motion, times: Real, rest: Callable[[Real | float], Real], tolerance: float = 1e-7
    ) -> Real:
        """Return z (m) at `times` (s), from rest at the first of them; rest: z_w (m) at a load (N)."""
        waves, loads = points.waves(), [motion(float(t))[1] for t in times]
        share, resting = (tabled(one, min(loads), max(loads)) for one in (points.share, rest))

        def rate(t: float, state: Real) -> list[float]:
            place, load = motion(t)
            angle = 2 * math.pi * math.fmod(place / points.period, 1.0)
            force = share(load) * pressed(float(state[0]), *waves, angle, *points.ends(load))[0]
            held = self.damping * float(state[1]) + self.spring * (float(state[0]) - resting(load))
            return [float(state[1]), (force - load - held) / self.mass]

        place, load = motion(float(times[0]))
        begin = [float(points.resting(load, np.array([place]))[0]), 0.0]
        found = solve_ivp(
            rate, (float(times[0]), float(times[-1])), begin, "LSODA", times, rtol=tolerance,
            atol=[tolerance * 1e-5, tolerance * 1e-1], max_step=LONGEST_STEP,
        )  # fmt: skip
        assert found.success, found.message
        return np.asarray(found.y[0])


def tabled(function: Callable[[float], Any], lightest: float, heaviest: float) -> OfLoad:
    """Return a function of the load (N) as a table, which takes a tenth of the time."""
    first, step = math.cbrt(lightest), max((math.cbrt(heaviest) - math.cbrt(lightest)) / LOADS, 1e-9)
    values = [float(function((first + step * number) ** 3)) for number in range(LOADS + 1)]

    def read(load: float) -> float:
        place = (math.cbrt(load) - first) / step
        number = min(max(int(place), 0), LOADS - 1)
        return values[number] + (place - number) * (values[number + 1] - values[number])

    return read


def growing_points(touch: Touch, heaviest: float, exponent: float) -> Points:
    """Return a comb whose length is that of `touch` at 1 N, and grows with the load to the power `exponent`."""
    longest = grown_length(touch, heaviest, exponent)
    places, width = _cells(touch, 0.5 * (touch.contact_length - longest), longest)

    def ends(load: float) -> tuple[float, float]:
        half = 0.5 * grown_length(touch, load, exponent) / width
        return max(0.5 * len(places) - half, 0.0), 0.5 * len(places) + half

    def foundation(load: float) -> float:
        length = grown_length(touch, load, exponent)
        return stiffness(replace(touch, load=load, contact_length=length)).k / length

    return Points(places, _ridges(touch, places), _share(foundation, width, heaviest), ends, *_texture(touch))


def round_points(touch: Touch, heaviest: float, radius: float) -> Points:
    """Return a round comb of `radius` (m), over all that may touch up to the load `heaviest` (N)."""

    def foundation(load: float) -> float:
        length = 2 * smooth_half_length(touch, load, radius)
        return stiffness(replace(touch, load=load, contact_length=length)).k / length

    heights, middle = touch.ridge_amplitude + touch.texture_amplitude, 0.5 * touch.contact_length
    half = math.sqrt(4 * radius * heights + smooth_half_length(touch, heaviest, radius) ** 2)
    places, width = _cells(touch, middle - half, 2 * half)
    finger, whole = _ridges(touch, places) - (places - middle) ** 2 / (2 * radius), (0.0, float(len(places)))
    return Points(places, finger, _share(foundation, width, heaviest), lambda _load: whole, *_texture(touch))


def _share(foundation: OfLoad, width: float, heaviest: float) -> OfLoad:
    """Return the share of a cell of `width` (m) on a foundation (Pa/m), as a function of the load (N)."""
    roots = np.linspace(0.1, np.cbrt(heaviest), SHARES)
    spline = CubicSpline(roots, [foundation(float(root) ** 3) * width for root in roots])
    return lambda load: float(spline(math.cbrt(load)))


def _cells(touch: Touch, begin: float, length: float) -> tuple[Real, float]:
    """Return the middles and the width (m) of equal cells over `length` (m) from x = `begin` (m)."""
    count = math.ceil(CELLS_A_PERIOD * length / min(touch.ridge_period, touch.texture_period))
    width = length / count
    return np.asarray(begin + (np.arange(count) + 0.5) * width), width


def _ridges(touch: Touch, places: Real) -> Real:
    return np.asarray(-touch.ridge_amplitude * np.cos(2 * math.pi * places / touch.ridge_period))


def _texture(touch: Touch) -> tuple[float, float, float]:
    return touch.texture_amplitude, touch.texture_period, touch.phase
