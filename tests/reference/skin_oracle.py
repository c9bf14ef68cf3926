"""A finger of viscous skin, one element and one step at a time: the twin of the engine's stepper.

Model   Elements at equal distances on h of Fagiani & Barbieri (2016), eq. 2. Each element carries two histories: of
        skin held by the surface since it first touched, and of skin left free since it last touched. The indentation to
        which an element would recover without pressure is the larger of both. Between two elements both histories are
        straight lines, and p is kappa A max(h - z - recovered, 0). z balances the load, or a mass on a
        spring, by SciPy's ``brentq``.
Source  Kelvin-Voigt with p constant over a step; relaxing springs with e linear over a step. Textbook forms.
Limits  Slow: 50 us per element and step. Independent of the engine.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import pairwise

from scipy.optimize import brentq


@dataclass(frozen=True)
class Skin:
    """Viscous skin.

    recovery: tau of Kelvin-Voigt, s, or None.
    times, weights: of relaxing springs, s, and parts of the stiffness.
    """

    recovery: float | None = 0.004
    times: tuple[float, ...] = ()
    weights: tuple[float, ...] = ()


@dataclass(frozen=True)
class Foundation:
    """Amplitudes, periods and length in metres, phase in rad; k = coefficient * load**power (N/m).

    spring: N/m, of a mass.
    rest: z (m) at which the spring has no force, at a load (N).
    """

    ridge_amplitude: float
    ridge_period: float
    texture_amplitude: float
    texture_period: float
    texture_phase: float
    length: float
    elements: int
    coefficient: float
    power: float
    skin: Skin
    step: float
    mass: float = 0.0
    damping: float = 0.0
    spring: float = 0.0
    rest: Callable[[float], float] = lambda _load: 0.0

    def finger(self, x: float) -> float:
        return -self.ridge_amplitude * math.cos(2 * math.pi * x / self.ridge_period)

    def texture(self, x: float, turns: float) -> float:
        angle = 2 * math.pi * (x / self.texture_period - turns) + self.texture_phase
        return self.texture_amplitude * math.cos(angle)

    def texture_slope(self, x: float, turns: float) -> float:
        angle = 2 * math.pi * (x / self.texture_period - turns) + self.texture_phase
        return -self.texture_amplitude * 2 * math.pi / self.texture_period * math.sin(angle)

    def places(self) -> list[float]:
        return [self.length * j / (self.elements - 1) for j in range(self.elements)]

    def heights(self, turns: float) -> list[float]:
        return [self.finger(x) + self.texture(x, turns) for x in self.places()]

    def modulus(self, load: float) -> float:
        """Return kappa, N/m^2."""
        return float(self.coefficient * load**self.power / self.length)


@dataclass
class Element:
    """A history of one element: indentation (m), and that of each relaxing spring."""

    indentation: float
    springs: list[float] = field(default_factory=list)


@dataclass
class Finger:
    """The state of a finger.

    The fields are z (m), z' (m/s), load and sum of the pressure (N), and the two histories of each element.
    dissipated: energy in the dashpots of Kelvin-Voigt since the start, J.
    force: on the texture's slope in the last step, N.
    """

    z: float
    velocity: float
    load: float
    pressing: float
    turns: float
    held: list[Element]
    free: list[Element]
    dissipated: float = 0.0
    force: float = 0.0


def hardness(skin: Skin, step: float) -> float:
    """Return p / kappa at the end of a step per metre of indentation beyond the recovered one."""
    if skin.recovery is not None:
        return 1 / (1 - math.exp(-step / skin.recovery))
    rest = 1 - sum(skin.weights)
    lasting = (g * t / step * (1 - math.exp(-step / t)) for g, t in zip(skin.weights, skin.times, strict=True))
    return (rest + sum(lasting)) / rest


def recovered(element: Element, skin: Skin, step: float) -> float:
    """Return the indentation of an element a step later without pressure."""
    if skin.recovery is not None:
        return element.indentation * math.exp(-step / skin.recovery)
    rest = 1 - sum(skin.weights)
    pull, stiffness = 0.0, rest
    for g, t, q in zip(skin.weights, skin.times, element.springs, strict=True):
        lasting = t / step * (1 - math.exp(-step / t))
        stiffness += g * lasting
        pull += g * lasting * element.indentation - g * math.exp(-step / t) * q
    return pull / stiffness


def moved(element: Element, indentation: float, skin: Skin, step: float) -> Element:
    """Return the element a step later, after an even change to `indentation`."""
    change = indentation - element.indentation
    springs = [
        q * math.exp(-step / t) + t / step * (1 - math.exp(-step / t)) * change
        for q, t in zip(element.springs, skin.times, strict=True)
    ]
    return Element(indentation, springs)


Piece = tuple[float, float, float, float]
"""A straight piece of the modified profile: x and height at one end, x and height at the other (m)."""


def pieces_of(places: list[float], heights: list[float], held: list[float], free: list[float]) -> list[Piece]:
    """Return the straight pieces of h - max(held, free), each line joined from element to element."""
    found: list[Piece] = []
    for j in range(len(places) - 1):
        stops = [0.0, 1.0]
        before, after = held[j] - free[j], held[j + 1] - free[j + 1]
        if before * after < 0:
            stops.insert(1, before / (before - after))
        ends = []
        for s in stops:
            line = [(1 - s) * row[j] + s * row[j + 1] for row in (places, heights, held, free)]
            ends.append((line[0], line[1] - max(line[2], line[3])))
        found += [(*one, *two) for one, two in pairwise(ends)]
    return found


def above(pieces: list[Piece], z: float) -> list[Piece]:
    """Return the parts of the pieces above z: x and height above z at both ends."""
    found = []
    for x0, g0, x1, g1 in pieces:
        p, q = g0 - z, g1 - z
        if p > 0 and q > 0:
            found.append((x0, p, x1, q))
        elif p > 0:
            found.append((x0, p, x0 + (x1 - x0) * p / (p - q), 0.0))
        elif q > 0:
            found.append((x1 - (x1 - x0) * q / (q - p), 0.0, x1, q))
    return found


def area(pieces: list[Piece], z: float) -> float:
    """Return the area above z, m^2."""
    return math.fsum(0.5 * (p + q) * (x1 - x0) for x0, p, x1, q in above(pieces, z))


def elastic_z(foundation: Foundation, turns: float, load: float, spring: float = 0.0) -> float:
    """Return z (m) of the elastic contact, on a spring (N/m)."""
    heights, nothing = foundation.heights(turns), [0.0] * foundation.elements
    pieces = pieces_of(foundation.places(), heights, nothing, nothing)
    modulus, home = foundation.modulus(load), foundation.rest(load)

    def excess(z: float) -> float:
        return area(pieces, z) - (load + spring * (z - home)) / modulus

    low = min(min(heights) - load / modulus / foundation.length - 1e-9, home if spring else math.inf)
    high = max(max(heights), home if spring else -math.inf)
    return float(brentq(excess, low, high, xtol=1e-24, rtol=1e-15))


def rested(foundation: Foundation, turns: float, load: float, velocity: float = 0.0) -> Finger:
    """Return relaxed skin in balance with the load and the spring."""
    z, springs = elastic_z(foundation, turns, load, foundation.spring), len(foundation.skin.times)
    pressing = load + foundation.spring * (z - foundation.rest(load))
    held = [Element(h - z, [0.0] * springs) for h in foundation.heights(turns)]
    free = [Element(0.0, [0.0] * springs) for _ in held]
    return Finger(z, velocity, load, pressing, turns, held, free)


def go_on(foundation: Foundation, finger: Finger, turns: float, load: float) -> float:
    """Advance `finger` by a step to `turns` and `load`; return the static z (m) there."""
    skin, h, m, c = foundation.skin, foundation.step, foundation.mass, foundation.damping
    when = 1.0
    if skin.recovery is not None:
        when = 1 / (1 - math.exp(-h / skin.recovery)) - skin.recovery / h
    pressed = finger.load + when * (load - finger.load)
    full = foundation.modulus(pressed) * hardness(skin, h)
    places, heights = foundation.places(), foundation.heights(turns)
    held = [recovered(e, skin, h) for e in finger.held]
    free = [recovered(e, skin, h) for e in finger.free]
    home = (foundation.rest(finger.load) + foundation.rest(load)) / 2
    pieces = pieces_of(places, heights, held, free)

    def excess(z: float) -> float:
        force, wanted = full * area(pieces, z), pressed
        if skin.recovery is None and m > 0:
            force, wanted = (force + finger.pressing) / 2, (load + finger.load) / 2
        inertia = 2 * m / h * ((z - finger.z) / h - finger.velocity) + c * (z - finger.z) / h
        return force - wanted - inertia - foundation.spring * ((finger.z + z) / 2 - home)

    low = high = finger.z
    while excess(low) < 0:
        low -= 1e-7 + 2 * (finger.z - low)
    while excess(high) > 0:
        high += 1e-7 + 2 * (high - finger.z)
    z = float(brentq(excess, low, high, xtol=1e-24, rtol=1e-15))
    finger.force = slope_force(foundation, pieces, z, full, turns - (1 - when) * (turns - finger.turns))
    finger.pressing = full * area(pieces, z)
    for j, height in enumerate(heights):
        advance(foundation, finger, j, height - z, held[j], free[j], foundation.modulus(pressed))
    finger.velocity = 2 * (z - finger.z) / h - finger.velocity if m > 0 else 0.0
    finger.z, finger.load, finger.turns = z, load, turns
    return elastic_z(foundation, turns, load)


def advance(
    foundation: Foundation, finger: Finger, j: int, depth: float, held: float, free: float, modulus: float
) -> None:
    """Advance element `j` to the end of the step.

    held, free: the recovered indentations of its two histories.
    """
    skin, step = foundation.skin, foundation.step
    was_held, touches = held >= free, depth > max(held, free)
    before = max(finger.held[j].indentation, finger.free[j].indentation)
    held_from = finger.free[j] if touches and not was_held else finger.held[j]
    free_from, recovers_to = (finger.held[j], held) if was_held and not touches else (finger.free[j], free)
    finger.held[j] = moved(held_from, depth, skin, step)
    finger.free[j] = moved(free_from, recovers_to, skin, step)
    if skin.recovery is not None:
        speed = (max(finger.held[j].indentation, finger.free[j].indentation) - before) / step
        share = 0.5 if j in (0, foundation.elements - 1) else 1.0
        width = share * foundation.length / (foundation.elements - 1)
        finger.dissipated += modulus * skin.recovery * speed**2 * step * width


def slope_force(foundation: Foundation, pieces: list[Piece], z: float, full: float, turns: float) -> float:
    """Return the force (N) of the pressure on the texture's slope, which is linear between elements."""
    width, total = foundation.length / (foundation.elements - 1), 0.0

    def slope(x: float, j: int) -> float:
        s = x / width - j
        left, right = (foundation.texture_slope(i * width, turns) for i in (j, j + 1))
        return (1 - s) * left + s * right

    for x0, p, x1, q in above(pieces, z):
        j = min(int((x0 + x1) / 2 / width), foundation.elements - 2)
        middle = 4 * (p + q) / 2 * slope((x0 + x1) / 2, j)
        total -= (x1 - x0) / 6 * (p * slope(x0, j) + middle + q * slope(x1, j))  # Simpson: exact for a cubic
    return full * total
