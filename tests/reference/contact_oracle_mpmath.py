"""The dimensionless contact in 40 digits, slower still and by a different method, to validate ``contact_oracle``.

Model   integral_0^tau max(A cos(2 pi X / Lambda - 2 pi theta + phi) - cos(2 pi X) - Z, 0) dX = W, solved for Z.
Source  Fagiani & Barbieri 2016, eqs 1, 2 and 7.
Method  No critical points are sought. For a given Z the length is halved until h, h' and the largest curvature prove of
        each cell that it touches everywhere, that it is free everywhere, or that h is monotone on it. Then the edge is
        polished and the plain antiderivative is evaluated; additional digits pay for its cancellation. Newton from
        full contact.
Limits  |error of Z| < 1e-30 (1 + A) for W/tau >= 1e-14; below 1e-20 the digits run out. 0.1 to 10 s per case.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from mpmath.ctx_mp import MPContext

#: Decimal digits carried, and the size, relative to 1 + A, below which a height counts as nothing.
DIGITS = 50
NOTHING = "1e-42"
#: Newton stops when a step is this small against 1 + A + |Z|.
SETTLED = "1e-36"
#: Cells are not halved below this share of the length; by then h moves by less than NOTHING on a cell that touches Z.
MOST_HALVINGS = 90


@dataclass(frozen=True)
class ExactContact:
    """Mpmath numbers: approach Z, contact length |C|, dZ/dW, dZ/dtheta, and the number of separate patches."""

    approach: Any
    contact_length: Any
    load_slope: Any
    phase_slope: Any
    patches: int


@dataclass
class _Profile:
    """The profile of one case, with a cache of heights and slopes."""

    context: Any
    tau: Any
    period: Any
    texture: Any
    offset: Any
    known: dict[Any, tuple[Any, Any]] = field(default_factory=dict)

    @property
    def bend(self) -> Any:
        """Bound of |h''|."""
        return (2 * self.context.pi) ** 2 * (1 + self.texture / self.period**2)

    def at(self, position: Any) -> tuple[Any, Any]:
        """H and h' at ``position``."""
        if position not in self.known:
            turn = 2 * self.context.pi
            cos1, sin1 = self.context.cos_sin(turn * position)
            cos2, sin2 = self.context.cos_sin(turn * (position / self.period + self.offset))
            height = self.texture * cos2 - cos1
            self.known[position] = height, turn * (sin1 - self.texture / self.period * sin2)
        return self.known[position]

    def sums_to(self, position: Any) -> tuple[Any, Any]:
        """Antiderivatives of h and of dh/dtheta at ``position``."""
        turn = 2 * self.context.pi
        cos2, sin2 = self.context.cos_sin(turn * (position / self.period + self.offset))
        area = self.texture * self.period * sin2 / turn - self.context.sin(turn * position) / turn
        return area, -self.texture * self.period * cos2


def solve_exactly(
    tau: float, period_ratio: float, amplitude_ratio: float, load: float, theta: float, phi: float = 0.0
) -> ExactContact:
    """Z(theta) of eq. 7 for one case (arguments as in ``contact_oracle.solve_contact``); ``load`` must be above zero.

    ValueError without load; ArithmeticError when Newton does not settle in 300 steps.
    """
    if not load > 0:
        raise ValueError("load must be above zero")
    context = MPContext()
    context.dps = DIGITS
    number = context.mpf
    offset = number(phi) / (2 * context.pi) - number(theta)
    profile = _Profile(context, number(tau), number(period_ratio), number(amplitude_ratio), offset)
    start, stop = profile.sums_to(number(0)), profile.sums_to(profile.tau)
    approach = (stop[0] - start[0] - number(load)) / profile.tau
    for _ in range(300):
        patches = _patches(profile, approach)
        area, length, phase = _sums(profile, patches, approach)
        step = (area - number(load)) / length
        approach += step
        if abs(step) < number(SETTLED) * (1 + profile.texture + abs(approach)):
            return ExactContact(approach, length, -1 / length, phase / length, len(patches))
    raise ArithmeticError("the contact did not settle in 300 steps")


def _sums(profile: _Profile, patches: list[list[Any]], approach: Any) -> tuple[Any, Any, Any]:
    """Area above the approach, contact length, and integral of dh/dtheta over the patches."""
    area = length = phase = profile.context.mpf(0)
    for left, right in patches:
        area_left, phase_left = profile.sums_to(left)
        area_right, phase_right = profile.sums_to(right)
        area += area_right - area_left - approach * (right - left)
        phase += phase_right - phase_left
        length += right - left
    return area, length, phase


def _patches(profile: _Profile, approach: Any) -> list[list[Any]]:
    """The touching intervals [left, right] at this approach, from left to right, neighbours joined."""
    nothing = profile.context.mpf(NOTHING) * (1 + profile.texture)
    patches: list[list[Any]] = []
    cells = [(profile.context.mpf(0), profile.tau, 0)]
    while cells:
        left, right, halvings = cells.pop()
        part = _decide(profile, approach, left, right, nothing if halvings < MOST_HALVINGS else profile.context.inf)
        if part is None:
            middle = (left + right) / 2
            cells += [(middle, right, halvings + 1), (left, middle, halvings + 1)]
        elif part and patches and patches[-1][1] == part[0]:
            patches[-1][1] = part[1]
        elif part:
            patches.append(part)
    return patches


def _decide(profile: _Profile, approach: Any, left: Any, right: Any, nothing: Any) -> list[Any] | None:
    """The touching part of a cell: [] when free, [left, right] when the whole touches, None when it must be halved."""
    middle, reach = (left + right) / 2, (right - left) / 2
    height, slope = profile.at(middle)
    change = abs(slope) * reach + profile.bend * reach**2 / 2
    above = height - approach
    if abs(above) > change or change < nothing:
        return [left, right] if above > 0 else []
    if abs(slope) <= profile.bend * reach:
        return None
    above_left, above_right = profile.at(left)[0] - approach, profile.at(right)[0] - approach
    if (above_left > 0) == (above_right > 0):
        return [left, right] if above_left > 0 else []
    edge = _edge(profile, approach, left, right, above_right > 0)
    return [edge, right] if above_right > 0 else [left, edge]


def _edge(profile: _Profile, approach: Any, left: Any, right: Any, rising: bool) -> Any:
    """The place where a monotone h crosses the approach: Newton inside a shrinking bracket, else bisection."""
    smallest = (right - left) * profile.context.mpf(10) ** (-DIGITS // 2 - 8)
    position = (left + right) / 2
    while right - left > smallest:
        height, slope = profile.at(position)
        if (height > approach) == rising:
            right = position
        else:
            left = position
        newton = position - (height - approach) / slope
        trusted = left < newton < right
        following = newton if trusted else (left + right) / 2
        if trusted and abs(following - position) < smallest:
            return following
        position = following
    return position
