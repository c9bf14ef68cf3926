"""PLAN: what will be simulated for a scene, in order, each with its reason, cost and error; and what is left out and
why.

Stage   2 (PLAN), as data that a person can read.
Source  design, sections 2 and 5. Errors are those measured while the response was built; `costing` adds the cost.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

from synth.effects.effect import Price
from synth.plan.channels import UNITS, ChannelPlan
from synth.plan.effects_preparation import QUANTITIES
from synth.plan.frame_plan import FramePlan
from synth.plan.preparation import N_MAX, Preparation
from synth.plan.warnings import plan_doubts
from synth.response.load_rows import Rows
from synth.response.steady import SteadyHarmonics
from synth.scene.effect_registry import effect_names, unit_of
from synth.scene.output_section import BAND
from synth.scene.scene import scene_document

if TYPE_CHECKING:
    from synth.plan.simulation_plan import SimulationPlan

FRAME_ERROR = 1e-7  # of solved frames: the filter's, and the rounding to float32
NEARLY = 1.05  # times the tolerance: less than this is not worth a warning, since the error is itself an estimate


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
        settings = {} if self.settings is None else {"settings": self.settings}
        price = {} if self.price is None else {"price": asdict(self.price)}
        return {"name": self.name, "reason": self.reason} | settings | price


@dataclass(frozen=True, slots=True)
class LeftOut:
    """One thing that is not simulated: why, and how much of the output it would change (relative, or None: nothing)."""

    name: str
    reason: str
    effect_on_output: float | None


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
        cost = self.cost
        return {
            "scene": self.scene,
            "simulated": [part.document() for part in self.simulated],
            "left_out": [
                {"name": part.name, "reason": part.reason, "effect_on_output": part.effect_on_output}
                for part in self.left_out
            ],
            "response": self.response,
            "estimated_error": self.estimated_error,
            "cost": None if cost is None else asdict(cost),
            "warnings": list(self.warnings),
        }  # fmt: skip


def plan_of(solved: Preparation, rows: Rows | None = None, *, framed: bool = False) -> Plan:
    """Return the plan of what was prepared, without a cost.

    rows: those of a voice whose load varies. framed: the voice solves its frames, as `solved.frames` says.
    """
    frames = solved.frames if framed else None
    errors: dict[str, float] = {}
    for added in () if solved.effects is None else solved.effects.channels:
        errors[added.quantity] = max(errors.get(added.quantity, 0.0), added.error)
    for channel in solved.channels:
        error = channel.error + _row_error(solved, channel, rows)
        if frames is not None:
            error = frames.errors[solved.demand().orders.index(channel.order)] + FRAME_ERROR
        errors[channel.quantity] = max(errors.get(channel.quantity, 0.0), error)
    response = _response(solved)
    if rows is not None:
        response["rows"] = len(rows.edges)
    if frames is not None:
        response |= {"method": "solved frames", "solutions_a_frame": frames.oversampling}
    return Plan(
        scene=scene_document(solved.scene),
        simulated=_simulated(solved, frames),
        left_out=_left_out(solved, frames),
        response=response,
        estimated_error=errors,
        cost=None,
        warnings=(*solved.warnings, *_row_warnings(solved, rows), *plan_doubts(solved)),
    )


def _row_error(solved: Preparation, channel: ChannelPlan, rows: Rows | None) -> float:
    """Return what rows of load add to a channel's error, relative to the peak-to-peak of the quantity at that load."""
    if rows is None or solved.spectrum is None or channel.order not in rows.demand.orders:
        return 0.0
    place = rows.demand.orders.index(channel.order)
    return max(0.0, rows.errors[place] + rows.row_error[place] - solved.spectrum.errors[place])


def _row_warnings(solved: Preparation, rows: Rows | None) -> tuple[str, ...]:
    if rows is None:
        return ()
    late = {channel.quantity: channel.error + _row_error(solved, channel, rows) for channel in solved.channels}
    found = []
    for channel in solved.channels:
        error = late[channel.quantity]
        if error > NEARLY * solved.tolerance and channel.order in rows.demand.orders:
            low, high = rows.worst_loads(channel.order)
            found.append(
                f"Where the load varies the {channel.quantity} may err by {error:.2g} of its peak-to-peak, not the "
                f"{solved.tolerance:.2g} asked for: rows of load reach no further. That is at loads between "
                f"{low:.4g} N and {high:.4g} N; elsewhere it errs less, and least at the load of the scan."
            )
    return tuple(dict.fromkeys(found))


def _simulated(solved: Preparation, frames: FramePlan | None) -> tuple[Simulated, ...]:
    if solved.spectrum is None:
        return ()
    response = () if solved.simulated else _response_parts(solved, frames)
    return (*response, *_simulation_part(solved), *_effect_parts(solved))


def _simulation_part(solved: Preparation) -> tuple[Simulated, ...]:
    plan = None if solved.effects is None else solved.effects.simulation
    if plan is None:
        return ()
    part = max(plan.change)
    place = (
        f"added to the response, since it changes it by {part:.2g} of its peak-to-peak only"
        if plan.added
        else f"in the place of the response, since it changes it by {part:.2g} of its peak-to-peak"
    )
    steps = f"z is simulated {plan.simulation.steps} steps a frame, {place}."
    if plan.work > 1.0:
        steps += f" A second of sound takes {plan.work:.2g} s of a processor."
    return (Simulated("simulation", f"{steps} {_beginning(solved, plan)}"),)


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
    if plan.repeats:
        return "It begins in its periodic state: each texture period is like the first."
    return "The motion does not repeat with the texture, so the error counts by how much its periods differ."


