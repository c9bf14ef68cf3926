"""The tangential force of a voice: read from responses of force, or taken from the simulation.

Stage   3 (VOICE), used by the effect `tangential` alone.
Model   Steady: the series of the slope force and of friction are one series, read as any other. Moving: each is read at
        the frame's place and load, and friction is given its direction there. Simulated: both come as frames of the
        simulation.
Limits  `error` of a simulated force is what halving the steps changes, a third more.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from synth.arrays import Array
from synth.contact.forces import FrictionForce, SlopeForce
from synth.effects.effect import AddedChannel, Block, Passage
from synth.effects.simulation.running import PRESS, SLOPE, Running, Signal
from synth.motion.motion import LOAD, SPEED, ScanMotion
from synth.plan.channels import PEAK, ROUNDING, STILL, ChannelPlan, extent_and_peak, spendable
from synth.plan.method_choice import cheapest_reader
from synth.plan.preparation import ALIAS_SHARE, Preparation
from synth.response.cache import ResponseCache
from synth.response.evaluation import SMALLEST, gate
from synth.response.spectrum import Complex, Demand, Spectrum, curves, points_for, solve_spectrum
from synth.response.steady import SteadyReader
from synth.scene.effects_section import FrozenMapping
from synth.voice.moving import MovingReader
from synth.voice.moving_tables import tables_for

QUANTITY = "tangential_force"
READER_SHARE = 0.15  # of the tolerance: what reading a steady series may err by
MEAN_LOADS = 65  # at which the mean of friction that is not Coulomb's is taken, over the cube root of the load
HEAVIEST_MEAN = 64.0  # N: beyond it the mean friction of a hand goes on as the last cubic does
SIMULATED = (Signal(SLOPE, 0), Signal(PRESS, 0))


@dataclass(frozen=True, slots=True)
class Friction:
    """The law of friction, and the full scale (N) that is asked for: see the effect `tangential`."""

    friction_coefficient: float
    pressure_exponent: float
    reference_pressure: float
    reversal_speed: float
    full_scale: float | None


@dataclass(frozen=True, slots=True)
class TangentialStage:
    """The effect made ready for one scene.

    law: of friction. solved: the scene. slope, friction: the forces over phase and load, as preparations of their own;
    None where the simulation gives them, friction also where it is Coulomb's. mean: of friction over a period (N) at
    each load. steady: what reads a constant scan; its mean (N). cache: where hands find the tables of others.
    """

    law: Friction
    solved: Preparation
    slope: Preparation | None
    friction: Preparation | None
    mean: Callable[[Array], Array]
    steady: tuple[SteadyReader, float] | None
    channel: AddedChannel
    cache: ResponseCache

    @classmethod
    def of(cls, solved: Preparation, law: Friction, cache: ResponseCache) -> TangentialStage:
        """Return the stage of a prepared scene that sounds."""
        assert solved.effects is not None and solved.contact is not None and solved.spectrum is not None
        if solved.effects.simulation is not None:
            mean = _coulomb(law.friction_coefficient)
            return cls(law, solved, None, None, mean, None, _simulated_channel(solved, law), cache)
        contact = solved.contact
        slope = _force_of(solved, SlopeForce(contact), cache)
        friction, mean = None, _coulomb(law.friction_coefficient)
        if law.pressure_exponent != 1.0 and law.friction_coefficient > 0.0:
            response = FrictionForce(contact, law.friction_coefficient, law.pressure_exponent, law.reference_pressure)
            friction = _force_of(solved, response, cache)
            mean = _mean_friction(response, solved)
        direction = math.tanh(solved.scene.scan.speed / law.reversal_speed)
        series = _series(slope, solved.highest)
        if friction is not None:
            series = series + direction * _series(friction, solved.highest)
        lifted = float(gate(solved.scene.scan.load, solved.scene.scan.lift_load)[0])
        level = direction * float(mean(np.array([solved.scene.scan.load]))[0])
        extent, _peak = extent_and_peak(series)
        peak = lifted * float(np.max(np.abs(curves(series, 0, 2 * points_for(len(series) - 1)) + level)))
        scale = law.full_scale or (peak / PEAK if peak > STILL else 1.0)
        error = _left_over(slope, solved.highest)
        if friction is not None:
            error += abs(direction) * _left_over(friction, solved.highest)
        error = error / extent if extent > 0.0 else 0.0
        steady = None
        if not solved.moving:
            reading = cheapest_reader(
                lifted * series, READER_SHARE * spendable(solved.tolerance), solved.scene.output.sample_rate
            )
            steady = reading.reader, lifted * level
            error += reading.error
        method = "response of force" if steady is None else steady[0].name
        channel = AddedChannel(QUANTITY, scale, lifted * extent, error + ROUNDING, method)
        return cls(law, solved, slope, friction, mean, steady, channel, cache)

    @property
    def channels(self) -> tuple[AddedChannel, ...]:
        """See `OutputStage`."""
        return (self.channel,)

    @property
    def signals(self) -> tuple[Signal, ...]:
        """See `OutputStage`."""
        return SIMULATED if self.slope is None else ()

    @property
    def memory_bytes(self) -> int:
        """See `OutputStage`."""
        spectra = [part.spectrum for part in (self.slope, self.friction) if part is not None]
        held = sum(0 if one is None else one.memory_bytes for one in spectra)
        return held + (0 if self.steady is None else self.steady[0].nbytes)

    def louder(self, times: float) -> TangentialStage:
        """See `OutputStage`."""
        if self.law.full_scale is not None:
            return self
        return replace(self, channel=replace(self.channel, full_scale=self.channel.full_scale * times))

    def start(self, phase: int, *, wait: bool) -> list[MovingReader]:
        """See `OutputStage`: the readers of the forces, none where the scan is constant or simulated."""
        if self.slope is None or self.steady is not None:
            return []
        readers = [self._reader(part, phase, wait=wait) for part in (self.slope, self.friction) if part is not None]
        if not self.solved.by_hand:
            loads = ScanMotion(self.solved.scene).recorded_loads()
            for reader in readers:
                reader.cover(*loads)
        return readers

    def _reader(self, force: Preparation, phase: int, *, wait: bool) -> MovingReader:
        assert force.contact is not None
        return MovingReader(force, phase, tables_for(force, self.cache, wait=wait, response=force.contact.key))

    def readers(self, state: list[MovingReader]) -> tuple[MovingReader, ...]:
        """See `OutputStage`."""
        return tuple(state)

    def begin_at(self, state: list[MovingReader], phase: int) -> None:
        """See `OutputStage`."""
        for reader in state:
            reader.phase[0] = phase

    def step(self, state: list[MovingReader], passage: Passage, block: Block) -> None:
        """See `OutputStage`."""
        column, scale = passage.column, self.channel.full_scale
        if self.steady is not None:
            reader, level = self.steady
            reader.read(passage.phase, passage.step, 1.0 / scale, block, column)
            block[:, column] += np.float32(level / scale)
            return
        motion = passage.motion
        speed: Array | float = self.solved.scene.scan.speed if motion is None else motion.samples[SPEED]
        direction = np.tanh(speed / self.law.reversal_speed)
        if passage.signals is not None:
            slope, pressed = passage.signals
            force = slope + direction * self.law.friction_coefficient * pressed
        else:
            assert motion is not None
            force = self._read(state, motion, direction, passage)
        force = force / scale
        block[:, column] = np.where(np.abs(force) >= SMALLEST, force, 0.0)

    def _read(self, readers: list[MovingReader], motion: Any, direction: Array | float, passage: Passage) -> Array:
        """Return the force (N) at the frames of a motion, from the responses."""
        parts = np.zeros((2, motion.samples.shape[1], 1), np.float32)
        for reader, part in zip(readers, parts, strict=False):
            if passage.by_hand:
                reader.phase[0] = passage.phase
                reader.read_hand(motion, part)
            else:
                reader.read(motion, part)
        loads, lift = motion.samples[LOAD], self.solved.scene.scan.lift_load
        level = self.mean(np.maximum(loads, 0.0)) * _gates(loads, lift)
        return np.asarray(parts[0, :, 0] + direction * (parts[1, :, 0] + level))


def _coulomb(coefficient: float) -> Callable[[Array], Array]:
    def mean(loads: Array) -> Array:
        return coefficient * loads

    return mean


def _gates(loads: Array, lift: float) -> Array:
    s = np.clip(loads / lift, 0.0, 1.0)
    return np.asarray(s**3 * (10.0 + s * (6.0 * s - 15.0)))


def _force_of(solved: Preparation, force: Any, cache: ResponseCache) -> Preparation:
    """Return a force as a preparation that a reader of displacement takes: 1 N for 1.0."""
    output = solved.scene.output.model_copy(update={"channels": None, "quantity": "displacement", "full_scale": 1.0})
    scene = solved.scene.model_copy(update={"output": output, "effects": FrozenMapping()})
    keep = solved.reach if solved.moving else solved.highest
    demand = Demand(max(solved.highest, 1), (0,), ALIAS_SHARE * spendable(solved.tolerance))
    load = scene.scan.load
    key = ("force", force.key, load, demand, keep)
    spectrum: Spectrum = cache.get(key, lambda: solve_spectrum(force, load, demand, keep))
    channel = ChannelPlan("displacement", 0, 1.0, spectrum.errors[0], 0.0, None)
    found = replace(solved, scene=scene, contact=force, spectrum=spectrum, channels=(channel,))
    return replace(found, effects=None, frames=None)


def _series(force: Preparation, highest: int) -> Complex:
    assert force.spectrum is not None
    kept = force.spectrum.harmonics[: max(highest, 1) + 1].copy()
    kept[0] = 0.0
    return kept


def _left_over(force: Preparation, highest: int) -> float:
    """Return the largest error (N) of a force over a period: each is known relative to its own peak-to-peak."""
    assert force.spectrum is not None
    return force.spectrum.errors[0] * extent_and_peak(_series(force, highest))[0]


def _mean_friction(response: FrictionForce, solved: Preparation) -> Callable[[Array], Array]:
    """Return the mean of friction over a period (N) as a function of the load (N)."""
    from scipy.interpolate import CubicSpline

    low, high = solved.loads
    if low == high:
        level = response.mean(high)
        return lambda loads: np.full_like(loads, level)
    roots = np.linspace(0.0, np.cbrt(min(high, HEAVIEST_MEAN)), MEAN_LOADS)
    curve = CubicSpline(roots, [response.mean(float(root) ** 3) for root in roots])
    return lambda loads: np.asarray(curve(np.cbrt(loads)))


def _simulated_channel(solved: Preparation, law: Friction) -> AddedChannel:
    """Return the channel of a simulated force: its peak and error at the scan's own speed and load."""
    assert solved.effects is not None and solved.effects.simulation is not None
    plan = solved.effects.simulation
    direction = math.tanh(solved.scene.scan.speed / law.reversal_speed)
    runs = [Running(one, SIMULATED).along(0, plan.pilot.moved.shape[1]) for one in (plan.nominal, plan.finer)]
    coarse, fine = (slope + direction * law.friction_coefficient * pressed for slope, pressed in runs)
    extent, peak = float(np.ptp(fine)), float(np.max(np.abs(fine)))
    scale = law.full_scale or (peak / PEAK if peak > STILL else 1.0)
    error = 4.0 / 3.0 * float(np.max(np.abs(fine - coarse))) / extent if extent > 0.0 else 0.0
    return AddedChannel(QUANTITY, scale, extent, error + ROUNDING, "simulation")
