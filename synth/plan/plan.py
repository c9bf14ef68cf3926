"""PLAN: what will be simulated for a scene, in order, each with its reason, cost and error; and what is left out and
why.

Stage   2 (PLAN), as data that a person can read.
Source  design, sections 2 and 5. Errors are those measured while the response was built; `costing` adds the cost.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, fields
from typing import TYPE_CHECKING, Any

from synth.effects.effect import Price
from synth.plan.channels import UNITS
from synth.plan.effect_choice import LeftOut
from synth.plan.preparation import Preparation
from synth.plan.request import N_MAX
from synth.plan.warnings import plan_doubts
from synth.response.table_error import QUANTITIES
from synth.scene.effects_section import effect_names, unit_of
from synth.scene.output_section import BAND
from synth.scene.scene import scene_document

if TYPE_CHECKING:
    from synth.plan.simulation_plan import SimulationPlan


@dataclass(frozen=True, slots=True)
class Simulated:
    """One thing that is simulated: its name and the reason, as sentences; an effect also has its settings and price.

    price: of a voice with this effect alone in the default scene, measured once on one machine; `Cost` is this scene's.
    """

    name: str
    reason: str
    settings: dict[str, Any] | None = None
    price: Price | None = None

    def document(self) -> dict[str, Any]:
        """Return it as JSON."""
        return {name: value for name, value in asdict(self).items() if value is not None}


@dataclass(frozen=True, slots=True)
class Cost:
    """What a scene costs on this machine.

    process_seconds: what this process took once before it could compute any scene, on top of setup_seconds: start,
    imports, and kernels. compile_seconds: the part of it in which kernels were compiled, as only a first use does.
    """

    setup_seconds: float
    ns_per_frame: float
    times_real_time: float
    memory_bytes: int
    process_seconds: float
    compile_seconds: float


@dataclass(frozen=True, slots=True)
class Plan:
    """The plan of one scene; `document` is its JSON."""

    scene: dict[str, Any]
    simulated: tuple[Simulated, ...]
    left_out: tuple[LeftOut, ...]
    response: dict[str, Any]
    estimated_error: dict[str, float]
    cost: Cost | None
    warnings: tuple[str, ...]

    def document(self) -> dict[str, Any]:
        """Return the plan as a JSON document (design, section 5)."""
        return {field.name: getattr(self, field.name) for field in fields(self)} | {
            "simulated": [part.document() for part in self.simulated],
            "left_out": [asdict(part) for part in self.left_out],
            "cost": None if self.cost is None else asdict(self.cost),
            "warnings": list(self.warnings),
        }


def plan_of(solved: Preparation) -> Plan:
    """Return the plan of what was prepared, without a cost."""
    errors: dict[str, float] = {}
    for channel in solved.all_channels:
        errors[channel.quantity] = max(errors.get(channel.quantity, 0.0), channel.error)
    return Plan(
        scene=scene_document(solved.scene),
        simulated=_simulated(solved),
        left_out=_left_out(solved),
        response=_response(solved),
        estimated_error=errors,
        cost=None,
        warnings=(*solved.warnings, *plan_doubts(solved)),
    )


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
        f"z is simulated {plan.simulation.steps} steps a frame, in the place of the response, since that changes it by "
        f"{max(plan.change):.2g} of its peak-to-peak."
    )
    if plan.work > 1.0:
        steps += f" A second of sound takes {plan.work:.2g} s of a processor."
    return Simulated("simulation", f"{steps} {_beginning(solved, plan)}")


def _beginning(solved: Preparation, plan: SimulationPlan) -> str:
    """Return in which state a simulation begins, as a sentence."""
    scan = solved.scene.scan
    if solved.by_hand:
        return "It begins on the elastic contact, following it."
    if scan.stroke is not None:
        return "It begins at rest."
    if scan.trajectory is not None:
        return "It begins where the finger comes down, on the elastic contact."
    if plan.simulation.steady is None:
        return f"It begins {plan.simulation.settling:.2g} s ahead, on the elastic contact."
    if plan.pilot.repeats:
        return "It begins in its periodic state: each texture period is like the first."
    return "The motion does not repeat with the texture, so the error counts by how much its periods differ."


def _response_parts(solved: Preparation) -> list[Simulated]:
    """Return the response at the scan's own speed and load, and what follows a motion where they vary."""
    spectrum, frames, table = solved.spectrum, solved.frames, solved.table
    assert spectrum is not None
    how = "The load flattens the whole contact, so z is one sinusoid in closed form."
    if not spectrum.closed:
        how = (
            f"z is solved at {spectrum.phases} phases of the texture period ({spectrum.solver}) and kept "
            f"as {solved.highest} harmonics, so that each output quantity keeps {solved.tolerance:.3g} of its "
            "peak-to-peak."
        )
    parts = [Simulated("contact response", how)]
    varies = "A hand moves and presses as it likes" if solved.by_hand else "The speed varies"
    if solved.load_varies and not solved.by_hand:
        low, high = solved.loads
        varies = f"The load varies between {low:.4g} N and {high:.4g} N"
    if frames is not None:
        every = "a frame" if frames.stride == 1 else f"in {frames.stride} frames"
        parts.append(Simulated("solved frames", f"{varies}, and z is solved {frames.count} times {every}."))
    if table is not None:
        reason = (
            f"{varies}, so z is read from a table of {len(table.loads)} loads and {len(table.levels.highest)} levels, "
            f"up to {table.harmonics} harmonics and {table.covered[1]:.4g} N; a heavier load is read as that."
        )
        parts.append(Simulated("response table", reason))
    return parts


