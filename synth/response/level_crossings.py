"""The approach z at all places and loads, from the mean of max(h - z, 0) at levels of z.

Stage   RESPONSE: making a layered table.
Model   `area_layers` gives F at levels from the top down. At each place F reaches w / k between two levels. There F, or
        its square root where it rises steeply, is interpolated by the cubic through these levels and their neighbours,
        and z is where F equals w / k.
        F is too large by at most half of its second difference D over the layers, and by D / 12 on average. The average
        is subtracted first. F is convex and falls. Hence the exact z of the points is at most where the chord of F
        between two levels meets w / k. It is at least where an extrapolated line meets w / k: the line through F at one
        level and F - D / 2 at the next higher one.
Source  Fagiani & Barbieri (2016), eq. 1; Jensen's inequality for the bounds.
Limits  The points are those on the lattice. D over the layers is at most the change of the slope of F at a level. Its
        mean is estimated from the second difference over the levels.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from synth.arrays import Array
from synth.contact.area_layers import BATCH, AreaLayers, Floats, in_bands
from synth.kernels import inlined, signed_kernel

HISTORY = 8  # levels kept before a batch, so that every interval has two levels above it and five or more below
BEFORE = 2  # of the levels lie above the interval; the lower bound needs more below
MEAN_GAIN, MOST_GAIN = 1.0 / 12.0, 0.5  # mean and largest part of D by which two layers in place of a height raise F
STEPS = 2  # of Newton's method from the chord; with 8, z changes by 3e-5 of the distance of two levels
STEEP = 4.0  # ratio of F at the last and the first of four levels, above which its square root is interpolated
CHUNK = 1024  # places


@dataclass(frozen=True, slots=True)
class Crossings:
    """z at some places and targets w / k.

    heights: z, m, float32 [targets, places].
    below, above: m [targets]; the exact z of the points is at most this far below and above `heights`.
    """

    heights: Floats
    below: Array
    above: Array


def crossings(layers: AreaLayers, targets: Array, chosen: Any, more: Array) -> tuple[Crossings, Crossings]:
    """Return z at all places for `targets`, and at the `chosen` places (indices of the lattice) for `more` targets.

    targets, more: w / k (m), rising, above 0.
    """
    plan = layers.plan
    places, spacing = plan.places[0] * plan.places[1], float(plan.stride)
    window = np.zeros((HISTORY + BATCH, places), np.float32)
    depths: Array = spacing * np.arange(-BATCH - HISTORY, 0, dtype=np.float64)  # nothing touches above the top
    searches = [_Search.of(places, targets), _Search.of(len(chosen), more)]
    for levels, batch in layers.batches():
        window[:HISTORY] = window[BATCH:]
        window[HISTORY:] = batch.reshape(BATCH, -1)
        depths = np.concatenate([depths[BATCH:], float(plan.top) - levels])
        searches[0].search(window, depths, layers.workers)
        searches[1].search(np.ascontiguousarray(window[:, chosen]), depths, 1)
        if all(one.done for one in searches):
            break
    height = plan.step * layers.grid.height_scale
    return searches[0].found(plan.top, height), searches[1].found(plan.top, height)


@dataclass(frozen=True, slots=True)
class _Search:
    """The search for all targets, from the top down.

    reached: number of targets that were reached [places].
    depths: below the top, in steps [targets, places].
    misses: largest distances from z to its bounds below and above, in steps [chunks, 2, targets].
    """

    targets: Array
    reached: Any
    depths: Floats
    misses: Array

    @classmethod
    def of(cls, places: int, targets: Array) -> _Search:
        chunks = math.ceil(places / CHUNK)
        depths, misses = np.empty((len(targets), places), np.float32), np.zeros((chunks, 2, len(targets)))
        return cls(targets, np.zeros(places, np.int64), depths, misses)

    @property
    def done(self) -> bool:
        """Whether all targets were reached at all places."""
        return int(self.reached.min()) == len(self.targets)

    def search(self, window: Floats, depths: Array, workers: int) -> None:
        """Search between the levels of `window` [HISTORY + BATCH, places], at `depths` (steps)."""
        arguments = self.targets, depths, window, self.reached, self.depths, self.misses
        in_bands(partial(search, *arguments), len(self.misses), workers)

    def found(self, top: int, height: float) -> Crossings:
        """Return the result; top: number of the first level; height: of a step, m."""
        np.subtract(np.float32(top), self.depths, out=self.depths)
        self.depths[:] *= np.float32(height)
        below, above = height * self.misses.max(axis=0)
        return Crossings(self.depths, below, above)


@inlined
def slope_below(window, inverse, level, p):
    """Return the rise of F per step from a level to the next lower one."""
    return (np.float64(window[level + 1, p]) - np.float64(window[level, p])) * inverse[0, level]


@inlined
def bend_at(window, inverse, level, p):
    """Return the change of the slope of F at a level."""
    return slope_below(window, inverse, level, p) - slope_below(window, inverse, level - 1, p)


@inlined
def middle_at(window, inverse, level, p):
    """Return F minus the mean of its error; D is the change of the slope per step."""
    bend = bend_at(window, inverse, level, p) * 2.0 * inverse[1, level - 1]
    return max(window[level, p] - MEAN_GAIN * bend, 0.0)


@inlined
def crossing(depths, inverse, level, target, a, b, c, d):
    """Return the depth between `level` and the next at which F is the target; a, b, c, d: F at four levels around."""
    if a * STEEP < d:
        a, b, c, d, target = math.sqrt(a), math.sqrt(b), math.sqrt(c), math.sqrt(d), math.sqrt(target)
    up, gap = depths[level] - depths[level - 1], depths[level + 1] - depths[level]
    before, rise, after = (b - a) * inverse[0, level - 1], (c - b) * inverse[0, level], (d - c) * inverse[0, level + 1]
    second = (rise - before) * inverse[1, level - 1]
    third = ((after - rise) * inverse[1, level] - second) * inverse[2, level - 1]
    x = (target - b) / rise
    for _step in range(STEPS):  # the cubic is b + x (rise + (x - gap) (second + third (x + up)))
        inner = second + third * (x + up)
        slope = rise + (2.0 * x - gap) * inner + x * (x - gap) * third
        if slope > 0.0:
            x = min(max(x - (b - target + x * (rise + (x - gap) * inner)) / slope, 0.0), gap)
    return depths[level] + x


@inlined
def highest(window, depths, inverse, level, p, target):
    """Return the depth at which the chord of F meets the target; `level` is above the crossing, or shortly below."""
    while level > 1 and window[level, p] >= target:
        level -= 1
    return depths[level] + (target - window[level, p]) / slope_below(window, inverse, level, p)


@inlined
def lowest(window, depths, inverse, level, p, target):
    """Return the depth at which F minus its largest error meets the target; infinite if the window ends before that."""
    while level < len(window) - 1:
        least = window[level, p] - MOST_GAIN * bend_at(window, inverse, level, p)
        if least >= target:
            fall = (window[level + 1, p] - least) * inverse[0, level]
            return depths[level] - (least - target) / fall if fall > 0.0 else depths[level]
        level += 1
    return math.inf


@signed_kernel("void(f8[::1], f8[::1], f4[:,::1], i8[::1], f4[:,::1], f8[:,:,::1], i8, i8)")
def search(targets, depths, window, reached, found, misses, one, end):
    """Write the depth at which each target is reached in the window, at each place, from the top down.

    depths: of the levels of the window, in steps below the top.
    reached, found, misses: as in `_Search`.
    one, end: chunks of places.
    """
    inverse = np.zeros((3, len(depths)))  # 1 / distance of a level from the first, second and third after it
    for further in range(3):
        for level in range(len(depths) - 1 - further):
            inverse[further, level] = 1.0 / (depths[level + 1 + further] - depths[level])
    for chunk in range(one, end):
        below, above = misses[chunk, 0], misses[chunk, 1]
        for p in range(chunk * CHUNK, min((chunk + 1) * CHUNK, len(reached))):
            following = reached[p]
            for level in range(BEFORE, BEFORE + BATCH):
                if following == len(targets):
                    break
                c = middle_at(window, inverse, level + 1, p)
                if c < targets[following]:
                    continue
                a, b = middle_at(window, inverse, level - 1, p), middle_at(window, inverse, level, p)
                d = middle_at(window, inverse, level + 2, p)
                while following < len(targets) and targets[following] <= c:
                    target = targets[following]
                    depth = crossing(depths, inverse, level, target, a, b, c, d)
                    found[following, p] = depth
                    low = lowest(window, depths, inverse, level, p, target)
                    high = highest(window, depths, inverse, level, p, target)
                    below[following] = max(below[following], low - depth)
                    above[following] = max(above[following], depth - high)
                    following += 1
            reached[p] = following
