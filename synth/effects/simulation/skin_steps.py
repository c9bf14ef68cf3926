"""A finger of points, step by step: a foundation of elements with memory or attraction, with or without a mass.

Model   sum of p dx = w, or m z'' + c z' + k_p (z - z_w) = sum of p dx - w with a mass (`pulp`), where p = kappa A max(h
        - z - efree, 0) and kappa = k / L (`terms`).
        Along the finger efree is smooth except for one kink, the front. Behind the front the skin has followed the
        surface, ahead of it the skin is still free. So each point has two states: `held`, as if the surface had held it
        since it last began to touch, and `free`, as if it had been free since it last left. The true efree is the
        larger of the two, because pressure only pushes. g = h - max(of both) is a polygon (`skin_profile`). Without
        memory the part of the points that is in contact may follow the load (`skin_points.Span`).
        A step h that moves z by s balances (2 m / h^2 + c / h) s - 2 m v0 / h + k_p (z0 + s / 2 - z_w) + w = sum of p
        dx, with v1 = 2 s / h - v0. Relative to a1 + a2 this is base + alpha (z - z0) = mean over L of max(g - z, 0).
        The right side is convex and falls with z. Newton's method starts from an extrapolated z.
        Elastic skin may attract: as in `table_steps`, R = k1 I(z) - k2 I(z - d0), with I the mean over L of max(h - z,
        0). R is not monotone. z is then the nearest root in the direction of the forces, from the place that the
        velocity leads to; a finger that nothing holds has let go.
        The pressure of a step belongs to one time in it (`when` of `Skin.coefficients`). The load and the slope of the
        texture are taken at this time. With one time constant it is the middle of the step, if h is well below tau. For
        relaxing skin, or without memory, it is the end; with a mass the means of both ends are then balanced.
        HEIGHT is z at the end of the step. REACTION and SLOPE_FORCE are those of the pressure of the step.
Source  Fagiani & Barbieri (2016), eqs 1, 4, 5. Newton's method here is Michelot's projection on the simplex (1986).
Limits  Second order in h on moving surfaces (tests/synth/effects/simulation/test_skin_physics.py): 240 steps per period
        of the texture leave 7e-4 of the peak-to-peak of z, 120 leave 3e-3 (4 ms, 80 mm/s). First order for a damper
        without a mass on relaxing skin, and for a mass on skin of one time constant with h beyond tau (it swings as if
        damped by k h / 2 more). Second order in the distance of points: 513 points leave 0.35 % of the peak-to-peak of
        z in the default scene. One state per point, with a front that jumps from point to point, left 7 %.
        A patch narrower than the distance of points ends too soon when the point behind it leaves. z then jumps, most
        for skin that relaxes while a front moves from point to point (1.7 % at 10 mm/s and 4 ms with 513 points, 0.14 %
        with 2049). z is solved to rounding. Skin does not bend sideways.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from synth.arrays import Array
from synth.effects.simulation.pulp import NO_PULP, Pulp
from synth.effects.simulation.skin_attraction import held_height
from synth.effects.simulation.skin_balance import (
    AT_REST,
    TURNS,
    balance_of,
    free_indentations,
    loads_of,
    reaction_of,
    remember,
    settled_height,
    slope_when_pressed,
    stiffness_of,
)
from synth.effects.simulation.skin_points import (
    ASIDE,
    DIRECTION,
    PIECES_ALONG,
    ROWS_ACROSS,
    WHOLE,
    SkinPoints,
    Span,
    write_heights,
    write_rates,
    write_rates_across,
)
from synth.effects.simulation.skin_profile import (
    POINTS,
    SURFACE,
    cut_weights,
    modified_profile,
    part_of,
    sum_of,
    window_of,
)
from synth.effects.simulation.steps import (
    ACROSS_FORCE,
    ATTACHED,
    BEFORE,
    EARLIER,
    HEIGHT,
    HELD,
    LOAD,
    REACTION,
    ROWS,
    SLOPE_FORCE,
    SPEED,
    STEP,
    Phases,
    State,
    Stepper,
    StiffnessLaw,
    Z,
)
from synth.effects.simulation.terms import ELASTIC, HARDNESS, KEEP, Skin
from synth.kernels import inner, signed_kernel
from synth.motion.motion import NO_PATH

BELOW = 1e-9  # of 1 + |z|: taken off the lower bound of z, so that rounding cannot put the bound above z

AREA_POINT, ROOTS = 4e-9, 12.0  # s per step, added for a point of several rows; time under attraction over that without


@dataclass(frozen=True, slots=True)
class SkinStepper(Stepper):
    """Simulates one contact of viscous skin; see `Stepper`.

    points: of the finger, with the heights there.
    law: of the skin.
    stiffness: of the relaxed contact.
    mass: kg.
    damping: N s/m.
    with_force: number of the components of the slope force that are computed: SLOPE_FORCE, and over an area
        ACROSS_FORCE. Each takes a quarter of the time of a step; the others are 0.
    pulp: spring between the contact and the bone.
    span: part of the points that is in contact.
    pull: attraction of elastic skin if everything touches (N), over the length of the points.
    reach: gap at which it vanishes, m.
    """

    points: SkinPoints
    law: Skin
    stiffness: StiffnessLaw
    mass: float = 0.0
    damping: float = 0.0
    with_force: int = 0
    pulp: Pulp = NO_PULP
    span: Span = WHOLE
    pull: float = 0.0
    reach: float = 1.0

    @property
    def scale(self) -> float:
        """See `Stepper`."""
        return self.points.height_scale

    @property
    def shape(self) -> tuple[int, ...]:
        """See `Stepper`: two states, the indentation and memories of each, at every point."""
        return 2, 1 + self.law.memories, self.points.count

    @property
    def step_time(self) -> float:
        """See `Stepper`."""
        return self.points.count * point_seconds(self.law, in_rows=self.points.in_rows, attracts=self.pull > 0.0)

    @property
    def at_rest(self) -> SkinStepper:
        """See `Stepper`."""
        return replace(self, law=ELASTIC, mass=0.0, damping=0.0, with_force=0)

    @property
    def elastic(self) -> SkinStepper:
        """See `Stepper`."""
        return replace(self.at_rest, pulp=NO_PULP, pull=0.0)

    @property
    def where(self) -> str:
        """See `Stepper`."""
        return f"at {self.points.count} points of the finger"

    @property
    def line(self) -> tuple[float, float] | None:
        """See `Stepper`."""
        aside, direction = self.points.place[[ASIDE, DIRECTION]].tolist()
        return (aside, direction) if self.points.of_area else None

    @property
    def memory(self) -> float:
        """See `Stepper`."""
        return self.law.slowest

    def late(self, step: float) -> float:
        """See `Stepper`."""
        return 1.0 - self.law.coefficients(step)[2]

    def forgetting(self, longest: float) -> SkinStepper:
        """See `Stepper`."""
        return replace(self, law=replace(self.law, times=tuple(min(time, longest) for time in self.law.times)))

    def taken_over(self, state: State) -> State | None:
        """See `Stepper`. The points of one row span the same length."""
        if self.points.in_rows:
            return state if state.elements.shape == self.shape else None
        places, known = (np.linspace(0.0, 1.0, count) for count in (self.points.count, state.elements.shape[-1]))
        elements = np.apply_along_axis(lambda row: np.interp(places, known, row), -1, state.elements)
        return replace(state, elements=elements)

    def run(self, state: State, phases: Phases, loads: Array, out: Array, path: Array = NO_PATH) -> None:
        """Step to each of `phases` and `loads` (N); see `Stepper`."""
        assert out.shape == (ROWS, len(phases)) and len(loads) == len(phases), f"{out.shape} for {len(phases)} phases"
        step, law = float(state.numbers[STEP]), self.stiffness
        head, terms, when = self.law.coefficients(step)
        contact = np.array([
            self.points.height_scale, self.points.texture_period, self.mass, self.damping,
            law.coefficient, law.power, law.lightest, self.pulp.stiffness, self.pull, self.reach,
        ])  # fmt: skip
        lowest = -math.inf if self.pull > 0.0 else law.lightest
        rests = self.pulp.rests(float(state.numbers[LOAD]), loads, lowest)
        points = self.points
        run_steps(
            points.rows, points.lattice, points.place, points.weights, points.rims, contact, self.span.numbers, step,
            when, head, terms, self.with_force, state.phase, state.numbers, state.elements, phases, loads,
            np.ascontiguousarray(path), rests, out,
        )  # fmt: skip


def point_seconds(law: Skin, *, in_rows: bool, attracts: bool) -> float:
    """Return the predicted computing time (s) of a step per point."""
    return (law.point_time + AREA_POINT * in_rows) * (ROOTS if attracts else 1.0)


@inner
def write_profile(points, phase, aside, direction, elements, keep, terms, nodes, pieces):
    """Write the surface that meets the finger at the end of a step, and g of Model."""
    rows, lattice, place = points
    write_heights(rows, lattice, place, TURNS * np.float64(np.int64(phase)), aside, direction, nodes[SURFACE])
    free_indentations(elements, keep, terms, nodes)
    modified_profile(nodes, pieces)


@inner
def height_after(nodes, pieces, weights, window, balance, attraction, load, ahead, numbers):
    """Return z before and after a step, relative to a1 + a2, and keep it in `numbers`.

    balance: base and alpha of Model.
    attraction: its part of the stiffness, and its reach; a reach of 0: there is none.
    load: N.
    ahead: how far the velocity leads in a step.
    """
    base, alpha, z0, earlier = balance[0], balance[1], numbers[Z], numbers[EARLIER:]
    total, whole = sum_of(nodes[POINTS, window[2] : window[3] + 1], weights[window[2] : window[3]])
    inside = 1.0 / (window[1] - window[0])
    if attraction[1] > 0.0:
        z, z0 = held_height(
            nodes, pieces, weights, window, attraction, base, alpha, z0, z0 + ahead, whole * inside, load, numbers
        )
    else:
        lowest = (total * inside - base + alpha * z0) / (whole * inside + alpha)  # the end pieces add at least 0
        lowest -= BELOW * (1.0 + abs(lowest))
        begin = 4.0 * (z0 + earlier[1]) - 6.0 * earlier[0] - earlier[2]  # cubic extrapolation from four
        z = settled_height(nodes, pieces, weights, window, base, alpha, z0, begin, lowest)
    if abs(z - z0) <= AT_REST * (1.0 + abs(z0)):
        z = z0
    earlier[2], earlier[1], earlier[0], numbers[Z] = earlier[1], earlier[0], z0, z
    return z0, z


@inner
def write_step(out, i, height, reaction, held):
    """Write step `i`: height (m), reaction (N), whether the surface holds the finger, and no slope force."""
    out[HEIGHT, i], out[REACTION, i], out[ATTACHED, i] = height, reaction, 1.0 if held else 0.0
    out[SLOPE_FORCE, i], out[ACROSS_FORCE, i] = 0.0, 0.0


@inner
def write_slope_forces(points, met, moved, forces, z, rates, with_force, out, i):
    """Write the components of the slope force of step `i`, N.

    points: rows, lattice and place of `SkinPoints`.
    met: nodes, pieces, weights and window.
    moved: where the pressure of the step belongs to: turns of the texture, across (m), and direction (rad).
    forces: of all points (N), of the attraction (N), its reach, and the factor from heights over turns to slopes.
    rates: working space [points].
    """
    rows, lattice, place = points
    nodes, pieces, weights, window = met
    for component in range(with_force):
        if component == 0:
            write_rates(rows, lattice, place, TURNS * moved[0], moved[1], moved[2], rates)
        else:
            write_rates_across(rows, lattice, place, TURNS * moved[0], moved[1], moved[2], rates)
        slope = forces[0] * slope_when_pressed(nodes, pieces, weights, window, rates, z)
        if forces[2] > 0.0:
            slope -= forces[1] * slope_when_pressed(nodes, pieces, weights, window, rates, z - forces[2])
        out[SLOPE_FORCE if component == 0 else ACROSS_FORCE, i] = slope * forces[3]


@signed_kernel(
    "void(f8[:,::1], f8[:,::1], f8[::1], f8[::1], f8[:,::1], f8[::1], f8[::1], f8, f8, f8[::1], f8[:,::1], i8, "
    "u8[::1], f8[::1], f8[:,:,::1], u8[::1], f8[::1], f8[:,::1], f8[::1], f8[:,::1])"
)
def run_steps(
    rows, lattice, place, weights, rims, contact, span, step, when, head, terms, with_force,
    phase, numbers, elements, phases, loads, path, rests, out,
):  # fmt: skip
    """Step to each of `phases` and `loads`, and write ROWS rows of `out`.

    rows, lattice, place, weights, rims: see `SkinPoints`.
    contact: a1 + a2 (m), texture period (m), mass (kg), damping (N s/m), the fields of `StiffnessLaw`, the stiffness of
        the pulp (N/m), and pull (N) and reach (m) of an attraction.
    span: the fields of `Span`.
    step: s; when, head, terms: see `Skin.coefficients`.
    with_force: number of components of the slope force.
    phase, numbers, elements: see `State`; updated.
    path: how far the texture has moved across (m) and the direction (rad) at the end of each step; empty: on a line.
    rests: z_w (m) before the first step and at the end of each.
    """
    scale, period, mass, lightest, spring, pull = contact[0], contact[1], contact[2], contact[6], contact[7], contact[8]
    count, share = rows.shape[1], 0.5 if mass > 0.0 else 1.0  # with a mass, the spring acts in the middle of a step
    reach = contact[9] / scale if pull > 0.0 else 0.0
    least, to_slopes = -np.inf if pull > 0.0 else lightest, 2.0 * math.pi * scale / period
    nodes, pieces, rates = np.empty((4, count)), np.empty((4, count - 1)), np.empty(count)
    aside, direction, points = place[ASIDE], place[DIRECTION], (rows, lattice, place)
    whole_weights, weights, cut_at = weights, weights.copy(), -1.0
    new_part = 0.5 if mass > 0.0 and when == 1.0 else 1.0  # share of this step's pressure in the pressure that balances
    for i in range(len(phases)):
        aside, direction = (path[0, i], path[1, i]) if path.shape[1] > 0 else (aside, direction)
        load = max(loads[i], least)
        pressed, balanced = loads_of(numbers, load, when, new_part, spring, rests[i + 1], rests[i], share, scale)
        part, in_rows = part_of(span, max(pressed, lightest)), rims.shape[1] > 0
        window = window_of(1.0 if in_rows else part, count - 1)
        if in_rows and part != cut_at:
            cut_weights(whole_weights, rims, place[PIECES_ALONG], place[ROWS_ACROSS], part, weights)
            cut_at = part
        own, more, full = stiffness_of(contact, head[HARDNESS], span, part, pressed, reach)
        write_profile(points, phases[i], aside, direction, elements, head[KEEP], terms, nodes, pieces)
        balance = balance_of(contact, numbers, balanced, new_part, share, step, full)
        ahead, attraction, met = step * numbers[SPEED] / scale, (more / full, reach), (nodes, pieces, weights, window)
        z0, z = height_after(nodes, pieces, weights, window, balance, attraction, load, ahead, numbers)
        held = pull == 0.0 or numbers[HELD] > 0.0
        numbers[SPEED] = 2.0 * scale * (z - z0) / step - numbers[SPEED] if mass > 0.0 and held else numbers[SPEED]
        reaction = reaction_of(met, (own, more, reach), balance, z0, z, new_part < 1.0, held, numbers)
        remember(elements, terms, nodes, z)
        write_step(out, i, scale * z, reaction, held)
        if with_force > 0 and held:
            turns, before = np.float64(np.int64(phases[i])), np.float64(np.int64(phases[i] - phase[0]))
            late, forces = 1.0 - when, (full, more, reach, to_slopes)
            beside = aside - late * (aside - numbers[BEFORE]), direction - late * (direction - numbers[BEFORE + 1])
            there = turns - late * before, beside[0], beside[1]
            write_slope_forces(points, met, there, forces, z, rates, with_force, out, i)
        numbers[BEFORE], numbers[BEFORE + 1], numbers[LOAD], phase[0] = aside, direction, load, phases[i]
