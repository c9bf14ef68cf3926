"""Make or reuse the response table of a scene: its contact, in the shape that its effects give it, as one table.

Stage   2 (PLAN).
Model   A table depends on the finger, the texture, the effects that shape the contact, the lift load and the band. It
        does not depend on speed, quantity, duration, or a load within TableBounds. Scenes that differ only in these
        share a table.
Limits  The table does not contain effects with a memory (inertia, viscous skin, adhesion), which are simulated. A force
        that an effect adds has a separate table.
"""

from __future__ import annotations

import json
import math
from collections.abc import Hashable
from dataclasses import replace
from functools import cache, partial
from typing import TYPE_CHECKING, Any, TypeVar

from synth.contact.area_path import MIDDLE, Line
from synth.contact.geometry import Geometry
from synth.contact.scene_contact import contact_of
from synth.errors import Fault, SceneError
from synth.kept_files import FileEntry, FileForm
from synth.motion.scan_motion import ScanMotion
from synth.plan.effects_preparation import shape_for
from synth.plan.stretch import stretch_of
from synth.response.demand import Demand
from synth.response.reading_filter import ORDERS, reading_filter
from synth.response.table import ResponseTable
from synth.response.table_error import QUANTITIES
from synth.response.table_file import table_bytes, table_of_bytes
from synth.response.table_making import BOUNDS, TableBounds, make_table
from synth.response_cache import ResponseCache
from synth.scene.catalogue import catalogue
from synth.scene.line_scan import turned_on_line
from synth.scene.output_section import FULL_BAND
from synth.scene.scene import Scene, parse_scene, scene_document
from synth.scene.text import json_text
from synth.scene.texture_registry import default_textures

if TYPE_CHECKING:
    from synth.contact.forces import Response

RATE_SHARE = 0.35  # largest band of a table, as a part of the sample rate (mip levels end at 0.49)
USUAL_BAND = 1000.0  # Hz: tables of wider bands have proportionally more harmonics, in fewer rows
MOST_HARMONICS = 256  # of a table; more would leave too few rows of load
EXACT_BYTES = 128 << 20  # largest table made to a tolerance; that of the default scene takes 4 s and 7 MB
EXACT_PHASES, EXACT_PLACES = 16, 10.0  # per harmonic of such a table; with fewer, folding or images add 1e-3
ROWS_SHARE = 0.4  # part of the tolerance for the error between rows; folding and the images of places use the rest
TABLE_FORM = FileForm(".safetensors", table_bytes, table_of_bytes)
SHAPES_JUDGED = Demand(8, (0,), 1e-2)  # demand with which an effect on the shape set to "auto" is judged

T = TypeVar("T")


def table_of_scene(
    scene: Scene, bounds: TableBounds | None = None, cache: ResponseCache | None = None
) -> ResponseTable:
    """Return the table of `scene`. The same scene always gives the same hash.

    bounds: limits on the table's cost; None for those of `bounds_for`.
    cache: cache from which the table is taken if it is there, and in which a new one is kept.
    Raises SceneError if neither surface has a height, if the surface is too long for a table, and if the shape
    cannot be solved.
    """
    geometry = Geometry.of_scene(scene)
    if geometry.height_scale == 0.0:
        hint = "Give the texture or the finger a height."
        raise SceneError([Fault("/finger/ridge_amplitude", "0.0", "above 0 m where texture.amplitude is 0 m", hint)])
    chosen = bounds or bounds_for(scene)
    if stretch_of(scene, 1, 0) is not None:
        allowed = f"a surface of which {chosen.harmonics} harmonics of its period show the waves"
        hint = "A voice solves this surface directly, without a table. For a table write a shorter surface."
        raise SceneError([Fault("/texture", f"a period of {scene.texture.period:.4g} m", allowed, hint)])
    contact = contact_of(scene)
    if scene.effects:
        loads = (0.0, chosen.heaviest)
        turns, judged_to = scene.scan.speed / scene.texture.period, SHAPES_JUDGED.tolerance
        contact, _shapes = shape_for(contact, scene, SHAPES_JUDGED, loads, turns, judged_to)
    kept = _kept(contact, scene, ResponseCache() if cache is None else cache, chosen)
    return replace(kept, scene=_scene_text(scene))  # another scene with the same contact may have made the table


