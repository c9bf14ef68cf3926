"""PLAN: the parts that are simulated for a scene, in order, each with its reason in sentences.

Stage   2 (PLAN), read by `plan`.
Source  design, sections 2 and 5.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

from synth.effects.effect import Price
from synth.motion.moved_skin import mover_of
from synth.plan.preparation import Preparation
from synth.plan.request import harmonics_in_band
from synth.plan.scene_series import series_tolerance
from synth.plan.scene_table import bounds_for
from synth.surfaces.heightmap import synthetic_words

if TYPE_CHECKING:
    from synth.plan.direct_plan import DirectPlan
    from synth.plan.simulation_plan import SimulationPlan
    from synth.response.table import ResponseTable

MOST_REPORTED = 1 << 40  # largest reported number of harmonics in the band: of a finger that hardly moves


@dataclass(frozen=True, slots=True)
class Simulated:
    """One thing that is simulated.

    name: its name.
    reason: why and how it is simulated, in sentences.
    settings: settings of an effect.
    price: cost of a voice of the default scene along a stroke with only this effect, measured once on one machine.
        `Cost` has the cost of the present scene.
    """

    name: str
    reason: str
    settings: dict[str, Any] | None = None
    price: Price | None = None

    def document(self) -> dict[str, Any]:
        """Return it as a JSON object, without fields that are None."""
        return {name: value for name, value in asdict(self).items() if value is not None}


def simulated_parts(solved: Preparation) -> tuple[Simulated, ...]:
    """Return what is simulated, in the order in which it runs."""
    if solved.spectrum is None and solved.effects is None:
        return ()
    plan = None if solved.effects is None else solved.effects.simulation
    called = () if solved.effects is None else solved.effects.called
    own = [_simulation_part(solved, plan)] if plan is not None else []
    if plan is None and solved.spectrum is not None:
        own = _response_parts(solved)
    return (
        *_synthetic_parts(solved),
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


def _synthetic_parts(solved: Preparation) -> list[Simulated]:
    """Return the waves of the texture that nobody measured, if it has any."""
    words = synthetic_words(solved.scene.texture.values())
    return [Simulated("synthetic waves", words)] if words else []


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
    if plan.of_series:
        return "The simulation begins in its periodic state: each texture period equals the first."
    begins = f"The simulation begins on the elastic contact, {plan.simulation.settling:.2g} s before the first frame."
    if plan.pilot.repeats or not scan.along_x:
        return begins
    return f"{begins} The motion does not repeat with the texture: the error includes the difference between its parts."


def _response_parts(solved: Preparation) -> list[Simulated]:
    """Return the response at the scan's own speed and load, and the solved frames or table of a moving scan."""
    parts, varies = [Simulated("contact response", _series_words(solved))], _varying(solved)
    if (frames := solved.frames) is not None:
        every = "per frame" if frames.stride == 1 else f"per {frames.stride} frames"
        parts.append(Simulated("solved frames", f"{varies}, and z is solved {frames.count} times {every}."))
    if solved.table is not None:
        parts.append(_table_part(solved.table, varies))
    if (direct := solved.direct) is not None:
        parts.append(_direct_part(solved, direct, varies))
    return parts


def _series_words(solved: Preparation) -> str:
    """Return how the response at the scan's own speed and load is solved."""
    spectrum = solved.spectrum
    assert spectrum is not None
    how = "The load flattens the whole contact, so z is one sinusoid in closed form."
    if not spectrum.closed:
        tolerance = series_tolerance(solved, solved.tolerance)
        how = (
            f"z is solved at {spectrum.phases} phases of the texture period ({spectrum.solver}) and kept as "
            f"{solved.highest} harmonics, for a tolerance of {tolerance:.3g} of the peak-to-peak of each quantity."
        )
    if solved.stretch is not None:
        how += (
            f" The surface repeats after {solved.scene.texture.period:.4g} m only. Levels, errors and full scale are "
            f"those of a stretch of {solved.period:.4g} m, the roughest, from {solved.stretch.begin:.4g} m on. What is "
            "rendered is the whole surface."
        )
    return how


def _varying(solved: Preparation) -> str:
    """Return why one series does not give the samples of a moving scan."""
    if solved.by_hand:
        return "A hand sets speed and load"
    if solved.load_varies:
        low, high = solved.loads
        return f"The load varies between {low:.4g} N and {high:.4g} N"
    if not solved.scene.scan.along_x:
        return "The surface moves on a path over the area"
    if mover_of(solved.scene) is not None:
        return "The skin does not move with the hand"
    return "The speed varies" if solved.stretch is None else "The surface is too long for a series"


def _table_part(table: ResponseTable, varies: str) -> Simulated:
    reason = (
        f"{varies}, so z is read from a table of {len(table.loads)} loads and {len(table.levels.highest)} levels, "
        f"up to {table.harmonics} harmonics and {table.covered[1]:.4g} N. A heavier load is read as that load."
    )
    return Simulated("response table", reason)


def _direct_part(solved: Preparation, direct: DirectPlan, varies: str) -> Simulated:
    why = "the finger may leave its line over the area and turn"
    if direct.turning is None:
        held = harmonics_in_band(solved.scene, MOST_REPORTED)
        most = bounds_for(solved.scene).harmonics
        why = f"{held} harmonics are in the band at the scan's own speed, more than the {most} of a table"
    reason = (
        f"{varies}, and {why}. So z is solved along the motion, {direct.rate:.5g} times per second, which takes "
        f"{100.0 * direct.work:.2g} % of a processor. A load above {direct.heaviest:.4g} N is read as that load."
    )
    if direct.radian_seconds > 0.0:
        reason += f" A finger that turns into new directions takes {direct.radian_seconds:.2g} s more for each radian."
    return Simulated("direct solutions", reason)
