"""PLAN: what is simulated for a scene, what is left out, how z is computed, the reasons, the errors and the cost.

Stage   2 (PLAN), as data that a person can read.
Source  design, sections 2 and 5. The errors were measured while the response was solved. `costing` adds the cost.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, fields
from typing import TYPE_CHECKING, Any

from synth.plan.effect_choice import LeftOut
from synth.plan.preparation import Preparation
from synth.plan.request import N_MAX, harmonics_in_band
from synth.plan.simulated_parts import MOST_REPORTED, Simulated, simulated_parts
from synth.plan.warnings import plan_doubts
from synth.response.table_error import QUANTITIES
from synth.scene.effects_section import effect_names, unit_of
from synth.scene.output_section import BAND
from synth.scene.scene import scene_document

if TYPE_CHECKING:
    from synth.plan.direct_plan import DirectPlan
    from synth.plan.simulation_plan import SimulationPlan
    from synth.response.table import ResponseTable


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
        simulated=simulated_parts(solved),
        left_out=_left_out(solved),
        response=response_document(solved),
        estimated_error=errors,
        cost=None,
        warnings=warnings_of(solved),
    )


def warnings_of(solved: Preparation) -> tuple[str, ...]:
    """Return the warnings about a prepared scene, without the rest of its plan."""
    return (*solved.warnings, *plan_doubts(solved))


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


def response_document(solved: Preparation) -> dict[str, Any]:
    """Return how z is computed, the channels, and the simulation or the table if there is one."""
    spectrum, table, reach = solved.spectrum, solved.table, solved.reach if solved.moving else N_MAX
    held, scene = solved.highest if spectrum is not None else 0, solved.scene
    if spectrum is not None and solved.moving and solved.reads_series and not solved.live:
        reach = spectrum.highest
    if solved.direct is not None or solved.stretch is not None:  # every harmonic in the band is rendered
        held = reach = harmonics_in_band(scene, MOST_REPORTED)
    response: dict[str, Any] = {
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
    for one in () if solved.effects is None else solved.effects.called:
        if one.motion is not None:
            response["motion"] = dict(one.motion)
    plan = None if solved.effects is None else solved.effects.simulation
    if plan is not None:
        response["simulation"] = _simulation_document(plan, scene.output.sample_rate)
    if table is not None:
        response["table"] = _table_document(table) | {"error_loads": list(solved.reported_loads)}
    if solved.direct is not None:
        response |= _direct_documents(solved.direct)
    if solved.stretch is not None:
        response["stretch"] = {"begin": solved.stretch.begin, "length": solved.stretch.period}
    return response


def _simulation_document(plan: SimulationPlan, rate: int) -> dict[str, Any]:
    return {
        "steps_a_frame": plan.simulation.steps,
        "processor_seconds_a_second": plan.work,
        "delay_behind_a_hand_seconds": plan.simulation.filters.margin / rate,
        "changes": {QUANTITIES[order]: one for order, one in zip(plan.orders, plan.change, strict=True)},
    }


def _table_document(table: ResponseTable) -> dict[str, Any]:
    return {
        "hash": table.hash,
        "bytes": table.memory_bytes,
        "loads": len(table.loads),
        "levels": len(table.levels.highest),
        "covered_loads": list(table.covered),
    }


def _direct_documents(direct: DirectPlan) -> dict[str, Any]:
    """Return the parts of a voice that is solved directly: its solutions, and how it turns."""
    found: dict[str, Any] = {
        "direct": {
            "solutions_a_second": direct.rate,
            "processor_seconds_a_second": direct.work,
            "error_loads": [direct.loads[0], direct.loads[-1]],
            "error_speed": direct.fastest,
        }
    }
    if direct.turning is not None:
        found["turning"] = {
            "error": dict(zip(QUANTITIES, direct.turning, strict=True)),
            "processor_seconds_a_second": direct.work,
            "processor_seconds_a_radian": direct.radian_seconds,
        }
    return found


def _channels(solved: Preparation) -> list[dict[str, Any]]:
    """Return the channels of the response, then those that effects add."""
    added = {} if solved.effects is None else {one.quantity: one.method for one in solved.effects.channels}
    works = {} if solved.effects is None else {one.quantity: one.work for one in solved.effects.channels}
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
        | ({"processor_seconds_a_second": works[channel.quantity]} if works.get(channel.quantity) else {})
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
        return "direct solutions"
    if solved.spectrum.closed:
        return "closed form"
    return "harmonics"
