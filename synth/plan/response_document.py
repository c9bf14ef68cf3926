"""PLAN: how z is computed, as the part `response` of a plan's JSON document.

Stage   2 (PLAN), read by `plan`.
Source  design, section 5.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from synth.plan.preparation import Preparation
from synth.plan.request import N_MAX, harmonics_in_band
from synth.plan.simulated_parts import MOST_REPORTED
from synth.response.table_error import QUANTITIES
from synth.scene.effects_section import unit_of

if TYPE_CHECKING:
    from synth.plan.direct_plan import DirectPlan
    from synth.plan.simulation_plan import SimulationPlan
    from synth.response.table import ResponseTable


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
