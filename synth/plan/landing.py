"""Solve a recording as often as its quickest landing or lift requires, and measure the folded error there.

Stage   2, used by `preparation`, after `frame_solver` has planned a recording whose load varies.
Model   Where the load begins or ends, z changes within a fraction of a millisecond. The place where the load changes
        most within RISE is solved with the planned number of solutions and with twice as many. The change is the folded
        error. While it exceeds its share of the tolerance, there are more solutions, within the limits on work and
        memory of `frame_solver`, and up to MOST_FINER times as many. What remains is part of the errors. Numbers that
        take more than LONGEST are not solved here: the error is then extrapolated. If the steady motion is below 1 nm,
        the error is relative to the motion about the place.
Source  design, section 4. In some 40 recordings (three fingers, landings of 2 to 30 ms) the error was 0.8 to 1.34 times
        the change.
Limits  Only the quickest place is solved, and not at the tightest tolerances, where MANY solutions take longer than
        LONGEST.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from synth.arrays import Array
from synth.contact.load_balance import Contact
from synth.motion.motion import LOAD
from synth.motion.scan_motion import ScanMotion
from synth.plan.channels import SteadyScan, extent_and_peak
from synth.plan.frame_solver import (
    FALL,
    FOLDED,
    FOLDED_SHARE,
    FRAME_SETUP,
    MARGIN,
    MOST_TOGETHER,
    PATIENCE,
    SEEN,
    FramePlan,
    FrameSolver,
    solution_nanoseconds,
)
from synth.plan.motion_peak import LOOK_RATE, LOOKS
from synth.response.mean_approach import Mean
from synth.scene.scene import Scene

RISE = 1e-3  # s
LONGEST = 10.0  # s of predicted work; over an area a third of it or less is spent at 0.3 N
MANY = 16  # solutions per stride: with more, the constants of `frame_solver` hold
MOST_FINER = 16  # times the planned number: no render takes longer than this; 2 ms landings of a fingertip need 15
ROUNDS = 6  # most increases of the number of solutions
SURE_FALL = 2.0  # power with which the error falls at least; FALL is reached with many solutions only
OVER_CHANGE = 1.5  # error over the change by twice as many solutions: a fingertip lands with up to 1.34


def at_landings(steady: SteadyScan, plan: FramePlan, contact: Contact, mean: Mean, tolerance: float) -> FramePlan:
    """Return `plan` with the solutions and the errors that the quickest landing or lift requires.

    steady: a recording whose load varies, at its own speed and load.
    contact: on the whole surface.
    mean: mean of z over a period, as for `FrameSolver`.
    """
    scene, place = steady.scene, _quickest(steady.scene)
    if place is None:
        return plan
    solution = 1e-9 * (solution_nanoseconds(contact) + FRAME_SETUP)
    strides = 4.0 * MARGIN / (plan.scale * plan.stride)  # of a chunk with its margins
    most = min(MOST_TOGETHER / strides, plan.count * PATIENCE / (plan.work * scene.output.duration))
    most = min(most, MOST_FINER * plan.count)
    looked = LONGEST / (3.0 * strides * solution)  # the place is solved at this number and at twice as many
    if plan.count > looked >= MANY:
        return plan

    def at_place(count: int) -> Array:
        """Return the frames about the place with `count` solutions per stride, SI [orders, frames]."""
        rate, size = scene.output.sample_rate, (plan.stride, plan.scale)
        solver = FrameSolver(contact.heights, scene, mean, rate, count=count, stride=size[0], scale=size[1], longest=0)
        return solver.solved(math.floor(place * rate / solver.chunk), steady.orders)

    count, allowed = max(1, math.floor(min(plan.count, looked))), FOLDED_SHARE * tolerance
    extents = np.array([extent_and_peak(steady.series(order))[0] for order in steady.orders])
    least = np.array([steady.least(order) for order in steady.orders])
    if np.any(extents <= least):  # then the steady motion is no measure
        own = np.where(extents <= least, np.maximum(np.ptp(at_place(count), axis=1), least), extents)
        if not own.all():
            return plan
        plan = replace(plan, errors=tuple((np.array(plan.errors) * np.maximum(extents, least) / own).tolist()))
        extents = own
    for step in range(ROUNDS + 1):
        error = OVER_CHANGE * np.max(np.abs(at_place(2 * count) - at_place(count)), axis=1) / extents
        excess = float(np.max(error)) / allowed
        wanted = math.floor(min(most, looked, math.ceil(count * excess ** (1.0 / FALL))))
        if wanted <= count or step == ROUNDS:
            break
        count = wanted
    wanted = max(plan.count, math.floor(min(most, math.ceil(count * excess ** (1.0 / SURE_FALL)))))
    if wanted > count:  # too many to be solved here
        count, error = wanted, error * (count / wanted) ** SURE_FALL
    counted = [FOLDED[order] * (SEEN / plan.count) ** FALL for order in steady.orders]
    beyond = np.maximum(error - counted, 0.0)
    return replace(plan, count=count, work=plan.work * count / plan.count).with_errors(beyond)


def _quickest(scene: Scene) -> float | None:
    """Return the time (s) at which the load begins or ends most quickly; None if it never does."""
    seconds = scene.output.duration
    rate = min(LOOK_RATE, LOOKS / seconds)
    looked = ScanMotion(scene, rate)
    load = looked.at(0, math.ceil(seconds * rate) + 1).samples[LOAD]
    changes = np.flatnonzero((load[1:] > 0.0) != (load[:-1] > 0.0))
    if not len(changes):
        return None
    reach = max(1, round(RISE * rate))
    before, after = np.maximum(changes - reach, 0), np.minimum(changes + 1 + reach, len(load) - 1)
    place = changes[np.argmax(np.maximum(load[before], load[after]))]
    return float(place) / rate
