"""The pulp of the finger: the spring between the contact and the bone.

Stage   coefficients of `table_steps` and `skin_steps`
Model   The spring adds k_p (z - z_w) to the load w. z_w is the mean of the quasi-static z over a texture period at the
        present load, so the mean force of the pulp is the load. A hand is slow: the bone stays where it is within a
        period.
Source  Wiertlewski & Hayward (2012), J. Biomech. 45: a fingertip is elastic up to some 100 Hz and viscous above.
Limits  The bone follows only the load, and without delay. If the mean of the simulated z is not z_w, the mean force
        differs from the load by k_p times the difference: 1 mN per um at 1 kN/m.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from synth.arrays import Array
from synth.effects.simulation.steps import HEIGHT, ROWS, Stepper
from synth.response.mean_approach import Mean
from synth.response.phases import turns_to_phase

MEAN_PHASES = 64  # of a period, for a mean with adhesion; k_p times the error of the mean is some uN
MEANS = 257  # loads, evenly spaced over their cube root; between them the mean is a straight line
ALMOST_NONE = -1e-9  # N, in place of 0, because a start with adhesion at a load of 0 has let go of the finger


@dataclass(frozen=True, slots=True)
class Pulp:
    """A spring that carries the contact.

    stiffness: k_p (N/m); 0: no spring.
    rest: z_w (m) as a function of w^(1/3) (N^(1/3)), or at the only load.
    """

    stiffness: float = 0.0
    rest: Mean | float = 0.0

    def rests(self, before: float, loads: Array, lightest: float) -> Array:
        """Return z_w (m) at the load `before` and at each of `loads`, float64 [loads + 1].

        before, loads: N; those below `lightest` count as `lightest`.
        """
        if isinstance(self.rest, float):
            return np.full(len(loads) + 1, self.rest)
        return np.asarray(self.rest(np.cbrt(np.maximum(np.append(before, loads), lightest))))


NO_PULP = Pulp()


def attracted_mean(stepper: Stepper, lowest: float, heaviest: float) -> Mean | float:
    """Return the mean of z over a period (m) with adhesion, over w^(1/3) (N^(1/3)) between two loads (N), or at one.

    stepper: without mass and pulp. A finger that lets go within the period counts as out of range.
    """
    if lowest == heaviest:
        return _mean_at(stepper, lowest)
    roots = np.linspace(np.cbrt(lowest), np.cbrt(heaviest), MEANS)
    values = np.array([_mean_at(stepper, float(root) ** 3) for root in roots])
    return lambda wanted: np.asarray(np.interp(wanted, roots, values))


def _mean_at(stepper: Stepper, load: float) -> float:
    """Return the mean of z (m) over the second of two periods at `load` (N)."""
    state, rows = stepper.start(0, load or ALMOST_NONE, 0.0, 1.0), np.empty((ROWS, MEAN_PHASES))
    phases, loads = turns_to_phase(np.arange(1, MEAN_PHASES + 1) / MEAN_PHASES), np.full(MEAN_PHASES, load)
    for _period in range(2):
        stepper.run(state, phases, loads, rows)
    return float(np.mean(rows[HEIGHT]))
