"""One frame of a table: the place in its cell, and in one of degree 3 the response; the gate of a lifting finger.

Model   In a cell, R is a polynomial of the place t along the phase, whose coefficients are cubics of the place s along
        the load; `cell_rates` has those of degree 5, and the derivatives over time. The gate is 10 s^3 - 15 s^4 +
        6 s^5 with s = w / lift_load, 1 above it: two continuous derivatives.
Source  design, section 4; coefficients: `tables`.
Limits  exact for the polynomials, to round-off.
"""

from __future__ import annotations

import numpy as np

from synth.kernels import inlined

SMALLEST = 1.2e-38  # the smallest normal float32; what is below leaves as zero, so that no denormal slows a peer
PLACE = 2.0**-53  # the 53 bits of the phase below the cell, as a fraction of the cell


@inlined
def smooth_step(s):
    """Return 3 s^2 - 2 s^3, kept in 0..1."""
    s = min(max(s, 0.0), 1.0)
    return s * s * (3.0 - 2.0 * s)


@inlined
def gate(load, lift):
    """Return the gate g at `load` and its first and second derivative over the load."""
    s = min(max(load / lift, 0.0), 1.0)
    rest = 1.0 - s
    first = 30.0 * s * s * rest * rest / lift
    second = 60.0 * s * rest * (1.0 - 2.0 * s) / (lift * lift)
    return s * s * s * (10.0 + s * (6.0 * s - 15.0)), first, second


@inlined
def row_value(pool, at, s):
    """Return the cubic over the load with coefficients pool[at : at + 4]; unsigned indices need no wrap-around test."""
    return pool[at] + s * (pool[at + np.uint64(1)] + s * (pool[at + np.uint64(2)] + s * pool[at + np.uint64(3)]))


@inlined
def cubic_surface(pool, at, t, s):
    """Return R from the 16 coefficients at pool[at], t along the phase and s along the load."""
    a = row_value(pool, at, s)
    b = row_value(pool, at + np.uint64(4), s)
    c = row_value(pool, at + np.uint64(8), s)
    d = row_value(pool, at + np.uint64(12), s)
    return a + t * (b + t * (c + t * d))


@inlined
def place(phase, bits, size, offset):
    """Return where the coefficients of the cell of `phase` begin in the pool, and the place in that cell, 0..1.

    bits: log2 of the cells of the table; size: coefficients of a cell; offset: where the table begins.
    """
    cell = phase >> (np.uint64(64) - bits)
    return np.uint64(offset) + size * cell, np.float64(np.int64((phase << bits) >> np.uint64(11))) * PLACE
