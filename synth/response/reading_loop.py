"""The compiled loop of a reader: z at every few frames of a motion, then the filter.

Stage   RESPONSE, how tables are read.
Model   docs/table.md. z = gate(w) swing(theta, w, |u|), or gate(w) (swing + mean(w)) for the approach. The swing is a
        quintic spline over place, a cubic over the load, and a fade of two levels over the speed. The
        filter is that of `reading_filter`.
Source  the readable twin is tests/reference/slow_table_reading.py.
Limits  what is not a number, or beyond float32, is silent.
"""

from __future__ import annotations

import numpy as np

from synth.kernels import inlined, signed_kernel
from synth.response.evaluation import PLACE, SMALLEST, gate, smooth_step
from synth.response.place_spline import PADDING
from synth.response.spline_vectors import spline_value

LARGEST = 3.4e38  # what a float32 holds

COUNT, STARTED, INTERVAL, LEVEL, HISTORY = 0, 1, 2, 3, 4  # entries of `state`; from HISTORY on, the last samples of z
SCALE, LIFT, GAIN, HOLD, WITH_MEAN, FULL, LAW, LAW_SLOPE, MOST = range(9)  # entries of `rules`
FADE, SILENT, BEGIN, PLACES, STEEPNESS = range(5)  # columns of `levels`
SPEED, LOAD = 0, 2  # rows of `motion`


@inlined
def interval_of(loads, load, start):
    """Return the interval of the rising `loads` that holds `load`, looking at `start` first."""
    if loads[start] <= load < loads[start + 1]:
        return start
    low, high = 0, len(loads) - 1
    while high - low > 1:
        middle = (low + high) // 2
        if loads[middle] <= load:
            low = middle
        else:
            high = middle
    return low


@signed_kernel("void(f4[::1], f8[:,::1], f8[:,::1], f8[::1], u8[::1], f8[:,::1], f8[::1], i8, f8[::1])")
def sample(pool, levels, rows, rules, phases, motion, state, stride, values):
    """Write z (m) at every `stride`-th frame from the first that is due, to `values`, as many as it holds.

    levels: float64 [levels, 5]: fade begin and end, begin in `pool`, places, 1 / length of the fade.
    rows: float64 [4, rows]: loads, mean of z, its slope, 1 / width of the interval above.
    phases: uint64 fractions of a turn [frames]. motion: float64 [5, frames], as in `motion.Motion`.
    """
    first = (stride - np.int64(state[COUNT])) % stride
    interval, level = np.int64(state[INTERVAL]), np.int64(state[LEVEL])
    loads = rows[0]
    last = loads[len(loads) - 1]
    for k in range(len(values)):
        i = first + k * stride
        load = min(max(motion[LOAD, i], 0.0), rules[MOST])
        held = min(load, last)
        turns = abs(motion[SPEED, i]) * rules[SCALE]
        interval = interval_of(loads, held, interval)
        width = loads[interval + 1] - loads[interval]
        s = (held - loads[interval]) * rows[3, interval]
        rest = 1.0 - s
        a, c = (1.0 + 2.0 * s) * rest * rest, s * s * (3.0 - 2.0 * s)
        b, d = s * rest * rest * width, -s * s * rest * width
        while level < len(levels) and turns >= levels[level, SILENT]:
            level += 1
        while level > 0 and turns < levels[level - 1, SILENT]:
            level -= 1
        value, share, now = 0.0, 1.0, level
        turn = np.float64(np.int64(phases[i] >> np.uint64(11))) * PLACE
        while now < len(levels) and share > 0.0:
            places = levels[now, PLACES]
            x = turn * places
            cell = np.int64(x)
            half = np.int64(places) + PADDING
            at = np.int64(levels[now, BEGIN]) + 2 * half * interval + cell
            gone = 0.0
            if now == level and turns > levels[now, FADE]:
                gone = smooth_step((turns - levels[now, FADE]) * levels[now, STEEPNESS])
            value += share * (1.0 - gone) * spline_value(pool, at, half, x - np.float64(cell), a, b, c, d)
            share *= gone
            now += 1
        if rules[WITH_MEAN] > 0.0:
            if load > last and rules[FULL] > 0.0:
                value += rules[LAW] + rules[LAW_SLOPE] * load * np.sqrt(load)
            else:
                value += a * rows[1, interval] + b * rows[2, interval]
                value += c * rows[1, interval + 1] + d * rows[2, interval + 1]
        if load < rules[LIFT]:
            value *= gate(load, rules[LIFT])[0]
        values[k] = value
    state[INTERVAL], state[LEVEL] = interval, level


