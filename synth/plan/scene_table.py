"""The response table of a scene: its contact, in the shape that its effects ask for, as one table.

Stage   PLAN: the part that only those ask for who take the table elsewhere.
Model   What decides a table is the finger, the texture, the effects that shape the contact, the lift load and the band.
        Speed, load, rate, quantity and duration do not: scenes that differ in these have the same table.
Limits  effects with a memory (inertia, viscous skin, adhesion) and outputs that they add are not part of a table.
"""

from __future__ import annotations

import json

from synth.contact.balance import Contact
from synth.contact.geometry import Geometry
from synth.contact.stiffness import Stiffness
from synth.errors import CannotRender
from synth.plan.effects_preparation import shape_for
from synth.response.spectrum import Demand
from synth.response.table import ResponseTable
from synth.response.table_making import BOUNDS, TableBounds, make_table
from synth.scene.scene import Scene, scene_document

USUAL_BAND = 1000.0  # Hz: of a scene that names none; what skin feels ends there
RATE_SHARE = 0.35  # of the sample rate: the band of a scene that asks for all of it (levels end at 0.49)
SHAPES_JUDGED = Demand(8, (0,), 1e-2)  # by which "auto" decides whether a shape is called for


def table_of_scene(scene: Scene, bounds: TableBounds = BOUNDS) -> ResponseTable:
    """Return the table of `scene`; raises CannotRender where neither surface has a height."""
    geometry = Geometry.of_scene(scene)
    if geometry.height_scale == 0.0:
        raise CannotRender("Neither the finger nor the texture has a height: there is nothing to make a table of.")
    contact = Contact.of(geometry, Stiffness.of_scene(scene))
    if scene.effects:
        loads = (0.0, bounds.heaviest)
        contact, _shapes = shape_for(contact, scene, SHAPES_JUDGED, loads, scene.scan.speed / scene.texture.period)
    return make_table(
        contact,
        period=scene.texture.period,
        band=band_of(scene),
        lift_load=scene.scan.lift_load,
        bounds=bounds,
        scene=json.dumps(told_scene(scene), sort_keys=True),
    )


def band_of(scene: Scene) -> float:
    """Return the frequency (Hz) up to which a table of `scene` sounds in full."""
    asked, most = scene.output.bandwidth, RATE_SHARE * scene.output.sample_rate
    if isinstance(asked, str):
        return most
    return min(USUAL_BAND if asked is None else float(asked), most)


def told_scene(scene: Scene) -> dict[str, object]:
    """Return the parts of the scene's document that decide its table."""
    document = scene_document(scene)
    return {name: document[name] for name in ("finger", "texture", "effects") if name in document}
