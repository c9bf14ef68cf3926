"""The forces of a step of a finger of points: its load, its stiffness, what balances, and the reaction.

Model   See `skin_steps`, whose kernel calls these functions.
Source  Fagiani & Barbieri (2016), eqs 1, 4, 5.
Limits  Those of `skin_steps`.
"""

from __future__ import annotations

from synth.effects.simulation.skin_attraction import forces_of
from synth.effects.simulation.skin_profile import modified_area
from synth.effects.simulation.steps import LOAD, PRESSING, SPEED, Z
from synth.kernels import inner


@inner
def loads_of(numbers, load, when, new_part, spring, rests, before, share, scale):
    """Return the load of the pressure of a step, and the load that balances it with the spring of the pulp, N.

    rests, before: z_w (m) at the end of the step and before it; share: of the end in the force of the spring.
    """
    pressed = load - (1.0 - when) * (load - numbers[LOAD])
    balanced = load - 0.5 * (load - numbers[LOAD]) if new_part < 1.0 else pressed
    return pressed, balanced + spring * (scale * numbers[Z] - rests - (1.0 - share) * (before - rests))


@inner
def stiffness_of(contact, hardness, span, part, pressed, reach):
    """Return the forces of the foundation, of the attraction and of both per mean of a1 + a2, N.

    contact, span: see `run_steps`; part: of the points in contact.
    """
    own = contact[0] * hardness * contact[4] * max(pressed, contact[6]) ** contact[5] * part ** span[3]
    more = contact[8] * part * part / reach if contact[8] > 0.0 else 0.0
    return own, more, own + more


@inner
def balance_of(contact, numbers, balanced, new_part, share, step, full):
    """Return base and alpha of Model.

    contact, step: see `run_steps`.
    balanced: load that the skin balances, N.
    new_part: share of the pressure of this step in the pressure that balances.
    share: of the end of the step in the force of the spring.
    full: force per mean of a1 + a2, N.
    """
    mass, damping, spring = contact[2], contact[3], contact[7]
    moved = (1.0 - new_part) * numbers[PRESSING] + 2.0 * mass * numbers[SPEED] / step
    alpha = contact[0] * ((2.0 * mass / step + damping) / step + share * spring) / (new_part * full)
    return (balanced - moved) / (new_part * full), alpha


@inner
def reaction_of(met, forces, balance, z0, z, by_area, held, numbers):
    """Return the reaction (N) after a step from z0 to z, and keep the force that presses in `numbers`.

    met: nodes, pieces, weights and window.
    forces: per mean of a1 + a2 (N): the foundation, the attraction and its reach; a reach of 0: there is none.
    balance: base and alpha of Model.
    by_area: whether it follows from the area: the value from the balance would carry rounding from step to step.
    """
    nodes, pieces, weights, window = met
    own, more, reach = forces
    if reach > 0.0:
        reaction, numbers[PRESSING] = forces_of(nodes, pieces, weights, window, own, more, reach, z, held)
        return reaction
    reaction = max((own + more) * (balance[0] + balance[1] * (z - z0)), 0.0)
    if by_area:
        reaction = (own + more) * modified_area(nodes, pieces, weights, z, window)[0]
    numbers[PRESSING] = reaction
    return reaction
