"""Position and load of the finger at every frame of a block.

Model   A motion holds, per frame, speed u, du/dt, load w, dw/dt, d2w/dt2 and, if known, the position p.
        `scan_motion` makes the motion of a scan, `update_smoothing` that of a live hand.
Source  design, section 4.
Limits  Where a motion has no derivatives, they are differences from the preceding frame (first order).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from operator import index
from typing import Any, NamedTuple

import numpy as np

from synth.arrays import Array

LARGEST_LOAD = 1e3  # N: the end of the scene's range; a larger load of a hand is clipped to it
SPEED, SPEED_RATE, LOAD, LOAD_RATE, LOAD_BEND = range(5)
NOWHERE: Array = np.empty(0)
NO_PATH: Array = np.empty((2, 0))
NO_FORCE: Array = np.empty((1, 0))
ACROSS, DIRECTION = range(2)  # rows of `path`
KEPT = ("load", "direction")  # fields of an update that remain until a later update has them


class Update(NamedTuple):
    """One contact update.

    time: of the client's clock, s.
    position: along x, m. An update has either a position or a speed.
    speed: m/s.
    load: N; None keeps the previous load.
    across: position along y, m, on a texture over an area; None: the hand stays on the line of the scan.
    direction: angle of the finger's length from x, rad, counter-clockwise; None keeps the previous angle.
    """

    seq: int
    time: float
    position: float | None
    speed: float | None
    load: float | None
    across: float | None = None
    direction: float | None = None

    def after(self, skipped: Update) -> Update:
        """Return this update with the fields that it keeps of `skipped`, the previous one, which was not applied."""
        kept = {name: getattr(skipped, name) for name in KEPT if getattr(self, name) is None}
        return self._replace(**kept)


@dataclass(frozen=True, slots=True)
class Motion:
    """The motion of the hand in a block. `of` makes and checks one; here only a voice checks the numbers of frames.

    samples: float64 [5, frames]: speed (m/s), its rate (m/s^2), load (N), its rate (N/s) and second rate (N/s^2).
    position: float64 [frames], m. It is empty if only the speed is known, from which the phase then follows.
    path: float64 [2, frames], over an area: how far the surface has moved across (m), and the direction of the finger
        (rad). It is empty if the finger stays on the line of the scan.
    complete: True where the derivatives are given; otherwise a voice takes differences from the preceding frame.
    force: float64 [axes, frames]: the force (N) that moves the skin in place of the hand (`moved_skin`), along x and,
        over an area, across. It is empty if the skin moves with the hand.
    """

    samples: Array
    position: Array = field(default_factory=lambda: NOWHERE)
    path: Array = field(default_factory=lambda: NO_PATH)
    complete: bool = True
    force: Array = field(default_factory=lambda: NO_FORCE)

    @property
    def frames(self) -> int:
        """Number of frames."""
        return int(self.samples.shape[1])

    def fills(self, frames: int) -> bool:
        """Return whether it has its rows, and `frames` values or none in each of them."""
        return (
            self.samples.shape == (5, frames)
            and self.position.shape in ((frames,), (0,))
            and self.path.shape in ((2, frames), (2, 0))
        )

    def part(self, first: int, end: int | None = None) -> Motion:
        """Return the motion from frame `first` to before frame `end`."""
        some = slice(first, end)
        return Motion(
            self.samples[:, some], self.position[some], self.path[:, some], self.complete, self.force[:, some]
        )

    @classmethod
    def of(
        cls,
        frames: int,
        *,
        load: Any,
        speed: Any = None,
        position: Any = None,
        speed_rate: Any = None,
        load_rate: Any = None,
        load_bend: Any = None,
        across: Any = None,
        direction: Any = None,
        pulls: Any = False,
    ) -> Motion:
        """Return a motion from numbers or arrays of `frames` values in SI units.

        load: N.
        speed, position: m/s, m; either, or both if they agree.
        speed_rate, load_rate: time derivatives of the speed and of the load.
        load_bend: second time derivative of the load.
        across, direction: over an area, how far the surface has moved across (m) and the direction of the finger (rad).
            They require a position.
        pulls: whether loads below 0 are kept, for a voice with adhesion. Otherwise they become 0.

        Raises ValueError where both speed and position are missing, across is given without position, or a value is not
        a finite number or one per frame; TypeError where `frames` is no whole number.
        """
        if (frames := index(frames)) < 0:
            raise ValueError(f"frames: got {frames}; give 0 or more")
        if speed is None and position is None:
            raise ValueError("a motion needs speed=... (m/s) or position=... (m), a number or one value per frame")
        complete = all(given is not None for given in (speed, speed_rate, load_rate, load_bend))
        rows = {"speed": speed, "speed_rate": speed_rate, "load": load, "load_rate": load_rate, "load_bend": load_bend}
        samples = np.stack([_per_frame(name, values, frames) for name, values in rows.items()])
        places, path = NOWHERE if position is None else _per_frame("position", position, frames), NO_PATH
        if across is not None or direction is not None:
            if position is None:
                raise ValueError(
                    "a motion over an area needs position=... (m) beside across=... (m) or direction=... (rad)"
                )
            path = np.stack([_per_frame("across", across, frames), _per_frame("direction", direction, frames)])
        samples[LOAD] = np.clip(samples[LOAD], -LARGEST_LOAD if pulls else 0.0, LARGEST_LOAD)
        return cls(samples, places, path, complete)


def _per_frame(name: str, values: Any, frames: int) -> Array:
    """Return `values` as float64 [frames]; None: 0. Raise ValueError if they are no number, or not one per frame."""
    try:
        given = np.asarray(0.0 if values is None else values)
        found = np.array(np.broadcast_to(given, frames), dtype=float) if given.dtype.kind in "iuf" else None
    except ValueError:
        found = None
    if found is None or np.ma.is_masked(values) or not np.isfinite(found).all():
        raise ValueError(f"{name}: give a finite number in SI units, or {frames}, one per frame")
    return found


def completed(motion: Motion, rate: int, before: Array) -> Motion:
    """Return `motion` with its missing derivatives, as differences from the preceding frame.

    before: float64 [4]: position (m), speed (m/s), load (N) and load rate (N/s) of the preceding frame, NaN where
    unknown. It is updated. A derivative is 0 until the frames that it needs are known.
    """
    samples = motion.samples.copy()
    if len(motion.position):
        samples[0] = _rate_of(motion.position, before[0], rate)
        before[0] = motion.position[-1]
    samples[1] = _rate_of(samples[0], before[1], rate)
    samples[3] = _rate_of(samples[2], before[2], rate)
    samples[4] = _rate_of(samples[3], before[3], rate)
    before[1], before[2], before[3] = samples[0, -1], samples[2, -1], samples[3, -1]
    return Motion(np.nan_to_num(samples, copy=False), motion.position, motion.path)


def _rate_of(values: Array, before: float, rate: int) -> Array:
    """Return the change from frame to frame per second; NaN where the preceding frame is unknown."""
    return np.asarray(np.diff(values, prepend=before) * rate)
