"""PLAN: what is simulated for a scene, what is left out, the reasons, the errors and the cost.

Stage   2 (PLAN), as data that a person can read.
Source  design, sections 2 and 5. The errors were measured while the response was solved. `costing` adds the cost.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, fields
from typing import Any

from synth.plan.effect_choice import LeftOut
from synth.plan.preparation import Preparation
from synth.plan.response_document import response_document
from synth.plan.simulated_parts import Simulated, simulated_parts
from synth.plan.warnings import plan_doubts
from synth.scene.effects_section import effect_names
from synth.scene.output_section import BAND
from synth.scene.scene import scene_document


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
