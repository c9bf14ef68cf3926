"""The waveforms of a study: a sound file for each scene and a manifest, for those who train models.

Stage   STUDY.
Model   A chunk of scenes is a folder of FLAC files, rendered as `render` does, each with its scene and its scale.
        The manifest has a line of JSON for each scene: file, scene, seeds, rate, quantities and units, full scale, rms
        and peak in SI, told errors, warnings, licence and split. A scene that cannot be rendered has its reason.
        A split is chosen by a hash of the texture, so that no texture is in two splits.
        The lines of a chunk are written when all of its files are; a chunk that has them is not rendered again.
Limits  Steady or not, a scene lasts as long as its output.duration. Files of one machine: no cluster.
"""

from __future__ import annotations

import json
import os
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np

from synth.encode.sound import render
from synth.errors import CannotRender, InvalidRequest
from synth.scene.scene import Scene, scene_document
from synth.study.chunks import Chunk

SPLITS = (("train", 0.8), ("validation", 0.9), ("test", 1.0))
"""Names, and where each ends between 0 and 1."""
MANIFEST = "manifest.jsonl"


def split_of(scene: Scene) -> str:
    """Return the split of a scene: equal textures have the same one, also where they begin at another place."""
    fields = {name: value for name, value in scene_document(scene)["texture"].items() if name != "phase"}
    texture = json.dumps(fields, sort_keys=True)
    part = int(sha256(texture.encode()).hexdigest()[:8], 16) / 2.0**32
    return next(name for name, end in SPLITS if part < end)


def lines_path(chunk: Chunk, folder: Path) -> Path:
    """Return the file with the lines of a chunk."""
    return folder / f"{chunk.first:08d}-{chunk.name[:16]}.jsonl"


def is_rendered(chunk: Chunk, folder: Path) -> bool:
    """Return whether all files of a chunk are there."""
    return lines_path(chunk, folder).exists()


def render_chunk(chunk: Chunk, folder: Path) -> int:
    """Render the scenes of a chunk into `folder`, and return their number. Raises OSError, CannotRender."""
    target = lines_path(chunk, folder)
    shard = folder / f"{chunk.first:08d}"
    shard.mkdir(parents=True, exist_ok=True)
    rows = [_rendered(chunk, number, shard) for number in range(len(chunk.values))]
    part = target.with_suffix(".part")
    part.write_text("".join(json.dumps(row, sort_keys=True) + "\n" for row in rows), "utf-8")
    os.replace(part, target)
    return len(rows)


def _rendered(chunk: Chunk, number: int, shard: Path) -> dict[str, Any]:
    """Render one scene; return its line, without licence."""
    row: dict[str, Any] = {"number": chunk.first + number, "axes": chunk.values[number]}
    try:
        scene = chunk.scene(number)
        sound = render(scene)
    except (InvalidRequest, CannotRender) as error:
        return row | {"file": None, "reason": str(error)}
    path = sound.save(shard / f"{chunk.first + number:08d}.flac")
    document, plan = scene_document(scene), sound.plan
    values = sound.values
    return row | {
        "file": f"{shard.name}/{path.name}",
        "scene": document,
        "seeds": {"finger": getattr(scene.finger, "seed", None), "texture": getattr(scene.texture, "seed", None)},
        "sample_rate": sound.sample_rate,
        "frames": len(values),
        "quantities": list(sound.quantities),
        "units": list(sound.units),
        "full_scale": list(sound.full_scale),
        "rms": np.sqrt(np.mean(values**2, axis=0)).tolist(),
        "peak": np.max(np.abs(values), axis=0, initial=0.0).tolist(),
        "told_error": {} if plan is None else dict(plan.estimated_error),
        "warnings": list(sound.warnings),
        "split": split_of(scene),
    }


def write_manifest(chunks: list[Chunk], folder: Path, licence: str | None) -> int:
    """Write the manifest of a study whose chunks are all there; return how many scenes have no file. Raises OSError."""
    missing, part = 0, folder / f"{MANIFEST}.part"
    with part.open("w", encoding="utf-8") as file:
        for chunk in chunks:
            for line in lines_path(chunk, folder).read_text("utf-8").splitlines():
                row = json.loads(line) | {"licence": licence}
                missing += row["file"] is None
                file.write(json.dumps(row, sort_keys=True) + "\n")
    os.replace(part, folder / MANIFEST)
    for chunk in chunks:
        lines_path(chunk, folder).unlink()
    return missing
