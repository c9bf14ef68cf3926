"""Import: makes a surface of a file and the options of the user, with a report of what was found and done.

Stage   SURFACES, from files.
Model   In this order: read the file; convert to metres; treat missing points; level; report. The heights are about
        their mean and stored as 32-bit numbers. The report is of the heights before that rounding.
        An option for a value that the file states is refused, except in place of the resolution tag of an image.
Limits  The greatest height of a scene's texture is 2 mm and its greatest slope 20 (docs/scene.md). A surface beyond
        these limits is imported with a note in the report, and a scene refuses it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from synth.errors import Fault, InvalidRequest, SceneError
from synth.scene.quantity import Dimension, show_quantity
from synth.surfaces.measurement.import_options import WRITTEN_UNITS, ImportOptions
from synth.surfaces.measurement.levelling import levelled, tilt_of
from synth.surfaces.measurement.roughness import roughness_of
from synth.surfaces.readers.file_formats import read_surface_file
from synth.surfaces.readers.surface_file import UNITS, Heights, Missing, SurfaceFile, check_shape
from synth.surfaces.surface_data import SurfaceData, remember

TILTED = 0.9  # rms of the tilt relative to Rq, above which a note mentions it; for one period of a sinusoid it is 0.78
CLOSEST, FARTHEST = 1e-12, 1e6  # m, allowed spacing that a file states: from a hundredth of an atom to a planet
STATED = "nothing here: the file states it"


@dataclass(frozen=True, eq=False)
class ImportedSurface:
    """The result of an import.

    heights: m, float64, about their mean.
    spacing: m, between columns, then rows.
    report: JSON values in SI; docs/import.md lists them.
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


def import_surface(path: Path, options: ImportOptions, name: str | None = None) -> ImportedSurface:
    """Return the surface in the file at `path`.

    name: the user's name for the file, if it differs from that of `path`; its ending decides the format.
    Raises InvalidRequest with every fault, CannotRender if the package for the format is not installed, OSError.
    """
    shown_name = path.name if name is None else Path(name).name
    found = read_surface_file(path, Path(shown_name).suffix)
    heights, spacing = _in_metres(found, options)
    heights, missing, rule = _whole(heights, found.missing, options.missing, spacing)
    check_shape(heights.shape)
    tilt = tilt_of(heights, missing)
    heights = levelled(heights, missing, options.level)
    heights = heights - np.mean(heights)
    report = _report(found, options, heights, spacing) | {"missing": rule}
    report["file"] = shown_name
    steepest = max(map(abs, tilt))
    if options.level == "none" and steepest / math.sqrt(12.0) > TILTED * report["rq"] > 0.0:
        rise = show_quantity(float(f"{steepest:.3g}"), Dimension.LENGTH)
        report["notes"].append(f"The surface is tilted: it rises by {rise}. level = tilt removes it")
    imported = ImportedSurface(heights, spacing, report)
    report["notes"] += _refusals_of_a_scene(imported)
    return imported


def _refusals_of_a_scene(imported: ImportedSurface) -> list[str]:
    """Return the reasons for which a scene with this surface would be refused, one sentence each."""
    from synth.scene.scene import parse_scene

    address = remember(imported.surface)
    try:
        parse_scene({"texture": {"kind": imported.kind, "surface": address}})
    except SceneError as error:
        return [f"A scene refuses it: {fault.allowed}. {fault.hint.rstrip('.')}" for fault in error.faults]
    return []


def _in_metres(found: SurfaceFile, options: ImportOptions) -> tuple[Heights, tuple[float, ...]]:
    """Return heights and spacing in m.

    Raises InvalidRequest for a missing option, and for an option whose value the file states.
    """
    faults: list[Fault] = []
    spacing = _spacing(found, options, faults)
    factor = _height_factor(found, options, spacing, faults)
    if faults:
        raise InvalidRequest(faults)
    return found.heights * factor, spacing


