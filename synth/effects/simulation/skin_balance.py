"""z of a finger of viscous skin at every step of a run: the compiled loop over the steps.

Model   base + alpha (z - z0) = mean over L of max(g - z, 0), all heights relative to a1 + a2: the right side is convex
        and falls, the left rises by alpha = (2 m / h^2 + c / h) / (k A), and Newton's method goes from z extrapolated.
Source  `skin_steps`, which says what is balanced; Newton is Michelot's projection on the simplex (1986).
Limits  z is settled to rounding, 1e-15 (1 + |z|) of a1 + a2 a step; a move of less than AT_REST is taken for rounding,
        and made once the moves left out have grown beyond it.
"""

from __future__ import annotations

import math

import numpy as np

from synth.contact.sampled import area_above, measure_pieces
from synth.effects.simulation.skin import HARDNESS, KEEP
from synth.effects.simulation.skin_profile import (
    SURFACE,
    free_indentations,
    modified_area,
    modified_profile,
    remember,
    slope_integral,
)
from synth.effects.simulation.skin_surface import write_heights, write_rates
from synth.effects.simulation.steps import ATTACHED, HEIGHT, REACTION, SLOPE_FORCE, STATIC
from synth.kernels import inlined, kernel
from synth.response.phases import HALF_TURN

AT_REST = 16 * 2.0**-52  # of 1 + |z|: a smaller move is rounding, and is none: a finger at rest stays where it is
SETTLED = (
    1e-17  # of 1 + |z|: what the bend of the area leaves in z after the last Newton step; more is seen above 1e-15
)
MOST_PASSES = 80  # never reached in the suite; it bounds the time of a step
BELOW = 1e-9  # of 1 + |z|: z begins this far below its lower bound at least: rounding must not put the bound above z
TURNS = 0.5 / HALF_TURN  # of one step of a phase taken as a signed number

Z, STATIC_Z, VELOCITY, LOAD, PRESSING, NUMBERS = 0, 4, 8, 9, 10, 11
"""Places in the numbers of a state: z and the three before it, static z and the three before it, z' (m/s), load (N),
sum of the pressure (N); how many they are."""


@inlined
def extrapolated(last):
    """Return where a cubic through the last four values, the newest first, goes on to."""
    return 4.0 * (last[0] + last[2]) - 6.0 * last[1] - last[3]


@inlined
def shifted(last, value):
    """Put `value` before the last three."""
    last[3], last[2], last[1], last[0] = last[2], last[1], last[0], value


@inlined
def settled(step, area, part, z):
    """Whether z stands after a Newton step from where area and part were taken: it is off by step^2 part / area."""
    return step <= AT_REST * (1.0 + abs(z)) or (part > 0.0 and step * step * part <= SETTLED * area * (1.0 + abs(z)))


@kernel
def settled_height(nodes, pieces, base, alpha, z0, z, lowest):
    """Return the z that balances; z: where to begin; `lowest`: no z that balances is below."""
    z = max(z, lowest)
    for _pass in range(MOST_PASSES):
        area, part = modified_area(nodes, pieces, z)
        if part + alpha <= 0.0:  # above every crest: from below it cannot miss
            z = lowest
            continue
        z1 = max(z + (area - base - alpha * (z - z0)) / (part + alpha), lowest)
        step = abs(z1 - z)
        z = z1
        if settled(step, area, part, z):
            break
    return z


@kernel
def elastic_height(profile, steepness, target, z):
    """Return z of the elastic contact of the heights `profile`; target: w / k; z: where to begin; `steepness`: room."""
    mean, _top = measure_pieces(profile, steepness)
    lowest = mean - target
    lowest -= BELOW * (1.0 + abs(lowest))
    z = max(z, lowest)
    for _pass in range(MOST_PASSES):
        area, part = area_above(profile, steepness, z)
        if part <= 0.0:
            z = lowest
            continue
        z1 = max(z + (area - target) / part, lowest)
        step = abs(z1 - z)
        z = z1
        if settled(step, area, part, z):
            break
    return z


