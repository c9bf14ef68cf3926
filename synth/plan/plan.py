"""PLAN: what is simulated for a scene, what is left out, the reasons, the errors and the cost.

Stage   2 (PLAN), as data that a person can read.
Source  design, sections 2 and 5. The errors were measured while the response was solved. `costing` adds the cost.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, fields
from typing import TYPE_CHECKING, Any

from synth.effects.effect import Price
from synth.plan.effect_choice import LeftOut
from synth.plan.preparation import Preparation
from synth.plan.request import N_MAX, harmonics_in_band
from synth.plan.scene_table import bounds_for
from synth.plan.warnings import plan_doubts
from synth.response.table_error import QUANTITIES
from synth.scene.effects_section import effect_names, unit_of
from synth.scene.output_section import BAND
from synth.scene.scene import scene_document

if TYPE_CHECKING:
    from synth.plan.simulation_plan import SimulationPlan

MOST_REPORTED = 1 << 40  # largest reported number of harmonics in the band: of a finger that hardly moves


@dataclass(frozen=True, slots=True)
class Simulated:
    """One thing that is simulated.

    name: its name.
    reason: why and how it is simulated, in sentences.
    settings: settings of an effect.
    price: cost of a voice of the default scene with only this effect, measured once on one machine. `Cost` has the cost
        of the present scene.
    """

    name: str
    reason: str
    settings: dict[str, Any] | None = None
    price: Price | None = None

    def document(self) -> dict[str, Any]:
        """Return it as a JSON object, without fields that are None."""
        return {name: value for name, value in asdict(self).items() if value is not None}


@dataclass(frozen=True, slots=True)
class Cost:
    """The cost of a scene on this machine.

    setup_seconds: time for the set-up of the scene.
    ns_per_frame: time per frame, ns.
    times_real_time: duration of the sound over the time to render it.
    memory_bytes: memory of a voice of the scene.
    process_seconds: start, imports and kernels of this process, once, before it can compute any scene. This time is not
        part of setup_seconds.
    compile_seconds: the part of process_seconds in which kernels were compiled. Only the first use compiles them.
    """

    setup_seconds: float
    ns_per_frame: float
    times_real_time: float
    memory_bytes: int
    process_seconds: float
    compile_seconds: float


@dataclass(frozen=True, slots=True, repr=False)
class Plan:
    """The plan of one scene.

    scene: complete document of the scene; empty in a plan without it.
    simulated: what is simulated, in the order in which it runs.
    left_out: what is not simulated.
    response: how z is computed.
    estimated_error: error of each quantity, relative to its peak-to-peak.
    cost: None until `costing` adds it.
    warnings: sentences.
    """

    scene: dict[str, Any]
    simulated: tuple[Simulated, ...]
    left_out: tuple[LeftOut, ...]
    response: dict[str, Any]
    estimated_error: dict[str, float]
    cost: Cost | None
    warnings: tuple[str, ...]

    def __repr__(self) -> str:
        parts = ", ".join(part.name for part in self.simulated) or "nothing"
        errors = ", ".join(f"{name} {error:.2g}" for name, error in self.estimated_error.items())
        return f"<Plan: {parts}; estimated error: {errors or 'none'}; warnings: {len(self.warnings)}>"

    def document(self) -> dict[str, Any]:
        """Return the plan as a JSON document (design, section 5)."""
        return {field.name: getattr(self, field.name) for field in fields(self)} | {
            "simulated": [part.document() for part in self.simulated],
            "left_out": [asdict(part) for part in self.left_out],
            "cost": None if self.cost is None else asdict(self.cost),
            "warnings": list(self.warnings),
        }


def plan_of(solved: Preparation, *, with_scene: bool = True) -> Plan:
    """Return the plan of a prepared scene, without its cost. with_scene: with its document, which may be large."""
    errors: dict[str, float] = {}
    for channel in solved.all_channels:
        errors[channel.quantity] = max(errors.get(channel.quantity, 0.0), channel.error)
    return Plan(
        scene=scene_document(solved.scene) if with_scene else {},
        simulated=_simulated(solved),
        left_out=_left_out(solved),
        response=_response(solved),
        estimated_error=errors,
        cost=None,
        warnings=warnings_of(solved),
    )


def warnings_of(solved: Preparation) -> tuple[str, ...]:
    """Return the warnings about a prepared scene, without the rest of its plan."""
    return (*solved.warnings, *plan_doubts(solved))


def _simulated(solved: Preparation) -> tuple[Simulated, ...]:
    """Return what is simulated, in the order in which it runs."""
    if solved.spectrum is None:
        return ()
    plan = None if solved.effects is None else solved.effects.simulation
    called = () if solved.effects is None else solved.effects.called
    own = [_simulation_part(solved, plan)] if plan is not None else _response_parts(solved)
    return (
        *own,
        *(
            Simulated(
                one.effect.name,
                f"{one.effect.reason(solved.scene, one.settings)} {one.reason}".strip(),
                one.settings.document(),
                one.effect.price,
            )
            for one in called
        ),
    )


def _simulation_part(solved: Preparation, plan: SimulationPlan) -> Simulated:
    steps = (
        f"z is simulated {plan.simulation.stepper.where}, with {plan.simulation.steps} steps per frame, and replaces "
        f"the response. This changes it by {max(plan.change):.2g} of its peak-to-peak."
    )
    if plan.work > 1.0:
        steps += f" A second of sound takes {plan.work:.2g} s of processor time."
    return Simulated("simulation", f"{steps} {_beginning(solved, plan)}")


def _beginning(solved: Preparation, plan: SimulationPlan) -> str:
    """Return a sentence on the state in which a simulation begins."""
    scan = solved.scene.scan
    if solved.by_hand:
        return "The simulation begins on the elastic contact and follows it."
    if scan.stroke is not None:
        return "The simulation begins at rest."
    if scan.trajectory is not None:
        return "The simulation begins on the elastic contact, where the finger comes down."
    if plan.simulation.steady is None or not scan.along_x:
        return f"The simulation begins on the elastic contact, {plan.simulation.settling:.2g} s before the first frame."
    if plan.pilot.repeats:
        return "The simulation begins in its periodic state: each texture period equals the first."
    return "The motion does not repeat with the texture. The error therefore includes the difference between periods."


def _response_parts(solved: Preparation) -> list[Simulated]:
    """Return the response at the scan's own speed and load, and the solved frames or table of a moving scan."""
    spectrum, frames, table, direct = solved.spectrum, solved.frames, solved.table, solved.direct
    scan = solved.scene.scan
    assert spectrum is not None
    how = "The load flattens the whole contact, so z is one sinusoid in closed form."
    if not spectrum.closed:
        how = (
            f"z is solved at {spectrum.phases} phases of the texture period ({spectrum.solver}) and kept "
            f"as {solved.highest} harmonics, for a tolerance of {solved.tolerance:.3g} of the peak-to-peak of each "
            "quantity."
        )
    if solved.stretch is not None:
        how += (
            f" The surface repeats after {solved.scene.texture.period:.4g} m only. Levels, errors and full scale are "
            f"those of a stretch of {solved.period:.4g} m, the roughest, from {solved.stretch.begin:.4g} m on. What is "
            "rendered is the whole surface."
        )
    parts = [Simulated("contact response", how)]
    varies = "A hand sets speed and load" if solved.by_hand else "The speed varies"
    if solved.stretch is not None and not solved.by_hand and not solved.load_varies:
        varies = "The surface is too long for a series"
    if not scan.along_x and not solved.by_hand:
        varies = "The surface moves on a path over the area"
    if solved.load_varies and not solved.by_hand:
        low, high = solved.loads
        varies = f"The load varies between {low:.4g} N and {high:.4g} N"
    if frames is not None:
        every = "per frame" if frames.stride == 1 else f"per {frames.stride} frames"
        parts.append(Simulated("solved frames", f"{varies}, and z is solved {frames.count} times {every}."))
    if table is not None:
        reason = (
            f"{varies}, so z is read from a table of {len(table.loads)} loads and {len(table.levels.highest)} levels, "
            f"up to {table.harmonics} harmonics and {table.covered[1]:.4g} N. A heavier load is read as that load."
        )
        parts.append(Simulated("response table", reason))
    if direct is not None:
        most = bounds_for(solved.scene).harmonics
        held = harmonics_in_band(solved.scene, MOST_REPORTED)
        why = f"{held} harmonics are in the band at the scan's own speed, more than the {most} of a table"
        if direct.turning is not None:
            why = "the finger may leave its line over the area and turn"
        if direct.table is not None:
            along, across = direct.table.places
            parts.append(
                Simulated(
                    "layered table",
                    f"In the finger's own direction z is read from a table of {along} x {across} places and "
                    f"{len(direct.table.loads)} loads, {1e-6 * direct.table.memory_bytes:.2g} MB. In any other "
                    "direction it is solved.",
                )
            )
        reason = (
            f"{varies}, and {why}. So z is solved along the motion, {direct.rate:.5g} times per "
            f"second, which takes {100.0 * direct.work:.2g} % of a processor. A load above {direct.heaviest:.4g} N is "
            "read as that load."
        )
        parts.append(Simulated("direct solutions", reason))
    return parts


