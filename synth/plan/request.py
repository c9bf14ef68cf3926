"""The requirements of a scene before it is solved: motion, harmonics and time derivatives, and why it may be silent.

Stage   2 (PLAN), the base of `preparation`, `channels` and `effect_choice`.
Source  design, section 4.
Limits  At most N_MAX harmonics are kept. A moving scan at a constant load is solved for `reach` harmonics:
        MOVING_REACH times as many as are in the band at its fastest speed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from synth.contact.geometry import Geometry
from synth.motion.moved_skin import mover_of
from synth.motion.scan_motion import ScanMotion
from synth.plan.stretch import Stretch
from synth.response.reading_filter import ORDERS
from synth.scene.output_section import BAND, FULL_BAND
from synth.scene.scene import Scene
from synth.scene.texture_registry import DEFAULT

N_MAX = 4096  # harmonics (design, section 4); more would cost proportionally more, far above the frequencies felt
MOVING_REACH = 8  # ratio of the harmonics kept to those at the fastest speed u: down to the speed u / 8 none is lost
MOST_READ = 5e5  # Hz at the fastest speed, of the harmonics of a series that a file reads: 10 steps a frame, 1 us
FEWEST_MOVING = 64  # smallest number of harmonics of a moving scan, at any speed, as it is slow at its turns
HAND_LOADS = (0.05, 1.8)  # N, usual loads of a hand (Fagiani & Barbieri, 2016, section 2)
HAND_SPEEDS = (0.01, 0.16)  # m/s, usual range, extended to the scene's speed: faster hands are limited; with a lower
# upper end, the sound is louder
RESTS = "The finger rests while the output lasts, so its quantities do not change."


@dataclass(frozen=True, slots=True)
class Request:
    """A scene and its motion.

    scene: the scene; for a hand, with its nominal scan.
    by_hand: whether a hand sets the motion.
    paced: whether the blocks have deadlines; see `prepare`.
    loads: smallest and largest load of the scan, N.
    stretch: of a surface whose period is too long for a series, or None.
    area: whether blocks have deadlines and the finger moves over an area: z is solved along its path.
    """

    scene: Scene
    by_hand: bool
    paced: bool
    loads: tuple[float, float]
    stretch: Stretch | None
    area: bool

    @property
    def request(self) -> tuple[Scene, bool, bool, tuple[float, float], Stretch | None, bool]:
        """The six fields, as arguments of a subclass."""
        return self.scene, self.by_hand, self.paced, self.loads, self.stretch, self.area

    @property
    def period(self) -> float:
        """Period of the series of z (m): of the texture, or of its stretch."""
        return self.scene.texture.period if self.stretch is None else self.stretch.period

    @property
    def turns(self) -> float:
        """Periods of the series per second at the scan's speed, signed."""
        return self.scene.scan.speed / self.period

    @property
    def moving(self) -> bool:
        """True if no series gives the samples: the speed or the load changes, or the surface is too long for one."""
        scan = self.scene.scan
        own = scan.stroke is not None or scan.trajectory is not None or not scan.along_x
        own = own or mover_of(self.scene) is not None
        return self.by_hand or own or self.stretch is not None or self.area

    @property
    def rests(self) -> bool:
        """True if the finger stands still."""
        return self.turns == 0.0 and not self.moving

    @property
    def over_area(self) -> bool:
        """True if the finger may leave the line of the scan: on a path over an area, or led by a hand."""
        return self.area or not self.scene.scan.along_x

    @property
    def reads_series(self) -> bool:
        """True if z is read from the series of one load, instead of being solved along the motion."""
        return not (self.load_varies or self.stretch is not None or self.over_area)

    @property
    def of_levels(self) -> bool:
        """True if the series gives levels and errors only, and every sample is solved."""
        return self.stretch is not None or self.area

    @property
    def live(self) -> bool:
        """True if the blocks have deadlines."""
        return self.paced or self.by_hand

    @property
    def highest(self) -> int:
        """Number of harmonics at the scan's speed; at least one for a moving scan, which also has lower speeds."""
        return max(harmonics_below(abs(self.turns), self.scene.output.band_limit), int(self.moving))

    @property
    def reach(self) -> int:
        """Largest number of harmonics of a moving voice."""
        if not self.moving or self.of_levels:
            return self.highest
        return min(N_MAX, max(MOVING_REACH * self.highest, FEWEST_MOVING))

    @property
    def kept(self) -> int:
        """Largest number of harmonics of a series: of a file that reads it along its motion, as many as it has.

        Where a stroke turns it is so slow that all of them are in the band for a moment.
        """
        if self.live or not (self.moving and self.reads_series):
            return self.reach
        fastest = ScanMotion(self.scene).fastest() / self.period
        return max(self.reach, min(N_MAX, math.floor(MOST_READ / fastest))) if fastest else self.reach

    @property
    def orders(self) -> tuple[int, ...]:
        """The orders of the channels' time derivatives, rising; only 0 for a finger at rest."""
        orders = {ORDERS[channel.quantity] for channel in self.scene.output.channel_list}
        return tuple(sorted(orders)) if self.moving or self.scene.scan.speed != 0.0 else (0,)

    @property
    def load_varies(self) -> bool:
        """True if the scan, or a hand, changes the load."""
        return self.loads[0] != self.loads[1]

    @property
    def reported_loads(self) -> tuple[float, float]:
        """The range of loads (N) for which the error of a table is reported: of the scan, or of usual hands."""
        low, high = ScanMotion(self.scene, whole=self.live).recorded_loads()
        return (min(low, HAND_LOADS[0]), max(high, HAND_LOADS[1])) if self.by_hand else (low, high)


