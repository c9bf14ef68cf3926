"""Where a hand is expected, from updates that come late, seldom, jittered, or with rough positions.

Model   An update of time t arrives at now = frame / rate. The smallest of the last KEPT values of now - t is how far
        the clocks are apart, and an update is late by what its own exceeds that. Its position p is carried on from its
        own time along the slope u of a straight line, fitted by least squares to the updates of the last WINDOW
        seconds: p + u (late + s). The interval of updates is the median of the last PACED.
Source  the design's live protocol; what each number was measured against is in docs/live-motion.md.
Limits  a clock that drifts by more than CREEP is followed late. Positions are of one finger on one line.
"""

from __future__ import annotations

import numpy as np

from synth.arrays import Array
from synth.kernels import signed_kernel, unfused

KEPT = 16  # updates whose lateness counts; fewer: a burst of late ones looks like another clock
PACED = 8  # intervals whose median counts; fewer: a lost update looks like another rate
POINTS = 64  # positions that are kept: WINDOW at 1000 Hz and more

WINDOW = 0.04  # s of updates that give the speed; longer: late at turns; shorter: mice and time stamps sound rough
SHORTEST_SPAN = 2e-3  # s: positions closer in time say nothing of the speed; smaller: rounded time stamps give bursts
PAUSE = 0.25  # s without an update (the watchdog's default) after which the old ones say nothing
FIRST_INTERVAL = 1.0 / 60.0  # s that updates are apart until two are known; unverified default

CREEP = 2e-3  # s a second by which later arrivals move the clock: drift is 1e-4; more is heard as a change of pitch
RETURN = 0.02  # s a second by which earlier ones do: a pitch wrong by 2 % at most; less: late for long at the beginning
HASTE, HURRY = 0.05, 0.01  # s a second of either where the difference is beyond HURRY s: the path has changed
OTHER_CLOCK = 0.1  # s of difference that is taken over at once: a client that restarts, a stream that runs ahead
LATEST = 0.05  # s that an update is carried on for its lateness; more: an error of the clocks throws the finger off
FASTEST = 10.0  # m/s: the end of the protocol's range

TIME, CLOCK, ARRIVALS, PLACES, INTERVALS, INTERVAL, SLOPE = range(7)
"""Entries of a track: time of the newest update (s), clocks apart (s), counts of arrivals, positions and intervals
known, the interval (s) and the slope (m/s); then LATENESS, PACES, TIMES and POSITIONS, rings."""
LATENESS = 7
PACES = LATENESS + KEPT
TIMES = PACES + PACED
POSITIONS = TIMES + POINTS
ENTRIES = POSITIONS + POINTS


def new_track() -> Array:
    """Return a track without updates."""
    track = np.zeros(ENTRIES)
    track[INTERVAL] = FIRST_INTERVAL
    return track


@unfused
def late_by(track: Array, now: float, time: float, silent: bool) -> float:
    """Return how late (s) an update is that has come at `now`, and learn of the clocks and the interval from it.

    silent: nothing sounds, so that a difference of the clocks may be taken over at once.
    """
    known = int(track[ARRIVALS])
    passed = time - track[TIME]
    if known > 0 and not passed > 0.0:  # the clock was set back: what was learnt is of another one
        known, track[PLACES], track[INTERVALS] = 0, 0.0, 0.0
    elif known > 0:
        _pace(track, passed)
    lateness = track[LATENESS:PACES]
    lateness[known % KEPT] = now - time
    least = lateness[0]
    for i in range(1, min(known + 1, KEPT)):
        least = min(least, lateness[i])
    gap, step = least - track[CLOCK], min(max(passed, 0.0), PAUSE)
    if known == 0 or silent or not abs(gap) < OTHER_CLOCK:
        track[CLOCK] = least
    elif gap < 0.0:
        track[CLOCK] = max(least, track[CLOCK] - (RETURN if gap > -HURRY else HASTE) * step)
    else:
        track[CLOCK] = min(least, track[CLOCK] + (CREEP if gap < HURRY else HASTE) * step)
    track[TIME], track[ARRIVALS] = time, known + 1
    return float(min(max((now - time) - track[CLOCK], -LATEST), LATEST))


@unfused
def _pace(track: Array, passed: float) -> None:
    """Learn from an interval (s), unless it is a pause: after one the old positions and speed say nothing."""
    if passed > PAUSE:
        track[PLACES], track[SLOPE] = 0.0, 0.0
        return
    paces, known = track[PACES:TIMES], int(track[INTERVALS])
    paces[known % PACED] = passed
    track[INTERVALS], track[INTERVAL] = known + 1, _median(paces, min(known + 1, PACED))


@unfused
def _median(values: Array, count: int) -> float:
    """Return the median of the first `count` values, the upper one of two; each is compared with all: there are few."""
    for i in range(count):
        smaller, equal = 0, 0
        for j in range(count):
            smaller += values[j] < values[i]
            equal += values[j] == values[i]
        if smaller <= count // 2 < smaller + equal:
            return float(values[i])
    return float(values[0])


@unfused
def slope_with(track: Array, time: float, position: float) -> float:
    """Return the speed (m/s) that the positions so far and this one tell, and keep this one."""
    times, positions, known = track[TIMES:POSITIONS], track[POSITIONS:ENTRIES], int(track[PLACES])
    n, t_sum, p_sum, tt, tp, span = 1.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for back in range(1, min(known, POINTS - 1) + 1):
        t, p = times[(known - back) % POINTS] - time, positions[(known - back) % POINTS] - position
        if n > 1.0 and t < -WINDOW:
            break
        n, t_sum, p_sum, tt, tp, span = n + 1.0, t_sum + t, p_sum + p, tt + t * t, tp + t * p, -t
    times[known % POINTS], positions[known % POINTS] = time, position
    track[PLACES] = known + 1
    if span >= SHORTEST_SPAN:
        track[SLOPE] = min(max((n * tp - t_sum * p_sum) / (n * tt - t_sum * t_sum), -FASTEST), FASTEST)
    return float(track[SLOPE])


@signed_kernel("void(f8[::1], f8)", fused=False)
def begin_anew(track: Array, slope: float) -> None:
    """Forget the positions: the finger is elsewhere, and moves at `slope` (m/s) for all that is known."""
    track[PLACES], track[SLOPE] = 0.0, slope
