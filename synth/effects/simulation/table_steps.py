"""A finger with mass, damping or adhesion over a texture, step by step on a table of the energy of its contact.

Stage   table of the energy -> STEPS -> z and forces at every frame
Model   m z'' + c z' = R(z, theta) - w, R = k I(z) - (P / d0) [I(z - d0) - I(z)]: at a gap g a place attracts with the
        part 1 - g / d0 of its largest pull, at none with all of it; P is the pull if all touched. k = k(w) of eqs 4-5.
        Loss of contact and bounce are I = 0. The force on the slopes of the texture is (1 / lambda2) dU/dtheta.
        With P = 0 loads below `lightest` count as `lightest`. With P > 0 a finger that no equilibrium holds, or that
        has left the range of adhesion at no load, has let go until there is load again.
Source  `table_balance` and `potential`. The force on slopes is the derivative of the energy of Fagiani & Barbieri
        (2016), eq. 1, over the place of the texture; m, c and the adhesive law are extensions of it.
Limits  second order in the step where it resolves the resonance, 2 pi f step below 0.5; beyond, a step still gives no
        energy of its own: on a surface that stands still it changed by 2e-8 of itself at most in 10 s, from 8 to 192
        kHz and from 1e-6 to 1 kg. A mass without damping may be driven without bound by a surface that moves. What
        the table leaves out is `PotentialTable.error`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from synth.arrays import Array
from synth.effects.simulation.potential import PotentialTable
from synth.effects.simulation.potential_reading import (
    base_at,
    cell_of,
    energy_slope,
    highest_at,
    row_of,
    slopes_of,
    weights_of,
)
from synth.effects.simulation.steps import ATTACHED, HEIGHT, REACTION, SLOPE_FORCE, STATIC, Phases
from synth.effects.simulation.table_balance import (
    BAND,
    EPSILON,
    downhill_move,
    elastic_place,
    energy_move,
    no_path,
    path_from,
    rounding_of,
)
from synth.kernels import inlined, kernel

Z, SPEED, LOAD, HELD, STATIC_PLACE, STEP = range(6)  # of TableState.numbers
COEFFICIENT, POWER, LIGHTEST, MASS, DAMPING, PULL, RANGE, PERIOD = range(8)  # of the coefficients of a stepper
TOUCH_LOAD = 1e-6  # N, far below what is felt: less does not bring back a finger that has let go


@dataclass(slots=True)
class TableState:
    """Where a finger stands.

    numbers: z (m), velocity (m/s), load (N), 1 while it touches or is held, d of the elastic contact (m), step (s).
    phase: [1]. cells: where the table was read last, a first guess.
    """

    numbers: Array
    phase: Phases
    cells: np.ndarray[Any, np.dtype[np.int64]]

    def copied(self) -> TableState:
        """Return a state that goes on from here by itself."""
        return TableState(self.numbers.copy(), self.phase.copy(), self.cells.copy())

    @property
    def nbytes(self) -> int:
        """Bytes that it holds."""
        return self.numbers.nbytes + self.phase.nbytes + self.cells.nbytes


@dataclass(frozen=True, slots=True)
class TableStepper:
    """Simulates one contact with mass, damping or adhesion.

    stiffness_coefficient, stiffness_power: k = coefficient max(w, lightest)^power (N/m): power -0.5 for eqs 4-5, 0 for
    a contact prepared at one load. lightest: N. mass: kg. damping: N s/m. pull: P (N), 0 without adhesion; reach: d0
    (m). texture_period: m. with_static, with_forces: whether the rows STATIC, and SLOPE_FORCE and REACTION, are
    written.
    """

    table: PotentialTable
    stiffness_coefficient: float
    stiffness_power: float
    lightest: float
    mass: float
    damping: float
    pull: float
    reach: float
    texture_period: float
    with_static: bool = True
    with_forces: bool = True

    @property
    def nbytes(self) -> int:
        """Bytes that it holds."""
        return self.table.nbytes

    @property
    def state_bytes(self) -> int:
        """Bytes of one state."""
        return 8 * (6 + 1 + 3)

    @property
    def coefficients(self) -> Array:
        """What the compiled loop reads."""
        law = (self.stiffness_coefficient, self.stiffness_power, self.lightest)
        return np.array([*law, self.mass, self.damping, self.pull, self.reach, self.texture_period])

    def start(self, phase: int, load: float, turns: float, step: float) -> TableState:
        """Return the state of a finger in equilibrium at `phase` and `load` (N).

        With mass it has the velocity of the equilibrium at `turns` texture periods a second (signed). With adhesion
        a finger that pulls is held where it can be; at no load at all it has let go. step: s.
        """
        state = TableState(np.zeros(6), np.array([phase], dtype=np.uint64), np.zeros(3, dtype=np.int64))
        state.numbers[LOAD], state.numbers[STEP] = load, step
        settle(self.table.pool, self.table.layout, self.coefficients, state.numbers, state.phase, state.cells, turns)
        return state

    def resumed(self, state: TableState, step: float) -> TableState:
        """See `Stepper`."""
        state = state.copied()
        state.numbers[STEP] = step
        return state

    def run(self, state: TableState, phases: Phases, loads: Array, out: Array) -> None:
        """Go on to each of `phases` and `loads` (N) in turn, and write the rows of `out` (`steps`)."""
        table, wanted = (self.table.pool, self.table.layout), (self.with_static, self.with_forces)
        standing = (state.numbers, state.phase, state.cells)
        run_steps(*table, self.coefficients, *standing, phases, loads, out, wanted)


@kernel
def stiffness_of(law, load):
    """Return k (N/m) at `load` (N)."""
    load, power = max(load, law[LIGHTEST]), law[POWER]
    if power == 0.0:
        return law[COEFFICIENT]
    return law[COEFFICIENT] / math.sqrt(load) if power == -0.5 else law[COEFFICIENT] * load**power


@inlined
def paths_from(pool, layout, row, weights, law, d, cells):
    """Return the paths of both places at which I counts."""
    first = path_from(pool, layout, row, weights, d, cells[0])
    second = path_from(pool, layout, row, weights, d - law[RANGE], cells[1]) if law[PULL] > 0.0 else no_path(cells[1])
    cells[0], cells[1] = first[0], second[0]
    return first, second


@inlined
def step_along(pool, layout, law, numbers, cells, phase, stiffness, load):
    """Write z, by energy, after a step whose middle stands at `phase` and `load`, and the velocity there."""
    row, t = row_of(layout, phase)
    weights = weights_of(t)
    z, h, mass = numbers[Z], numbers[STEP], law[MASS]
    base = base_at(pool, layout, row, weights)
    first, second = paths_from(pool, layout, row, weights, law, z - base, cells)
    pulling = law[PULL] / law[RANGE] if law[PULL] > 0.0 else 0.0
    pair = (stiffness + pulling, pulling)
    band = rounding_of(first, second, pair, load, z)
    ahead = h * numbers[SPEED] if mass > 0.0 else 0.0
    if abs(ahead) <= BAND * EPSILON * abs(z) and abs(load - pair[0] * first[2] + pair[1] * second[2]) <= band:
        numbers[SPEED] = 0.0
        return
    drive = (2.0 * mass / (h * h), law[DAMPING] / h, ahead, load)
    move = energy_move(pool, layout, row, weights, first, second, pair, drive, band)
    numbers[Z] = z + (ahead + move)
    numbers[SPEED] = numbers[SPEED] + 2.0 * move / h if mass > 0.0 else move / h


@kernel
def step_to_rest(pool, layout, law, numbers, cells, phase, stiffness, load):
    """Write z of the equilibrium that z leads to at `phase` and `load`; return whether there is one."""
    row, t = row_of(layout, phase)
    weights = weights_of(t)
    base = base_at(pool, layout, row, weights)
    first, second = paths_from(pool, layout, row, weights, law, numbers[Z] - base, cells)
    pulling = law[PULL] / law[RANGE] if law[PULL] > 0.0 else 0.0
    pair = (stiffness + pulling, pulling)
    band = rounding_of(first, second, pair, load, numbers[Z])
    move, held = downhill_move(pool, layout, row, weights, first, second, pair, load, band)
    numbers[Z] += move
    return held


@kernel
def out_of_range(pool, layout, law, phase):
    """Return the lowest z (m) at which nothing touches or attracts at `phase`."""
    row, t = row_of(layout, phase)
    return highest_at(pool, layout, row, weights_of(t)) + law[RANGE]


@kernel
def write_static(pool, layout, numbers, cells, phase, indentation, out, i):
    """Write z of the elastic contact at w / k = `indentation` (m)."""
    row, t = row_of(layout, phase)
    weights = weights_of(t)
    base = base_at(pool, layout, row, weights)
    place, cells[2] = elastic_place(pool, layout, row, weights, numbers[STATIC_PLACE], cells[2], indentation, base)
    numbers[STATIC_PLACE] = place
    out[STATIC, i] = base + place


@kernel
def forces_of(pool, layout, law, z, cells, phase, stiffness):
    """Return k I (N), dU/dtheta (N m a turn), dR/dtheta (N a turn) and -dR/dz (N/m), at `phase` and z (m)."""
    row, t = row_of(layout, phase)
    weights, slopes = weights_of(t), slopes_of(t, float(layout.stride - 3))
    d = z - base_at(pool, layout, row, weights)
    base_slope = base_at(pool, layout, row, slopes)
    cell = cell_of(pool, layout, d, cells[0])
    depth, touching, energy, drift = energy_slope(pool, layout, row, weights, slopes, base_slope, cell, d)
    pressed, work, change, slope = stiffness * depth, stiffness * energy, stiffness * drift, stiffness * touching
    if law[PULL] > 0.0:
        pulling = law[PULL] / law[RANGE]
        cell = cell_of(pool, layout, d - law[RANGE], cells[1])
        _d, wide, far, moved = energy_slope(pool, layout, row, weights, slopes, base_slope, cell, d - law[RANGE])
        work += pulling * (energy - far)
        change += pulling * (drift - moved)
        slope += pulling * (touching - wide)
    return pressed, work, change, slope


@kernel
def settle(pool, layout, law, numbers, phase, cells, turns):
    """Write the equilibrium at the phase and the load of the state, and its velocity at `turns` a second."""
    load, pull = numbers[LOAD], law[PULL]
    stiffness = stiffness_of(law, load)
    row, t = row_of(layout, phase[0])
    weights = weights_of(t)
    base = base_at(pool, layout, row, weights)
    target = max(load, law[LIGHTEST]) / stiffness
    place, cells[2] = elastic_place(pool, layout, row, weights, pool[layout.bounds + 1], 0, target, base)
    numbers[STATIC_PLACE], numbers[Z], numbers[HELD] = place, base + place, 1.0
    if pull > 0.0:
        held = load != 0.0 and step_to_rest(pool, layout, law, numbers, cells, phase[0], stiffness, load)
        numbers[HELD] = 1.0 if held else 0.0
        if not held:
            numbers[Z] = out_of_range(pool, layout, law, phase[0])
            return
    if law[MASS] > 0.0 and turns != 0.0:
        _pressed, _work, change, slope = forces_of(pool, layout, law, numbers[Z], cells, phase[0], stiffness)
        numbers[SPEED] = turns * change / slope


@kernel
def run_steps(pool, layout, law, numbers, state_phase, cells, phases, loads, out, wanted):
    """Go on to each phase and load, and write the rows wanted."""
    with_static, with_forces = wanted
    dynamic, pull, lightest = law[MASS] > 0.0 or law[DAMPING] > 0.0, law[PULL], law[LIGHTEST]
    phase, load = state_phase[0], numbers[LOAD]
    for i in range(len(phases)):
        after, load_after = phases[i], loads[i]
        if pull > 0.0 and numbers[HELD] == 0.0 and load_after >= TOUCH_LOAD:
            numbers[HELD] = 1.0
        stiffness = stiffness_of(law, load_after)
        if numbers[HELD] > 0.0:
            held = True
            if dynamic:
                middle, pressing = phase + np.uint64(np.int64(after - phase) >> 1), 0.5 * (load + load_after)
                if pull == 0.0:
                    pressing = 0.5 * (max(load, lightest) + max(load_after, lightest))
                k = stiffness if load == load_after else stiffness_of(law, pressing)
                step_along(pool, layout, law, numbers, cells, middle, k, pressing)
                held = pull == 0.0 or load_after > 0.0 or numbers[Z] <= out_of_range(pool, layout, law, after)
            else:
                pressing = load_after if pull > 0.0 else max(load_after, lightest)
                held = step_to_rest(pool, layout, law, numbers, cells, after, stiffness, pressing)
            numbers[HELD] = 1.0 if held else 0.0
        if numbers[HELD] == 0.0:
            numbers[Z], numbers[SPEED] = out_of_range(pool, layout, law, after), 0.0
        phase, load = after, load_after
        out[HEIGHT, i], out[ATTACHED, i] = numbers[Z], numbers[HELD]
        if with_static:
            write_static(pool, layout, numbers, cells, phase, max(load, lightest) / stiffness, out, i)
        if with_forces:
            out[SLOPE_FORCE, i], out[REACTION, i] = 0.0, 0.0
            if numbers[HELD] > 0.0:
                pressed, work, _change, _slope = forces_of(pool, layout, law, numbers[Z], cells, phase, stiffness)
                out[SLOPE_FORCE, i], out[REACTION, i] = work / law[PERIOD], pressed
    state_phase[0], numbers[LOAD] = phase, load
