"""Renders, explains and opens a scene, with changes to its fields.

The changes are a partial scene. `synth.scene.merge` merges them like a PATCH request (RFC 7396); a field also removes
the fields that it excludes. The result is then checked. A warning of a plan is given once, as a RenderWarning.
"""

from __future__ import annotations

import io
import logging
import os
import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any, BinaryIO

from service.store.own_textures import own_store, texture_named, with_imported
from service.store.stored_texture import StoredTexture
from synth.errors import Fault, InvalidRequest, RenderWarning, shown
from synth.scene.catalogue import CatalogueEntry, catalogue
from synth.scene.merge import merge_patch
from synth.scene.scene import Scene, SceneLike, document_of, scene_document
from synth.scene.scene import parse_scene as parsed
from synth.scene.texture_registry import with_files
from synth.voice.hand_log import is_recording, require_scene

if TYPE_CHECKING:
    from synth.accuracy.report import AccuracyReport, Progress
    from synth.encode.sound import Sound
    from synth.plan.plan import Plan
    from synth.plan.preparation import Preparation
    from synth.voice.voice import Voice

    SceneSource = SceneLike | Sound

LOG = logging.getLogger("ridgewave")
"""At the level INFO it tells when a preparation begins, and how long it took."""


def parse_scene(scene: SceneSource, **fields: Any) -> Scene:
    """Return `scene` with the sections of the partial scene `fields` merged into it, checked and frozen.

    scene: a Scene, a mapping as in docs/scene.md, the path of a JSON file or of a sound file of ridgewave, or a
        texture's name, also of an imported one; or a Sound, for its scene. Lists of numbers may be arrays; the scene
        holds copies.
    Raises SceneError, which lists every fault; OSError if a file cannot be read.

    Example: rw.parse_scene("denim-72x56", scan={"load": "0.5 N"}).scan.load
    """
    if isinstance(scene, Scene):
        if not fields:
            return scene
        return parsed(with_imported(with_files(merge_patch(scene_document(scene), with_imported(fields)))))
    document = _document_of(scene)
    if isinstance(document, Scene):
        return parse_scene(document, **fields)
    require_scene(document)
    if fields and isinstance(document, Mapping):
        document = merge_patch(document, fields)
    return parsed(with_imported(with_files(document)))


def _document_of(source: SceneSource) -> Any:
    """Return a Scene unchanged, or the mapping that `source` is, names or has in it."""
    if isinstance(source, str | os.PathLike):
        return document_of(source, lambda name: texture_named(name).document)
    if isinstance(source, Scene | Mapping):
        return source
    from synth.encode.sound import Sound

    if isinstance(source, Sound):
        return source.scene if source.recording is None else source.recording
    return source


def render(scene: SceneSource, **fields: Any) -> Sound:
    """Render the whole duration of a scene, or the recording of a live session.

    scene: as `parse_scene`, or a recording: its mapping, or the path of its JSON file or of a sound rendered from it.
    fields: sections of a partial scene, such as scan={"load": "0.5 N"}; a recording cannot be changed.
    Returns a Sound: float32 frames, their full scale, and `values` in SI units.
    Raises SceneError for an invalid scene, and for one whose contact cannot be solved.
    Source: Fagiani & Barbieri (2016), eqs 1-5.

    Example: rw.render("grating-1mm-31um", output={"duration": "1 s"}).save("coarse.wav")
    """
    from synth.encode.sound import render as rendered
    from synth.encode.sound import rendered_recording

    started = perf_counter()
    document = _document_of(scene)
    if isinstance(document, Mapping) and is_recording(document) and not fields:
        with_imported({})  # its scenes may have surfaces of the user's store
        sound = rendered_recording(document)
    else:
        checked = parse_scene(document, **fields)
        LOG.info("rendering %.6g s of %s", checked.output.duration, checked.texture.kind)
        sound = rendered(checked, plan_as=_plan_as)
    LOG.info("rendered %.6g s in %.3g s", sound.seconds, perf_counter() - started)
    _warn(sound.warnings)
    return sound


def _plan_as(solved: Preparation) -> Plan:
    from synth.accuracy.costing import plan_with_contact

    return plan_with_contact(solved)


def _warn(sentences: Sequence[str]) -> None:
    """Give each warning to the caller of the public function, once per line of code."""
    for sentence in sentences:
        warnings.warn(sentence, RenderWarning, stacklevel=3)


def load(path: str | os.PathLike[str] | BinaryIO) -> Sound:
    """Return the sound in a WAV or FLAC file: `frames`, `values` in SI, full scale, quantities and scene.

    path: of the file, or a binary file that is open for reading, such as io.BytesIO.
    A file of another program, or one whose metadata was removed, has samples without a scale: its quantity is
    "unscaled", and a RenderWarning says so. So does one where a WAV file of ridgewave is incomplete; an incomplete FLAC
    is refused.
    Raises InvalidRequest for a file that is no sound, OSError if it cannot be read.

    Example:
        import ridgewave as rw
        sound = rw.load(rw.render("denim-72x56", output={"duration": "0.1 s"}).save("denim.wav"))
        print(sound.peak, sound.units, sound.scene.texture.kind)
    """
    from synth.encode.sound_files import load as loaded

    with_imported({})  # the scene may name a surface of the user's store
    opened = isinstance(path, io.IOBase) and not isinstance(path, io.TextIOBase)
    if not opened and not isinstance(path, str | os.PathLike):
        hint = "Write a path, or a binary file that is open for reading. A Sound needs no loading."
        raise InvalidRequest([Fault("/path", shown(path), "the path of a WAV or FLAC file", hint)])
    sound = loaded(Path(path) if isinstance(path, str | os.PathLike) else path)
    _warn(sound.warnings)
    return sound


def explain(scene: SceneSource, **fields: Any) -> Plan:
    """Return the plan of a scene: what is simulated, why, at what error, and at what cost on this machine.

    scene, fields, errors: as `parse_scene`.

    Example: rw.explain("grating-1mm-31um", effects={"inertia": {}}).document()["simulated"]
    """
    from synth.accuracy.costing import explain as explained

    return explained(parse_scene(scene, **fields))


def measure_accuracy(
    scene: SceneSource, *, quantity: str | None = None, live: bool = False, progress: Progress | None = None
) -> AccuracyReport:
    """Return the error and the cost of every method, for one channel of a scene. It takes up to a minute.

    scene, errors: as `parse_scene`.
    quantity: quantity of the channel; None for the first channel.
    live: True for a live voice, behind a hand, in place of a file.
    progress: called before each method with its name, the number of methods done, and the number of all methods.
    Raises InvalidRequest if the scene has no channel with that quantity, or does not move.
    """
    from synth.accuracy.report import measure_accuracy as measured

    return measured(parse_scene(scene), quantity=quantity, live=live, progress=progress)


def open_voice(scene: SceneSource, *, live: bool = False, **fields: Any) -> Voice:
    """Return a voice whose `render(frames, motion)` gives the next block, float32 [frames, channels] over full scale.

    scene, fields, errors: as `parse_scene`.
    live: True for a hand that moves in real time.

    Example: block = rw.open_voice("grating-1mm-31um").render(480)
    """
    from synth.voice.voice import open_voice as opened

    return opened(parse_scene(scene, **fields), live=live)


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