TOGETHER = 4  # frames that are filtered together: of a stride that is a multiple of it, with the usual number of taps
USUAL = 7  # differences that the usual filter weighs


@inlined
def told(value):
    """Return `value` where a float32 holds it as a normal number, else 0."""
    return value if SMALLEST <= abs(value) <= LARGEST else 0.0


@signed_kernel("void(f8[::1], f8[:,::1], f8, f8, i8, f4[:])")
def filter_samples(z, weights, hold, gain, count, out):
    """Write the output of each frame from z, whose first samples are those before the block.

    weights: float64 [taps - 1, stride]. count: frames since the last sample of those before the block.
    """
    width, stride = weights.shape
    middle = (width + 1) // 2 - 1
    # of frame 0, in steps since the oldest sample; a block begins within the step of the last sample before it, or with
    # a new sample
    begin, j = (0, count) if count > 0 else (1, 0)
    done = 0
    if width == USUAL and stride % TOGETHER == 0:
        four = np.empty(TOGETHER)
        while done < len(out):
            b0, b1, b2 = z[begin + 1] - z[begin], z[begin + 2] - z[begin + 1], z[begin + 3] - z[begin + 2]
            b3, b4, b5 = z[begin + 4] - z[begin + 3], z[begin + 5] - z[begin + 4], z[begin + 6] - z[begin + 5]
            b6 = z[begin + 7] - z[begin + 6]
            held = hold * z[begin + middle]
            lane = j % TOGETHER
            group = j - lane
            w = weights[:, group : group + TOGETHER]
            for i in range(TOGETHER):
                near = w[2, i] * b2 + w[3, i] * b3 + w[4, i] * b4
                far = w[0, i] * b0 + w[1, i] * b1 + w[5, i] * b5 + w[6, i] * b6
                four[i] = gain * (near + far + held)
            taken = min(TOGETHER - lane, len(out) - done)
            for i in range(taken):
                out[done + i] = told(four[lane + i])
            done += taken
            j += taken
            if j == stride:
                begin, j = begin + 1, 0
        return
    while done < len(out):
        total = 0.0
        for m in range(width):
            total += weights[m, j] * (z[begin + m + 1] - z[begin + m])
        out[done] = told(gain * (total + hold * z[begin + middle]))
        done += 1
        j += 1
        if j == stride:
            begin, j = begin + 1, 0


@signed_kernel("void(f4[::1], f8[:,::1], f8[:,::1], f8[:,::1], f8[::1], u8[::1], f8[:,::1], f8[::1], f4[:])")
def read_block(pool, levels, rows, weights, rules, phases, motion, state, out):
    """Write the next frames to `out` and take `state` on; arguments as in `sample` and `filter_samples`."""
    width, stride = weights.shape
    taps, frames = width + 1, len(phases)
    count = np.int64(state[COUNT])
    first = (stride - count) % stride
    due = max(0, (frames - first + stride - 1) // stride)
    z = np.empty(taps + due)
    sample(pool, levels, rows, rules, phases, motion, state, stride, z[taps:])
    for i in range(taps):
        z[i] = state[HISTORY + i] if state[STARTED] > 0.0 else z[taps]
    filter_samples(z, weights, rules[HOLD], rules[GAIN], count, out)
    for i in range(taps):
        state[HISTORY + i] = z[due + i]
    state[STARTED] = 1.0
    state[COUNT] = (count + frames) % stride
