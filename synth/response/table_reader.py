"""Reads a table along any motion: position and load at every frame in, one quantity at every frame out.

Stage   RESPONSE: reading its result.
Model   docs/table.md. A compiled loop reads z at every few frames; the filter of `reading_filter` makes the quantity
        from it, so every term of a changing load and speed counts. z = gate(w) swing(theta, w, |u|), or
        gate(w) (swing + mean(w)) for the approach. The swing is z minus its mean: a quintic spline over place, a cubic
        over the load, and a fade between two levels over the speed. The output is `delay` frames behind the motion.
        Before the first frame the finger rests at its first position.
Source  design, section 1. The readable twin of the loop is tests/reference/slow_table_reading.py.
Limits  The errors of the table and of the filter. An output that is not a number, or beyond float32, becomes zero.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from synth.arrays import Array
from synth.kernels import inlined, signed_kernel
from synth.response.lift_gate import gate
from synth.response.phases import fill_phases
from synth.response.place_spline import PADDING, spline_value
from synth.response.reading_filter import TAPS, ReadingFilter, reading_filter
from synth.response.series_curve import PLACE, SMALLEST
from synth.response.table import Floats, ResponseTable

LARGEST = 3.4e38  # of a float32

USUAL_WIDTH = TAPS - 1  # differences per output, of the usual filter

COUNT, STARTED, HISTORY = 0, 1, 2  # entries of `state`; from HISTORY on, the last samples of z
SCALE, LIFT, GAIN, HOLD, WITH_MEAN, FULL, LAW, LAW_SLOPE, MOST, RATE, PERIOD = range(11)  # entries of `rules`
FADE, SILENT, BEGIN, PLACES, STEEPNESS = range(5)  # columns of `levels`
SPEED, LOAD = 0, 2  # rows of `motion`


@dataclass(frozen=True, slots=True)
class TableReader:
    """Reads one quantity of a table at one rate. It keeps no state: `start` returns one, `read` updates it.

    table: the table.
    filter: from z to the quantity.
    read: read(state, motion, position, phase, out, column) writes the next frames of the quantity to a column of `out`,
        updates `state`, and returns the next phase.
        motion: float64 [5, frames], as in `motion.Motion`.
        position: of the texture (m) at each frame. Where it is empty, the texture goes on from `phase` at the speed of
            the motion.
        phase: 64-bit fraction of a turn.
        out: float32 [frames, columns].
    """

    table: ResponseTable
    filter: ReadingFilter
    read: Callable[[Array, Array, Array, int, Floats, int], int]

    @classmethod
    def of(cls, table: ResponseTable, quantity: str, rate: int, gain: float = 1.0) -> TableReader:
        """Return the reader of `quantity`, in SI times `gain`, at `rate` (Hz).

        quantity: displacement, velocity, acceleration or approach.
        """
        chosen = reading_filter(quantity, rate, table.band)
        fades = table.levels.fades
        levels = np.stack([*fades, *table.layout.T.astype(float), 1.0 / (fades[1] - fades[0])], axis=1)
        rows = np.concatenate([table.loads[np.newaxis], table.means]).astype(float)
        weights = np.ascontiguousarray(chosen.weights.T)
        rules = np.zeros(11)
        rules[RATE], rules[PERIOD] = rate, table.period
        rules[SCALE] = 1.0 / (table.period * table.band)
        rules[LIFT], rules[GAIN], rules[HOLD] = table.lift_load, gain, chosen.hold
        rules[WITH_MEAN], rules[FULL] = quantity == "approach", table.full
        rules[LAW], rules[LAW_SLOPE] = table.mean_law
        rules[MOST] = table.covered[1]
        read = partial(read_block, table.pool, np.ascontiguousarray(levels), rows, weights, rules)
        return cls(table, chosen, read)

    @property
    def delay(self) -> int:
        """Frames by which the output is behind the motion: output frame n belongs to motion frame n - delay."""
        return self.filter.delay

    def start(self) -> Array:
        """Return the state of a reader before its first frame."""
        return np.zeros(HISTORY + self.filter.taps)


@inlined
def interval_of(loads, load):
    """Return the interval of the rising `loads` that contains `load`."""
    low, high = 0, len(loads) - 1
    while high - low > 1:
        middle = (low + high) // 2
        if loads[middle] <= load:
            low = middle
        else:
            high = middle
    return low


@inlined
def level_of(levels, turns):
    """Return the first level that sounds at `turns`, or the number of levels where none does."""
    level = 0
    while level < len(levels) and turns >= levels[level, SILENT]:
        level += 1
    return level


@inlined
def load_weights(s, width):
    """Return the weights of a cubic Hermite piece: value and slope at the load below, then at the load above.

    s, width: place in the interval, 0 to 1; length of the interval (N).
    """
    rest = 1.0 - s
    return (1.0 + 2.0 * s) * rest * rest, s * rest * rest * width, s * s * (3.0 - 2.0 * s), -s * s * rest * width


@inlined
def smooth_step(s):
    """Return 3 s^2 - 2 s^3 for s clipped to 0..1."""
    s = min(max(s, 0.0), 1.0)
    return s * s * (3.0 - 2.0 * s)


@inlined
def swing_of(pool, levels, level, interval, turn, a, b, c, d):
    """Return the swing (m) of one level at `turn` turns of the texture. a, b, c, d: weights as in `spline_value`."""
    places = levels[level, PLACES]
    x = turn * places
    cell, half = np.int64(x), np.int64(places) + PADDING
    at = np.int64(levels[level, BEGIN]) + 2 * half * interval + cell
    return spline_value(pool, at, half, x - np.float64(cell), a, b, c, d)


@inlined
def mean_of(rows, rules, interval, load, a, b, c, d):
    """Return the mean of z (m) at `load`. a, b, c, d: as from `load_weights`."""
    if rules[FULL] > 0.0 and load > rows[0, rows.shape[1] - 1]:
        return rules[LAW] + rules[LAW_SLOPE] * load * np.sqrt(load)
    below, above = rows[:, interval], rows[:, interval + 1]
    return a * below[1] + b * below[2] + c * above[1] + d * above[2]


@inlined
def sample(pool, levels, rows, rules, phases, motion, first, stride, values):
    """Write z (m), or the approach, at the frames first, first + stride, ... to `values`.

    levels: float64 [levels, 5]: fade begin and end, begin in `pool`, places, 1 / length of the fade.
    rows: float64 [3, rows]: loads (N), mean of z (m), its slope (m/N).
    rules: float64 [11], see the entries above.
    phases: uint64 fractions of a turn at every frame.
    motion: float64 [5, frames], as in `motion.Motion`.
    """
    loads = rows[0]
    last = loads[len(loads) - 1]
    interval, level, steep = 0, 0, 0.0
    low, high, slow, fast, fade = 1.0, 0.0, 1.0, 0.0, 0.0  # ranges in which interval and level are valid: empty so far
    for k in range(len(values)):
        i = first + k * stride
        pressed = max(motion[LOAD, i], 0.0)
        load = min(pressed, rules[MOST])
        held = min(load, last)
        if not low <= held < high:
            interval = interval_of(loads, held)
            low, high = loads[interval], loads[interval + 1]
            steep = 1.0 / (high - low)
        turns = abs(motion[SPEED, i]) * rules[SCALE]
        if not slow <= turns < fast:
            level = level_of(levels, turns)
            slow = levels[level - 1, SILENT] if level > 0 else 0.0
            fast, fade = np.inf, np.inf
            if level < len(levels):
                fast, fade = levels[level, SILENT], levels[level, FADE]
        a, b, c, d = load_weights((held - low) * steep, high - low)
        turn = np.float64(np.int64(phases[i] >> np.uint64(11))) * PLACE
        value = 0.0
        if level < len(levels):
            value = swing_of(pool, levels, level, interval, turn, a, b, c, d)
        if turns > fade:
            gone = smooth_step((turns - fade) * levels[level, STEEPNESS])
            value *= 1.0 - gone
            if level + 1 < len(levels):
                value += gone * swing_of(pool, levels, level + 1, interval, turn, a, b, c, d)
        if rules[WITH_MEAN] > 0.0:
            value += mean_of(rows, rules, interval, load, a, b, c, d)
        if pressed < rules[LIFT]:
            value *= gate(pressed, rules[LIFT])
        values[k] = value


@inlined
def heard(value):
    """Return `value`, or zero where it is not finite, a denormal float32, or beyond float32."""
    return value if SMALLEST <= abs(value) <= LARGEST else 0.0


@inlined
def weighted(z, changes, weights, hold, gain, column):
    """Write gain (hold z + the weighted sum of the changes) of each step to `column`."""
    for step in range(len(column)):
        column[step] = hold * z[step]
    for m in range(len(weights)):
        for step in range(len(column)):
            column[step] += weights[m] * changes[step + m]
    for step in range(len(column)):
        column[step] = heard(gain * column[step])


@inlined
def seven_weighted(z, changes, weights, hold, gain, column):
    """Like `weighted`, for seven weights: one pass, half the time, the same sums in the same order."""
    a, b, c, d = weights[0], weights[1], weights[2], weights[3]
    e, f, g = weights[4], weights[5], weights[6]
    for i in range(len(column)):
        value = hold * z[i] + a * changes[i] + b * changes[i + 1] + c * changes[i + 2] + d * changes[i + 3]
        value = value + e * changes[i + 4] + f * changes[i + 5] + g * changes[i + 6]
        column[i] = heard(gain * value)


@inlined
def filter_samples(z, weights, hold, gain, skipped, out):
    """Filter z, one sample per step, to one output per frame.

    weights: float64 [taps - 1, stride], one column per frame of a step; each column is one pass.
    skipped: number of frames of the first step that were written before.
    """
    width, stride = weights.shape
    middle, frames = (width + 1) // 2 - 1, len(out)
    steps = (skipped + frames + stride - 1) // stride
    room = np.empty(steps + width - 1 + steps)
    changes, column = room[: steps + width - 1], room[steps + width - 1 :]
    for i in range(len(changes)):
        changes[i] = z[i + 1] - z[i]
    for j in range(stride):
        if width == USUAL_WIDTH:
            seven_weighted(z[middle:], changes, weights[:, j], hold, gain, column)
        else:
            weighted(z[middle:], changes, weights[:, j], hold, gain, column)
        first = j - skipped
        for step in range(1 if first < 0 else 0, steps if (steps - 1) * stride + first < frames else steps - 1):
            out[step * stride + first] = column[step]


@signed_kernel("void(f8[::1], f8[:,::1], f8, f8, i8, f4[:,:], i8)")
def filter_frames(z, weights, hold, gain, skipped, out, column):
    """Write the frames that `filter_samples` makes of z to a column of `out`."""
    filter_samples(z, weights, hold, gain, skipped, out[:, column])


@signed_kernel("u8(f4[::1], f8[:,::1], f8[:,::1], f8[:,::1], f8[::1], f8[::1], f8[:,::1], f8[::1], u8, f4[:,:], i8)")
def read_block(pool, levels, rows, weights, rules, state, motion, position, phase, out, column):
    """Write the next frames to a column of `out`, update `state`, and return the phase after the last frame.

    pool, levels, rows, rules: as in `sample`.
    weights: as in `filter_samples`.
    state, motion, position, phase: as in `TableReader.read`.
    """
    taps, stride, frames = weights.shape[0] + 1, weights.shape[1], len(out)
    count = np.int64(state[COUNT])
    first = (stride - count) % stride
    due = max(0, (frames - first + stride - 1) // stride)
    phases, z = np.empty(frames, dtype=np.uint64), np.empty(taps + due)
    after = fill_phases(motion, position, phase, rules[RATE], rules[PERIOD], phases)
    fresh = z[taps:]
    sample(pool, levels, rows, rules, phases, motion, first, stride, fresh)
    for i in range(taps):
        z[i] = state[HISTORY + i] if state[STARTED] > 0.0 else z[taps]
    # A block begins within the step of the last sample before it, or with a new sample.
    begin, skipped = (0, count) if count > 0 else (1, 0)
    filter_samples(z[begin:], weights, rules[HOLD], rules[GAIN], skipped, out[:, column])
    for i in range(taps):
        state[HISTORY + i] = z[due + i]
    state[STARTED] = 1.0
    state[COUNT] = (count + frames) % stride
    return after
