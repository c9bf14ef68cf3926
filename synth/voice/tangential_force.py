"""The tangential force of a voice: read from responses of force, or taken from the simulation.

Stage   3 (VOICE), used only by the effect `tangential`.
Model   In a steady scan the slope force and friction are one series. In a motion each has a response table, and the
        direction of friction is applied at each frame. In a simulation both are read from its frames.
Limits  The error of a simulated force is that of z in `simulation_plan`, at the scan's own speed and load, without what
        has not settled where the scan begins.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from synth.arrays import Array, Block
from synth.contact.forces import FrictionForce, Response, SlopeForce
from synth.effects.effect import AddedChannel, Passage
from synth.effects.simulation.running import PRESS, SLOPE, Running, Signal, gates_of
from synth.errors import Fault, SceneError
from synth.motion.motion import LOAD, SPEED
from synth.plan.channels import PEAK, ROUNDING, STILL, extent_and_peak, spendable
from synth.plan.preparation import Preparation
from synth.plan.scene_series import SERIES_SHARE
from synth.plan.scene_table import bounds_for, kept_table, read_error
from synth.response.lift_gate import gate
from synth.response.series_curve import SMALLEST, SeriesCurve
from synth.response.spectrum import Complex, Demand, Spectrum, curves, points_for, solve_spectrum
from synth.response.table import ResponseTable
from synth.response.table_reader import TableReader
from synth.response_cache import ResponseCache
from synth.scene.finger_section import KINDS
from synth.voice.table_reading import HandReader, ScanReader, TableChannels, delayed

QUANTITY = "tangential_force"
READ_AS = "displacement", "approach"  # how the tables are read: the slope force has no mean, friction has one
LIVE_WORK, FILE_WORK = 2.0, 8.0  # times the work of a contact's table: a phase of friction takes ten times as long
MOST_ERROR = 1.0  # of the peak-to-peak: a larger error is refused, if the table lacks harmonics in the band
LEFT_BY_COARSER = 1.0  # error over the change by half the points or table: a force has slopes, of a lower order than z
SIMULATED = (Signal(SLOPE, 0), Signal(PRESS, 0))


@dataclass(frozen=True, slots=True)
class Force:
    """One force over place and load.

    series: harmonics at the scan's load, without the mean, N.
    mean: over a period at that load, N.
    table: for reading a motion; None in a steady scan.
    error: relative to the peak-to-peak of the force.
    """

    series: Complex
    mean: float
    table: ResponseTable | None
    error: float

    @classmethod
    def of(cls, solved: Preparation, force: Response, cache: ResponseCache) -> Force:
        """Return `force` of a prepared scene."""
        highest, load = max(solved.highest, 1), solved.scene.scan.load
        demand = Demand(highest, (0,), SERIES_SHARE * spendable(solved.tolerance))
        key = ("force", force.key, load, demand)
        spectrum: Spectrum = cache.get(key, lambda: solve_spectrum(force, load, demand))
        series, error = spectrum.harmonics[: highest + 1].copy(), spectrum.errors[0]
        mean, series[0] = float(series[0].real), 0.0
        if not solved.moving:
            return cls(series, mean, None, error)
        work, rate = LIVE_WORK if solved.by_hand or solved.paced else FILE_WORK, solved.scene.output.sample_rate
        table = kept_table(force, solved.scene, cache, work=work)
        return cls(series, mean, table, read_error(table, READ_AS[0], rate, solved.reported_loads, highest))

    @property
    def left_over(self) -> float:
        """The largest error (N) over a period."""
        return self.error * extent_and_peak(self.series)[0]


@dataclass(slots=True)
class ForceState:
    """The state of a voice.

    reader: of the tables, if there are any.
    past: direction and load (N) of the last frames of a hand [2, frames].
    """

    reader: HandReader | ScanReader | None
    past: Array | None = None


@dataclass(frozen=True, slots=True)
class TangentialStage:
    """The effect prepared for one scene.

    law: the settings of the effect `tangential`: the law of friction, and the requested full scale (N).
    solved: the prepared scene.
    forces: the slope force and, unless it is Coulomb's, friction; empty where a simulation provides both.
    steady: reader and mean (N) of a constant scan, else None.
    channel: the channel that it adds.
    """

    law: Any
    solved: Preparation
    forces: tuple[Force, ...]
    steady: tuple[SeriesCurve, float] | None
    channel: AddedChannel

    @classmethod
    def of(cls, solved: Preparation, law: Any, cache: ResponseCache) -> TangentialStage:
        """Return the stage of a prepared scene. The scene must not be silent."""
        assert solved.effects is not None and solved.contact is not None and solved.spectrum is not None
        if solved.effects.simulation is not None:
            return cls(law, solved, (), None, _simulated_channel(solved, law))
        scan = solved.scene.scan
        if law.pressure_exponent != 1.0 and not solved.contact.of_one_line:
            allowed = "1 under a fingertip, for which the pressure of each place is not computed"
            others = " or ".join(f'"{name}"' for name, kind in KINDS.items() if not kind.of_area)
            hint = f"Write a pressure_exponent of 1, or finger.kind {others}."
            value = f"{law.pressure_exponent:g}"
            raise SceneError([Fault("/effects/tangential/pressure_exponent", value, allowed, hint)])
        direction, mean = math.tanh(scan.speed / law.reversal_speed), law.friction_coefficient * scan.load
        contact = solved.contact.as_profile()
        forces = [Force.of(solved, SlopeForce(contact), cache)]
        series, left_over = forces[0].series, forces[0].left_over
        if law.pressure_exponent != 1.0 and law.friction_coefficient > 0.0:
            response = FrictionForce(contact, law.friction_coefficient, law.pressure_exponent, law.reference_pressure)
            forces.append(Force.of(solved, response, cache))
            mean = forces[1].mean
            series = series + direction * forces[1].series
            left_over += abs(direction) * forces[1].left_over
        lifted, level = float(gate(scan.load, scan.lift_load)), direction * mean
        extent, _peak = extent_and_peak(series)
        peak = lifted * float(np.max(np.abs(curves(series, 0, 2 * points_for(len(series) - 1)) + level)))
        scale = law.full_scale or (peak / PEAK if peak > STILL else 1.0)
        error = left_over / extent if extent > 0.0 else 0.0
        steady, method = None, "response table of the force"
        if not solved.moving:
            reader = SeriesCurve(lifted * series)
            steady, method = (reader, lifted * level), reader.name
        worst, held = max(error, *(one.error for one in solved.channels)), bounds_for(solved.scene).harmonics
        if solved.moving and solved.highest > held and worst > MOST_ERROR:
            allowed = f"an error of {MOST_ERROR:g} or less wherever speed or load change, where a table is read"
            hint = (
                "The texture has more detail than a table holds. Write a shorter texture, render a file at constant "
                "speed and load, or leave tangential out."
            )
            value = f"an error of {worst:.2g} of the peak-to-peak"
            raise SceneError([Fault("/effects/tangential", value, allowed, hint)])
        channel = AddedChannel(QUANTITY, scale, lifted * extent, error + ROUNDING, method)
        return cls(law, solved, tuple(forces), steady, channel)

    @property
    def channels(self) -> tuple[AddedChannel, ...]:
        """See `OutputStage`."""
        return (self.channel,)

    @property
    def signals(self) -> tuple[Signal, ...]:
        """See `OutputStage`."""
        return () if self.forces else SIMULATED

    def louder(self, times: float, moved: tuple[float, ...]) -> TangentialStage:
        """See `OutputStage`."""
        if self.law.full_scale is not None:
            return self
        return replace(self, channel=replace(self.channel, full_scale=self.channel.full_scale * times))

    def start(self, phase: int) -> ForceState:
        """See `OutputStage`."""
        scene = self.solved.scene
        rate = scene.output.sample_rate
        read = zip(self.forces, READ_AS, strict=False)
        readers = tuple(TableReader.of(one.table, name, rate) for one, name in read if one.table is not None)
        if not readers:
            return ForceState(None)
        if not self.solved.by_hand:
            return ForceState(ScanReader(TableChannels(readers), scene))
        hand = HandReader(TableChannels(readers), scene.texture.period, rate)
        hand.phase = phase
        return ForceState(hand)

    def begin_at(self, state: ForceState, phase: int) -> None:
        """See `OutputStage`."""
        if isinstance(state.reader, HandReader):
            state.reader.phase = phase

    def delay(self, state: ForceState) -> int:
        """See `OutputStage`."""
        return state.reader.delay if isinstance(state.reader, HandReader) else 0

    def step(self, state: ForceState, passage: Passage, block: Block) -> None:
        """See `OutputStage`."""
        column, scale = passage.column, self.channel.full_scale
        if self.steady is not None:
            reader, level = self.steady
            reader.read(passage.phase, passage.step, 1.0 / scale, block, column)
            block[:, column] += np.float32(level / scale)
            return
        direction, load = self._of_motion(state, passage, len(block))
        if passage.signals is not None:
            slope, pressed = passage.signals
            force = slope + direction * self.law.friction_coefficient * pressed
        else:
            force = self._read(state, passage, direction, load)
        force = force / scale
        block[:, column] = np.where(np.abs(force) >= SMALLEST, force, 0.0)

    def _of_motion(self, state: ForceState, passage: Passage, frames: int) -> Array:
        """Return the direction of friction and the gated load (N) at each frame of the block [2, frames]."""
        scan, motion = self.solved.scene.scan, passage.motion
        speeds = np.full(frames, scan.speed) if motion is None else motion.samples[SPEED]
        loads = np.full(frames, scan.load) if motion is None else np.ascontiguousarray(motion.samples[LOAD])
        both = np.array([np.tanh(speeds / self.law.reversal_speed), loads * gates_of(loads, scan.lift_load)])
        late = self.delay(state) or passage.late
        if not late:
            return both
        if state.past is None:
            state.past = np.repeat(both[:, :1], late, axis=1)
        return np.asarray(delayed(both, state.past))

    def _read(self, state: ForceState, passage: Passage, direction: Array, load: Array) -> Array:
        """Return the force (N) at the frames of a motion, from the tables."""
        assert state.reader is not None and passage.motion is not None
        read = np.zeros((len(load), len(self.forces)), np.float32)
        if isinstance(state.reader, HandReader):
            state.reader.read(passage.motion, read)
        else:
            state.reader.read(passage.frame, read)
        friction = self.law.friction_coefficient * load if len(self.forces) == 1 else read[:, 1]
        return np.asarray(read[:, 0] + direction * friction)


def _simulated_channel(solved: Preparation, law: Any) -> AddedChannel:
    """Return the channel of a simulated force: its peak and error at the scan's own speed and load."""
    assert solved.effects is not None and solved.effects.simulation is not None
    plan = solved.effects.simulation
    direction = math.tanh(solved.scene.scan.speed / law.reversal_speed)
    simulations = plan.nominal, plan.finer, *plan.coarser
    runs = [Running(one, SIMULATED).along(0, plan.pilot.moved.shape[1]) for one in simulations]
    coarse, fine, *pair = (slope + direction * law.friction_coefficient * pressed for slope, pressed in runs)
    extent, peak = float(np.ptp(fine)), float(np.max(np.abs(fine)))
    scale = law.full_scale or (peak / PEAK if peak > STILL else 1.0)
    left = 4.0 / 3.0 * float(np.max(np.abs(fine - coarse)))
    if pair:
        left += LEFT_BY_COARSER * float(np.max(np.abs(pair[1] - pair[0])))
    error = left / extent if extent > 0.0 else 0.0
    return AddedChannel(QUANTITY, scale, extent, error + plan.filtered + ROUNDING, "simulation")
