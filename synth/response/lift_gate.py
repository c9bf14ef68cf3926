"""The lift gate, and two numbers that every compiled reader shares.

Model   The gate is 10 s^3 - 15 s^4 + 6 s^5 with s = w / lift_load, 1 above it: two continuous derivatives.
Source  design, section 4.
"""

from __future__ import annotations

from synth.kernels import inlined, kernel

SMALLEST = 1.2e-38  # the smallest normal float32; smaller values leave as zero, since denormals are slow
PLACE = 2.0**-53  # one unit of the 53 phase bits below the cell, as a fraction of the cell


@inlined
def smooth_step(s):
    """Return 3 s^2 - 2 s^3 for s clipped to 0..1."""
    s = min(max(s, 0.0), 1.0)
    return s * s * (3.0 - 2.0 * s)


@kernel
def gate(load, lift):
    """Return the gain, 0 to 1, at `load` (N); `lift` is lift_load (N)."""
    s = min(max(load / lift, 0.0), 1.0)
    return s * s * s * (10.0 + s * (6.0 * s - 15.0))
