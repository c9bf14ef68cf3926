"""The position of a finger held by adhesion, from following its path in small moves: the reference for renders.

Model   w = R(z, theta), R = k I(z) - (P / d0) (I(z - d0) - I(z)) as in `moving_oracle`, with k of eqs 4-5 at the load.
        Where there are several roots, the finger takes the first one downhill. If R(z) > w, it rises to the next z with
        R = w; otherwise it sinks to the next one. A finger that rises beyond the range of the attraction has let go.
Source  Fagiani & Barbieri (2016), eqs 1 to 5; the attraction is that of the effect's own docstring.
Method  Moves of `move` metres until R - w changes its sign, then SciPy's ``brentq``.
Limits  Two roots within one move are missed.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
from scipy.optimize import brentq

from tests.reference.moving_oracle import Profile, Reaction, elastic
from tests.reference.stiffness_oracle import Touch, stiffness

Real = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Held:
    """z (m), 1 while the finger is held, the force on the slopes and the sum of the pressure (N), at every place."""

    z: Real
    held: Real
    slope_force: Real
    pressed: Real


@dataclass(frozen=True)
class Path:
    """A texture and a finger that it attracts.

    stress: Pa.
    reach: m.
    lightest: N; smaller loads count as this load.
    """

    touch: Touch
    stress: float
    reach: float
    lightest: float = 1e-3
    move: float = 2e-8

    def followed(self, theta: Real, loads: Real, *, forces: bool = False, held: bool = True) -> Held:
        """Return the rest position at each theta (turns) and load (N) in turn, starting with a touching finger."""
        reaction = Reaction(Profile(self.touch), self.stress * self.touch.contact_length**2, self.reach)
        rows = np.zeros((4, len(theta)))
        z: float | None = None
        for i, (turn, load) in enumerate(zip(theta.tolist(), loads.tolist(), strict=True)):
            k = stiffness(replace(self.touch, load=max(load, self.lightest))).k
            if not held and load > 1e-6:
                held, z = True, self.top(reaction, turn)
            if held:
                if z is None:
                    z = elastic(reaction.profile, max(load, self.lightest) / k, turn)
                found = self.downhill(reaction, z, turn, load, k)
                held, z = found is not None, found
            rows[0, i] = self.top(reaction, turn) if z is None else z
            rows[1, i] = held
            if forces and z is not None:
                rows[2, i] = reaction.force(z, turn, k)
                rows[3, i] = reaction.at(z, turn, k)[1]
        return Held(*rows)

    def top(self, reaction: Reaction, theta: float) -> float:
        """Return the lowest z (m) at which nothing is in reach."""
        return float(reaction.profile.touching(0.0, theta)[2]) + self.reach

    def downhill(self, reaction: Reaction, z: float, theta: float, load: float, k: float) -> float | None:
        """Return the root that the finger reaches from `z`, or None where it lets go."""

        def excess(place: float) -> float:
            return reaction.at(place, theta, k)[0] - load

        first = excess(z)
        up, highest = first > 0.0, self.top(reaction, theta)
        step = self.move if up else -self.move
        while True:
            after = z + step
            if up and after >= highest:
                return None
            if (excess(after) > 0.0) != up:
                return float(brentq(excess, min(z, after), max(z, after), xtol=1e-16, rtol=1e-14))
            z = after
