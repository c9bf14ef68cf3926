"""The dimensionless groups of the model: those of a contact, and a scene that has given ones.

Model   integral_0^tau max(A cos(2 pi X / Lambda - 2 pi theta + phi) - cos(2 pi X) - Z, 0) dX = W, with X = x / lambda1,
        Z = z / a1, tau = L / lambda1, Lambda = lambda2 / lambda1, A = a2 / a1, W = w / w*, w* = k a1 lambda1 / L.
        Four groups decide Z over the phase: scenes that share them have equal Z. The speed sets the time only.
Source  Fagiani & Barbieri (2016), eqs 6 and 7. The paper's text names tau; Lambda, A and W follow from eqs 2, 6 and 7.
Limits  a1 > 0, because the groups are relative to a1. The solver is relative to a1 + a2 and has no such limit.
"""

from __future__ import annotations

from dataclasses import dataclass

from synth.contact.geometry import Geometry
from synth.contact.stiffness import Stiffness
from synth.errors import Fault, SceneError, shown
from synth.scene.merge import merge_patch
from synth.scene.scene import Scene, parse_scene, scene_document
from synth.scene.texture_registry import DEFAULT

NAMES = ("ridges", "period_ratio", "amplitude_ratio", "load")
"""tau, Lambda, A and W, as `Groups` and `response.groups` of a plan have them."""


@dataclass(frozen=True, slots=True)
class Groups:
    """tau, Lambda, A and W of eq. 7."""

    ridges: float
    period_ratio: float
    amplitude_ratio: float
    load: float

    @classmethod
    def of_contact(cls, geometry: Geometry, stiffness: Stiffness, load: float) -> Groups | None:
        """Return the groups of a contact at `load` (N); None for a smooth finger (a1 = 0)."""
        a1 = geometry.ridge_amplitude
        if a1 == 0.0:
            return None
        tau = geometry.ridges
        return cls(
            ridges=tau,
            period_ratio=geometry.equivalent[1] / geometry.ridge_period,
            amplitude_ratio=geometry.equivalent[0] / a1,
            load=tau * stiffness.indentation(load) / a1,
        )

    @classmethod
    def of_scene(cls, scene: Scene) -> Groups | None:
        """Return the groups of `scene` at the load of its scan; None for a smooth finger."""
        return cls.of_contact(Geometry.of_scene(scene), Stiffness.of_scene(scene), max(scene.scan.load, 0.0))

    @property
    def numbers(self) -> tuple[float, float, float, float]:
        """The four groups, in the order of NAMES."""
        return self.ridges, self.period_ratio, self.amplitude_ratio, self.load


def with_groups(scene: Scene, groups: dict[str, float]) -> Scene:
    """Return `scene` with the given groups: with another contact length, period, amplitude and load.

    groups: some or all of NAMES, each above 0. Groups that are not given are kept as far as the scene keeps their
        fields; the load of the scan is changed only for a given `load`, which is met for the final surfaces.
    Raises SceneError for another name or number, for a smooth finger, and for another finger or texture than the
    paper's: ridges and a sinusoid.
    """
    _check(scene, groups)
    finger, patch = scene.finger, dict[str, dict[str, float]]()
    if "ridges" in groups:
        patch["finger"] = {"contact_length": groups["ridges"] * finger.ridge_period}
    texture = {}
    if "period_ratio" in groups:
        texture["period"] = groups["period_ratio"] * finger.ridge_period
    if "amplitude_ratio" in groups:
        texture["amplitude"] = groups["amplitude_ratio"] * finger.ridge_amplitude
    found = parse_scene(merge_patch(scene_document(scene), {**patch, **({"texture": texture} if texture else {})}))
    if "load" not in groups:
        return found
    law = Stiffness.of_scene(found)
    pressed = groups["load"] * finger.ridge_amplitude / Geometry.of_scene(found).ridges  # w / k, m
    load = (pressed / law.indentation(1.0)) ** (1.0 / law.load_exponent)
    return parse_scene(merge_patch(scene_document(found), {"scan": {"load": load}}))


def _check(scene: Scene, groups: dict[str, float]) -> None:
    faults = []
    for name, value in groups.items():
        if name not in NAMES:
            faults.append(Fault(f"/groups/{name}", shown(value), f"one of {', '.join(NAMES)}", "Check the name."))
        elif not isinstance(value, int | float) or not 0.0 < value < 1e12:
            hint = "Write a plain number such as 1.6: groups have no unit."
            faults.append(Fault(f"/groups/{name}", shown(value), "a number above 0", hint))
    if not scene.finger.traits.straight or scene.texture.kind != DEFAULT or scene.finger.ridge_amplitude == 0.0:
        hint = 'Write finger.kind "comb" with ridges, and texture.kind "sinusoid".'
        told = f"a {scene.finger.kind} on a {scene.texture.kind}"
        faults.append(Fault("/groups", told, "ridges on a sinusoid, of which the groups are", hint))
    if faults:
        raise SceneError(faults)
