"""The tangential force of a voice: read from responses of force, or taken from the simulation.

Stage   3 (VOICE), used only by the effect `tangential`.
Model   The components are those along x and, if asked for, y of the surface. Friction acts in the direction of the
        motion, which is applied at each frame.
        In a steady scan the slope force and friction are one series. Elsewhere they are read: along a line from
        response tables, over an area as `area_force_reading` has it. In a simulation both are read from its frames.
        The surface along a line has no slope across, so its force along y is friction alone.
Limits  The error of a simulated force is found as that of z in `simulation_plan`, at the scan's own speed and load and
        along the first part of a file's motion, without what has not settled where the scan begins.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from synth.arrays import Array, Block
from synth.effects.effect import AddedChannel, Passage
from synth.effects.simulation.running import PRESS, SLOPE, SLOPE_ACROSS, Running, Signal, Simulation
from synth.motion.motion import LOAD
from synth.motion.scan_motion import ScanMotion
from synth.plan.channels import PEAK, ROUNDING, STILL
from synth.plan.motion_peak import MOST_FRAMES, TOGETHER
from synth.plan.pilot_run import LONGEST_OWN, OWN, work_of
from synth.plan.preparation import Preparation
from synth.plan.simulation_plan import PATIENCE_FILE, SimulationPlan
from synth.response.lift_gate import gate, gates
from synth.response.series_curve import SMALLEST, SeriesCurve
from synth.response.table_reader import TableReader
from synth.response_cache import ResponseCache
from synth.scene.line_scan import as_written
from synth.voice.area_force_reading import SolvedForces, reader_of
from synth.voice.forces_of_scene import READ_AS, Force, Steady, forces_of, require_detail, sum_of_series
from synth.voice.friction_force import after_hand, along_scan, directed, own_direction
from synth.voice.table_reading import HandReader, ScanReader, TableChannels, delayed

QUANTITY, QUANTITY_ACROSS = "tangential_force", "tangential_force_y"
SMALL = 0.01  # of the force along the motion: a smaller steady force is no measure of its error
LEFT_BY_COARSER = 1.0  # error over the change by half the points or table: a force has slopes, of a lower order than z
LEFT_BY_TABLE = 0.5  # the same of a table of a smooth texture: of second order where crests begin to touch
RUNS = 5.0  # time to judge a part of a motion, over that to run it: steps of half the length, and two tables or points
SIGNALS = (Signal(SLOPE, 0), Signal(SLOPE_ACROSS, 0))  # of a simulation, of each component


@dataclass(slots=True)
class ForceState:
    """The state of a voice.

    reader: of the forces, if they are read.
    own: motion of the scan as it is written.
    past: direction [2] and load (N) of the last frames of a hand [3, frames].
    place: along and across (m) of the last frame of a hand over an area.
    """

    reader: HandReader | ScanReader | SolvedForces | None
    own: ScanMotion
    past: Array | None = None
    place: Array | None = None


@dataclass(frozen=True, slots=True)
class TangentialStage:
    """The effect prepared for one scene.

    law: the settings of the effect `tangential`: the law of friction, and the requested full scale (N).
    solved: the prepared scene.
    slopes: the slope force of each component that has one; empty where a simulation provides all forces.
    friction: unless it is Coulomb's.
    steady: reader (None: nothing varies) and mean (N) of each component in a constant scan; else empty.
    channels: the channels that it adds.
    """

    law: Any
    solved: Preparation
    slopes: tuple[Force, ...]
    friction: Force | None
    steady: tuple[tuple[SeriesCurve | None, float], ...]
    channels: tuple[AddedChannel, ...]

    @classmethod
    def of(cls, solved: Preparation, law: Any, cache: ResponseCache) -> TangentialStage:
        """Return the stage of a prepared scene. The scene must not be silent."""
        assert solved.effects is not None and solved.contact is not None and solved.spectrum is not None
        of_file = solved.moving and not (solved.live or solved.by_hand)
        if solved.effects.simulation is not None:
            simulated = cls(law, solved, (), None, (), _simulated_channels(solved, law))
            return simulated.levelled() if of_file else simulated
        slopes, friction = forces_of(solved, law, cache)
        scan, direction = solved.scene.scan, own_direction(solved.scene, law)
        mean = law.friction_coefficient * scan.load if friction is None else friction.mean
        components = []
        for axis, way in enumerate(direction[: law.count].tolist()):
            series, left = np.zeros(2, complex), 0.0
            if axis < len(slopes):
                series, left = slopes[axis].series, slopes[axis].left_over
            if friction is not None:
                series, left = sum_of_series(series, way * friction.series), left + abs(way) * friction.left_over
            aside = slopes[axis].mean if 0 < axis < len(slopes) else 0.0  # along the motion it is 0
            components.append(Steady(series, way * mean + aside, left))
        require_detail(solved, slopes, components)
        lifted = float(gate(scan.load, scan.lift_load))
        steady: tuple[tuple[SeriesCurve | None, float], ...] = ()
        if not solved.moving:
            steady = tuple(one.reader(lifted) for one in components)
        method = "solved forces" if slopes[0].moving else "response table of the force"
        if steady:
            method = SeriesCurve(slopes[0].series).name
        moving = (one.moving for one in (*slopes, friction) if one is not None and one.moving is not None)
        first, *others = _channels(law, components, lifted, method)
        channels = replace(first, work=math.fsum(one.work for one in moving)), *others
        stage = cls(law, solved, slopes, friction, steady, channels)
        return stage.levelled() if of_file else stage

    def levelled(self) -> TangentialStage:
        """Return the stage of a file with the full scale of its own motion, where the scene sets none.

        The error of a simulated force is the larger one of the steady scan and of the motion: a slower finger has finer
        waves in the band. Where the steady force is small beside the file's, the file's peak-to-peak is told.
        """
        assert self.solved.effects is not None
        plan, unit = self.solved.effects.simulation, self.channels[0].full_scale
        moved = self._along(None if plan is None else plan.simulation)
        extents, steady = unit * np.ptp(moved, axis=0), max(one.extent for one in self.channels)
        small, errors = plan is not None and steady < SMALL * np.max(extents), np.zeros(len(extents))
        if plan is not None:
            errors = unit * self._errors_along(plan, moved) / max(np.max(extents) if small else steady, STILL)
            errors += plan.filtered + ROUNDING
        scale, found = unit * float(np.max(np.abs(moved))) / PEAK, []
        if self.law.full_scale is not None or scale <= STILL:
            scale = unit
        whole = len(moved) == self._frames()
        for one, extent, error in zip(self.channels, extents.tolist(), errors.tolist(), strict=True):
            own = replace(one, extent=extent, error=error) if small else replace(one, error=max(one.error, error))
            found.append(replace(own, full_scale=scale, of_own_motion=whole))
        return replace(self, channels=tuple(found))

    def _frames(self, longest: float = math.inf) -> int:
        """Return the frames of the file, of a stroke those of a period; longest: s."""
        output, stroke = self.solved.scene.output, self.solved.scene.scan.stroke
        seconds = min(output.duration, longest, math.inf if stroke is None else stroke.period)
        return max(1, round(seconds * output.sample_rate))

    def _errors_along(self, plan: SimulationPlan, moved: Block) -> Array:
        """Return the error of each channel along the first part of the motion, in units of `moved`."""
        seconds = min(OWN, PATIENCE_FILE / max(RUNS * work_of(plan.simulation), 1e-9))
        others = (replace(one, scene=self.solved.scene) for one in (plan.finer, *plan.coarser))
        finer, *pair = (self._along(one, seconds).T.astype(float) for one in others)
        return _changed(self.solved, moved[: finer.shape[1]].T.astype(float), finer, pair)

    def _along(self, simulation: Simulation | None, longest: float = math.inf) -> Block:
        """Return the channels of a file along its own motion: a period of a stroke, or MOST_FRAMES of a recording.

        A simulation, and forces that are solved, run for LONGEST_OWN at most.

        longest: s.
        """
        scene, running = self.solved.scene, None if simulation is None else Running(simulation, self.signals)
        costly = running is not None or any(one.moving is not None for one in self.slopes)
        frames = min(self._frames(min(longest, LONGEST_OWN if costly else math.inf)), MOST_FRAMES)
        found = np.zeros((frames, len(self.channels)), np.float32)
        state, motion = self.start(0), ScanMotion(scene)
        for first in range(0, len(found), TOGETHER):
            block = found[first : first + TOGETHER]
            signals = None if running is None else running.along(first, len(block))
            self.step(state, Passage(first, 0, 0, motion.at(first, len(block)), False, signals, 0, 0, ()), block)
        return found

    @property
    def signals(self) -> tuple[Signal, ...]:
        """See `OutputStage`."""
        return () if self.slopes else _signals(self.solved, self.law)

    def louder(self, times: float, moved: tuple[float, ...]) -> TangentialStage:
        """See `OutputStage`."""
        if self.law.full_scale is not None:
            return self
        return replace(self, channels=tuple(replace(one, full_scale=one.full_scale * times) for one in self.channels))

    def start(self, phase: int) -> ForceState:
        """See `OutputStage`."""
        scene = self.solved.scene
        own = ScanMotion(as_written(scene), whole=self.solved.live)
        forces = (*self.slopes, *([] if self.friction is None else [self.friction]))
        moving = tuple(one.moving for one in forces if one.moving is not None)
        if moving:
            reader = reader_of(self.solved, moving)
        else:
            read = zip(forces, READ_AS, strict=False)
            rate = scene.output.sample_rate
            readers = tuple(TableReader.of(one.table, name, rate) for one, name in read if one.table is not None)
            if not readers:
                return ForceState(None, own)
            if not self.solved.by_hand:
                return ForceState(ScanReader(TableChannels(readers), scene), own)
            reader = HandReader(TableChannels(readers), scene.texture.period, rate)
        state = ForceState(reader, own)
        self.begin_at(state, phase)
        return state

    def begin_at(self, state: ForceState, phase: int) -> None:
        """See `OutputStage`."""
        if isinstance(state.reader, HandReader):
            state.reader.phase = phase

    def delay(self, state: ForceState) -> int:
        """See `OutputStage`."""
        return state.reader.delay if isinstance(state.reader, HandReader) else 0

    def step(self, state: ForceState, passage: Passage, block: Block) -> None:
        """See `OutputStage`."""
        column, scale = passage.column, self.channels[0].full_scale
        if self.steady:
            for place, (reader, level) in enumerate(self.steady, column):
                block[:, place] = 0.0
                if reader is not None:
                    reader.read(passage.phase, passage.step, 1.0 / scale, block, place)
                block[:, place] += np.float32(level / scale)
            return
        *direction, load = self._of_motion(state, passage, len(block))
        if passage.signals is not None:
            *slopes, friction = passage.signals
            friction = self.law.friction_coefficient * friction
        else:
            slopes, friction = self._read(state, passage, load)
        for axis in range(len(self.channels)):
            force = direction[axis] * friction
            if axis < len(slopes):
                force = slopes[axis] + force
            force = force / scale
            block[:, column + axis] = np.where(np.abs(force) >= SMALLEST, force, 0.0)

    def _of_motion(self, state: ForceState, passage: Passage, frames: int) -> Array:
        """Return both parts of the direction of friction and the gated load (N) at each frame of the block."""
        scene, motion = self.solved.scene, passage.motion
        scan = scene.scan
        loads = np.full(frames, scan.load) if motion is None else np.ascontiguousarray(motion.samples[LOAD])
        if passage.by_hand:
            assert motion is not None
            moved, state.place = after_hand(motion, state.place, scene.output.sample_rate)
        else:
            moved = along_scan(state.own, passage.frame, frames)
        both = np.array([*directed(moved, self.law.reversal_speed), loads * gates(loads, scan.lift_load)])
        late = self.delay(state) or passage.late
        if not late:
            return both
        if state.past is None:
            state.past = np.repeat(both[:, :1], late, axis=1)
        return np.asarray(delayed(both, state.past))

    def _read(self, state: ForceState, passage: Passage, load: Array) -> tuple[list[Array], Array]:
        """Return the slope forces and the size of friction (N) at the frames of a motion."""
        assert state.reader is not None and passage.motion is not None
        count = len(self.slopes)
        read = np.zeros((len(load), count + (self.friction is not None)), np.float32)
        if isinstance(state.reader, HandReader):
            state.reader.read(passage.motion, read)
        else:
            state.reader.read(passage.frame, read)
        rows: list[Any] = list(read.T)
        return rows[:count], self.law.friction_coefficient * load if self.friction is None else rows[count]


def _channels(law: Any, components: list[Steady], lifted: float, method: str) -> tuple[AddedChannel, ...]:
    """Return the added channels: of one full scale, and with errors relative to the largest peak-to-peak.

    lifted: the lift gate at the load of the scan.
    """
    peak, extent = (lifted * max(getattr(one, name) for one in components) for name in ("peak", "extent"))
    scale, found = law.full_scale or (peak / PEAK if peak > STILL else 1.0), []
    for quantity, one in zip((QUANTITY, QUANTITY_ACROSS), components, strict=False):
        error = lifted * one.left_over / extent if extent > 0.0 else 0.0
        found.append(AddedChannel(quantity, scale, lifted * one.extent, error + ROUNDING, method))
    return tuple(found)


def _signals(solved: Preparation, law: Any) -> tuple[Signal, ...]:
    """Return the signals of a simulation: the slope force of each component that has one, and the pressure."""
    contact: Any = solved.contact
    count = law.count if contact.geometry.over_area else 1
    return (*SIGNALS[:count], Signal(PRESS, 0))


def _changed(solved: Preparation, forces: Array, finer: Array, pair: list[Array]) -> Array:
    """Return the error of simulated forces [components, frames], in their unit.

    finer: in steps of half the length. pair: on a coarser table or fewer points, and on those of the plan, or none.
    """
    assert solved.effects is not None and solved.effects.simulation is not None and solved.contact is not None
    left = 4.0 / 3.0 * np.max(np.abs(finer - forces), axis=1)
    if pair:
        profile = solved.contact.geometry.profile
        smooth = profile is None or not profile.corners.size
        in_table = solved.effects.simulation.simulation.stepper.coarser() is not None
        part = LEFT_BY_TABLE if smooth and in_table else LEFT_BY_COARSER
        left += part * np.max(np.abs(pair[1] - pair[0]), axis=1)
    return np.asarray(left)


def _simulated_channels(solved: Preparation, law: Any) -> tuple[AddedChannel, ...]:
    """Return the channels of a simulated force: their peak and error at the scan's own speed and load."""
    assert solved.effects is not None and solved.effects.simulation is not None
    plan, signals = solved.effects.simulation, _signals(solved, law)
    direction = law.friction_coefficient * own_direction(solved.scene, law)[: law.count, np.newaxis]
    simulations = plan.nominal, plan.finer, *plan.coarser
    runs = []
    for one in simulations:
        *slopes, pressed = Running(one, signals).along(0, plan.pilot.moved.shape[1])
        forces = direction * pressed
        forces[: len(slopes)] += slopes
        runs.append(forces)
    coarse, fine, *pair = runs
    extents, peak = np.ptp(fine, axis=1), float(np.max(np.abs(fine)))
    scale = law.full_scale or (peak / PEAK if peak > STILL else 1.0)
    left = _changed(solved, coarse, fine, pair)
    errors = left / np.max(extents) if np.any(extents) else np.zeros(len(extents))
    own = plan.filtered + ROUNDING
    told = zip((QUANTITY, QUANTITY_ACROSS), extents.tolist(), (errors + own).tolist(), strict=False)
    return tuple(AddedChannel(quantity, scale, extent, error, "simulation") for quantity, extent, error in told)
