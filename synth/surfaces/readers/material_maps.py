"""The pixels of the maps of a set: displacement, slopes of a normal map, and roughness.

Stage   SURFACES, from files.
Model   Each file is read as it would be alone (`file_formats`), and must be what its name says. All numbers are linear,
        whatever a file says of its colours. The roughness of a packed map is its green channel. Gloss is 1 - roughness.
Source  Names and channels: the public documentation of the libraries. alpha = roughness^2: glTF 2.0, appendix B.
Limits  The roughness of a set becomes one number: the root mean square of alpha over the map.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np

from synth.errors import InvalidRequest, shown
from synth.surfaces.readers.file_formats import read_surface_file
from synth.surfaces.readers.image import opened, wide_pixels
from synth.surfaces.readers.map_names import PACKED, named
from synth.surfaces.readers.map_set import MapFile
from synth.surfaces.readers.surface_file import Slopes, SurfaceFile, refuse_file

GREY = "Download it as PNG or TIFF, in grey."

T = TypeVar("T")


def _naming(map_file: MapFile, read: Callable[[], T]) -> T:
    """Return what `read` returns. The faults that it raises name the map."""
    try:
        return read()
    except InvalidRequest as error:
        fault = error.faults[0]
        refuse_file(f"{shown(map_file.name)}: {fault.value}", fault.allowed, fault.hint, error.__cause__)


def displacement(map_file: MapFile) -> SurfaceFile:
    """Return a displacement map. Raises InvalidRequest for another file, and for one with transparent pixels."""
    found = _naming(map_file, lambda: read_surface_file(map_file.path))
    if found.slopes is not None or found.heights.ndim != 2:
        refuse_file(f"{shown(map_file.name)}: {found.layout}", "a grey displacement map", GREY)
    if np.any(found.missing):
        refuse_file(f"{shown(map_file.name)}: transparent pixels", "a map without transparency", "Fill them.")
    return found


def slopes(map_file: MapFile) -> tuple[tuple[Slopes, Slopes], SurfaceFile]:
    """Return the slopes of a normal map along x and down the rows, as if green pointed up, and its file."""
    found = _naming(map_file, lambda: read_surface_file(map_file.path, is_normal_map=True))
    if found.slopes is None:
        hint = "Its colours are no normals. Rename it, or download the normal map again."
        refuse_file(f"{shown(map_file.name)}: {found.layout}", "a normal map", hint)
    return found.slopes, found


def alpha_of(map_file: MapFile, role: str) -> float:
    """Return the root mean square of alpha = roughness^2 over a roughness map, or over a packed one."""
    roughness = _naming(map_file, lambda: _green_channel(map_file) if role == PACKED else _grey(map_file))
    low, high = float(np.min(roughness)), float(np.max(roughness))
    if not (low >= 0.0 and high <= 1.0):
        refuse_file(f"{shown(map_file.name)}: {low:.3g} to {high:.3g}", "roughness from 0 to 1", GREY)
    found = named(map_file.name)
    return float(np.sqrt(np.mean((1.0 - roughness if found and found.gloss else roughness) ** 4)))


def _grey(map_file: MapFile) -> np.ndarray[Any, Any]:
    found = read_surface_file(map_file.path)
    if found.slopes is not None or found.heights.ndim != 2:
        refuse_file(found.layout, "a grey roughness map", GREY)
    return found.heights / (found.full_scale or 1.0)


def _green_channel(map_file: MapFile) -> np.ndarray[Any, Any]:
    """Return the green channel of a picture in colour, 0 to 1."""
    with opened(map_file.path) as image:
        wide = image.format == "PNG" and "16" in str(image.tile[0].args)
        if image.mode not in ("RGB", "RGBA") or (image.format == "TIFF" and "16" in str(image.tile[0].args)):
            refuse_file(f"a packed map of the kind {image.mode}", "RGB of 8 bits, or PNG of 16", "Save it as PNG.")
        pixels = wide_pixels(map_file.path) if wide else np.asarray(image)
    return np.asarray(pixels[:, :, 1] / np.iinfo(pixels.dtype).max, np.float64)
