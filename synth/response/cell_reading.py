"""Reading the tables of a moving voice at audio rate: its compiled inner loops.

Model   The phase theta (`phases`) is a 64-bit fraction of a turn; its high bits name the cell, the rest the place in
        it. displacement G = g(w) R(theta, w); velocity dG/dt = G_theta theta' + G_w w'; acceleration d2G/dt2 = G_tt
        theta'^2 + G_t theta'' + 2 G_tw theta' w' + G_ww w'^2 + G_w w''. R is the contact response about its mean; g is
        1 from `lift_load` on, and below it 10 s^3 - 15 s^4 + 6 s^5 with s = w / lift_load, which has two continuous
        derivatives and is exactly 0 at no load.
Source  design, sections 1, 4 and 8; the readable twin is tests/reference/slow_reading.py.
Limits  the loops stop at the first frame whose table is not built and return its index.
"""

from __future__ import annotations

import numpy as np

from synth.kernels import inlined, kernel
from synth.response.cell_rates import surface_rates
from synth.response.evaluation import SMALLEST, cubic_surface, gate, place, smooth_step
from synth.response.phases import phases_of, rest_of_step
from synth.response.prefetch import AHEAD, prefetch_cell

LARGEST = 3.4e38  # what a float32 holds; a hand whose derivatives ask for more, or for no number, is silent there

STRETCH = 64  # frames that `run_until` looks at first; longer makes short runs dear, shorter long ones

# entries of `layout`; then fade_from and fade_to of each level, then the edges of the intervals of load
RATE, PERIOD, LIFT, GAIN, HOLD, CONSTANTS = 0, 1, 2, 3, 4, 5
# rows of `motion`
SPEED, SPEED_RATE, LOAD, LOAD_RATE, LOAD_BEND = 0, 1, 2, 3, 4


@kernel
def interval_of(edges, load, start):
    """Return the interval of the rising `edges` that holds `load`, its ends and 1 / width, looking from `start`, or,
    where that is below 0, anywhere.

    The first and last interval reach on without end, so that a load beyond the rows stays in them.
    """
    last = len(edges) - 2
    if start < 0:
        start = min(max(np.searchsorted(edges, load, side="right") - 1, 0), last)
    while start < last and load >= edges[start + 1]:
        start += 1
    while start > 0 and load < edges[start]:
        start -= 1
    return start, edges[start], edges[start + 1], 1.0 / (edges[start + 1] - edges[start])


@kernel
def level_of(fades, turns, level):
    """Return the level that sounds at |turns| a frame, from and to which it does, and where it begins to fade.

    fades: fade_from, then fade_to of every level. The number of levels means silence. `level`: where to begin looking.
    """
    count = len(fades) // 2
    while level < count and turns >= fades[count + level]:
        level += 1
    while level > 0 and turns < fades[count + level - 1]:
        level -= 1
    slowest = fades[count + level - 1] if level > 0 else 0.0
    if level == count:
        return level, slowest, np.inf, np.inf
    return level, slowest, fades[count + level], fades[level]


@kernel
def run_until(motion, start, step, slowest, fade, low, high):
    """Return the first frame from `start` on whose speed or load leaves the ranges of one table."""
    # A stretch is counted first, which can be vectorised; each is twice as long as the one before, so that a short run
    # does not cost the length of the block.
    frames, stretch = motion.shape[1], STRETCH
    while start < frames:
        end = min(start + stretch, frames)
        speed, loads = motion[SPEED, start:end], motion[LOAD, start:end]
        outside = 0
        for i in range(len(speed)):
            turns, load = abs(speed[i]) * step, loads[i]
            outside += (turns < slowest) | (turns >= fade) | (load < low) | (load >= high)
        if outside > 0:
            for i in range(len(speed)):
                turns, load = abs(speed[i]) * step, loads[i]
                if (turns < slowest) | (turns >= fade) | (load < low) | (load >= high):
                    return start + i
        start, stretch = end, 2 * stretch
    return frames


@kernel
def run_displacement(
    pool, offset, bits, offset2, bits2, phases, motion, low, width, step, fade, fastest, gain, out, channel, start, stop
):
    """Write the displacement of frames `start` to `stop`, all of one level and interval, above the gate.

    offset2, bits2: the table of the next level, into which frames faster than `fade` turns a frame fade; below 0:
    silence.
    """
    phases, out = phases[start:stop], out[start:stop]
    loads, speeds = motion[LOAD, start:stop], motion[SPEED, start:stop]
    for i in range(len(phases)):
        prefetch_cell(pool, phases[min(i + AHEAD, len(phases) - 1)], bits, np.uint64(16), offset)
        s = (loads[i] - low) * width
        at, t = place(phases[i], bits, np.uint64(16), offset)
        value = cubic_surface(pool, at, t, s)
        turns = abs(speeds[i]) * step
        if turns > fade:
            part = smooth_step((turns - fade) / (fastest - fade))
            value -= part * value
            if offset2 >= 0:
                at, t = place(phases[i], bits2, np.uint64(16), offset2)
                value += part * cubic_surface(pool, at, t, s)
        value *= gain
        out[i, channel] = value if abs(value) >= SMALLEST else 0.0


