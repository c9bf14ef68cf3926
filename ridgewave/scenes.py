"""Renders, explains and opens a scene, with changes to its fields.

The changes are a partial scene. `synth.scene.merge` merges them like a PATCH request (RFC 7396); a field also removes
the fields that it excludes. The result is then checked.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from service.store.own_textures import own_store, texture_named, with_imported
from service.store.store import StoredTexture
from synth.scene.catalogue import CatalogueEntry, catalogue
from synth.scene.merge import merge_patch
from synth.scene.scene import Scene, SceneLike, document_of, parse_scene, scene_document

if TYPE_CHECKING:
    from synth.encode.sound import Sound
    from synth.plan.plan import Plan
    from synth.voice.voice import Voice


def changed(scene: SceneLike, fields: Mapping[str, Any]) -> Scene:
    """Return `scene` with the sections of the partial scene `fields` merged into it.

    scene: a Scene, a mapping as in docs/scene.md, the path of a JSON file, or a texture's name.
    Raises SceneError, which lists every fault; OSError if a file cannot be read.
    """
    if isinstance(scene, Scene):
        return parse_scene(merge_patch(scene_document(scene), with_imported(fields))) if fields else scene
    document = _document_of(scene) if isinstance(scene, str | os.PathLike) else scene
    if fields and isinstance(document, Mapping):
        document = merge_patch(document, fields)
    return parse_scene(with_imported(document))


def _document_of(source: str | os.PathLike[str]) -> Mapping[str, Any]:
    return document_of(source, lambda name: texture_named(name).document)


def render(scene: SceneLike, **fields: Any) -> Sound:
    """Render the whole duration of a scene.

    scene: a Scene, a mapping as in docs/scene.md, the path of a JSON file, or a texture's name.
    fields: sections of a partial scene, such as scan={"load": "0.5 N"}.
    Returns a Sound: float32 frames, their full scale, and `values` in SI units.
    Raises SceneError for an invalid scene, and for one whose contact cannot be solved.
    Source: Fagiani & Barbieri (2016), eqs 1-5.

    Example: rw.render("grating-1mm-31um", output={"duration": "1 s"}).save("coarse.wav")
    """
    from synth.encode.sound import render as rendered

    return rendered(changed(scene, fields))


def explain(scene: SceneLike, **fields: Any) -> Plan:
    """Return the plan of a scene: what is simulated, why, at what error, and at what cost on this machine.

    scene, fields, errors: as `render`.

    Example: rw.explain("grating-1mm-31um", effects={"inertia": {}}).document()["simulated"]
    """
    from synth.accuracy.costing import explain as explained

    return explained(changed(scene, fields))


def open_voice(scene: SceneLike, *, live: bool = False, **fields: Any) -> Voice:
    """Return a voice whose `render(frames, motion)` gives the next block, float32 [frames, channels] over full scale.

    scene, fields, errors: as `render`.
    live: True for a hand that moves in real time.

    Example: block = rw.open_voice("grating-1mm-31um").render(480)
    """
    from synth.voice.voice import open_voice as opened

    return opened(changed(scene, fields), live=live)


def textures() -> dict[str, CatalogueEntry | StoredTexture]:
    """Return the named textures: the catalogue, group by group, then those imported on this machine.

    An entry has `title`, `group`, `document` (the partial scene of its name), `everyday` (a scene in which a fingertip
    scans the texture), `sources` (of each number) and `note`. An imported texture has a `report` (docs/import.md) in
    place of the sources.
    Raises CannotRender if the imported textures cannot be read.

    Example: rw.render(rw.textures()["denim-72x56"].everyday).save("jeans.wav")
    """
    found: dict[str, CatalogueEntry | StoredTexture] = {entry.name: entry for entry in catalogue()}
    return found | {texture.name: texture for texture in own_store().textures("")}
