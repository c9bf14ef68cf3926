"""One frame of a table: the response and its time derivatives at one place, and the gate of a lifting finger.

Model   In a cell, R is a polynomial of the place t along the phase, whose coefficients are cubics of the place s along
        the load. dR/dt and d2R/dt2 are its total derivatives: R_tt t'^2 + R_t t'' + 2 R_ts t' s' + R_ss s'^2 + R_s s''.
        The gate is 10 s^3 - 15 s^4 + 6 s^5 with s = w / lift_load, 1 above it: two continuous derivatives.
Source  design, section 4; coefficients: `tables`.
Limits  exact for the polynomials, to round-off.
"""

from __future__ import annotations

import numpy as np

from synth.contact.kernels import inlined

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
def quintic(a, b, c, d, e, f, t):
    """Return a polynomial of the fifth degree at t with its first and second derivative."""
    value = a + t * (b + t * (c + t * (d + t * (e + t * f))))
    first = b + t * (2.0 * c + t * (3.0 * d + t * (4.0 * e + t * (5.0 * f))))
    second = 2.0 * c + t * (6.0 * d + t * (12.0 * e + t * (20.0 * f)))
    return value, first, second


@inlined
def row_cubic(pool, at, s):
    """Return the cubic over the load with coefficients pool[at : at + 4], its first and its second derivative."""
    a, b, c, d = pool[at], pool[at + np.uint64(1)], pool[at + np.uint64(2)], pool[at + np.uint64(3)]
    return a + s * (b + s * (c + s * d)), b + s * (2.0 * c + s * (3.0 * d)), 2.0 * c + 6.0 * d * s


@inlined
def surface_rates(pool, at, t, s, turn_rate, turn_bend, load_rate, load_bend):
    """Return R and its first and second total time derivative from the 24 coefficients at pool[at].

    turn_rate, turn_bend: dt/dt and d2t/dt2 in cells a second; load_rate, load_bend: the same of s.
    """
    a, a1, a2 = row_cubic(pool, at, s)
    b, b1, b2 = row_cubic(pool, at + np.uint64(4), s)
    c, c1, c2 = row_cubic(pool, at + np.uint64(8), s)
    d, d1, d2 = row_cubic(pool, at + np.uint64(12), s)
    e, e1, e2 = row_cubic(pool, at + np.uint64(16), s)
    f, f1, f2 = row_cubic(pool, at + np.uint64(20), s)
    value, along, bend = quintic(a, b, c, d, e, f, t)
    by_load = a1 + t * (b1 + t * (c1 + t * (d1 + t * (e1 + t * f1))))
    mixed = b1 + t * (2.0 * c1 + t * (3.0 * d1 + t * (4.0 * e1 + t * (5.0 * f1))))
    load_curve = a2 + t * (b2 + t * (c2 + t * (d2 + t * (e2 + t * f2))))
    first = along * turn_rate + by_load * load_rate
    second = bend * turn_rate * turn_rate + along * turn_bend + 2.0 * mixed * turn_rate * load_rate
    second += load_curve * load_rate * load_rate + by_load * load_bend
    return value, first, second


@inlined
def place(phase, bits, size, offset):
    """Return where the coefficients of the cell of `phase` begin in the pool, and the place in that cell, 0..1.

    bits: log2 of the cells of the table; size: coefficients of a cell; offset: where the table begins.
    """
    cell = phase >> (np.uint64(64) - bits)
    return np.uint64(offset) + size * cell, np.float64(np.int64((phase << bits) >> np.uint64(11))) * PLACE