@kernel
def run_rate(
    pool, offset, bits, offset2, bits2, phases, motion, low, width, step, fade, fastest, spatial, gain, out, channel,
    start, stop, order,
):  # fmt: skip
    """Write the velocity or acceleration of frames `start` to `stop`, as `run_displacement` does."""
    scale = spatial * np.float64(np.int64(1) << np.int64(bits))
    scale2 = spatial * np.float64(np.int64(1) << np.int64(bits2))
    phases, out = phases[start:stop], out[start:stop]
    speeds, speed_rates = motion[SPEED, start:stop], motion[SPEED_RATE, start:stop]
    loads, load_rates = motion[LOAD, start:stop], motion[LOAD_RATE, start:stop]
    load_bends = motion[LOAD_BEND, start:stop]
    for i in range(len(phases)):
        prefetch_cell(pool, phases[min(i + AHEAD, len(phases) - 1)], bits, np.uint64(24), offset)
        s = (loads[i] - low) * width
        along, along_bend = load_rates[i] * width, load_bends[i] * width
        speed, speed_rate = speeds[i], speed_rates[i]
        at, t = place(phases[i], bits, np.uint64(24), offset)
        _value, first, second = surface_rates(pool, at, t, s, speed * scale, speed_rate * scale, along, along_bend)
        value = first if order == 1 else second
        turns = abs(speed) * step
        if turns > fade:
            part = smooth_step((turns - fade) / (fastest - fade))
            value -= part * value
            if offset2 >= 0:
                at, t = place(phases[i], bits2, np.uint64(24), offset2)
                _value, first, second = surface_rates(
                    pool, at, t, s, speed * scale2, speed_rate * scale2, along, along_bend
                )
                value += part * (first if order == 1 else second)
        value *= gain
        out[i, channel] = value if SMALLEST <= abs(value) <= LARGEST else 0.0


@inlined
def next_table(tables, level, interval):
    """Return offset and log2 of cells of the next level's table, and whether a run may fade into it."""
    if level + 1 == len(tables):
        return np.int64(-1), np.uint64(0), True
    return tables[level + 1, 1 + interval], np.uint64(tables[level + 1, 0]), tables[level + 1, 1 + interval] >= 0


@kernel
def fading_displacement(pool, tables, level, interval, phase, s, part):
    """Return the displacement of one frame, `part` of the way from `level` to the next; NaN where a table is
    missing.
    """
    value = 0.0
    for k in range(level, min(level + 2, len(tables))):
        weight = 1.0 - part if k == level else part
        if weight == 0.0:
            continue
        if tables[k, 1 + interval] < 0:
            return np.nan
        at, t = place(phase, np.uint64(tables[k, 0]), np.uint64(16), tables[k, 1 + interval])
        value += weight * cubic_surface(pool, at, t, s)
    return value


@kernel
def fading_rates(pool, tables, level, interval, phase, s, part, spatial, motion, i, along, along_bend):
    """Return R and its two total time derivatives of frame `i`, as `fading_displacement` does."""
    value, first, second = 0.0, 0.0, 0.0
    for k in range(level, min(level + 2, len(tables))):
        weight = 1.0 - part if k == level else part
        if weight == 0.0:
            continue
        if tables[k, 1 + interval] < 0:
            return np.nan, 0.0, 0.0
        at, t = place(phase, np.uint64(tables[k, 0]), np.uint64(24), tables[k, 1 + interval])
        scale = spatial * np.float64(np.int64(1) << np.int64(np.uint64(tables[k, 0])))
        a, b, c = surface_rates(
            pool, at, t, s, motion[SPEED, i] * scale, motion[SPEED_RATE, i] * scale, along, along_bend
        )
        value, first, second = value + weight * a, first + weight * b, second + weight * c
    return value, first, second