@kernel
def slope_when_pressed(tables, before, after, when, rates, nodes, pieces, z):
    """Return `slope_integral` with the texture at the part `when` of the way between two phases; `rates`: room."""
    turned = np.float64(np.int64(after)) - (1.0 - when) * np.float64(np.int64(after - before))
    write_rates(tables, TURNS * turned, rates)
    return slope_integral(rates, nodes, pieces, z)


@kernel
def elastic_heights(tables, phases, target, heights):
    """Write z of the elastic contact at each of `phases` (uint64 fractions of a turn)."""
    count = len(tables[0])
    profile, steepness = np.empty(count), np.empty(count - 1)
    z = np.inf
    for i in range(len(phases)):
        write_heights(tables, TURNS * np.float64(np.int64(phases[i])), profile)
        z = elastic_height(profile, steepness, target, z)
        heights[i] = z


@kernel
def run_steps(tables, contact, load_law, time, head, terms, wanted, phase, numbers, elements, phases, loads, out):
    """Simulate a step to each of `phases` and `loads`, and write ROWS rows of `out`.

    contact: a1 + a2 (m), texture period (m), mass (kg), damping (N s/m). load_law: see `LoadLaw`. time: h (s), and
    `when` of `StepCoefficients`. wanted: whether STATIC, and whether SLOPE_FORCE. phase to elements: `SkinState`.
    """
    scale, period, mass, damping = contact
    coefficient, power, lightest = load_law
    (step, when), (with_static, with_force) = time, wanted
    count = len(tables[0])
    nodes, pieces = np.empty((4, count)), np.empty((4, count - 1))
    steepness, rates = np.empty(count - 1), np.empty(count)
    new_part = 0.5 if mass > 0.0 and when == 1.0 else 1.0  # of this step's pressure, in the one that balances
    for i in range(len(phases)):
        load = max(loads[i], lightest)
        change = load - numbers[LOAD]
        pressed = load - (1.0 - when) * change
        balanced = load - 0.5 * change if new_part < 1.0 else pressed
        full = scale * head[HARDNESS] * coefficient * pressed**power  # N for a mean of a1 + a2
        write_heights(tables, TURNS * np.float64(np.int64(phases[i])), nodes[SURFACE])
        free_indentations(elements, head[KEEP], terms, nodes)
        mean = modified_profile(nodes, pieces)
        z0 = numbers[Z]
        moved = (1.0 - new_part) * numbers[PRESSING] + 2.0 * mass * numbers[VELOCITY] / step
        base = (balanced - moved) / (new_part * full)
        alpha = scale * (2.0 * mass / step + damping) / step / (new_part * full)
        lowest = (mean - base + alpha * z0) / (1.0 + alpha)
        lowest -= BELOW * (1.0 + abs(lowest))
        z = settled_height(nodes, pieces, base, alpha, z0, extrapolated(numbers[Z : Z + 4]), lowest)
        if abs(z - z0) <= AT_REST * (1.0 + abs(z0)):
            z = z0
        shifted(numbers[Z : Z + 4], z)
        if mass > 0.0:
            numbers[VELOCITY] = 2.0 * scale * (z - z0) / step - numbers[VELOCITY]
        if new_part < 1.0:  # measured: what the balance says would carry its rounding from step to step for ever
            numbers[PRESSING] = full * modified_area(nodes, pieces, z)[0]
        else:
            numbers[PRESSING] = max(full * (base + alpha * (z - z0)), 0.0)
        remember(elements, terms, nodes, z)
        out[HEIGHT, i], out[REACTION, i], out[ATTACHED, i] = scale * z, numbers[PRESSING], 1.0
        out[STATIC, i], out[SLOPE_FORCE, i] = 0.0, 0.0
        if with_static:
            last = numbers[STATIC_Z : STATIC_Z + 4]
            target = load / (scale * coefficient * load**power)
            shifted(last, elastic_height(nodes[SURFACE], steepness, target, extrapolated(last)))
            out[STATIC, i] = scale * last[0]
        if with_force:
            slope = slope_when_pressed(tables, phase[0], phases[i], when, rates, nodes, pieces, z)
            out[SLOPE_FORCE, i] = full * slope * 2.0 * math.pi * scale / period
        phase[0], numbers[LOAD] = phases[i], load
