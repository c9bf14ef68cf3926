"""Which harmonics a moving voice may sound, by its instantaneous frequency.

Model   A level is the series cut at one harmonic. At nu turns a frame the n-th harmonic stands at n nu of the sample
        rate: below 0.35 it must sound, above 0.49 it must not (design, section 4). Between two levels the voice fades
        over [0.35 / (N' + 1), 0.49 / N] turns a frame, N and N' < N their highest harmonics, so no harmonic starts
        with a step. Levels lie 1.37 apart, which keeps the fades short and from overlapping: at most two levels sound
        at once.
Source  design, section 4; the ratio follows from 0.49 / 0.35 = 1.4.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from synth.arrays import Array

KEEP = 0.35  # of the sample rate: below it no harmonic is lost; a smaller value dulls a moving finger
LOSE = 0.49  # of the sample rate: above it no harmonic sounds; 0.5 would fold
STEP = 1.37  # ratio of neighbouring levels; above 1.4 the fades would be empty, below 1.19 they would overlap

ROUNDINGS = 1e-12  # relative: how far off the compiled loops may count the turns a frame; they count them otherwise


@dataclass(frozen=True, slots=True)
class Levels:
    """Levels from the fullest to the last, which holds the fundamental alone.

    highest: highest harmonic of each level. fade_from, fade_to: turns a frame between which a level fades to the next
    one (the last: to silence).
    """

    highest: tuple[int, ...]
    fade_from: Array
    fade_to: Array


def levels_up_to(highest: int) -> Levels:
    """Return the levels of a series of `highest` harmonics, at least 1."""
    ladder = [1]
    while ladder[-1] < highest:
        ladder.append(min(highest, max(ladder[-1] + 1, int(STEP * (ladder[-1] + 1)))))
    if len(ladder) > 2 and ladder[-1] < 1.4 * (ladder[-3] + 1):
        del ladder[-2]
    steps = ladder[::-1]
    below = [*steps[1:], 0]
    fade_from = np.array([KEEP / (n + 1) for n in below])
    fade_to = np.array([LOSE / n for n in steps])
    return Levels(tuple(steps), fade_from, fade_to)


def levels_heard(levels: Levels, turns: float) -> range:
    """Return the levels that sound at |turns| a frame: one, two where one fades into the next, none beyond the last.

    turns: as the compiled loops count it, but for ROUNDINGS: what sounds for them is among the levels either way.
    """
    slower, faster = turns * (1.0 - ROUNDINGS), turns * (1.0 + ROUNDINGS)
    first = int(np.searchsorted(levels.fade_to, slower, side="right"))
    last = int(np.searchsorted(levels.fade_to, faster, side="right"))
    count = len(levels.highest)
    return range(first, min(last + 1 + int(last < count and faster > levels.fade_from[last]), count))
