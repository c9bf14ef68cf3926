"""The kernels of a layered table: z at any place and load, and the coefficients in the order in which they are read.

Stage   RESPONSE: reading an area.
Model   See `layered_table`. z is a sum over 4 places along, 4 across and 4 rows of load, which are near in memory, and
        over 4 coefficients of the mean.
Limits  A place that is not a number gives a z that is not a number.
"""

from __future__ import annotations

import math

import numpy as np

from synth.contact.layer_sums import cubic_weights
from synth.kernels import inlined, signed_kernel

PADDING = 3  # places repeated at the end of a period, so that a reader need not wrap around


@inlined
def root(load):
    """Return u = w^(1/4)."""
    return math.sqrt(math.sqrt(load))


@inlined
def cell_of(at, cells):
    """Return which of the `cells` contains `at`, and the position of `at` in it, 0 to 1."""
    cell = min(max(np.int64(at), 0), cells - 1)  # also where `at` is not a number
    return cell, at - cell


@inlined
def curve_at(curve, part):
    """Return m (m) at `part`, 0 to 1, of the range of u."""
    k, t = cell_of(part * (len(curve) - 3), len(curve) - 3)
    a, b, c, d = cubic_weights(t)
    return a * curve[k] + b * curve[k + 1] + c * curve[k + 2] + d * curve[k + 3]


@signed_kernel("void(f8[::1], f8[::1], f8[::1], f8[::1])")
def read_means(curve, ends, loads, found):
    """Write m (m) at each of `loads` (N). Arguments as in `read_heights`."""
    low = root(ends[0])
    scale = 1.0 / (root(ends[1]) - low)
    for n in range(len(found)):
        found[n] = curve_at(curve, (root(min(max(loads[n], ends[0]), ends[1])) - low) * scale)


@signed_kernel("void(i2[:,:,::1], f8[::1], f8[::1], f8[::1], f8[::1], f8[::1], f8[::1], f8[::1])")
def read_heights(coefficients, scales, curve, ends, phases, across, loads, found):
    """Write z (m) at each place and load. Arguments as in `LayeredTable`.

    ends: of the range of loads, N [2].
    """
    rows, columns, count = coefficients.shape[0] - PADDING, coefficients.shape[1] - PADDING, coefficients.shape[2] - 3
    low = root(ends[0])
    scale = 1.0 / (root(ends[1]) - low)
    for n in range(len(found)):
        part = (root(min(max(loads[n], ends[0]), ends[1])) - low) * scale
        i, x = cell_of((phases[n] - math.floor(phases[n])) * columns, columns)
        j, y = cell_of((across[n] - math.floor(across[n])) * rows, rows)
        k, t = cell_of(part * count, count)
        along, over = cubic_weights(x), cubic_weights(y)
        a, b, c, d = cubic_weights(t)
        a, b, c, d = a * scales[k], b * scales[k + 1], c * scales[k + 2], d * scales[k + 3]
        total = 0.0
        for m in range(4):
            line, some = coefficients[j + m], 0.0
            for n_along in range(4):
                taps = line[i + n_along]
                some += along[n_along] * (a * taps[k] + b * taps[k + 1] + c * taps[k + 2] + d * taps[k + 3])
            total += over[m] * some
        found[n] = curve_at(curve, part) + total


@signed_kernel("void(f4[:,::1], f8, i8, i2[:,:,::1], i8, i8)")
def store(values, scale, number, shorts, one, end):
    """Write the coefficients of one row of load, in units of `scale`, to rows `one` to `end` of `shorts`."""
    rows, columns = values.shape
    for j in range(one, end):
        line = values[(j - 1) % rows]
        for i in range(shorts.shape[1]):
            shorts[j, i, number] = np.int16(np.rint(line[(i - 1) % columns] / scale))