def _left_out(solved: Preparation) -> tuple[LeftOut, ...]:
    output = solved.scene.output
    parts: list[LeftOut] = []
    if solved.spectrum is None:
        parts.append(LeftOut("contact response", solved.silence, None))
    elif output.bandwidth_hz < BAND * output.sample_rate:
        reason = f'output.bandwidth is {output.bandwidth_hz:.6g} Hz; "full" keeps what the sample rate holds.'
        parts.append(LeftOut("components above the band", reason, None))
    if solved.spectrum is not None and not solved.moving and not solved.simulated:
        parts.append(LeftOut("response table", "Neither speed nor load varies: one series serves.", None))
    parts += () if solved.effects is None else solved.effects.spared
    others = [name for name in effect_names() if name not in solved.scene.effects]
    return (*parts, *(LeftOut(name, "The scene does not call for it.", None) for name in others))


def _response(solved: Preparation) -> dict[str, Any]:
    """Return how the response is found, with its channels, and the simulation and the table where there are any."""
    spectrum, table, reach = solved.spectrum, solved.table, solved.reach if solved.moving else N_MAX
    told = {
        "method": _method(solved),
        "solver": "" if spectrum is None else spectrum.solver,
        "tolerance": solved.tolerance,
        "fundamental_hz": abs(solved.turns),
        "harmonics": solved.highest if spectrum is not None else 0,
        "n_max": reach if table is None else table.harmonics,
        "band_limit_hz": solved.scene.output.band_limit,
        "phases_solved": 0 if spectrum is None else spectrum.phases,
        "channels": _channels(solved),
    }
    plan = None if solved.effects is None else solved.effects.simulation
    if plan is not None:
        told["simulation"] = {
            "steps_a_frame": plan.simulation.steps,
            "processor_seconds_a_second": plan.work,
            "delay_behind_a_hand_seconds": plan.simulation.filters.margin / solved.scene.output.sample_rate,
            "changes": {QUANTITIES[order]: one for order, one in zip(plan.orders, plan.change, strict=True)},
        }
    if table is not None:
        told["table"] = {
            "hash": table.hash,
            "bytes": table.memory_bytes,
            "loads": len(table.loads),
            "levels": len(table.levels.highest),
            "covered_loads": list(table.covered),
            "error_loads": list(solved.told_loads),
        }
    return told


def _channels(solved: Preparation) -> list[dict[str, Any]]:
    """Return the channels of the response and those that effects add."""
    added = {} if solved.effects is None else {one.quantity: one.method for one in solved.effects.channels}
    readers = {
        channel.quantity: "simulation" if solved.simulated else "" if channel.reader is None else channel.reader.name
        for channel in solved.channels
    } | added
    return [
        {
            "quantity": channel.quantity,
            "unit": UNITS.get(channel.quantity) or unit_of(channel.quantity),
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
    if solved.spectrum.closed:
        return "closed form"
    return "harmonics"