def harmonics_below(frequency: float, limit: float, most: int = N_MAX) -> int:
    """Return the number of harmonics of `frequency` (Hz, at least 0) below `limit` (Hz). It is `most` at most."""
    if frequency * most < limit:
        return most
    return max(0, math.ceil(limit / frequency * (1.0 - 1e-12)) - 1)


def harmonics_in_band(scene: Scene, most: int) -> int:
    """Return the number of harmonics of the texture in the band at the scan's own speed. It is `most` at most."""
    return harmonics_below(abs(scene.scan.speed) / scene.texture.period, scene.output.band_limit, most)


def silence_of(asked: Request, geometry: Geometry) -> str:
    """Return why the finger of the request does not move at all, or ""."""
    if geometry.texture_amplitude == 0.0:
        named = " (texture.amplitude is 0 m)" if asked.scene.texture.kind == DEFAULT else ""
        return f"The texture has no height{named}, so the finger does not move up and down."
    if asked.scene.scan.load == 0.0:
        return "The finger does not touch the texture (the load is 0 N), so it does not move."
    motion = ScanMotion(asked.scene, whole=asked.live)
    low, high = motion.load_range()
    rests = asked.scene.scan.trajectory is not None and motion.fastest() == 0.0 and low == high
    return RESTS if rests and 0 not in asked.orders and not asked.by_hand and not asked.scene.effects else ""


def above_band(asked: Request) -> str:
    """Return what `beyond_band` does; "" for a moving scan, which has lower speeds."""
    return "" if asked.highest > 0 else beyond_band(asked)


def beyond_band(asked: Request) -> str:
    """Return the sentence that every harmonic is above the band at the scan's own speed, or ""."""
    output = asked.scene.output
    if harmonics_in_band(asked.scene, 1):
        return ""
    text = (
        f"Every harmonic is above the band: u / lambda2 is {abs(asked.turns):.6g} Hz, "
        f"and only harmonics below {output.band_limit:.6g} Hz are rendered."
    )
    if abs(asked.turns) < BAND * output.sample_rate and output.bandwidth != FULL_BAND:
        text += ' Write output.bandwidth "full" for the whole band of the sample rate.'
    return text
