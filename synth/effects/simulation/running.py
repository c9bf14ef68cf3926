"""A simulation that runs along a motion: steps from the last position of the finger to the next, and frames from steps.

Model   Every frame is `steps` steps long. The stepper writes rows. These become signals at the rate of the steps, faded
        by the lift gate. The decimator makes band-limited frames and time derivatives of the signals.
        A constant scan whose motion repeats is read from the series of its period (`periodic`), without steps.
        The motion of another scan is known beforehand, so the steps run ahead of the frames. A stroke begins at rest,
        where it turns at t = 0. A recording begins where the finger comes down: it follows the elastic contact, with
        skin that was never pressed.
        The motion of a hand is not known beforehand. It begins following the elastic contact, and its frames are late
        by the filter's margin. Between two frames it moves along the cubic through its places and speeds.
Source  design, sections 4 (gate, derivatives) and 8 (blocks of any size give the same samples).
Limits  The gate follows the load. If an effect may hold the finger (`held`), the gate instead follows whether the
        finger touches, over LIFT_TIME. A constant scan that does not repeat, and a stroke or a recording that is read
        from a later frame on, begin `settling` before that frame. While the magnitude of the load is below TOUCH_LOAD,
        the finger counts as taken away.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from synth.arrays import Array
from synth.effects.simulation.hand_steps import fill_between, last_of, path_between
from synth.effects.simulation.periodic import SteadyMotion
from synth.effects.simulation.steps import (
    ACROSS_FORCE,
    ATTACHED,
    HEIGHT,
    REACTION,
    ROWS,
    SLOPE_FORCE,
    TOUCH_LOAD,
    Phases,
    Stepper,
)
from synth.kernels import signed_kernel
from synth.motion.motion import LOAD, NO_PATH, SPEED, Motion
from synth.motion.scan_motion import LIFT_TIME, ScanMotion
from synth.response.demand import Complex
from synth.response.lift_gate import gate, gates
from synth.response.phases import phase_step, turns_to_phase
from synth.response.series_curve import SeriesCurve
from synth.sampling.decimation import Decimator
from synth.scene.scene import Scene

RESPONSE, SLOPE, PRESS, WHOLE, SLOPE_ACROSS = range(5)
"""Kinds of signal: z about its mean (m), the force of the slopes along x (N), the sum of the pressure without
attraction (N), z itself (m), and the force of the slopes along y (N)."""
ROW_OF = {SLOPE: SLOPE_FORCE, PRESS: REACTION, WHOLE: HEIGHT, SLOPE_ACROSS: ACROSS_FORCE}


@dataclass(frozen=True, slots=True)
class Signal:
    """One output of a simulation.

    kind: RESPONSE, SLOPE, PRESS, WHOLE or SLOPE_ACROSS.
    order: number of time derivatives.
    """

    kind: int
    order: int


@dataclass(frozen=True, slots=True)
class Simulation:
    """One contact, ready to run. Frozen, so that many voices share it.

    stepper: simulates the contact.
    steps: steps per frame.
    filters: band limit and derivatives.
    reference: z (m) about which displacement is measured, as a function of the cube root of the load (N).
    offset: mean of the simulated z above `reference` at the scan's load (m).
    held: whether an effect may hold the finger where the load does not.
    settling: time (s) simulated before the first frame of a scan that does not begin at its start.
    whole: as of `ScanMotion`.
    steady: the steady motion of a constant scan, if it is known and repeats.
    """

    stepper: Stepper
    scene: Scene
    steps: int
    filters: Decimator
    reference: Callable[[Array], Array]
    offset: float
    held: bool
    settling: float
    whole: bool = False
    steady: SteadyMotion | None = None

    @property
    def rate(self) -> int:
        """Steps per second."""
        return self.scene.output.sample_rate * self.steps

    def rest(self, loads: Any) -> Any:
        """Return z (m) about which displacement is measured, at a load or at each of `loads` (N).

        As in the steps, a load below the lift load counts as that load, unless an effect may hold the finger.
        """
        lightest = 0.0 if self.held else self.scene.scan.lift_load
        return self.reference(np.cbrt(np.maximum(loads, lightest))) + self.offset

    def series(self, signal: Signal) -> Complex | None:
        """Return the series of a signal of a constant scan, under the gate; None if its motion does not repeat."""
        steady, scan, period = self.steady, self.scene.scan, self.scene.texture.period
        if steady is None or steady.harmonics is None:
            return None
        row = steady.height() if signal.kind in (RESPONSE, WHOLE) else steady.harmonics[ROW_OF[signal.kind]]
        found = row * (2j * math.pi * scan.speed / period * np.arange(len(row))) ** signal.order
        if signal.kind == RESPONSE and signal.order == 0:
            found[0] -= self.rest(max(scan.load, 0.0))
        gain = float(steady.attached and abs(scan.load) >= TOUCH_LOAD) if self.held else gate(scan.load, scan.lift_load)
        return np.asarray(found * gain)

    def signal(self, kind: int, rows: Array, loads: Array) -> Array:
        """Return a signal from the rows of some steps, before the lift gate."""
        if kind == RESPONSE:
            return np.asarray(rows[HEIGHT] - self.rest(loads))
        return np.asarray(rows[ROW_OF[kind]])


class Running:
    """One run of a simulation, along the scan's own motion or after a hand.

    signals: the signal in each row of the frames.
    phase: phase of the texture at frame 0 of a constant scan, a 64-bit fraction of a turn.
    """

    def __init__(self, simulation: Simulation, signals: tuple[Signal, ...], phase: int = 0) -> None:
        self.simulation, self.signals = simulation, signals
        self._kinds = sorted({signal.kind for signal in signals})
        self._phase = phase
        scan = simulation.scene.scan
        self._own = ScanMotion(simulation.scene, simulation.rate, whole=simulation.whole)
        self._constant = scan.stroke is None and scan.trajectory is None and scan.along_x and not self._own.moved
        self._state: Any = None
        self._touching = np.ones(1)
        self._kept: Array = np.empty((len(self._kinds), 0))
        self._frame = self._next = -1
        self._before: tuple[int, float, float, float] | None = None
        self._line = simulation.stepper.line
        known = [simulation.series(signal) for signal in signals] if self._constant else []
        self._series = [SeriesCurve(one) for one in known if one is not None]
        self._aside = NO_PATH if self._line is None else np.array(self._line)[:, np.newaxis]

    @property
    def margin(self) -> int:
        """Frames by which the steps run ahead along a scan, and by which the frames are late behind a hand."""
        return self.simulation.filters.margin

    # -- along the scan's own motion

    def along(self, first: int, frames: int) -> Array:
        """Return float64 [signals, frames] from frame `first` on. Continuing the last call repeats no steps."""
        steps, margin = self.simulation.steps, self.margin
        if self._series:
            return self._read(first, frames)
        if first != self._frame or self._state is None:
            self._begin(first)
        end = (first + frames + margin - 1) * steps + 1
        values = self._stepped_along(self._next, end - self._next)
        self._next = end
        self._frame = first + frames
        return self._filtered(values, frames)

    def _read(self, first: int, frames: int) -> Array:
        """Return the frames of a constant scan from the series of its period."""
        scene = self.simulation.scene
        step = phase_step(scene.scan.speed, scene.texture.period, scene.output.sample_rate)
        places = np.ldexp(_phases(self._phase + step * first, step, frames).astype(float), -64)
        return np.array([one.heights(places, places) for one in self._series])

    def _begin(self, first: int) -> None:
        """Start where the motion begins, or `settling` before frame `first`, and run up to the steps to be filtered."""
        steps = self.simulation.steps
        settling = math.ceil(self.simulation.settling * self.simulation.scene.output.sample_rate)
        looks_at = (first - self.margin) * steps
        at = max(looks_at - 1 - settling * steps, min(looks_at - 1, self._first_step))
        phases, loads, path = self._own_motion(at, 1)
        self._start(int(phases[0]), float(loads[0]), self._turns(at), path)
        self._kept = np.empty((len(self._kinds), 0))
        if at + 1 < looks_at:
            self._stepped_along(at + 1, looks_at - at - 1)
            self._kept = np.empty((len(self._kinds), 0))
        self._next = looks_at

    def _stepped_along(self, first: int, count: int) -> Array:
        """Run `count` steps from `first` on, see `_stepped`. A recording begins anew where the finger comes down."""
        down = self._first_step
        early = down + 1 - first
        if self.simulation.scene.scan.trajectory is not None and 0 <= early < count:
            self._kept = self._stepped(*self._own_motion(first, early)) if early else self._kept
            phases, loads, path = self._own_motion(down, 1)
            self._start(int(phases[0]), float(loads[0]), self._turns(down), path)
            first, count = first + early, count - early
        return self._stepped(*self._own_motion(first, count))

    @property
    def _first_step(self) -> int:
        """Step at which a scan begins: a stroke where it turns, a recording where the finger comes down."""
        if self.simulation.scene.scan.stroke is None and self.simulation.scene.scan.trajectory is None:
            return -(1 << 62)
        comes_down = self.simulation.scene.scan.trajectory is not None
        return math.floor(-LIFT_TIME * self.simulation.rate) if comes_down else 0

    def _turns(self, at: int) -> float:
        if self.simulation.scene.scan.stroke is not None:
            at = max(at, 0)
        motion = self._own.at(at, 2)
        speed = motion.samples[SPEED, 0] if not motion.path.size else np.diff(motion.position)[0] * self._own.rate
        return float(speed) / self.simulation.scene.texture.period

    def _own_motion(self, first: int, count: int) -> tuple[Phases, Array, Array]:
        """Return phases, loads and path of `count` steps from step `first` on; step n is at t = n / rate."""
        scene = self.simulation.scene
        if not self._constant:
            early = min(max(-first, 0), count) if scene.scan.stroke is not None else 0  # at rest until t = 0
            motion = self._own.at(first + early, max(count - early, 1))
            phases = turns_to_phase(motion.position / scene.texture.period)
            path = self._path_of(motion)
            at = np.maximum(np.arange(count) - early, 0)
            return phases[at], motion.samples[LOAD, at], path[:, at] if path.size else path
        step = phase_step(scene.scan.speed, scene.texture.period, self.simulation.rate)
        phases = _phases(self._phase + step * first, step, count)
        return phases, np.full(count, scene.scan.load), np.repeat(self._aside, count, axis=1)

    def _path_of(self, motion: Motion) -> Array:
        """Return the path of `motion` [2, frames], or NO_PATH where every finger stays on its line."""
        if self._line is None:
            return NO_PATH
        return (
            motion.path if motion.path.size else np.repeat(np.array(self._line)[:, np.newaxis], motion.frames, axis=1)
        )

    # -- after a hand

    def after(self, motion: Motion, phases: Phases) -> Array:
        """Return float64 [signals, frames] of a hand, `margin` frames late.

        phases: of the texture at the frames of `motion`.
        """
        samples, path = np.ascontiguousarray(motion.samples), self._path_of(motion)  # positions become a view of speeds
        if self._before is None:
            turns = samples.item(SPEED, 0) / self.simulation.scene.texture.period
            self._aside = path[:, :1]
            self._start(int(phases[0]), samples.item(LOAD, 0), turns, self._aside)
            first = self._stepped(phases[:1], samples[LOAD, :1], self._aside)
            self._kept = np.repeat(first, (2 * self.margin - 1) * self.simulation.steps + 1, axis=1)
            self._before = last_of(phases[:1], samples)
        finer = np.empty(len(phases) * self.simulation.steps, np.uint64), np.empty(len(phases) * self.simulation.steps)
        turn = 1.0 / (self.simulation.scene.texture.period * self.simulation.scene.output.sample_rate)
        phase, *rest = self._before
        fill_between(
            phases, samples, np.uint64(phase), np.array(rest), self.simulation.steps, turn,
            1.0 / self.simulation.scene.output.sample_rate, *finer,
        )  # fmt: skip
        self._before = last_of(phases, samples)
        finer_path = path_between(self._aside, path, self.simulation.steps)
        self._aside = path[:, -1:].copy()
        return self._filtered(self._stepped(*finer, finer_path), len(phases))

    # -- both

    def _start(self, phase: int, load: float, turns: float, path: Array) -> None:
        where = (path,) if self._line is not None else ()
        self._state = self.simulation.stepper.start(phase, load, turns, 1.0 / self.simulation.rate, *where)
        self._touching[0] = -1.0

    def _stepped(self, phases: Phases, loads: Array, path: Array) -> Array:
        """Run the steps. Return float64 [kinds, steps]: old steps that the filter needs, then the new ones, gated."""
        rows = np.empty((ROWS, len(phases)))
        self.simulation.stepper.run(self._state, phases, loads, rows, *((path,) if self._line is not None else ()))
        gates = self._gates(rows[ATTACHED], loads)
        new = np.stack([self.simulation.signal(kind, rows, np.maximum(loads, 0.0)) * gates for kind in self._kinds])
        return np.concatenate([self._kept, new], axis=1)

    def _gates(self, attached: Array, loads: Array) -> Array:
        if self.simulation.held:
            there = attached * (np.abs(loads) >= TOUCH_LOAD)
            return np.asarray(held_gates(there, self._touching, 1.0 / (LIFT_TIME * self.simulation.rate)))
        return np.asarray(gates(loads, self.simulation.scene.scan.lift_load))

    def _filtered(self, values: Array, frames: int) -> Array:
        """Return the frames, and keep the steps that the next frames need."""
        filters, steps = self.simulation.filters, self.simulation.steps
        out = np.empty((len(self.signals), frames))
        for row, signal in enumerate(self.signals):
            near = values[self._kinds.index(signal.kind)]
            late = signal.kind in (SLOPE, PRESS, SLOPE_ACROSS)
            taps = filters.late_row if late else filters.orders.index(signal.order)
            out[row] = filters.read(near, taps, frames)
        self._kept = values[:, frames * steps :].copy()
        return out


def _phases(first: int, step: int, count: int) -> Phases:
    """Return `count` phases from `first` on, `step` apart; both in 64-bit fractions of a turn."""
    return np.uint64(first % 2**64) + np.uint64(step) * np.arange(count, dtype=np.uint64)


@signed_kernel("f8[::1](f8[::1], f8[::1], f8)")
def held_gates(attached, touching, step):
    """Return a gate that rises to 1 while the finger is attached and falls to 0 while it is not.

    touching: float64 [1], progress of the gate from 0 to 1. A negative value is set to 1 or 0 by the first step.
    step: change of `touching` per step.
    """
    gates = np.empty(len(attached))
    if touching[0] < 0.0:
        touching[0] = attached[0]
    for i in range(len(attached)):
        touching[0] = min(1.0, touching[0] + step) if attached[i] > 0.0 else max(0.0, touching[0] - step)
        gates[i] = gate(touching[0], 1.0)
    return gates
