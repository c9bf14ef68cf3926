"""The kernels of `area_layers`: layers of a texture, images of a finger, and the sums of their products.

Model   See `area_layers`. A sample of the texture is split between two layers and, along and across, between the two
        places of the lattice next to it. A cubic B-spline spreads a point of the finger over TAPS places in both
        directions.
Source  Unser, Splines: a perfect fit for signal and image processing (1999).
Limits  The layers are summed in float32, a few hundred samples each.
"""

from __future__ import annotations

import math

import numpy as np

from synth.contact.area_solver import BEFORE, FINER_X, FINER_Y, ROWS, SPAN, STRIDE
from synth.kernels import inlined, signed_kernel

TAPS = 4  # places


@signed_kernel("void(f4[::1], i8[::1], f8, i8, i8, f8, i8, f4[:,:,::1], i8, i8)")
def lay_texture(texture, shape, per, fine_x, fine_y, step, first, layers, one, end):
    """Add the texture to rows `one` to `end` of the layers: at each place, the mean of the samples around it.

    texture, shape, per: as in `area_solver.solve_area`.
    fine_x, fine_y: samples per cell of the lattice.
    step, first: as in `LayerPlan`.
    """
    count, rows, columns = layers.shape
    finer_x, finer_y, stride, span, cells = shape[FINER_X], shape[FINER_Y], shape[STRIDE], shape[SPAN], shape[ROWS]
    samples = columns * fine_x
    near, beyond, part = np.empty(samples, np.int64), np.empty(samples, np.int64), np.empty(samples, np.float32)
    for i in range(samples):
        at = i / samples * per * finer_x
        whole = np.int64(at)
        near[i] = whole % finer_x * stride + whole // finer_x + BEFORE
        beyond[i] = (whole + 1) % finer_x * stride + (whole + 1) // finer_x + BEFORE
        part[i] = at - whole
    inverse = np.float32(1.0 / step)
    for row in range(one, end):
        for moved in range(1 - fine_y, fine_y):
            at = ((row * fine_y + moved) % (rows * fine_y)) / (rows * fine_y) * (cells * finer_y)
            whole = np.int64(at)
            fy = np.float32(at - whole)
            low = (whole % finer_y * finer_x) * stride + whole // finer_y * span
            whole = (whole + 1) % (cells * finer_y)
            high = (whole % finer_y * finer_x) * stride + whole // finer_y * span
            share = (fine_y - abs(moved)) / (fine_y * fine_y * fine_x)
            for i in range(samples):
                below = texture[low + near[i]] + part[i] * (texture[low + beyond[i]] - texture[low + near[i]])
                above = texture[high + near[i]] + part[i] * (texture[high + beyond[i]] - texture[high + near[i]])
                height = (below + fy * (above - below)) * inverse
                layer = min(np.int64(math.floor(height)), first + count - 2)  # the highest place may be rounded up
                upper = height - np.float32(layer)
                layer -= first
                if layer < -1:
                    continue
                column, beside = i // fine_x, i % fine_x
                right = share * beside / fine_x
                left = share - right
                following = column + 1 if column + 1 < columns else 0
                if layer >= 0:
                    layers[layer, row, column] += (np.float32(1.0) - upper) * left
                    layers[layer, row, following] += (np.float32(1.0) - upper) * right
                layers[layer + 1, row, column] += upper * left
                layers[layer + 1, row, following] += upper * right


@inlined
def cubic_weights(t):
    """Return the weights of a cubic B-spline at 0 <= t < 1 of a cell."""
    rest = 1.0 - t
    return (
        rest * rest * rest / 6.0,
        (3.0 * t * t * t - 6.0 * t * t + 4.0) / 6.0,
        (3.0 * rest * rest * rest - 6.0 * rest * rest + 4.0) / 6.0,
        t * t * t / 6.0,
    )


@signed_kernel("void(f8[::1], f8[::1], f8[::1], f8[::1], f8[:,::1], f8[:,::1], f8[:,::1])")
def share_points(x, y, heights, shares, sums, above, rest):
    """Add points, weighted by `shares`, to the places around them.

    x, y: in places of the images, which are periodic.
    heights: n, above the level, in steps. A point adds n to `sums`, min(n, 1) to `above` and 1 - min(n, 1) to `rest`.
    """
    rows, columns = sums.shape
    for n in range(len(x)):
        column, row = np.int64(x[n]), np.int64(y[n])
        along, across = cubic_weights(x[n] - column), cubic_weights(y[n] - row)
        share = min(heights[n], 1.0)
        for j in range(TAPS):
            to = (row - 1 + j) % rows
            for i in range(TAPS):
                weight, at = shares[n] * across[j] * along[i], (column - 1 + i) % columns
                sums[to, at] += heights[n] * weight
                above[to, at] += share * weight
                rest[to, at] += (1.0 - share) * weight


@signed_kernel("void(f8[:,::1], i8, i8, f4[:,::1])")
def fold(sums, column, row, image):
    """Write `sums`, whose first place is at `column` and `row`, to the periodic `image`."""
    rows, columns = image.shape
    image[:] = 0.0
    for j in range(sums.shape[0]):
        to = (row + j) % rows
        at = column % columns
        for i in range(sums.shape[1]):
            image[to, at] += sums[j, i]
            at = at + 1 if at + 1 < columns else 0


@signed_kernel("void(c8[:,:,::1], c8[:,:,::1], i8[:,::1], c8[:,:,::1], i8, i8)")
def mix(layers, finger, slots, mixed, one, end):
    """Write the sum over the layers j of layers[j] finger[slots[k, j]] to rows `one` to `end` of mixed[k]."""
    for row in range(one, end):
        for k in range(len(slots)):
            out = mixed[k, row]
            out[:] = 0.0
            for j in range(len(layers)):
                layer, other = layers[j, row], finger[slots[k, j], row]
                for i in range(len(out)):
                    out[i] += layer[i] * other[i]
