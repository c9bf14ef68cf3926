"""The contact that a scene describes, by its kind of finger.

Stage   CONTACT: the only place that knows which solver a kind of finger has.
"""

from __future__ import annotations

from synth.contact.area_path import Line
from synth.contact.geometry import Geometry
from synth.contact.load_balance import Contact
from synth.contact.stiffness import Stiffness
from synth.scene.finger_section import Finger
from synth.scene.scene import Scene
from synth.surfaces import met_by
from synth.surfaces.profile import Profile


def contact_of(scene: Scene, profile: Profile | None = None, coarser: float = 1.0, *, refines: bool = False) -> Contact:
    """Return the contact of `scene`, without effects. At least one of its surfaces must have a height.

    profile: a texture in place of that of the scene; the stiffness remains that of the scene.
    coarser: factor on the size of the cells over an area, and on the distances of the columns of a fingertip.
    refines: whether these become smaller where a tolerance requires it, as the segments along a line always do.

    Raises SceneError for a probe that is too flat.
    """
    finger, stiffness = scene.finger, Stiffness.of_scene(scene)
    geometry = Geometry.of_scene(scene) if profile is None else Geometry.of_surfaces(finger, met_by(scene, profile))
    line = Line(scene.scan.y, scene.scan.direction)
    over_area = geometry.over_area
    if finger.kind == "probe" and over_area:
        from synth.contact.tip_on_area import TipOnArea

        return TipOnArea.of(geometry, stiffness, scene.scan.load, line, coarser, refines)
    if finger.kind == "probe":
        from synth.contact.curved_contact import RoundContact

        return RoundContact.of(geometry, stiffness, finger.tip_radius)
    if finger.kind == "fingertip":
        return _fingertip(finger, geometry, stiffness, line, coarser, refines)
    if over_area:
        from synth.contact.area_contact import CombOnArea

        return CombOnArea(geometry, stiffness, line, coarser, refines)
    return Contact(geometry, stiffness)


def _fingertip(
    finger: Finger, geometry: Geometry, stiffness: Stiffness, line: Line, coarser: float, refines: bool
) -> Contact:
    """Return the contact of a fingertip. Scenes that differ only in scan, effects or output share its solver."""
    from synth.contact.fingertip import FingertipContact
    from synth.surfaces.ridge_field import RidgeField

    field = RidgeField(
        period=finger.ridge_period,
        amplitude=finger.ridge_amplitude,
        pattern=finger.pattern or "loop",
        spacing_spread=finger.spacing_spread or 0.0,
        direction_spread=finger.direction_spread or 0.0,
        height_spread=finger.height_spread or 0.0,
        seed=finger.seed or 0,
    )
    return FingertipContact.of_field(geometry, stiffness, field, finger.width, line, coarser, refines)
