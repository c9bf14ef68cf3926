"""Import: makes a surface of a file and the options of the user, with a report of what was found and done.

Stage   SURFACES, from files.
Model   In this order: read the file; convert to metres; treat missing points, or resample; level; report. The heights
        are about their mean and stored as 32-bit numbers. The report is of the heights before that rounding.
        An option that contradicts the file is refused, except in place of the resolution tag of an image.
        A set of maps of a material has an import of its own (`importing_maps`), with the same report.
Limits  The greatest height of a scene's texture is 2 mm and its greatest slope 20 (docs/scene.md). A surface beyond
        these limits is imported with a note in the report, and a scene refuses it.
"""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from synth.errors import InvalidRequest
from synth.scene.quantity import Dimension, show_quantity
from synth.surfaces.measurement.import_options import ImportOptions
from synth.surfaces.measurement.import_report import ImportedSurface, refusals_of_a_scene, report_of
from synth.surfaces.measurement.import_units import check_no_set, in_metres, option_fault, positions_of
from synth.surfaces.measurement.importing_maps import import_maps
from synth.surfaces.measurement.levelling import levelled, tilt_of
from synth.surfaces.measurement.resampling import resampled
from synth.surfaces.readers.file_formats import read_surface_file
from synth.surfaces.readers.map_set import is_set
from synth.surfaces.readers.surface_file import Heights, Missing, SurfaceFile, check_shape

TILTED = 0.9  # rms of the tilt relative to Rq, above which a note mentions it; for one period of a sinusoid it is 0.78
MARKS = (
    9999.0,
    99999.0,
    32767.0,
    32768.0,
    999.0,
    999.9,
    99.99,
    99.9,
    99.0,
    8191.0,
    65535.0,
    2147483647.0,
    2147483648.0,
    9.96921e36,
    3.402823466e38,
    1e30,
)  # that programs write for no height
FAR = 10.0  # times the range of all other heights: such a mark is no height


def import_surface(
    path: Path, options: ImportOptions, name: str | None = None, folder: Path | None = None
) -> ImportedSurface:
    """Return the surface in the file at `path`, or of the set of maps there: a folder or a ZIP file.

    name: the user's name for the file, if it differs from that of `path`; its ending decides the format.
    folder: for unpacked maps, deleted by the caller; None: a temporary one.
    Raises InvalidRequest with every fault, CannotRender if the package for the format is not installed, OSError.
    """
    shown_name = path.name if name is None else Path(name).name
    if is_set(path):
        return import_maps(path, options, shown_name, folder)
    found = read_surface_file(path, Path(shown_name).suffix)
    check_no_set(options)
    found = replace(found, notes=(*found.notes, *_marks(found)))
    heights, spacing, units = in_metres(found, options)
    if options.resample is None:
        heights, missing, rule = _whole(heights, found.missing, options.missing, spacing)
    else:
        along = positions_of(found, spacing, units[0])
        heights, rule, note = resampled(along, heights, found.missing, options.missing, options.resample)
        spacing, missing = (options.resample,), np.zeros(heights.shape, bool)
        found = replace(found, notes=(*found.notes, note))
    check_shape(heights.shape)
    tilt = tilt_of(heights, missing)
    heights = levelled(heights, missing, options.level)
    heights = heights - np.mean(heights)
    report = report_of(found, options, units, heights, spacing) | {"missing": rule}
    report["file"] = shown_name
    steepest = max(map(abs, tilt))
    if options.level == "none" and steepest / math.sqrt(12.0) > TILTED * report["rq"] > 0.0:
        rise = show_quantity(float(f"{steepest:.3g}"), Dimension.LENGTH)
        report["notes"].append(f"The surface is tilted: it rises by {rise}. level = tilt removes it")
    imported = ImportedSurface(heights, spacing, report)
    report["notes"] += refusals_of_a_scene(imported)
    return imported


def _marks(found: SurfaceFile) -> list[str]:
    """Return a note about extreme numbers that mark missing points, or that repeat far from all others."""
    measured = found.heights[~found.missing]
    if found.full_scale is not None:
        return []
    for mark in (np.min(measured, initial=np.inf), np.max(measured, initial=-np.inf)):
        others = measured[measured != mark]
        if len(others) < 2:
            continue
        count = len(measured) - len(others)
        distance = float(np.min(np.abs(others - mark)))
        spread = float(np.max(others)) - float(np.min(others))
        is_run = bool(np.any((measured[1:] == mark) & (measured[:-1] == mark)))
        is_mark = np.any(np.isclose(abs(mark), MARKS)) and (distance > FAR * spread or count > 1)
        if is_mark or (is_run and distance > spread):
            points = "1 point" if count == 1 else f"{count} points"
            return [f"The height of {points} is {mark:g}, far from all others. If it marks missing points, write nan"]
    return []


def _whole(
    heights: Heights, missing: Missing, rule: str, spacing: tuple[float, ...]
) -> tuple[Heights, Missing, dict[str, Any]]:
    """Return heights without missing points, and what was done. With the rule "refuse", raises InvalidRequest."""
    count = int(np.count_nonzero(missing))
    done = {"points": count, "rule": rule}
    if not count:
        return heights, missing, done
    if count == heights.size:
        raise InvalidRequest(
            [option_fault("file", "only missing points", "a surface with heights", "Is this the channel?")]
        )
    if rule == "refuse":
        share = f"{count} missing points ({100.0 * count / heights.size:.3g} %)"
        hint = "Write missing = fill to fill them from their neighbours, or crop for the largest part without them."
        raise InvalidRequest([option_fault("missing", share, "no missing points", hint)])
    from synth.surfaces.measurement.missing_points import filled, largest_whole_part  # imports numba, 1/3 of the start

    if rule == "fill":
        return filled(heights, missing, spacing), np.zeros_like(missing), done
    part = largest_whole_part(missing)
    kept = heights[part].copy()
    return kept, np.zeros(kept.shape, bool), done
