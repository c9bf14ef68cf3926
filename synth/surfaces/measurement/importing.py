"""Import: makes a surface of a file and the options of the user, with a report of what was found and done.

Stage   SURFACES, from files.
Model   In this order: read the file; convert to metres; treat missing points, or resample; level; report. The heights
        are about their mean and stored as 32-bit numbers. The report is of the heights before that rounding.
        Resampling, of steps of x that are not equal: straight lines between neighbouring points, read at equal steps
        from the first point on. Missing points are left out first ("fill"), or only the longest piece without them is
        kept ("crop"). Levelling: the least-squares plane (tilt) or polynomial of second order (curvature) through the
        measured points is subtracted.
        An option that contradicts the file is refused, except in place of the resolution tag of an image.
        A set of maps of a material has an import of its own (`importing_maps`), with the same report.
Source  Levelling: the F-operation of ISO 25178-2 with a polynomial.
Limits  Detail that is finer than a new step is lost without a filter. Between distant points the profile is a straight
        line, which was not measured. The last point is kept only if a step ends there. The fit of a form is not robust:
        a tall feature shifts it.
        The greatest height of a scene's texture is 2 mm and its greatest slope 20 (docs/scene.md). A surface beyond
        these limits is imported with a note in the report, and a scene refuses it.
"""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from synth.errors import Fault, InvalidRequest
from synth.scene.quantity import Dimension, show_quantity
from synth.surfaces.measurement.import_options import ImportOptions
from synth.surfaces.measurement.import_report import ImportedSurface, refusals_of_a_scene, report_of
from synth.surfaces.measurement.import_units import check_no_set, in_metres, option_fault, positions_of
from synth.surfaces.measurement.importing_maps import import_maps
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
POWERS = {"tilt": 1, "curvature": 2}
STEEP, FEWEST_STEPS = 5.0, 16  # times the rms step between neighbours; heights of a profile whose ends are judged
WIDE = 5.0  # times the new step: a distance between neighbouring points that a note mentions


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
    report["notes"] += _ends(heights)
    imported = ImportedSurface(heights, spacing, report)
    report["notes"] += refusals_of_a_scene(imported)
    return imported


def _ends(heights: Heights) -> list[str]:
    """Return a note about a step of a profile where its end is joined to its beginning."""
    if heights.ndim > 1 or len(heights) < FEWEST_STEPS:
        return []
    step, usual = abs(float(heights[0] - heights[-1])), math.sqrt(float(np.mean(np.diff(heights) ** 2)))
    if step <= STEEP * usual or usual == 0.0:
        return []
    high = show_quantity(float(f"{step:.3g}"), Dimension.LENGTH)
    return [f'A line joins its ends, a step of {high} in each period. With ends = "mirror" a scene has no step']


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


def levelled(heights: Heights, missing: Missing, level: str) -> Heights:
    """Return `heights` less their fitted form, with 0 at missing points.

    heights: [n] or [rows, columns].
    level: "tilt" or "curvature"; "none" changes nothing.
    """
    if level == "none":
        return heights
    grid, measured = np.atleast_2d(heights), np.atleast_2d(~missing).astype(np.float64)
    rows, columns = grid.shape
    x, y = _scale(columns), _scale(rows)
    order = POWERS[level]
    terms = [(i, j) for i in range(order + 1) for j in range(order + 1) if i + j <= order and (rows > 1 or not j)]
    # Each product of two terms is again x^i y^j. So sums over the points suffice, without a matrix row per point.
    sums: dict[tuple[int, int], float] = {}
    for i in range(2 * order + 1):
        along = measured @ x**i
        for j in range(2 * order + 1):
            sums[i, j] = float(along @ y**j)
    products = np.array([[sums[i + k, j + m] for k, m in terms] for i, j in terms])
    right = np.array([float(y**j @ ((grid * measured) @ x**i)) for i, j in terms])
    factors = np.linalg.lstsq(products, right, rcond=None)[0]
    form = np.zeros_like(grid)
    for (i, j), factor in zip(terms, factors, strict=True):
        form += factor * np.outer(y**j, x**i)
    left: Any = (grid - form) * measured
    return np.asarray(left.reshape(heights.shape))


def tilt_of(heights: Heights, missing: Missing) -> tuple[float, ...]:
    """Return the rise of the fitted plane over the length of the surface, along x, then along y."""
    grid, measured = np.atleast_2d(heights), np.atleast_2d(~missing).astype(np.float64)
    rises = []
    for axis in (1, 0)[: heights.ndim]:
        at = _scale(grid.shape[axis])
        weights = measured.sum(axis=1 - axis)
        total = float(weights.sum())
        centre = float(weights @ at) / total
        sums = (grid * measured).sum(axis=1 - axis)
        spread = float(weights @ (at - centre) ** 2)
        rises.append(2.0 * float(sums @ (at - centre)) / spread if spread else 0.0)
    return tuple(rises)


def _scale(count: int) -> Heights:
    return np.linspace(-1.0, 1.0, count) if count > 1 else np.zeros(1)


def resampled(
    positions: Heights, heights: Heights, missing: Missing, rule: str, step: float
) -> tuple[Heights, dict[str, Any], str]:
    """Return heights at equal steps, the number of missing points with the rule, and a note of what was done.

    positions: x of each point (m), increasing.
    rule: for missing points.
    step: m.
    Raises InvalidRequest if points are missing and the rule is "refuse", and for a step longer than the profile.
    """
    count = int(np.count_nonzero(missing))
    done = {"points": count, "rule": rule}
    if count == heights.size:
        raise InvalidRequest([Fault("/file", "only missing points", "a profile with heights", "Is this the column?")])
    if count and rule == "refuse":
        share = f"{count} missing points ({100.0 * count / heights.size:.3g} %)"
        hint = "Write missing = fill to leave them out, or crop for the longest part without them."
        raise InvalidRequest([Fault("/missing", share, "no missing points", hint)])
    kept: Any = ~missing
    if rule == "crop" and count:
        from synth.surfaces.measurement.missing_points import largest_whole_part

        kept = largest_whole_part(missing)[0]
    positions, heights = positions[kept], heights[kept]
    length = float(positions[-1] - positions[0])
    if length < step:
        shown = _shown(length)
        raise InvalidRequest([Fault("/resample", _shown(step), f"at most {shown}, the length of x", "Write less.")])
    points = int(length / step * (1.0 + 1e-12)) + 1
    check_shape((points,))
    steps = np.diff(positions)
    note = (
        f"Resampled linearly to steps of {_shown(step)}. The file has {len(positions)} points in steps from "
        f"{_shown(float(np.min(steps)))} to {_shown(float(np.max(steps)))}"
    )
    if np.max(steps) > WIDE * step:
        note += ". Across the longest of them the profile is a straight line, which was not measured"
    return np.interp(positions[0] + step * np.arange(points), positions, heights), done, note


def _shown(length: float) -> str:
    return show_quantity(float(f"{length:.4g}"), Dimension.LENGTH)
