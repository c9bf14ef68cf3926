"""The result of an import: a surface in metres, with a report of what was found and done.

Stage   SURFACES, from files.
Model   The report is of the heights before they are rounded to 32 bits. Rq and Ra are the root mean square and the mean
        absolute height about the mean of all points. For an area they are called Sq and Sa. The slopes are those
        between neighbouring points, along x and along y. Peak to valley is the largest less the smallest height.
Source  ISO 21920-2 and ISO 25178-2.
Limits  No filter is applied: waviness counts. A finer spacing shows steeper slopes.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from synth.errors import SceneError
from synth.surfaces.measurement.import_options import ImportOptions
from synth.surfaces.measurement.import_units import UPWARDS, Units
from synth.surfaces.readers.surface_file import Heights, SurfaceFile
from synth.surfaces.surface_data import SurfaceData, remember


class Roughness(NamedTuple):
    """rq, ra, peak_to_valley: m. slopes: rms slope along x, then y."""

    rq: float
    ra: float
    peak_to_valley: float
    slopes: tuple[float, ...]


def roughness_of(heights: Heights, spacing: tuple[float, ...]) -> Roughness:
    """Return the roughness of `heights` (m), [n] or [rows, columns]. spacing: m, between columns, then rows."""
    about_mean = heights - np.mean(heights)
    slopes = tuple(
        math.sqrt(float(np.mean((np.diff(heights, axis=axis) / step) ** 2)))
        for axis, step in zip((-1, 0)[: heights.ndim], spacing, strict=True)
    )
    return Roughness(
        math.sqrt(float(np.mean(about_mean**2))),
        float(np.mean(np.abs(about_mean))),
        float(np.ptp(heights)),
        slopes,
    )


@dataclass(frozen=True, eq=False)
class ImportedSurface:
    """The result of an import.

    heights: m, float64, about their mean.
    spacing: m, between columns, then rows.
    report: JSON values in SI; docs/import.md lists them. "texture", if it is there, has the fields that a scene needs
        beside kind and surface.
    """

    heights: Heights
    spacing: tuple[float, ...]
    report: dict[str, Any]

    @cached_property
    def surface(self) -> SurfaceData:
        """The surface as scenes use it."""
        return SurfaceData(self.heights.astype(np.float32), self.spacing)

    @property
    def kind(self) -> str:
        """The kind of texture: "profile" for a line, "heightmap" for an area."""
        return "profile" if self.heights.ndim == 1 else "heightmap"


def refusals_of_a_scene(imported: ImportedSurface) -> list[str]:
    """Return the reasons for which a scene with this surface would be refused, one sentence each."""
    from synth.scene.scene import parse_scene

    address = remember(imported.surface)
    try:
        parse_scene({"texture": {"kind": imported.kind, "surface": address, **imported.report.get("texture", {})}})
    except SceneError as error:
        return [f"A scene refuses it: {fault.allowed}. {fault.hint.rstrip('.')}" for fault in error.faults]
    return []


def report_of(
    found: SurfaceFile,
    options: ImportOptions,
    units: Units,
    heights: Heights,
    spacing: tuple[float, ...],
) -> dict[str, Any]:
    """Return the report of `heights` (m), as kept. units: of x and of the heights."""
    roughness = roughness_of(heights, spacing)
    counts = heights.shape[::-1]  # columns, then rows, as spacing and size
    notes = list(found.notes)
    if found.doubt:
        notes.append(f"{found.doubt[0].upper()}{found.doubt[1:]}, was read as {UPWARDS}")
    if found.tagged and found.spacing is not None and options.pixel is not None:
        notes.append("The given distance replaces that of the resolution tag")
    stated = found.unit if found.unit != "pixel" else None
    return {
        "format": found.format,
        "layout": found.layout,
        "reading": found.reading and _with_units(found.reading, units),
        "channel": found.channel,
        "kind": "profile" if heights.ndim == 1 else "heightmap",
        "points": list(counts),
        "spacing": list(spacing),
        "size": [count * step for count, step in zip(counts, spacing, strict=True)],
        "unit": None if units[1] == "pixel" else units[1],
        "unit_stated_by_file": stated is not None,
        "unit_of_x": None if found.tagged else units[0],
        "rq": roughness.rq,
        "ra": roughness.ra,
        "peak_to_valley": roughness.peak_to_valley,
        "rms_slope": list(roughness.slopes),
        "level": options.level,
        "resample": options.resample,
        "notes": notes,
    }


def _with_units(reading: dict[str, Any], units: Units) -> dict[str, Any]:
    """Return how a text was read, with the units that were used for its columns."""
    used = {"x": units[0], "y": units[0], "height": units[1]}
    columns = [one | {"unit": one["unit"] or used.get(one["read_as"])} for one in reading["columns"]]
    return reading | {"columns": columns}