def _left_out(solved: Preparation) -> tuple[LeftOut, ...]:
    output = solved.scene.output
    parts: list[LeftOut] = []
    if solved.spectrum is None:
        parts.append(LeftOut("contact response", solved.silence, None))
    elif output.bandwidth_hz < BAND * output.sample_rate:
        reason = f'output.bandwidth is {output.bandwidth_hz:.6g} Hz; "full" keeps the whole band of the sample rate.'
        parts.append(LeftOut("components above the band", reason, None))
    if solved.spectrum is not None and not solved.moving and not solved.simulated:
        parts.append(LeftOut("response table", "Speed and load are constant, so one series is enough.", None))
    parts += () if solved.effects is None else solved.effects.spared
    others = [name for name in effect_names() if name not in solved.scene.effects]
    return (*parts, *(LeftOut(name, "The scene does not call for it.", None) for name in others))


def _response(solved: Preparation) -> dict[str, Any]:
    """Return how z is computed, the channels, and the simulation or the table if there is one."""
    spectrum, table, reach = solved.spectrum, solved.table, solved.reach if solved.moving else N_MAX
    held, scene = solved.highest if spectrum is not None else 0, solved.scene
    if solved.direct is not None or solved.stretch is not None:  # every harmonic in the band is rendered
        held = reach = harmonics_in_band(scene, MOST_REPORTED)
    response = {
        "method": _method(solved),
        "solver": "" if spectrum is None else spectrum.solver,
        "tolerance": solved.tolerance,
        "fundamental_hz": abs(scene.scan.speed) / scene.texture.period,
        "harmonics": held,
        "n_max": reach if table is None else table.harmonics,
        "band_limit_hz": solved.scene.output.band_limit,
        "phases_solved": 0 if spectrum is None else spectrum.phases,
        "channels": _channels(solved),
    }
    plan = None if solved.effects is None else solved.effects.simulation
    if plan is not None:
        response["simulation"] = {
            "steps_a_frame": plan.simulation.steps,
            "processor_seconds_a_second": plan.work,
            "delay_behind_a_hand_seconds": plan.simulation.filters.margin / solved.scene.output.sample_rate,
            "changes": {QUANTITIES[order]: one for order, one in zip(plan.orders, plan.change, strict=True)},
        }
    if table is not None:
        response["table"] = {
            "hash": table.hash,
            "bytes": table.memory_bytes,
            "loads": len(table.loads),
            "levels": len(table.levels.highest),
            "covered_loads": list(table.covered),
            "error_loads": list(solved.reported_loads),
        }
    if solved.direct is not None:
        response["direct"] = {
            "solutions_a_second": solved.direct.rate,
            "processor_seconds_a_second": solved.direct.work,
            "error_loads": [solved.direct.loads[0], solved.direct.loads[-1]],
            "error_speed": solved.direct.fastest,
        }
        if solved.direct.table is not None:
            response["layered"] = {
                "places": list(solved.direct.table.places),
                "loads": len(solved.direct.table.loads),
                "bytes": solved.direct.table.memory_bytes,
            }
        if (turning := solved.direct.turning) is not None:
            response["turning"] = {
                "error": dict(zip(QUANTITIES, turning.errors, strict=True)),
                "processor_seconds_a_second": turning.work,
            }
    if solved.stretch is not None:
        response["stretch"] = {"begin": solved.stretch.begin, "length": solved.stretch.period}
    return response


def _channels(solved: Preparation) -> list[dict[str, Any]]:
    """Return the channels of the response, then those that effects add."""
    added = {} if solved.effects is None else {one.quantity: one.method for one in solved.effects.channels}
    readers = {
        channel.quantity: "simulation" if solved.simulated else "" if channel.reader is None else channel.reader.name
        for channel in solved.channels
    } | added
    return [
        {
            "quantity": channel.quantity,
            "unit": unit_of(channel.quantity),
            "full_scale": channel.full_scale,
            "peak_to_peak": channel.extent,
            "reader": readers[channel.quantity],
        }
        for channel in solved.all_channels
    ]


def _method(solved: Preparation) -> str:
    if solved.spectrum is None:
        return "silence"
    if solved.simulated:
        return "simulation"
    if solved.table is not None:
        return "response table"
    if solved.frames is not None:
        return "solved frames"
    if solved.direct is not None:
        return "direct solutions" if solved.direct.table is None else "layered table"
    if solved.spectrum.closed:
        return "closed form"
    return "harmonics"
