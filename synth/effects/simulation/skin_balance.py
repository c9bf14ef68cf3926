"""The parts of a step of a finger of points: its free indentations, the z that balances, its memories, its slope force.

Model   See `skin_steps`, whose kernel calls these functions.
Source  Fagiani & Barbieri (2016), eqs 1, 4, 5. Newton's method here is Michelot's projection on the simplex (1986).
Limits  z is solved to rounding.
"""

from __future__ import annotations

from synth.effects.simulation.skin_attraction import forces_of
from synth.effects.simulation.skin_profile import (
    FREE_FREE,
    HELD_FREE,
    POINTS,
    SURFACE,
    ends_above,
    modified_area,
    slope_integral,
)
from synth.effects.simulation.steps import LOAD, PRESSING, SPEED, Z
from synth.effects.simulation.terms import DECAY, FOLLOW, LOSE
from synth.kernels import inner
from synth.response.phases import TURN

AT_REST = 16 * 2.0**-52  # of 1 + |z|: smaller moves are rounding and count as none, so a finger at rest stays there
SETTLED = 1e-17  # of 1 + |z|: error of z after the last iteration; with more, errors above 1e-15 are seen
MOST_PASSES = 80  # never reached in the tests; bounds the time of a step
TURNS = 1.0 / TURN  # turns per unit of a phase that is read as a signed number
TINY = 1e-200  # of a1 + a2: rounds memories to multiples of 1e-216, so that none becomes a slow denormal number
KEPT, FREE = 0, 1  # the two states of a point


@inner
def free_indentations(elements, keep, terms, nodes):
    """Write efree of both states of every point.

    elements: float64 [2, 1 + n, points], the indentation and n memories of each state.
    """
    for state in range(2):
        free, indentation = nodes[HELD_FREE + state], elements[state, 0]
        for j in range(free.shape[0]):
            free[j] = keep * indentation[j]
        for i in range(terms.shape[1]):
            lose, memory = terms[LOSE, i], elements[state, 1 + i]
            for j in range(free.shape[0]):
                free[j] -= lose * memory[j]


@inner
def remember(elements, terms, nodes, z):
    """Advance every point to the end of a step that ended at `z`.

    A point that begins to touch starts its held state from its free state. A point that leaves does the reverse.
    """
    surface, points = nodes[SURFACE], nodes[POINTS]
    held_free, free_free = nodes[HELD_FREE], nodes[FREE_FREE]
    held, free = elements[KEPT], elements[FREE]
    held_depths, free_depths = held[0], free[0]
    for i in range(terms.shape[1]):
        decay, follow = terms[DECAY, i], terms[FOLLOW, i]
        held_memories, free_memories = held[1 + i], free[1 + i]
        for j in range(points.shape[0]):
            begins = (points[j] > z) & (held_free[j] < free_free[j])
            leaves = (points[j] <= z) & (held_free[j] >= free_free[j])
            held_memory, free_memory = held_memories[j], free_memories[j]
            held_depth, free_depth = held_depths[j], free_depths[j]
            held_before = free_memory if begins else held_memory
            held_moved = (surface[j] - z) - (free_depth if begins else held_depth)
            free_before = held_memory if leaves else free_memory
            free_moved = held_free[j] - held_depth if leaves else free_free[j] - free_depth
            held_memories[j] = (decay * held_before + follow * held_moved + TINY) - TINY
            free_memories[j] = (decay * free_before + follow * free_moved + TINY) - TINY
    for j in range(points.shape[0]):
        leaves = (points[j] <= z) & (held_free[j] >= free_free[j])
        recovered = held_free[j] if leaves else free_free[j]
        held_depths[j] = surface[j] - z
        free_depths[j] = (recovered + TINY) - TINY


@inner
def settled_height(nodes, pieces, weights, window, base, alpha, z0, z, lowest):
    """Return the z that balances.

    z: start of the iteration.
    lowest: lower bound of the result.
    """
    z = max(z, lowest)
    for _pass in range(MOST_PASSES):
        area, part = modified_area(nodes, pieces, weights, z, window)
        if part + alpha <= 0.0:  # above every crest: from the lower bound the iteration cannot miss
            z = lowest
            continue
        z1 = max(z + (area - base - alpha * (z - z0)) / (part + alpha), lowest)
        move = abs(z1 - z)
        z = z1
        bend = move * move * part  # the error left after the move is bend / area
        if move <= AT_REST * (1.0 + abs(z)) or (part > 0.0 and bend <= SETTLED * area * (1.0 + abs(z))):
            break
    return z


@inner
def slope_when_pressed(nodes, pieces, weights, window, rates, z):
    """Return the mean over L of max(g - z, 0) times `rates`, of the texture where the pressure of the step acts."""
    begin, end, first, last = window
    work = slope_integral(rates, nodes, pieces, weights, z, first, last)
    if begin > 0.0:
        work += ends_above(rates, nodes[POINTS], z, window)[2]
    return work / (end - begin)


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
