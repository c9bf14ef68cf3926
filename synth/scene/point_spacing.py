"""Merge or move apart the points of a recorded motion that are too close in time.

Stage   1 (SCENE), for trajectories only.
Model   Points that are nearly simultaneous do not define a speed: 50 um within 10 us are 5 m/s. A tracker's clock can
        give such times. Two points are too close if the interval between them is shorter than the gap. The gap is half
        the mean interval of the points within AROUND on either side, or LEAST_GAP if there are fewer than SEVERAL such
        points.
        Position: a run of points that are too close counts as one point, at the mean of their times and positions.
        Load: every point counts, because a step of the load is written with two points. The times are moved apart until
        no interval is shorter than its gap, but stay as near as possible to the recorded times (least squares).
Source  The least-squares times are an isotonic regression of t_i - (sum of the gaps before i). AROUND, SEVERAL and
        LEAST_GAP are unverified defaults.
Limits  No position moves by more than the extent of its run. No time of a load moves by more than AROUND / 2; the times
        of a pair move by half a gap at most. A recording with even times is never changed.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from synth.arrays import Array

AROUND = 0.04
"""s on either side of an interval: longer than the interval of a tracker (8 ms), shorter than the turn of a stroke.
With a larger value, a pause in a recording makes the points next to it look sparse. With a smaller value, a burst of
reports looks like a fast tracker."""

SEVERAL = 5
"""Points within AROUND from which a tracker's interval is estimated. Fewer points were probably written by hand."""

LEAST_GAP = 1e-3
"""s. The interval of the fastest common trackers and mice (1000 Hz). With a smaller value, a load written as a step
sounds as a click. With a larger value, recorded steps of the load become slower."""

ROUNDING = 1e-12
"""s. An interval may be shorter than its gap by this much."""


def least_gaps(times: Array) -> Array:
    """Return the shortest permitted interval (s) between each of the rising `times` and the next."""
    middle = 0.5 * (times[:-1] + times[1:])
    low, high = np.maximum(middle - AROUND, times[0]), np.minimum(middle + AROUND, times[-1])
    count = np.searchsorted(times, high, side="right") - np.searchsorted(times, low)
    return np.where(count >= SEVERAL, 0.5 * (high - low) / np.maximum(count - 1, 1), LEAST_GAP)


def merged_places(times: Array, places: Array) -> tuple[Array, Array]:
    """Return times (s) and places with each run of too close points merged. The first and last times stay.

    places: [points], or [coordinates, points]; each in m, or rad.
    """
    wide = np.diff(times) >= least_gaps(times) - ROUNDING
    if wide.all() or not wide.any():
        return times, places
    run = np.concatenate([[0], np.cumsum(wide)])
    count = np.bincount(run)
    means = np.bincount(run, times) / count
    means[0], means[-1] = times[0], times[-1]
    alone = np.flatnonzero(count == 1)
    rows = np.atleast_2d(places)
    found = np.stack([np.bincount(run, row) / count for row in rows])
    first = np.searchsorted(run, alone)
    means[alone], found[:, alone] = times[first], rows[:, first]  # exact, without the rounding of a mean
    return means, found.reshape(*np.shape(places)[:-1], len(count))


def spaced_times(times: Array) -> Array:
    """Return the times (s) of the loads, moved apart where they are too close."""
    gaps = least_gaps(times)
    if np.all(np.diff(times) >= gaps - ROUNDING):
        return times
    from scipy.optimize import isotonic_regression

    room = np.concatenate([[0.0], np.cumsum(gaps)])
    moved = isotonic_regression(times - room).x + room
    return np.where(np.abs(moved - times) > ROUNDING, moved, times)


def largest_speed(points: Sequence[tuple[float, ...]]) -> float:
    """Return the largest mean speed (m/s) between successive positions, or places over an area, after merging.

    It is negative where the fastest step between two positions is backwards.
    """
    recorded = np.array(points).T
    if len(recorded) > 3:
        times, places = merged_places(recorded[0], recorded[1:3])
        return float(np.max(np.hypot.reduce(np.diff(places), axis=0) / np.diff(times)))
    times, places = merged_places(recorded[0], recorded[1:2])
    speeds = np.diff(places[0]) / np.diff(times)
    return float(speeds[np.argmax(np.abs(speeds))])
