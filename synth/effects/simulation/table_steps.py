"""A finger with mass or adhesion over a texture, simulated step by step on a table of the energy of its contact.

Stage   table of the energy -> STEPS -> z and forces at every frame
Model   m z'' + c z' + k_p (z - z_w) = R(z, theta) - w, with R = -dU/dz = k1 I(z) - k2 I(z - d0), k1 = k + P / d0 and k2
        = P / d0. P is the pull if everything touched. A place that touches attracts with its largest pull, a place at a
        gap g with the part 1 - g / d0 of it. k = k(w) of eqs 4-5. Loss of contact and bounce are I = 0. The force on
        the slopes of the texture is (1 / lambda2) dU/dtheta.
        With mass, a step h with s = z1 - z0 is taken at the phase and load of its middle:
        m (v1 - v0) / h + c s / h + k_p ((z0 + z1) / 2 - z_w) = -[U(z1) - U(z0)] / s - w,  s = h (v0 + v1) / 2.
        z_w (`pulp`) and w are means of both ends. The energy k_p (z - z_w)^2 / 2 of the spring is quadratic, so its
        difference over s is its force in the middle. Multiplied by s, this changes m v^2 / 2 + U + k_p (z - z_w)^2 / 2
        + w z by exactly -c s^2 / h, so that only the surface and the load drive the mass. Without mass, z descends the
        rest of that energy to the first place where the forces balance. Both cases solve g(s) = 0.
        With P = 0, loads below `lightest` count as `lightest`. With P > 0, the finger lets go if no equilibrium holds
        it, or if it leaves the range of adhesion at a load of 0 N or less. It stays away until a load presses it again.
Source  Gonzalez (1996), J. Nonlinear Sci. 6; McLachlan, Quispel & Robidoux (1999), Phil. Trans. R. Soc. A 357; for
        collisions Chatziioannou & van Walstijn (2015), J. Sound Vib. 340; Bilbao, Torin & Chatziioannou (2015), Acta
        Acust. united Ac. 101. Adhesive law: Maugis (1992), J. Colloid Interface Sci. 150, with a force that falls
        linearly with the gap. The force on slopes is the derivative of the energy of Fagiani & Barbieri (2016), eq. 1.
Limits  Solved to round-off. With adhesion a step may have several solutions; it takes the one nearest to the place that
        the velocity leads to, in the direction of the forces. Second order in the step where it resolves the resonance
        (2 pi f step below 0.5). Longer steps still add no energy: on a surface at rest, it changed by at most 2e-8 of
        itself in 10 s, from 8 to 192 kHz and from 1e-6 to 1 kg. A moving surface may drive a mass without damping
        without bound. `EnergyTable.error` reports the error of the table.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from synth.arrays import Array
from synth.effects.simulation.energy_reading import (
    BASE,
    BOTTOM,
    HIGHEST,
    WIDTH,
    curve_at,
    depth_in,
    depth_near,
    drift_at,
    mean_depth,
    piece_at,
    row_of,
    weights_of,
)
from synth.effects.simulation.energy_table import EnergyTable
from synth.effects.simulation.pulp import NO_PULP, Pulp
from synth.effects.simulation.steps import (
    ATTACHED,
    HEIGHT,
    HELD,
    LOAD,
    REACTION,
    ROWS,
    SLOPE_FORCE,
    SPEED,
    STEP,
    TOUCH_LOAD,
    Phases,
    State,
    Stepper,
    StiffnessLaw,
    Z,
)
from synth.kernels import inlined, inner, signed_kernel
from synth.motion.motion import NO_PATH
from synth.response.phases import turns_to_phase

EPSILON = 2.0**-52
BAND = 64.0  # roundings of forces and of z within which a finger rests; with few a damped one keeps swinging at 1e-19 m
MOST_ITERATIONS = 100  # bisection ends before this
MARCH = 1.6  # growth of the strides towards a solution; above 2 they would skip neighbouring solutions
FURTHEST, OVER = 16.0, 1.05  # largest first stride: in strides that cannot skip a solution, and in Newton steps
TABLE_STEP = 150e-9  # s per step, as predicted (`tests.bench effects`)
COEFFICIENT, POWER, LIGHTEST, MASS, DAMPING, PULL, RANGE, PERIOD, SPRING = range(9)  # coefficients of a stepper


@dataclass(frozen=True, slots=True)
class TableStepper(Stepper):
    """Simulates one contact with mass or adhesion.

    table: energy of the contact.
    stiffness: k at a load.
    mass: kg.
    damping: N s/m, of a mass.
    pull: P (N), 0 without adhesion.
    reach: d0 (m).
    texture_period: m.
    with_forces: whether the rows SLOPE_FORCE and REACTION are written.
    pulp: spring between the contact and the bone.
    """

    table: EnergyTable
    stiffness: StiffnessLaw
    mass: float
    damping: float
    pull: float
    reach: float
    texture_period: float
    with_forces: bool = True
    pulp: Pulp = NO_PULP
    step_time = TABLE_STEP

    @property
    def where(self) -> str:
        """See `Stepper`."""
        return "on a table of its energy"

    @property
    def at_rest(self) -> TableStepper:
        """See `Stepper`."""
        return replace(self, mass=0.0, damping=0.0, with_forces=False)

    @property
    def elastic(self) -> TableStepper:
        """See `Stepper`."""
        return replace(self.at_rest, pull=0.0, pulp=NO_PULP)

    def run(self, state: State, phases: Phases, loads: Array, out: Array, path: Array = NO_PATH) -> None:
        """Step to each of `phases` and `loads` (N) in turn, and write the rows of `out`; see `Stepper`."""
        table, law = (self.table.nodes, self.table.curves, self.table.grid), self.stiffness
        contact = (self.mass, self.damping, self.pull, self.reach, self.texture_period, self.pulp.stiffness)
        coefficients = np.array([law.coefficient, law.power, law.lightest, *contact])
        rests = self.pulp.rests(float(state.numbers[LOAD]), loads, self.lowest)
        run_steps(*table, coefficients, state.numbers, state.phase, phases, loads, rests, out, self.with_forces)

    @property
    def lowest(self) -> float:
        """Smaller loads (N) count as this one."""
        return -math.inf if self.pull > 0.0 else self.stiffness.lightest

    def heights(self, turns: Array, load: float) -> Array:
        """Return z (m) of a finger without mass or adhesion, at each of `turns` and at `load` (N)."""
        still, rows = self.elastic, np.empty((ROWS, len(turns)))
        state = still.start(0, load, 0.0, 1.0)
        still.run(state, turns_to_phase(turns), np.full(len(turns), load), rows)
        return np.asarray(rows[HEIGHT])

    def coarser(self) -> TableStepper:
        """See `Stepper`."""
        return replace(self, table=self.table.coarser())


@inlined
def excess_at(nodes, row, weights, law, drive, s):
    """Return g, dg/ds and the size of the terms of g, where g(s) = inertia (s - ahead) + drag s - R + load.

    law, drive: see `move_of`.
    """
    k1, k2, width, place, gap, here, away = law
    inertia, drag, ahead, load, rest = drive
    move, resisting = s / width, inertia * (s - ahead) + drag * s
    if rest:
        near, rise = depth_near(nodes, row, weights, here, place + move)
    else:
        near, rise = mean_depth(nodes, row, weights, here, place, move)
    total, slope, size = resisting - k1 * near + load, inertia + drag - k1 * rise / width, abs(resisting) + abs(load)
    if k2 == 0.0:
        return total, slope, size + k1 * near
    if rest:
        far, rise = depth_near(nodes, row, weights, away, place + move - gap)
    else:
        far, rise = mean_depth(nodes, row, weights, away, place - gap, move)
    return total + k2 * far, slope + k2 * rise / width, size + k1 * near + k2 * far


@inlined
def bracket_of(nodes, row, weights, law, drive):
    """Return two moves (m) between which g changes sign; the second is the further one.

    The change is the nearest to `ahead` in the direction of the forces. Both moves are infinite if nothing holds a
    finger at rest.
    """
    steepest = drive[0] + drive[1] + law[0]  # dg/ds is at most this
    top = (len(nodes) - 1 + law[4] - law[3]) * law[2]
    near, far, sign, stride = drive[2], drive[2], 0.0, 0.0
    while True:
        total, slope, _size = excess_at(nodes, row, weights, law, drive, far)
        if sign == 0.0:
            sign, stride = (-1.0 if total > 0.0 else 1.0), abs(total) / steepest
            if slope > 0.0:
                stride = min(FURTHEST * stride, OVER * abs(total) / slope)
        elif far == near or total * sign >= 0.0:
            return near, far
        elif drive[4] and drive[1] == 0.0 and far > top and sign > 0.0:
            return np.inf, np.inf
        else:
            stride *= MARCH
        near, far = far, far + sign * stride


@inlined
def move_of(nodes, row, weights, law, drive, band):
    """Return s - ahead (m) of one step, with ahead = h v0; infinite if nothing holds the finger.

    law: k1 and k2 (N/m), the step of d (m), the place of z and d0 in such steps, and the pieces of I at that place and
        d0 below it, which an iteration seldom leaves.
    drive: 2 m / h^2 and c / h + k_p / 2 (N/m), ahead (m), the load with the force of the spring at z (N), and whether z
        goes to rest, in which case the first three are 0, k_p and 0.
    band: excess force (N) that counts as balance.
    """
    ahead = drive[2]
    least = drive[0] + drive[1] - 0.5 * law[1]  # dg/ds is at least this; if positive, there is one solution
    low, high, s = -np.inf, np.inf, ahead
    if drive[4] or least < 0.0:
        near, s = bracket_of(nodes, row, weights, law, drive)
        if s == np.inf:
            return s
        low, high, least = min(near, s), max(near, s), 0.0
    move = s - ahead
    for _ in range(MOST_ITERATIONS):
        total, slope, size = excess_at(nodes, row, weights, law, drive, s)
        if abs(total) <= band and (s == 0.0 or abs(total) <= 4.0 * EPSILON * size):
            return move
        if total > 0.0:
            high = min(high, s)
        else:
            low = max(low, s)
        step = -total / max(slope, least) if slope > 0.0 or least > 0.0 else np.inf
        if not low < s + step < high and (low > -np.inf and high < np.inf):
            step = 0.5 * (low + high) - s
            if high - low <= EPSILON * (abs(low) + abs(high)):
                return move + step
        move += step
        s = ahead + move
        if abs(step) <= EPSILON * abs(s):
            return move
    return move


@inner
def stiffness_of(law, load):
    """Return k (N/m) at `load` (N)."""
    load, power = max(load, law[LIGHTEST]), law[POWER]
    if power == 0.0:
        return law[COEFFICIENT]
    return law[COEFFICIENT] / math.sqrt(load) if power == -0.5 else law[COEFFICIENT] * load**power


@inlined
def advanced(nodes, curves, grid, law, numbers, phase, load, home, rest):
    """Write z and its velocity after a step at `phase` and `load` (N). Return whether the finger is held.

    home: z_w (m).
    rest: whether z goes to rest, without momentum.
    """
    row, t = row_of(grid, phase)
    weights, width = weights_of(t), grid[WIDTH]
    z, h = numbers[Z], numbers[STEP]
    place, gap = (z - curve_at(curves, BASE, row, weights) - grid[BOTTOM]) / width, law[RANGE] / width
    k2 = law[PULL] / law[RANGE] if law[PULL] > 0.0 else 0.0
    k1 = stiffness_of(law, load) + k2
    here = away = piece_at(nodes, row, weights, place)
    near, rise = far, fall = depth_in(here, place)
    if k2 > 0.0:
        away = piece_at(nodes, row, weights, place - gap)
        far, fall = depth_in(away, place - gap)
    # some roundings of forces and of z: a smaller force is balance
    spring = law[SPRING]
    sizes = k1 * near + k2 * far + abs(load) + spring * (abs(z) + abs(home))
    band = BAND * EPSILON * (sizes - abs(z) * (k1 * rise + k2 * fall) / width)
    load += spring * (z - home)
    ahead = 0.0 if rest else h * numbers[SPEED]
    if abs(ahead) <= BAND * EPSILON * abs(z) and abs(load - k1 * near + k2 * far) <= band:
        numbers[SPEED] = 0.0
        return True
    inertia, drag = (0.0, spring) if rest else (2.0 * law[MASS] / (h * h), law[DAMPING] / h + 0.5 * spring)
    move = move_of(
        nodes, row, weights, (k1, k2, width, place, gap, here, away), (inertia, drag, ahead, load, rest), band
    )
    if move == np.inf:
        return False
    numbers[Z] = z + (ahead + move)
    numbers[SPEED] = 0.0 if rest else numbers[SPEED] + 2.0 * move / h
    return True


@inner
def out_of_range(curves, grid, law, phase):
    """Return the lowest z (m) at which nothing touches or attracts at `phase`."""
    row, t = row_of(grid, phase)
    return curve_at(curves, HIGHEST, row, weights_of(t)) + law[RANGE]


@inner
def forces_of(nodes, curves, grid, law, z, phase, load):
    """Return k I (N) and dU/dtheta (N m per turn) at `phase` and z (m)."""
    row, t = row_of(grid, phase)
    stiffness, width = stiffness_of(law, load), grid[WIDTH]
    place = (z - curve_at(curves, BASE, row, weights_of(t)) - grid[BOTTOM]) / width
    depth, _slope, drift = drift_at(nodes, curves, grid, row, t, place)
    if law[PULL] == 0.0:
        return stiffness * depth, stiffness * drift
    _depth, _slope, far = drift_at(nodes, curves, grid, row, t, place - law[RANGE] / width)
    return stiffness * depth, stiffness * drift + law[PULL] / law[RANGE] * (drift - far)


@signed_kernel(
    "void(f8[:,:,::1], f8[:,::1], f8[::1], f8[::1], f8[::1], u8[::1], u8[::1], f8[::1], f8[::1], f8[:,::1], b1)"
)  # fmt: skip
def run_steps(nodes, curves, grid, law, numbers, state_phase, phases, loads, rests, out, with_forces):
    """Step to each phase and load, and write the rows of `out`.

    rests: z_w (m) before the first step and at the end of each.
    with_forces: whether to write SLOPE_FORCE and REACTION.
    """
    rest, pull, lightest = law[MASS] == 0.0, law[PULL], law[LIGHTEST]
    phase, load = state_phase[0], numbers[LOAD]
    for i in range(len(phases)):
        before, load_before, phase, load = phase, load, phases[i], loads[i]
        if pull > 0.0 and numbers[HELD] == 0.0 and load >= TOUCH_LOAD:
            numbers[HELD] = 1.0
        if numbers[HELD] > 0.0:
            place = phase if rest else before + np.uint64(np.int64(phase - before) >> 1)
            lowest = -np.inf if pull > 0.0 else lightest
            pressing = max(load, lowest) if rest else 0.5 * (max(load_before, lowest) + max(load, lowest))
            home = rests[i + 1] if rest else 0.5 * (rests[i] + rests[i + 1])
            held = advanced(nodes, curves, grid, law, numbers, place, pressing, home, rest)
            if (not rest or law[SPRING] > 0.0) and pull > 0.0 and load <= 0.0:
                held = numbers[Z] <= out_of_range(curves, grid, law, phase)
            numbers[HELD] = 1.0 if held else 0.0
        if numbers[HELD] == 0.0:
            numbers[Z], numbers[SPEED] = out_of_range(curves, grid, law, phase), 0.0
        out[HEIGHT, i], out[ATTACHED, i] = numbers[Z], numbers[HELD]
        if with_forces:
            out[SLOPE_FORCE, i], out[REACTION, i] = 0.0, 0.0
            if numbers[HELD] > 0.0:
                pressed, work = forces_of(nodes, curves, grid, law, numbers[Z], phase, load)
                out[SLOPE_FORCE, i], out[REACTION, i] = work / law[PERIOD], pressed
    state_phase[0], numbers[LOAD] = phase, load
