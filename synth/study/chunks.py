"""Scenes that are solved together, and the files from which an interrupted study goes on.

Stage   STUDY.
Model   A chunk is CHUNK scenes, fewer where a scene takes long. Its file is named by a hash of its scenes, of phases
        and lines, and of the source of the engine, so a study finds what another run, or another study with the same
        scenes, has finished. A file is written under another name and renamed when it is complete; one that cannot be
        read counts as absent.
        A scene that cannot be solved has NaN everywhere, and its reason.
Limits  The numbers of a scene depend on the scene alone: chunks may be solved anywhere and in any order.
"""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, fields
from hashlib import sha256
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from synth.errors import CannotRender, InvalidRequest
from synth.kept_files import source_hash
from synth.scene.scene import Scene
from synth.study.spec import StudySpec, scene_at
from synth.study.variables import VARIABLES, shape_of
from synth.surfaces.surface_data import SurfaceData, remember, surface_at

CHUNK = 32  # scenes: a second or two of a fingertip; an interrupt loses a chunk, and smaller ones cost more files
CHUNK_SLOW = 4  # scenes with effects, or of what the skin feels, each of which takes up to some seconds
REASON = "reason"
Numbers = dict[str, np.ndarray[Any, Any]]


@dataclass(frozen=True, slots=True)
class Chunk:
    """Some scenes of a study.

    first: number of the first one.
    base: document of the scene that the values change.
    values: of every axis, for each scene.
    phases, lines, skin, textures: as of the spec.
    surfaces: the imported surfaces of these scenes, which another process does not know.
    """

    first: int
    base: dict[str, Any]
    values: tuple[dict[str, Any], ...]
    phases: int
    lines: int
    skin: bool
    textures: dict[str, dict[str, Any]]
    surfaces: tuple[SurfaceData, ...]

    def scene(self, number: int) -> Scene:
        """Return one of its scenes. Raises SceneError where its values are no scene."""
        for one in self.surfaces:
            remember(one)
        return scene_at(self.base, self.values[number], self.textures)

    @property
    def name(self) -> str:
        """Name of its file."""
        decided = {one.name: getattr(self, one.name) for one in fields(self) if one.name not in ("first", "surfaces")}
        return sha256(f"{source_hash()} {json.dumps(decided, sort_keys=True)}".encode()).hexdigest() + ".npz"


def chunks_of(spec: StudySpec) -> Iterator[Chunk]:
    """Yield the chunks of a study, in order."""
    slow = spec.skin or bool(spec.scene.get("effects")) or any(one.name.startswith("effects") for one in spec.axes)
    size, columns, surfaces = CHUNK_SLOW if slow else CHUNK, spec.columns(), _surfaces(spec)
    for first in range(0, spec.count, size):
        yield _chunk(spec, range(first, min(first + size, spec.count)), columns, surfaces)


def chunk_of_some(spec: StudySpec, numbers: Sequence[int]) -> Chunk:
    """Return a chunk with some scenes of a study."""
    return _chunk(spec, numbers, spec.columns(), _surfaces(spec))


def _chunk(
    spec: StudySpec, numbers: Sequence[int], columns: dict[str, list[Any]], surfaces: tuple[SurfaceData, ...]
) -> Chunk:
    values = tuple({name: column[number] for name, column in columns.items()} for number in numbers)
    return Chunk(numbers[0], spec.scene, values, spec.phases, spec.lines, spec.skin, spec.textures, surfaces)


def _surfaces(spec: StudySpec) -> tuple[SurfaceData, ...]:
    """Return the imported surfaces that a study names."""
    textures = [spec.scene.get("texture", {}), *spec.textures.values()]
    textures += [value for axis in spec.axes if axis.name == "texture" for value in axis.values]
    addresses = {str(one["surface"]) for one in textures if one.get("surface") is not None}
    addresses |= {str(value) for axis in spec.axes if axis.name == "texture.surface" for value in axis.values}
    found = (surface_at(address) for address in sorted(addresses))
    return tuple(one for one in found if one is not None)


def solved(chunk: Chunk) -> Numbers:
    """Return every variable of the scenes of `chunk` [scenes, ...], and the reason of each that cannot be solved."""
    from synth.study.series_outcome import nothing
    from synth.study.steady_outcome import outcome_of

    rows, reasons = [], []
    for number in range(len(chunk.values)):
        reason = ""
        try:
            scene = chunk.scene(number)
            found = outcome_of(scene, chunk.phases, chunk.lines)
            if chunk.skin:
                from synth.study.skin_outcome import levels_of

                found |= levels_of(scene)
        except (InvalidRequest, CannotRender) as error:
            found, reason = nothing(chunk.lines), str(error)
        rows.append(found)
        reasons.append(reason)
    numbers = {one.name: np.array([row[one.name] for row in rows], float) for one in VARIABLES}
    return numbers | {REASON: np.array(reasons)}


def read(chunk: Chunk, folder: Path) -> Numbers | None:
    """Return the numbers of a finished chunk, or None."""
    with suppress(Exception):  # a damaged file may raise anything
        with np.load(folder / chunk.name, allow_pickle=False) as file:
            numbers = {name: file[name] for name in (*(one.name for one in VARIABLES), REASON)}
        count = len(chunk.values)
        if all(numbers[one.name].shape == (count, *shape_of(one, chunk.lines)) for one in VARIABLES):
            return numbers
    return None


def write(chunk: Chunk, numbers: Numbers, folder: Path) -> None:
    """Write the file of a chunk, whole. Raises OSError."""
    content = BytesIO()
    np.savez(content, allow_pickle=False, **numbers)
    folder.mkdir(parents=True, exist_ok=True)
    descriptor, part = tempfile.mkstemp(dir=folder, suffix=".part")
    try:
        with os.fdopen(descriptor, "wb") as file:
            file.write(content.getvalue())
        os.replace(part, folder / chunk.name)
    except BaseException:
        os.unlink(part)
        raise
