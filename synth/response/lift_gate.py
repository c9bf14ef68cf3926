"""The lift gate: fades the output with the load of a finger that lifts.

Model   The gate is 10 s^3 - 15 s^4 + 6 s^5 with s = w / lift_load, and 1 above it. Two derivatives are continuous.
Source  design, section 4.
"""

from __future__ import annotations

import numpy as np

from synth.arrays import Array
from synth.kernels import kernel


@kernel
def gate(load, lift):
    """Return the gain, 0 to 1, at `load` (N); `lift` is lift_load (N)."""
    s = min(max(load / lift, 0.0), 1.0)
    return s * s * s * (10.0 + s * (6.0 * s - 15.0))


def gates(loads: Array, lift: float) -> Array:
    """Return the gain at each of `loads` (N), as `gate` does."""
    s = np.clip(loads / lift, 0.0, 1.0)
    return np.asarray(s**3 * (10.0 + s * (6.0 * s - 15.0)))
