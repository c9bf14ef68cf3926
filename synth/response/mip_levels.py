"""Mip levels: the number of harmonics that sound at each speed, and the fade from one level to the next.

Stage   RESPONSE: the levels of a table.
Model   A level holds the harmonics 1 to N. At a speed u harmonic n has the frequency n |u| / period. A harmonic up to
        the band B is heard in full; above 1.4 B it is silent. Between a level of N harmonics and the next of N' < N
        harmonics, the share of the next is s^2 (3 - 2 s); s goes from 0 to 1 as B period / |u| falls from N' + 1 to
        N / 1.4. The gain of harmonic n is the sum of the shares of the levels that hold it (`gains`), in tables and in
        files alike.
Source  design, section 4: 0.49 / 0.35 = 1.4. Mip levels are images in steps of resolution (Williams, 1983).
Limits  At speeds below B period / N of the fullest level, harmonics above N are left out. The table's error counts
        them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from synth.arrays import Array

WIDTH = 1.4  # times the band: silent above. A smaller value makes fades shorter; levels an octave apart would need 2.5
STEP = 1.37  # ratio of neighbouring levels; above WIDTH a fade would be empty, below 1.19 two fades would overlap
PLACES_A_HARMONIC = 5.5  # with 5 the images of the highest harmonic are twice as strong; with 6 a table is larger
FEWEST_PLACES = 24  # per level; with fewer, images in the lowest levels are as strong as their error target


@dataclass(frozen=True, slots=True)
class MipLevels:
    """Levels from the fullest to the last, which contains the fundamental only.

    highest: highest harmonic of each level.
    places: spline coefficients per period of each level.
    """

    highest: tuple[int, ...]
    places: tuple[int, ...]

    @classmethod
    def up_to(cls, harmonics: int, density: float = PLACES_A_HARMONIC) -> MipLevels:
        """Return the levels of a table of `harmonics` (at least 1); density: places per harmonic."""
        ladder = [1]
        while ladder[-1] < harmonics:
            ladder.append(min(harmonics, max(ladder[-1] + 1, int(STEP * (ladder[-1] + 1)))))
        if len(ladder) > 2 and ladder[-1] < WIDTH * (ladder[-3] + 1):
            del ladder[-2]
        highest = tuple(ladder[::-1])
        return cls(highest, tuple(max(FEWEST_PLACES, math.ceil(density * n)) for n in highest))

    @property
    def fades(self) -> Array:
        """Begin and end of each level's fade to the next (the last: to silence), in |u| / (period B): [2, levels]."""
        below = np.array([*self.highest[1:], 0])
        return np.stack([1.0 / (below + 1.0), WIDTH / np.array(self.highest)])

    def shares(self, turns: float) -> Array:
        """Return the share of each level at `turns` = |u| / (period B), the periods that pass in 1 / B: [levels]."""
        begin, end = self.fades
        s = np.clip((abs(turns) - begin) / (end - begin), 0.0, 1.0)
        gone = s * s * (3.0 - 2.0 * s)
        entered = np.concatenate([[1.0], gone[:-1]])
        return np.asarray(entered - gone)

    def gains(self, turns: float) -> Array:
        """Return the gain of harmonics 1 to the highest at `turns` = |u| / (period B): [harmonics]."""
        n = np.arange(1, self.highest[0] + 1)
        shares = zip(self.shares(turns), self.highest, strict=True)
        return np.asarray(sum(share * (n <= highest) for share, highest in shares))