def kept_table(
    response: Response, scene: Scene, cache: ResponseCache, *, work: float = 1.0, tolerance: float | None = None
) -> ResponseTable:
    """Return the table of `response`, from `cache` if it was made before.

    response: a contact or a force of `scene`.
    work: permitted cost, relative to that of a contact's table.
    tolerance: tolerance to which the table is made, within EXACT_BYTES, however long that takes. None: the cost is
        limited so that a voice can wait for it.
    """
    bounds = bounds_for(scene)
    bounds = replace(bounds, work=work * bounds.work)
    if tolerance is not None:
        targets = (ROWS_SHARE * tolerance,) * 3
        bounds = replace(
            bounds, work=math.inf, nbytes=EXACT_BYTES, targets=targets, phases=EXACT_PHASES, places=EXACT_PLACES
        )
    return _kept(response, scene, cache, bounds)


def _kept(response: Response, scene: Scene, cache: ResponseCache, bounds: TableBounds) -> ResponseTable:
    period, band, lift_load = scene.texture.period, band_of(scene), scene.scan.lift_load
    make = partial(make_table, response, period=period, band=band, lift_load=lift_load, bounds=bounds)
    key = ("response table", response.key, period, band, lift_load, bounds)
    file = partial(entry_of, scene, response, (period, band, lift_load, bounds), TABLE_FORM)
    return cache.get(key, lambda: make(scene=_scene_text(scene)), file)


def entry_of(scene: Scene, response: Response, decided_by: Hashable, form: FileForm[T]) -> FileEntry[T] | None:
    """Return the entry of a result of `scene` among the files, or None if no file keeps it.

    Files keep results for an unchanged finger without effects. The texture must be one of the catalogue, an imported
    surface or a kind without fields, also unchanged; over an area, the line must be the middle one. Others are not
    kept, because moving a slider would fill the folder.

    response: the response of the result, which must be the whole contact of the scene.
    decided_by: numbers that determine the result, in addition to finger and texture.
    """
    document = scene_document(scene)
    if scene.effects or document["finger"] != _finger_document(scene.finger.kind):
        return None
    if Line(scene.scan.y, scene.scan.direction) != MIDDLE or turned_on_line(scene):
        return None
    cells = {name: getattr(response, name) for name in ("coarser", "refines") if hasattr(response, name)}
    if response.key != contact_of(scene, **cells).key:
        return None
    texture = _written(document["texture"])
    imported = {"kind": scene.texture.kind, "surface": scene.texture.surface}
    if texture not in _known_textures() and (
        scene.texture.surface is None or document["texture"] != _texture_document(imported)
    ):
        return None
    return FileEntry(f"{_scene_text(scene)} {form.ending} {cells!r} {decided_by!r}", form)


@cache
def _finger_document(kind: str) -> Any:
    return scene_document(parse_scene({"finger": {"kind": kind}}))["finger"]


def _texture_document(texture: dict[str, Any]) -> Any:
    return scene_document(parse_scene({"texture": texture}))["texture"]


@cache
def _known_textures() -> frozenset[bytes]:
    """Return the textures of the catalogue and of each kind without fields, as `entry_of` compares them."""
    named = [*(entry.document for entry in catalogue()), *default_textures()]
    return frozenset(_written(_texture_document(one["texture"])) for one in named)


def _written(texture: dict[str, Any]) -> bytes:
    """Return the section as text. It may hold a map of a megabyte, so it is written in pieces."""
    return json_text(dict(sorted(texture.items())))


def bounds_for(scene: Scene) -> TableBounds:
    """Return the limits of the table of `scene`. Rows cover the loads of its scan; a wide band has more harmonics."""
    heaviest = max(BOUNDS.heaviest, ScanMotion(scene, whole=True).recorded_loads()[1])
    wider = 1 << max(0, math.ceil(math.log2(band_of(scene) / USUAL_BAND)))
    return replace(BOUNDS, heaviest=heaviest, harmonics=min(MOST_HARMONICS, wider * BOUNDS.harmonics))


def read_error(table: ResponseTable, quantity: str, rate: int, loads: tuple[float, float], highest: int) -> float:
    """Return the error of reading `quantity` from the table, relative to its peak-to-peak.

    rate: frames per second.
    loads: smallest and largest load, N.
    highest: number of harmonics in the band.
    """
    name = QUANTITIES[ORDERS[quantity]]
    return table.error.over(loads, name, highest) + reading_filter(quantity, rate, table.band).error


def band_of(scene: Scene) -> float:
    """Return the frequency (Hz) up to which a table of `scene` has all components in full."""
    most = RATE_SHARE * scene.output.sample_rate
    return most if scene.output.bandwidth == FULL_BAND else min(scene.output.bandwidth_hz, most)


def _scene_text(scene: Scene) -> str:
    """Return the parts of the scene's document that determine its table, as JSON."""
    document = scene_document(scene)
    parts = {name: document[name] for name in ("finger", "texture", "effects") if name in document}
    return json.dumps(parts, sort_keys=True)