def _effect_parts(solved: Preparation) -> tuple[Simulated, ...]:
    """Return the effects that are simulated, in the order in which they run."""
    if solved.effects is None:
        return ()
    return tuple(
        Simulated(
            one.effect.name,
            f"{one.effect.reason(solved.scene, one.settings)} {one.reason}".strip(),
            one.settings.document(),
            one.effect.price,
        )
        for one in solved.effects.called
    )


def _response_parts(solved: Preparation, frames: FramePlan | None) -> tuple[Simulated, ...]:
    assert solved.spectrum is not None
    if frames is not None:
        reason = (
            f"The load varies, and z is solved {frames.oversampling} times a frame: for this recording that is cheaper "
            f"than rows of load, or holds {solved.tolerance:.3g} where they would not."
        )
        return (Simulated("solved frames", reason),)
    if solved.spectrum.closed:
        reason = "The load flattens the whole contact, so z is one sinusoid in closed form."
    else:
        reason = (
            f"z is solved at {solved.spectrum.phases} phases of the texture period ({solved.spectrum.solver}) and kept "
            f"as {solved.highest} harmonics, so that each output quantity keeps {solved.tolerance:.3g} of "
            "its peak-to-peak."
        )
    parts = [Simulated("contact response", reason)]
    if solved.load_varies:
        low, high = solved.loads
        varies = f"The load varies between {low:.4g} N and {high:.4g} N."
        parts.append(Simulated("rows of load", "A hand presses as it likes." if solved.by_hand else varies))
    if solved.moving:
        parts.append(Simulated("levels", "The speed varies, so the band limit follows the instantaneous frequency."))
    return tuple(parts)


def _left_out(solved: Preparation, frames: FramePlan | None) -> tuple[LeftOut, ...]:
    spared = () if solved.effects is None else solved.effects.spared
    effects = tuple(LeftOut(one.name, one.reason, one.change) for one in spared)
    effects += tuple(
        LeftOut(name, "The scene does not call for it.", None)
        for name in effect_names()
        if name not in solved.scene.effects
    )
    if solved.spectrum is None:
        return (LeftOut("contact response", solved.silence, None), *effects)
    effects = (*_above_the_band(solved), *effects)
    if solved.simulated:
        return effects
    if frames is not None:
        return (LeftOut("rows of load", "Every frame is solved by itself.", None), *effects)
    parts = []
    if not solved.load_varies:
        parts.append(LeftOut("rows of load", f"The load stays at {solved.loads[0]:.4g} N.", None))
    if not solved.moving:
        parts.append(LeftOut("levels", "The speed does not vary: one band limit serves.", None))
    return (*parts, *effects)


def _above_the_band(solved: Preparation) -> tuple[LeftOut, ...]:
    output = solved.scene.output
    if output.bandwidth_hz >= BAND * output.sample_rate:
        return ()
    reason = f'output.bandwidth is {output.bandwidth_hz:.6g} Hz; "full" keeps what the sample rate holds.'
    return (LeftOut("components above the band", reason, None),)


def _response(solved: Preparation) -> dict[str, Any]:
    spectrum = solved.spectrum
    return {
        "method": _method(solved),
        "solver": "" if spectrum is None else spectrum.solver,
        "tolerance": solved.tolerance,
        "fundamental_hz": abs(solved.turns),
        "harmonics": solved.highest if spectrum is not None else 0,
        "n_max": solved.reach if solved.moving else N_MAX,
        "band_limit_hz": solved.scene.output.band_limit,
        "phases_solved": 0 if spectrum is None else spectrum.phases,
        "channels": [
            {
                "quantity": channel.quantity,
                "unit": UNITS[channel.quantity],
                "full_scale": channel.full_scale,
                "peak_to_peak": channel.extent,
                "reader": "simulation" if solved.simulated else "" if channel.reader is None else channel.reader.name,
            }
            for channel in solved.channels
        ] + _added_channels(solved),
    } | _simulation(solved)  # fmt: skip


def _added_channels(solved: Preparation) -> list[dict[str, Any]]:
    return [
        {
            "quantity": channel.quantity,
            "unit": unit_of(channel.quantity),
            "full_scale": channel.full_scale,
            "peak_to_peak": channel.extent,
            "reader": channel.method,
        }
        for channel in (() if solved.effects is None else solved.effects.channels)
    ]


def _simulation(solved: Preparation) -> dict[str, Any]:
    """Return how effects on the balance are simulated, if there are any."""
    plan = None if solved.effects is None else solved.effects.simulation
    if plan is None:
        return {}
    rate = solved.scene.output.sample_rate
    return {
        "simulation": {
            "takes_the_place_of_the_response": not plan.added,
            "steps_a_frame": plan.simulation.steps,
            "processor_seconds_a_second": plan.work,
            "delay_behind_a_hand_seconds": plan.simulation.filters.margin / rate,
            "changes": {name: one for name, one in zip(map(QUANTITIES.get, plan.orders), plan.change, strict=True)},
        }
    }


def _method(solved: Preparation) -> str:
    if solved.spectrum is None:
        return "silence"
    if solved.simulated:
        return "simulation"
    if solved.spectrum.closed:
        return "closed form"
    if solved.load_varies:
        return "rows of load"
    readers = [channel.reader for channel in solved.channels]
    return "harmonics" if all(isinstance(reader, SteadyHarmonics) for reader in readers) else "phase table"
