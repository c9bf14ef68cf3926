"""Solves eq. 1 along any motion: position and load at every frame in, the channels of a voice at every frame out.

Stage   SAMPLING: without a response table, for a surface whose period is long against the waves that matter, and
        for a finger that may leave its line over an area.
Model   y = gate(w) (z(p / lambda2, w) - mean(w)) is solved at every few frames; the approach is gate(w) z. The filter
        of `reading_filter` limits the band, takes derivatives and makes the frames. All channels share the solutions.
        A solution starts from those before it, and the last digit of z depends on the start. Solutions are therefore
        made in groups of GROUP, counted from the first frame, and every group starts afresh. A block that ends within a
        group solves the first part of the group, and the next block solves the group from its beginning again. So the
        samples are the same in blocks of any size. Where neither place nor load has changed, z is copied, so a finger
        at rest is exactly silent and costs nothing.
        Before the first frame the finger rests at its first position.
Source  design, sections 1 and 8. Fagiani & Barbieri (2016), eq. 1.
Limits  z of higher frequency than the solutions folds into the band (`plan.direct_plan` measures it), and the filter
        errs (`reading_filter`). A load above the heaviest is read as the heaviest. At speeds above those measured no
        error is reported. In blocks shorter than a group, up to GROUP times as many solutions are made.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from synth.arrays import Array
from synth.contact.load_balance import Contact
from synth.response.mean_approach import Mean
from synth.response.phases import phases_of
from synth.response.reading_filter import ReadingFilter
from synth.response.series_curve import PLACE
from synth.response.table import Floats
from synth.response.table_reader import filter_frames

Phases = np.ndarray[tuple[int], np.dtype[np.uint64]]

GROUP = 40  # solutions: two groups in a block of 10 ms at 1 kHz; a fresh start takes the time of several solutions
if TYPE_CHECKING:
    from synth.contact.area_forces import ForceOverArea

LOAD = 2  # row of `motion`
PHASE, PRESSED, PATH = 0, 1, slice(2, 4)  # rows of a place: phase (turns), load (N), and the path over an area


@dataclass(slots=True)
class DirectState:
    """The state of a direct reader: the last samples only.

    places: of the solutions of the present group [rows, solutions].
    before: place of the last solution of the group before [rows]; NaN before the first.
    last: its z, m.
    count: frames since the last solution, less than the stride.
    samples: last samples of y, then of the approach, m [2, taps]; None before the first.
    """

    places: Array
    before: Array
    last: float = np.nan
    count: int = 0
    samples: Array | None = None


@dataclass(frozen=True, slots=True)
class DirectReader:
    """Reads the channels of a voice without a table. It keeps no state: `start` returns one, `read` updates it.

    contact: gives z (m), or a force (N), at phases (turns) and loads (N), and over an area along a path.
    line: position of the texture across (m) and direction of the finger (rad), for a motion without a path over an
        area; None: the finger stays on its line.
    mean: mean of z over the surface (m) as a function of the cube root of the load (N^(1/3)).
    period: of the texture, m.
    lift_load: below it the output fades, N.
    heaviest: the largest load that is solved, N.
    rate: frames per second.
    filters: from y to each channel, of one stride and length.
    gains: factor on the SI value of each channel.
    with_mean: whether each channel is the approach.
    """

    contact: Contact | ForceOverArea
    line: tuple[float, float] | None
    mean: Mean
    period: float
    lift_load: float
    heaviest: float
    rate: int
    filters: tuple[ReadingFilter, ...]
    gains: tuple[float, ...]
    with_mean: tuple[bool, ...]

    @property
    def delay(self) -> int:
        """Frames by which the output is behind the motion: output frame n belongs to motion frame n - delay."""
        return self.filters[0].delay

    @property
    def cycle(self) -> int:
        """Frames after which solutions and groups begin again."""
        return GROUP * self.filters[0].stride

    def start(self) -> DirectState:
        """Return the state of a reader before its first frame."""
        rows = 2 if self.line is None else 4
        return DirectState(np.empty((rows, 0)), np.full(rows, np.nan))

    def read(self, state: DirectState, motion: Array, position: Array, path: Array, phase: int, out: Floats) -> int:
        """Write the next frames of all channels to `out`, update `state`, and return the next phase.

        motion: float64 [5, frames], as in `motion.Motion`.
        position: of the texture (m) at each frame. Where it is empty, the texture goes on from `phase` at the speed of
            the motion.
        path: as in `motion.Motion`; it is empty where the finger is on its line.
        phase: 64-bit fraction of a turn.
        out: float32 [frames, channels].
        """
        stride, taps, frames = self.filters[0].stride, self.filters[0].taps, len(out)
        first = (stride - state.count) % stride
        phases: Phases = np.empty(frames, dtype=np.uint64)
        after: int = phases_of(motion, position, np.uint64(phase), float(self.rate), self.period, phases)
        phases = phases[first::stride]
        places = np.empty((len(state.before), len(phases)))
        places[PHASE] = (phases >> np.uint64(11)).astype(np.float64) * PLACE
        places[PRESSED] = np.clip(motion[LOAD, first::stride], 0.0, self.heaviest)
        if self.line is not None:
            places[PATH] = path[:, first::stride] if path.size else np.reshape(self.line, (2, 1))
        fresh = self._samples(state, places)
        if state.samples is None:
            state.samples = np.repeat(fresh[:, :1], taps, axis=1)
        samples = np.concatenate([state.samples, fresh], axis=1)
        # A block begins within the step of the last sample before it, or with a new sample.
        begin, skipped = (0, state.count) if state.count > 0 else (1, 0)
        for column, (one, gain, whole) in enumerate(zip(self.filters, self.gains, self.with_mean, strict=True)):
            weights = np.ascontiguousarray(one.weights.T)
            filter_frames(samples[int(whole), begin:], weights, one.hold, gain, skipped, out, column)
        state.samples = samples[:, samples.shape[1] - taps :].copy()
        state.count = (state.count + frames) % stride
        return after

    def _samples(self, state: DirectState, places: Array) -> Array:
        """Return y and the approach (m) at each of `places` [2, solutions]."""
        solved = [np.empty(0)]
        done = 0
        while done < places.shape[1]:
            known = state.places.shape[1]
            state.places = np.concatenate([state.places, places[:, done : done + GROUP - known]], axis=1)
            z = self.solved(state.places, state.before, state.last)
            solved.append(z[known:])
            done += len(z) - known
            if len(z) == GROUP:
                state.before, state.last = state.places[:, -1], float(z[-1])
                state.places = state.places[:, :0]
        loads = places[PRESSED]
        s = np.minimum(loads / self.lift_load, 1.0)
        faded, height = s * s * s * (10.0 + s * (6.0 * s - 15.0)), np.concatenate(solved)
        return np.asarray(faded * np.stack([height - self.mean(np.cbrt(loads)), height]))

    def solved(self, places: Array, before: Array, last: float) -> Array:
        """Return z (m) at each of `places`, 0 where nothing touches; `before` and `last` as in `DirectState`."""
        moved = np.any(np.diff(places, axis=1, prepend=before[:, np.newaxis]) != 0.0, axis=0)
        solved = moved & (places[PRESSED] > 0.0)
        z = np.where(moved, 0.0, last)
        if solved.any():
            phases, loads, *path = np.ascontiguousarray(places[:, solved])
            contact: Any = self.contact
            z[solved] = contact.heights(phases, loads, *([np.stack(path)] if path else []))
        newest = np.maximum.accumulate(np.where(moved, np.arange(len(z)), -1))
        return np.asarray(np.where(newest < 0, last, z[np.maximum(newest, 0)]))