@kernel
def read_displacement(pool, tables, layout, state, motion, position, start, out, channel):
    """Write the displacement of frames `start` onward; return the first frame whose table is missing, or the frame
    count.

    pool: float64, all tables. tables: int64 [levels, 1 + intervals], log2 of the cells of a level, then where its table
    of each interval begins, or -1. layout: float64, frames a second, texture period (m), lift_load (N), gain, and 1
    where the end rows hold beyond the edges (0: such a frame is missing); then fade_from and fade_to of each level
    (turns a frame), and the edges of the intervals (N). state: uint64 [1], the phase of frame `start`, moved on.
    motion: float64 [5, frames] (rows above). position: float64 [frames] (m) or empty. out: float32 [frames, channels].
    """
    frames, levels = motion.shape[1], len(tables)
    step, lift, gain = 1.0 / (layout[RATE] * layout[PERIOD]), layout[LIFT], layout[GAIN]
    fades, edges = layout[CONSTANTS : CONSTANTS + 2 * levels], layout[CONSTANTS + 2 * levels :]
    rest = rest_of_step(step, layout[RATE], layout[PERIOD])
    bend = 0.5 * step / layout[RATE]
    phases, after = phases_of(motion, position, start, state[0], step, rest, bend, layout[PERIOD])
    level, interval, i = 0, -1, start
    while i < frames:
        turns, load = abs(motion[SPEED, i]) * step, motion[LOAD, i]
        level, slowest, fastest, fade = level_of(fades, turns, level)
        interval, low, high, width = interval_of(edges, load, interval)
        if level < levels and lift <= load < high and load >= low and tables[level, 1 + interval] >= 0:
            offset2, bits2, fades_too = next_table(tables, level, interval)
            upper = fastest if fades_too else fade
            if turns < upper:
                stop = run_until(motion, i, step, slowest, upper, max(low, lift), high)
                run_displacement(
                    pool, tables[level, 1 + interval], np.uint64(tables[level, 0]), offset2, bits2, phases, motion,
                    low, width, step, fade, fastest, gain, out, channel, i, stop,
                )  # fmt: skip
                i = stop
                continue
        value = 0.0
        if layout[HOLD] == 0.0 and load > 0.0 and not edges[0] <= load <= edges[-1]:
            state[0] = phases[i]
            return i
        if level < levels and load > 0.0:
            s = min(max((load - low) * width, 0.0), 1.0)
            part = smooth_step((turns - fade) / (fastest - fade))
            value = fading_displacement(pool, tables, level, interval, phases[i], s, part)
            if value != value:
                state[0] = phases[i]
                return i
            value *= gain * gate(load, lift)[0]
        out[i, channel] = value if abs(value) >= SMALLEST else 0.0
        i += 1
    state[0] = after
    return frames


@kernel
def read_rate(pool, tables, layout, state, motion, position, start, out, channel, order):
    """Write the velocity (`order` 1) or acceleration (`order` 2), as `read_displacement` does, from tables of degree
    5.
    """
    frames, levels = motion.shape[1], len(tables)
    step, lift, gain = 1.0 / (layout[RATE] * layout[PERIOD]), layout[LIFT], layout[GAIN]
    fades, edges = layout[CONSTANTS : CONSTANTS + 2 * levels], layout[CONSTANTS + 2 * levels :]
    spatial = 1.0 / layout[PERIOD]
    rest = rest_of_step(step, layout[RATE], layout[PERIOD])
    bend = 0.5 * step / layout[RATE]
    phases, after = phases_of(motion, position, start, state[0], step, rest, bend, layout[PERIOD])
    level, interval, i = 0, -1, start
    while i < frames:
        turns, load = abs(motion[SPEED, i]) * step, motion[LOAD, i]
        level, slowest, fastest, fade = level_of(fades, turns, level)
        interval, low, high, width = interval_of(edges, load, interval)
        if level < levels and lift <= load < high and load >= low and tables[level, 1 + interval] >= 0:
            offset2, bits2, fades_too = next_table(tables, level, interval)
            upper = fastest if fades_too else fade
            if turns < upper:
                stop = run_until(motion, i, step, slowest, upper, max(low, lift), high)
                run_rate(
                    pool, tables[level, 1 + interval], np.uint64(tables[level, 0]), offset2, bits2, phases, motion,
                    low, width, step, fade, fastest, spatial, gain, out, channel, i, stop, order,
                )  # fmt: skip
                i = stop
                continue
        result = 0.0
        if layout[HOLD] == 0.0 and load > 0.0 and not edges[0] <= load <= edges[-1]:
            state[0] = phases[i]
            return i
        if level < levels and load > 0.0:
            s, load_rate, load_bend = (load - low) * width, motion[LOAD_RATE, i], motion[LOAD_BEND, i]
            inside = width if 0.0 <= s <= 1.0 else 0.0
            part = smooth_step((turns - fade) / (fastest - fade))
            value, first, second = fading_rates(
                pool, tables, level, interval, phases[i], min(max(s, 0.0), 1.0), part, spatial, motion, i,
                load_rate * inside, load_bend * inside,
            )  # fmt: skip
            if value != value:
                state[0] = phases[i]
                return i
            g, g1, g2 = gate(load, lift)
            rate = g1 * load_rate
            second = g * second + 2.0 * rate * first + (g2 * load_rate * load_rate + g1 * load_bend) * value
            result = gain * (g * first + rate * value if order == 1 else second)
        out[i, channel] = result if SMALLEST <= abs(result) <= LARGEST else 0.0
        i += 1
    state[0] = after
    return frames
