"""Expected position of a hand, from updates that are late, sparse, jittered or rounded.

Model   An update with time t arrives at now = frame / rate. The offset of the clocks follows the smallest of the last
        KEPT values of now - t. It takes a value that is earlier by LATEST at once, and the smallest of CHANGED in a row
        that are all later by as much: a stream stood still, or runs ahead. The lateness of an update is its own now - t
        minus that offset. Its position p is extrapolated at the slope u of a least-squares line through the updates of
        the last WINDOW seconds: s seconds after its arrival it is p + u (late + s). The interval of updates is the
        median of the last PACED intervals.
Source  The design's live protocol; docs/live-motion.md has the measurements behind each constant.
Limits  A clock that drifts by more than CREEP is followed with a lag. Positions are of one finger on one line.
"""

from __future__ import annotations

import numpy as np

from synth.arrays import Array
from synth.kernels import signed_kernel, unfused

KEPT = 16  # updates whose lateness counts; fewer: a burst of late ones looks like a new clock
PACED = 8  # intervals in the median; fewer: a lost update looks like a new rate
LONGEST_STALL = 1.0  # s, pause whose mean speed is that of a hand that was not heard of: a service skips longer ones
POINTS = 64  # positions that are kept: more than WINDOW at 1000 Hz

WINDOW = 0.04  # s of updates that determine the speed; longer: late at turns; shorter: mice and time stamps sound rough
SHORTEST_SPAN = 2e-3  # s: positions closer in time give no speed; smaller: rounded time stamps give bursts
PAUSE = 0.25  # s without an update, which are no interval; in silence the old ones are ignored (the watchdog's default)
FIRST_INTERVAL = 1.0 / 60.0  # s, assumed interval until two updates are known; unverified default

CREEP = 2e-3  # s per second by which later arrivals move the clock: drift is 1e-4; more is heard as a change of pitch
RETURN = 0.02  # the same for earlier arrivals: 2 % error of pitch at most; less: late for longer at the beginning
HASTE, HURRY = 0.05, 0.01  # s per second in place of both if the difference exceeds HURRY s: the network path changed
LATEST = 0.05  # s, longest extrapolation for lateness; more: an error of the clocks moves the finger far off. Arrivals
# that are earlier by more are adopted at once: a stream that stood still goes on. So are CHANGED later ones in a row
CHANGED = 4  # fewer: a burst of late ones looks like a new clock; more: the finger is taken for one that has stopped
FASTEST = 10.0  # m/s: the end of the protocol's range

TIME, CLOCK, ARRIVALS, PLACES, INTERVALS, INTERVAL, SLOPE = range(7)
"""Entries of a track: time of the newest update (s), offset of the clocks (s), numbers of known arrivals, positions and
intervals, the interval (s) and the slope (m/s). The rings LATENESS, PACES, TIMES and POSITIONS follow."""
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
    """Return how late (s) an update is that arrived at `now`, and update the clock offset and the interval.

    silent: nothing sounds, so a difference of the clocks may be adopted at once.
    """
    known = int(track[ARRIVALS])
    passed = time - track[TIME]
    if known > 0 and not passed > 0.0:  # the clock was set back: discard the values of the old clock
        known, track[PLACES], track[INTERVALS] = 0, 0.0, 0.0
    elif known > 0:
        _pace(track, passed, silent)
    lateness = track[LATENESS:PACES]
    recent = lateness[known % KEPT] = now - time
    for i in range(1, min(known + 1, CHANGED)):
        recent = min(recent, lateness[(known - i) % KEPT])
    if known + 1 >= CHANGED and recent - track[CLOCK] >= LATEST:
        lateness[:] = recent
    least = lateness[0]
    for i in range(1, min(known + 1, KEPT)):
        least = min(least, lateness[i])
    gap, step = least - track[CLOCK], min(max(passed, 0.0), PAUSE)
    if known == 0 or silent or not abs(gap) < LATEST:
        track[CLOCK] = least
    elif gap < 0.0:
        track[CLOCK] = max(least, track[CLOCK] - (RETURN if gap > -HURRY else HASTE) * step)
    else:
        track[CLOCK] = min(least, track[CLOCK] + (CREEP if gap < HURRY else HASTE) * step)
    track[TIME], track[ARRIVALS] = time, known + 1
    return float(min(max((now - time) - track[CLOCK], -LATEST), LATEST))


@unfused
def _pace(track: Array, passed: float, silent: bool) -> None:
    """Record an interval (s), unless it is a pause: after a long one the old positions and speed are discarded."""
    if passed > PAUSE:
        if silent or passed > LONGEST_STALL:
            track[PLACES], track[SLOPE] = 0.0, 0.0
        return
    paces, known = track[PACES:TIMES], int(track[INTERVALS])
    paces[known % PACED] = passed
    track[INTERVALS], track[INTERVAL] = known + 1, _median(paces, min(known + 1, PACED))


@unfused
def _median(values: Array, count: int) -> float:
    """Return the median of the first `count` values, or the upper of the middle two. Values are few: no sorting."""
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
    """Return the speed (m/s) from the known positions and this one, and record this one."""
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
    """Discard the positions, which are of another place. `slope` (m/s) is the speed until it is known again."""
    track[PLACES], track[SLOPE] = 0.0, slope
