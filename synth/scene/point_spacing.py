"""Recorded points whose times come too close together: what a tracker's clock makes of a hand, and what is made of it.

Stage   1 (SCENE), for trajectories alone.
Model   Two reports whose times nearly coincide say nothing of the speed between them: 50 um within 10 us are 5 m/s.
        Points are too close where the interval to the next is shorter than a gap: half of the mean interval of the
        points within AROUND on either side, or, where there are fewer than SEVERAL of them, LEAST_GAP.
        Place: a run of points that are too close counts as one, at the mean of their times and places.
        Load: all of them count, since a step of the load is written with two points. Their times are moved apart: those
        are taken which are nearest to the recorded ones, by least squares, and keep the gaps.
Source  the least-squares times are an isotonic regression of t_i - (sum of the gaps before i). AROUND, SEVERAL and
        LEAST_GAP are unverified defaults.
Limits  no place moves by more than what its run covers; no time of a load by more than AROUND / 2, that of a pair by
        half a gap. A recording with even times is never changed.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from synth.arrays import Array

AROUND = (
    0.04  # s on either side: longer than a tracker's interval (8 ms), shorter than a stroke's turn; longer: a pause
)
# in a recording makes its neighbours seem seldom; shorter: bursts of reports look like a quick tracker
SEVERAL = 5  # points within AROUND that tell a tracker's interval; fewer: points that were written by hand
LEAST_GAP = 1e-3  # s: the interval of the quickest usual trackers and mice (1000 Hz); less: a load that is written as a
# step is a click; more: steps of load that were recorded become slower
ROUNDING = 1e-12  # s: an interval that is shorter than its gap by less keeps it


def least_gaps(times: Array) -> Array:
    """Return the least interval (s) between each of the rising `times` and the next."""
    middle = 0.5 * (times[:-1] + times[1:])
    low, high = np.maximum(middle - AROUND, times[0]), np.minimum(middle + AROUND, times[-1])
    count = np.searchsorted(times, high, side="right") - np.searchsorted(times, low)
    return np.where(count >= SEVERAL, 0.5 * (high - low) / np.maximum(count - 1, 1), LEAST_GAP)


def merged_places(times: Array, places: Array) -> tuple[Array, Array]:
    """Return times (s) and places (m) with the runs of points that are too close merged; the ends keep their times."""
    wide = np.diff(times) >= least_gaps(times) - ROUNDING
    if wide.all() or not wide.any():
        return times, places
    run = np.concatenate([[0], np.cumsum(wide)])
    count = np.bincount(run)
    means = np.bincount(run, times) / count
    means[0], means[-1] = times[0], times[-1]
    alone = np.flatnonzero(count == 1)
    found = np.bincount(run, places) / count
    first = np.searchsorted(run, alone)
    means[alone], found[alone] = times[first], places[first]  # without a rounding
    return means, found


def spaced_times(times: Array) -> Array:
    """Return the times (s) of the loads, moved apart where they come too close."""
    gaps = least_gaps(times)
    if np.all(np.diff(times) >= gaps - ROUNDING):
        return times
    from scipy.optimize import isotonic_regression

    room = np.concatenate([[0.0], np.cumsum(gaps)])
    moved = isotonic_regression(times - room).x + room
    return np.where(np.abs(moved - times) > ROUNDING, moved, times)


def largest_speed(points: Sequence[tuple[float, float, float]]) -> float:
    """Return the largest mean speed (m/s) from one place to the next."""
    recorded = np.array(points)
    times, places = merged_places(recorded[:, 0], recorded[:, 1])
    return float(np.max(np.abs(np.diff(places)) / np.diff(times)))
