"""What a scene asks for before anything is solved: its motion, harmonics and derivatives.

Stage   2 (PLAN), the base of `preparation`, `channels` and `effect_choice`.
Source  design, section 4.
Limits  no more than N_MAX harmonics; a moving scan at a constant load keeps those up to MOVING_REACH times its fastest
        speed's, which `reach` tells.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from synth.motion.scan_motion import ScanMotion
from synth.response.reading_filter import ORDERS
from synth.scene.scene import Scene

N_MAX = 4096  # harmonics (design, section 4); more cost time in proportion and are far above what skin feels
MOVING_REACH = 8  # a moving scan keeps the harmonics of this many times its fastest speed's: at u / 8 nothing is lost
FEWEST_MOVING = 64  # harmonics that a moving scan keeps at least, however fast: it is slow where it turns
HAND_LOADS = (0.05, 1.8)  # N of usual hands (Fagiani & Barbieri, 2016, section 2)


@dataclass(frozen=True, slots=True)
class Request:
    """A scene, and how it is moved.

    by_hand: a hand moves, and `scene` holds its nominal scan.
    paced: its blocks have deadlines, see `prepare`.
    loads: smallest and largest load of the scan (N).
    """

    scene: Scene
    by_hand: bool
    paced: bool
    loads: tuple[float, float]

    @property
    def request(self) -> tuple[Scene, bool, bool, tuple[float, float]]:
        """The four parts, for what adds to them."""
        return self.scene, self.by_hand, self.paced, self.loads

    @property
    def turns(self) -> float:
        """Texture periods a second at the scan's speed, signed."""
        return self.scene.scan.speed / self.scene.texture.period

    @property
    def moving(self) -> bool:
        """True where the scan changes speed or load by itself, or a hand does."""
        scan = self.scene.scan
        return self.by_hand or scan.stroke is not None or scan.trajectory is not None

    @property
    def live(self) -> bool:
        """True where blocks have deadlines."""
        return self.paced or self.by_hand

    @property
    def highest(self) -> int:
        """Harmonics kept at the scan's speed; at least one of a moving scan, which is slower elsewhere."""
        return max(harmonics_below(abs(self.turns), self.scene.output.band_limit), int(self.moving))

    @property
    def reach(self) -> int:
        """Harmonics that a moving voice keeps at most."""
        return min(N_MAX, max(MOVING_REACH * self.highest, FEWEST_MOVING)) if self.moving else self.highest

    @property
    def orders(self) -> tuple[int, ...]:
        """The time derivatives that the channels need, rising; a finger that stands still needs none."""
        orders = {ORDERS[channel.quantity] for channel in self.scene.output.channel_list}
        return tuple(sorted(orders)) if self.moving or self.scene.scan.speed != 0.0 else (0,)

    @property
    def load_varies(self) -> bool:
        """True where the scan, or a hand, changes its load."""
        return self.loads[0] != self.loads[1]

    @property
    def told_loads(self) -> tuple[float, float]:
        """The loads (N) over which the error of a table is told: those of the scan, or of usual hands."""
        low, high = ScanMotion(self.scene).recorded_loads()
        return (min(low, HAND_LOADS[0]), max(high, HAND_LOADS[1])) if self.by_hand else (low, high)


def harmonics_below(frequency: float, limit: float, most: int = N_MAX) -> int:
    """Return how many harmonics of `frequency` (Hz, at least 0) lie below `limit` (Hz), `most` at most."""
    if frequency * most < limit:
        return most
    return max(0, math.ceil(limit / frequency * (1.0 - 1e-12)) - 1)
