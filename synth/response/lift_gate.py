"""What every reader shares: the gate of a lifting finger, the fade of a level, and what a float32 cannot hold.

Model   The gate is 10 s^3 - 15 s^4 + 6 s^5 with s = w / lift_load, 1 above it: two continuous derivatives.
Source  design, section 4.
"""

from __future__ import annotations

from synth.kernels import inlined, kernel

SMALLEST = 1.2e-38  # the smallest normal float32; what is below leaves as zero, so that no denormal slows a peer
PLACE = 2.0**-53  # the 53 bits of the phase below the cell, as a fraction of the cell


@inlined
def smooth_step(s):
    """Return 3 s^2 - 2 s^3, kept in 0..1."""
    s = min(max(s, 0.0), 1.0)
    return s * s * (3.0 - 2.0 * s)


@kernel
def gate(load, lift):
    """Return the gate at `load`."""
    s = min(max(load / lift, 0.0), 1.0)
    return s * s * s * (10.0 + s * (6.0 * s - 15.0))
