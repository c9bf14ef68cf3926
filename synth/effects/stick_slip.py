"""Friction that sticks and slips: the hand drags the skin on a spring, and it judders on glass, leather or rubber.

Kind    MOTION: moves the skin in place of the hand, and adds `friction_force`, the component along x of the surface,
        and with the components "xy" also `friction_force_y`, in newtons. See `motion.skin_drag` and
        `voice.friction_force`.
Model   m x'' + c x' + k x = k x_h + c x_h' - F: the fingertip hangs on the hand x_h by spring and damper. F is the
        force of a bristle, the shear of the skin at the contact, whose friction falls with speed from mu_s w to mu_d w.
        The place that touches, x less the bend of the bristle, takes the place of the hand in all that follows.
        Over an area both axes are dragged, each with its share of load and speed: along a straight line in any
        direction this is the same motion as along x.
        In contact, friction rises to `moisture_rise` times itself within `moisture_time`, and falls again off it.
        "auto" simulates it where sliding is unstable (`motion.stick_slip_onset`) at a speed that the scan or a hand
        may have, and where a finger that starts at rest does not come to slide. Where it is left out, the force is that
        of sliding.
Source  Bristle: LuGre, Canudas de Wit et al. (1995), with an elastic range, Dupont et al. (2002). Friction of surfaces,
        and every other number, is an unverified default; `SURFACES` has what is known. mu of 0.53 +- 0.21 in stick-slip
        on wet glass: Derler & Rotaru. Friction on glass rises within tens of seconds of contact: Adams et al. (2013),
        Dzidek et al. (2017).
Limits  One mass on one bristle; its force does not follow the slopes of the texture. The force is not limited to the
        band. On a path that bends, the two axes are coupled through their shares only.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np
from pydantic import Field

from synth.arrays import Array
from synth.effects.effect import MotionEffect, Price
from synth.motion.dragged_hand import DraggedHand
from synth.motion.moved_skin import SETTLING
from synth.motion.stick_slip_onset import dragged, fall_of_friction, most_damping, sticks_and_slips, unstable
from synth.scene.effects_section import AUTO
from synth.scene.finger_section import KINDS
from synth.scene.line_scan import as_written
from synth.scene.quantity import Dimension
from synth.scene.rules import Choice, Fields, Quantity, Refusal, refusal
from synth.scene.scene import Scene
from synth.scene.section import Section

if TYPE_CHECKING:
    from synth.plan.preparation import Preparation
    from synth.response_cache import ResponseCache
    from synth.voice.friction_force import FrictionStage

QUANTITIES = "friction_force", "friction_force_y"
COMPONENTS = "x", "xy"
SURFACES: Mapping[str, tuple[float, float, float]] = MappingProxyType({
    "skin": (0.9, 0.5, 0.01),
    "dry_glass": (1.1, 0.8, 0.02),
    "wet_glass": (0.8, 0.35, 0.01),
    "leather": (0.66, 0.45, 0.02),
    "rubber": (1.3, 0.9, 0.03),
    "silicone": (1.6, 1.1, 0.03),
})  # fmt: skip
"""mu_s, mu_d and v_s (m/s) of a finger on a surface: unverified defaults. Dry skin has a mu of about 0.5, moist skin
above 1 (Derler & Gerhardt, 2012). Wet glass: 0.53 +- 0.21 in stick-slip (Derler & Rotaru, 2013). Leather: mu_s of a
moist palm on suede (Buchholz et al., 1988). Rubber: mu_d on hoses (Seo et al., 2009). The others are general
knowledge."""
SPEEDS = 64  # speeds up to the largest at which "auto" looks for stick-slip
SLOWEST = 1e-2  # of v_s: the smallest of them


class StickSlipSettings(Section):
    """The fingertip, its friction, the moisture of the contact, and the full scale of the force."""

    surface: Annotated[str, Choice(tuple(SURFACES))] = Field(
        default="skin", description="Surface whose friction is taken where it is not given (unverified default)."
    )
    static_friction: Annotated[float | None, Quantity(Dimension.NONE, 0.01, 10.0)] = Field(
        default=None,
        description="Coefficient mu_s at rest; null: that of the surface, or mu_d if that is given and larger "
        "(unverified default).",
    )
    kinetic_friction: Annotated[float | None, Quantity(Dimension.NONE, 0.01, 10.0)] = Field(
        default=None,
        description="Coefficient mu_d of a fast finger; null: that of the surface, or mu_s if that is given and "
        "smaller (unverified default).",
    )
    stribeck_speed: Annotated[float | None, Quantity(Dimension.SPEED, 1e-5, 1.0)] = Field(
        default=None,
        description="Speed v_s at which friction falls from mu_s to mu_d; null: that of the surface (unverified "
        "default).",
    )
    mass: Annotated[float, Quantity(Dimension.MASS, 1e-6, 1.0)] = Field(
        default=1e-3, description="Mass m of the fingertip that moves along the surface (unverified default)."
    )
    damping: Annotated[float, Quantity(Dimension.DAMPING, 0.0, 1e3)] = Field(
        default=1.0, description="Damper c between fingertip and hand (unverified default)."
    )
    stiffness: Annotated[float, Quantity(Dimension.STIFFNESS, 1.0, 1e6)] = Field(
        default=1e3, description="Spring k between fingertip and hand (unverified default, 0.5 to 2 kN/m)."
    )
    bristle_stiffness: Annotated[float, Quantity(Dimension.STIFFNESS, 10.0, 1e8)] = Field(
        default=1e4, description="Stiffness sigma0 of the skin in shear (unverified default, 1 to 10 kN/m)."
    )
    bristle_damping: Annotated[float, Quantity(Dimension.DAMPING, 0.0, 1e3)] = Field(
        default=3.0, description="Damper sigma1 of the skin in shear, while it sticks (unverified default)."
    )
    moisture_rise: Annotated[float, Quantity(Dimension.NONE, 1.0, 20.0)] = Field(
        default=1.0,
        description="Factor by which friction rises in a lasting contact; 1: it does not (unverified default, several "
        "on glass).",
    )
    moisture_time: Annotated[float, Quantity(Dimension.TIME, 0.1, 1e4)] = Field(
        default=10.0, description="Time constant of this rise (unverified default, up to 20 s on glass)."
    )
    drying_time: Annotated[float, Quantity(Dimension.TIME, 0.1, 1e4)] = Field(
        default=100.0, description="Time constant of its fall while the finger is lifted (unverified default)."
    )
    components: Annotated[Literal["x", "xy"], Choice(COMPONENTS)] = Field(
        default="x", description="Components of the force along x and y of the surface, a channel each."
    )
    full_scale: Annotated[float | None, Quantity(Dimension.LOAD, 1e-12, 1e6)] = Field(
        default=None,
        description="Force that a sample of 1.0 stands for; null: the force at which the finger slips becomes 0.8, or "
        "the largest of a file if it is larger.",
    )

    @property
    def friction(self) -> tuple[float, float, float]:
        """Coefficients mu_s and mu_d, and v_s (m/s)."""
        static, kinetic, speed = SURFACES[self.surface]
        if self.static_friction is not None:
            static, kinetic = self.static_friction, min(kinetic, self.static_friction)
        if self.kinetic_friction is not None:
            static, kinetic = max(static, self.kinetic_friction), self.kinetic_friction
        return static, kinetic, speed if self.stribeck_speed is None else self.stribeck_speed

    @property
    def parameters(self) -> Array:
        """Parameters of `skin_drag`."""
        finger = self.mass, self.damping, self.stiffness, self.bristle_stiffness, self.bristle_damping
        slow = self.moisture_rise, 1.0 / self.moisture_time, 1.0 / self.drying_time
        return np.array([*finger, *self.friction, *slow])

    @classmethod
    def conflicts(cls, given: Fields) -> list[Refusal]:
        """Refuse friction that rises with speed."""
        static, kinetic = cls.value_of(given, "static_friction"), cls.value_of(given, "kinetic_friction")
        if static is None or kinetic is None or kinetic <= static:
            return []
        allowed = f"at least the kinetic friction, {kinetic:g}"
        return [refusal(["static_friction"], static, allowed, "Write a larger one, or reduce kinetic_friction.")]


class StickSlip(MotionEffect["Preparation"]):
    """The effect; see the module."""

    name = "stick_slip"
    summary = (
        "Friction that sticks and slips: the skin judders behind the hand, and its force is an additional channel."
    )
    settings = StickSlipSettings
    units: Mapping[str, str] = MappingProxyType(dict.fromkeys(QUANTITIES, "N"))
    fingers = tuple(KINDS)
    price = Price(490.0, 5_000_000)

    def reason(self, scene: Scene, settings: StickSlipSettings) -> str:
        """See `Effect`."""
        static, kinetic, speed = settings.friction
        return (
            f"The skin is dragged on a spring of {settings.stiffness:.4g} N/m by friction that falls from {static:.4g} "
            f"to {kinetic:.4g} of the load at {1e3 * speed:.4g} mm/s."
        )

    def mover(self, scene: Scene, settings: Any, *, by_hand: bool) -> DraggedHand | None:
        """See `MotionEffect`."""
        asked = StickSlipSettings() if settings == AUTO else settings
        if settings == AUTO and not _may_slip(scene, asked, by_hand=by_hand):
            return None
        return DraggedHand(tuple(asked.parameters.tolist()), scene.output.sample_rate)

    def told(self, scene: Scene, settings: StickSlipSettings, *, by_hand: bool) -> dict[str, Any]:
        """See `MotionEffect`."""
        scan = as_written(scene).scan
        p, load, speed = settings.parameters, max(scan.load, 0.0), abs(scan.speed)
        falls, most = fall_of_friction(p, load, speed), most_damping(p, load)
        slides = f"Sliding at {1e3 * speed:.4g} mm/s and {load:.4g} N is"
        onset = unstable(p, load, speed)
        document: dict[str, Any] = {
            "sliding_is_stable": not onset,
            "fall_of_friction": falls,
            "damping": settings.damping,
            "damping_above_which_every_speed_slides": most,
        }
        found = dragged(p, load, speed, scene.output.sample_rate).after(SETTLING + scene.output.duration)
        document |= {"frequency_hz": found.frequency, "slip_share": found.slip_share}
        document |= {"mean_force": found.force[0], "force_peak_to_peak": found.force[1], "error": found.error}
        document |= {"force_error": found.force_error, "place_error": found.place_error}
        how = f"{'unstable' if onset else 'stable'}: friction falls by {falls:.3g} N s/m, and the damper has "
        how += f"{settings.damping:.3g} N s/m."
        if falls > settings.damping and not onset:
            how += " The bristle bends before friction falls, which keeps it stable."
        if found.frequency > 0.0:
            how += " A finger that" if onset else " A finger that slides goes on sliding, but one that"
            how += f" starts at rest sticks and slips at {found.frequency:.3g} Hz and slips for "
            how += f"{100.0 * found.slip_share:.3g} % of the time, to {found.error:.1g}."
        return document | {"reason": f"{slides} {how}"}

    def channels(self, scene: Scene, settings: StickSlipSettings) -> tuple[str, ...]:
        """See `OutputEffect`."""
        return QUANTITIES[: len(settings.components)]

    def scales(self, settings: StickSlipSettings) -> tuple[float | None, ...]:
        """See `OutputEffect`."""
        return (settings.full_scale,) * len(settings.components)

    def scaled(self, settings: StickSlipSettings, full_scale: tuple[float | None, ...]) -> StickSlipSettings:
        """See `OutputEffect`."""
        return settings.model_copy(update={"full_scale": full_scale[0]})

    def prepare(self, solved: Preparation, settings: StickSlipSettings, cache: ResponseCache) -> FrictionStage:
        """See `OutputEffect`."""
        from synth.voice.friction_force import FrictionStage

        p, scan, output = settings.parameters, as_written(solved.scene).scan, solved.scene.output
        found = dragged(p, max(scan.load, 0.0), abs(scan.speed), output.sample_rate).after(SETTLING + output.duration)
        known, rise = (found.force[1], found.force_error), settings.moisture_rise
        return FrictionStage.of(solved, settings.friction, rise, self.scales(settings), QUANTITIES, known)


def _may_slip(scene: Scene, settings: StickSlipSettings, *, by_hand: bool) -> bool:
    """Return whether the finger sticks and slips at the speed of a scan, or at one that a hand may have."""
    scan, p = as_written(scene).scan, settings.parameters
    loads = [point[-1] for point in scan.trajectory] if scan.trajectory is not None else [scan.load]
    if scan.stroke is not None:
        loads = [scan.stroke.load]
    if not by_hand and scan.trajectory is None and scan.stroke is None:
        return sticks_and_slips(p, max(loads[0], 0.0), scan.speed, scene.output.sample_rate)
    slow = settings.friction[2]
    fastest = 3.0 * slow if by_hand else min(3.0 * slow, abs(scan.speed))
    if fastest == 0.0:
        return False
    speeds = np.geomspace(min(SLOWEST * slow, fastest), fastest, SPEEDS)
    return any(unstable(p, max(*loads, 0.0), float(speed)) for speed in speeds)


EFFECT = StickSlip()