def _spacing(found: SurfaceFile, options: ImportOptions, faults: list[Fault]) -> tuple[float, ...]:
    """Return the spacing (m). Faults are added to `faults`; the returned value then has no meaning."""
    axes = found.heights.ndim
    if options.pixel is not None and (found.spacing is None or found.tagged):
        if len(options.pixel) > axes:
            faults.append(_fault("pixel", f"{len(options.pixel)} lengths", "one length for a profile", "Write one."))
        return (options.pixel * axes)[:axes]
    if options.pixel is not None:
        faults.append(_fault("pixel", "a length", STATED, "Leave it out."))
    if found.spacing is None:
        hint = 'Write the distance between points with its unit, such as "5 um".'
        faults.append(_fault("pixel", "nothing", "a length: the file does not state it", hint))
        return (1.0,) * axes
    unit = found.spacing_unit or found.unit or options.unit
    if unit is None:
        return found.spacing  # the unit is missing, and `_height_factor` says so
    spacing = tuple(float(value * UNITS[unit]) for value in found.spacing)
    for value in spacing:
        if not CLOSEST <= value <= FARTHEST:
            allowed = f"a spacing from {CLOSEST:g} m to {FARTHEST:g} m"
            faults.append(_fault("file", f"a spacing of {value:g} m", allowed, "Correct the file."))
    return spacing


def _height_factor(
    found: SurfaceFile, options: ImportOptions, spacing: tuple[float, ...], faults: list[Fault]
) -> float:
    """Return the factor from the file's heights to m. Faults are added to `faults`; the value then has no meaning."""
    if options.height is not None and (found.full_scale is None or options.unit is not None):
        hint = "Leave it out." if found.full_scale is None else "Leave out height or unit."
        faults.append(_fault("height", "a length", "a height for displacement maps only, without a unit", hint))
    if found.unit is not None:
        if options.unit is not None:
            faults.append(_fault("unit", repr(options.unit), STATED, "Leave it out."))
        if found.unit != "pixel":
            return UNITS[found.unit]
        if len(set(spacing)) > 1 and not found.spacing:
            faults.append(_fault("pixel", "two lengths", "square pixels of a normal map", "Write one length."))
        return spacing[0]
    if options.unit is not None:
        return UNITS[options.unit]
    if found.full_scale is None:
        hint = "Write the unit of the numbers in the file, such as um."
        allowed = f"{', '.join(WRITTEN_UNITS)}: the file does not state its unit"
        faults.append(_fault("unit", "nothing", allowed, hint))
    elif options.height is not None:
        return options.height / found.full_scale
    else:
        hint = 'Write the height between its lowest and its highest number, such as "120 um"; or unit for real heights.'
        faults.append(_fault("height", "nothing", "a length: a displacement map has no height of its own", hint))
    return 1.0


def _fault(option: str, value: str, allowed: str, hint: str) -> Fault:
    return Fault(f"/{option}", value, allowed, hint)


def _whole(
    heights: Heights, missing: Missing, rule: str, spacing: tuple[float, ...]
) -> tuple[Heights, Missing, dict[str, Any]]:
    """Return heights without missing points, and what was done. With the rule "refuse", raises InvalidRequest."""
    count = int(np.count_nonzero(missing))
    done = {"points": count, "rule": rule}
    if not count:
        return heights, missing, done
    if count == heights.size:
        raise InvalidRequest([_fault("file", "only missing points", "a surface with heights", "Is this the channel?")])
    if rule == "refuse":
        share = f"{count} missing points ({100.0 * count / heights.size:.3g} %)"
        hint = "Write missing = fill to fill them from their neighbours, or crop for the largest part without them."
        raise InvalidRequest([_fault("missing", share, "no missing points", hint)])
    from synth.surfaces.measurement.missing_points import filled, largest_whole_part  # imports numba, 1/3 of the start

    if rule == "fill":
        return filled(heights, missing, spacing), np.zeros_like(missing), done
    part = largest_whole_part(missing)
    kept = heights[part].copy()
    return kept, np.zeros(kept.shape, bool), done


def _report(found: SurfaceFile, options: ImportOptions, heights: Heights, spacing: tuple[float, ...]) -> dict[str, Any]:
    """Return the report of `heights` (m), as kept."""
    roughness = roughness_of(heights, spacing)
    counts = heights.shape[::-1]  # columns, then rows, as spacing and size
    notes = list(found.notes)
    if found.tagged and found.spacing is not None and options.pixel is not None:
        notes.append("The given distance replaces that of the resolution tag")
    stated = found.unit if found.unit != "pixel" else None
    return {
        "format": found.format,
        "layout": found.layout,
        "channel": found.channel,
        "kind": "profile" if heights.ndim == 1 else "heightmap",
        "points": list(counts),
        "spacing": list(spacing),
        "size": [count * step for count, step in zip(counts, spacing, strict=True)],
        "unit": stated or options.unit,
        "unit_stated_by_file": stated is not None,
        "rq": roughness.rq,
        "ra": roughness.ra,
        "peak_to_valley": roughness.peak_to_valley,
        "rms_slope": list(roughness.slopes),
        "level": options.level,
        "notes": notes,
    }
