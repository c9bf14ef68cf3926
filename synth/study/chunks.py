"""Scenes that are solved together, and the files from which an interrupted study goes on.

Stage   STUDY.
Model   A chunk is CHUNK scenes, fewer of what the skin feels. Its file is named by a hash of its scenes, of phases and
        lines, and of the source of the engine, so a study finds what another run, or another study with the same
        scenes, has finished. A file is written under another name and renamed when it is complete; one that cannot be
        read counts as absent.
        A scene that cannot be solved has NaN everywhere, and its reason.
Limits  The numbers of a scene depend on the scene alone: chunks may be solved anywhere and in any order.
"""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, fields
from hashlib import sha256
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from synth.errors import CannotRender, InvalidRequest
from synth.kept_files import source_hash
from synth.study.spec import StudySpec, scene_at
from synth.study.variables import VARIABLES, shape_of

CHUNK = 256  # scenes: a second of a comb; a smaller one loses less to an interrupt, and costs more files
CHUNK_SKIN = 8  # scenes of a study with "skin", each of which takes up to some seconds
REASON = "reason"
Numbers = dict[str, np.ndarray[Any, Any]]


@dataclass(frozen=True, slots=True)
class Chunk:
    """Some scenes of a study.

    first: number of the first one.
    base: document of the scene that the values change.
    values: of every axis, for each scene.
    phases, lines, skin: as of the spec.
    """

    first: int
    base: dict[str, Any]
    values: tuple[dict[str, Any], ...]
    phases: int
    lines: int
    skin: bool

    @property
    def name(self) -> str:
        """Name of its file."""
        decided = {one.name: getattr(self, one.name) for one in fields(self) if one.name != "first"}
        return sha256(f"{source_hash()} {json.dumps(decided, sort_keys=True)}".encode()).hexdigest() + ".npz"


def chunks_of(spec: StudySpec) -> Iterator[Chunk]:
    """Yield the chunks of a study, in order."""
    columns = spec.columns()
    size = CHUNK_SKIN if spec.skin else CHUNK
    for first in range(0, spec.count, size):
        some = range(first, min(first + size, spec.count))
        values = tuple({name: column[number] for name, column in columns.items()} for number in some)
        yield Chunk(first, spec.scene, values, spec.phases, spec.lines, spec.skin)


def solved(chunk: Chunk) -> Numbers:
    """Return every variable of the scenes of `chunk` [scenes, ...], and the reason of each that cannot be solved."""
    from synth.study.series_outcome import nothing
    from synth.study.steady_outcome import outcome_of

    rows, reasons = [], []
    for values in chunk.values:
        reason = ""
        try:
            scene = scene_at(chunk.base, values)
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
