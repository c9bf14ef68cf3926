"""Import: makes a surface of a file and the options of the user, with a report of what was found and done.

Stage   SURFACES, from files.
Model   In this order: read the file; convert to metres; treat missing points, or resample; level; report. The heights
        are about their mean and stored as 32-bit numbers. The report is of the heights before that rounding.
        An option that contradicts the file is refused, except in place of the resolution tag of an image.
Limits  The greatest height of a scene's texture is 2 mm and its greatest slope 20 (docs/scene.md). A surface beyond
        these limits is imported with a note in the report, and a scene refuses it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from synth.errors import Fault, InvalidRequest, SceneError
from synth.scene.quantity import Dimension, show_quantity
from synth.surfaces.measurement.import_options import WRITTEN_UNITS, ImportOptions
from synth.surfaces.measurement.levelling import levelled, tilt_of
from synth.surfaces.measurement.resampling import resampled
from synth.surfaces.measurement.roughness import roughness_of
from synth.surfaces.readers.file_formats import read_surface_file
from synth.surfaces.readers.surface_file import UNITS, UNSTATED, Heights, Missing, SurfaceFile, check_shape
from synth.surfaces.surface_data import SurfaceData, remember

TILTED = 0.9  # rms of the tilt relative to Rq, above which a note mentions it; for one period of a sinusoid it is 0.78
CLOSEST, FARTHEST = 1e-12, 1e6  # m, allowed spacing that a file states: from a hundredth of an atom to a planet
STATED = "nothing here: the file states it"
LEAVE = "Leave it out."
UPWARDS = "heights that count upwards"
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
Units = tuple[str | None, str | None]
"""Of x and of the heights: keys of UNITS, or "pixel"; None where a unit is not known or not needed."""


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
    found = replace(found, notes=(*found.notes, *_marks(found)))
    heights, spacing, units = _in_metres(found, options)
    if options.resample is None:
        heights, missing, rule = _whole(heights, found.missing, options.missing, spacing)
    else:
        along = _positions(found, spacing, units[0])
        heights, rule, note = resampled(along, heights, found.missing, options.missing, options.resample)
        spacing, missing = (options.resample,), np.zeros(heights.shape, bool)
        found = replace(found, notes=(*found.notes, note))
    check_shape(heights.shape)
    tilt = tilt_of(heights, missing)
    heights = levelled(heights, missing, options.level)
    heights = heights - np.mean(heights)
    report = _report(found, options, units, heights, spacing) | {"missing": rule}
    report["file"] = shown_name
    steepest = max(map(abs, tilt))
    if options.level == "none" and steepest / math.sqrt(12.0) > TILTED * report["rq"] > 0.0:
        rise = show_quantity(float(f"{steepest:.3g}"), Dimension.LENGTH)
        report["notes"].append(f"The surface is tilted: it rises by {rise}. level = tilt removes it")
    imported = ImportedSurface(heights, spacing, report)
    report["notes"] += _refusals_of_a_scene(imported)
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


def _refusals_of_a_scene(imported: ImportedSurface) -> list[str]:
    """Return the reasons for which a scene with this surface would be refused, one sentence each."""
    from synth.scene.scene import parse_scene

    address = remember(imported.surface)
    try:
        parse_scene({"texture": {"kind": imported.kind, "surface": address}})
    except SceneError as error:
        return [f"A scene refuses it: {fault.allowed}. {fault.hint.rstrip('.')}" for fault in error.faults]
    return []


def _units(found: SurfaceFile, options: ImportOptions, faults: list[Fault]) -> Units:
    """Return the units of x and of the heights. A unit that is missing or contradicts the file is added to `faults`."""
    has_x = found.spacing is not None or found.positions is not None
    stated_x = (found.spacing_unit or found.unit) if has_x else None
    if found.spacing_unit == UNSTATED:
        stated_x = None
    given = options.unit or (None,)
    given_x, given_heights = given[0], given[-1]
    if len(given) == 1 and stated_x is not None and given_x != found.unit:
        given_x = stated_x if given_heights is not None else None
    contradicting = []
    for stated, chosen, of in ((stated_x, given_x, "x"), (found.unit, given_heights, "the heights")):
        if stated is not None and chosen is not None and UNITS.get(stated) != UNITS[chosen]:
            written = repr(", ".join(options.unit or ()))
            contradicting.append(_fault("unit", written, f"{STATED} ({of} in {stated})", LEAVE))
    if found.unit is not None and has_x and stated_x is None and given_x is None:
        allowed = f"two units: the file states that of the heights, {found.unit}, and not that of x"
        faults.append(_fault("unit", "nothing", allowed, f'Write both, such as "mm, {found.unit}".'))
    faults += contradicting[:1]
    along = (stated_x or given_x) if has_x else None
    return along, found.unit or given_heights


def _in_metres(found: SurfaceFile, options: ImportOptions) -> tuple[Heights, tuple[float, ...], Units]:
    """Return heights and spacing in m, and the units that the file has.

    Raises InvalidRequest for a missing option, and for an option whose value the file states.
    """
    faults: list[Fault] = []
    if found.doubt and options.unit is None:
        faults.append(_doubted(found))
    units = _units(found, options, faults)
    spacing = _spacing(found, options, units[0], faults)
    factor = _height_factor(found, options, units[1], spacing, faults)
    if options.resample is not None and found.heights.ndim > 1:
        faults.append(_fault("resample", "a length", "nothing: only profiles are resampled", "Leave it out."))
    if faults:
        raise InvalidRequest(faults)
    return found.heights * factor, spacing, units


def _doubted(found: SurfaceFile) -> Fault:
    """Return the fault of heights whose name has words that are not understood."""
    has_x = found.spacing is not None or found.positions is not None
    along = (found.spacing_unit or found.unit) if has_x else found.unit
    spelled = {UNSTATED: "mm"} | {unit: "um" for unit in UNITS if UNITS[unit] == UNITS["um"]}
    written = [spelled.get(one, one) for one in (along, found.unit) if one]
    how = f'write unit = "{", ".join(dict.fromkeys(written))}"'
    if found.unit is None:
        how = "write their unit"
    elif not set(written) <= set(WRITTEN_UNITS):
        how = f"write their name with the unit alone: z [{found.unit}]"
    hint = f"If its numbers are {UPWARDS}, {how}. Else correct the file."
    return _fault("unit", found.doubt, "heights whose name is understood, or a unit that confirms them", hint)


def _positions(found: SurfaceFile, spacing: tuple[float, ...], unit: str | None) -> Heights:
    """Return x of each point of a profile (m). unit: of x in the file."""
    x = found.positions if found.positions is not None else found.measured_x
    if x is not None and unit in UNITS and (found.positions is not None or found.spacing is not None):
        return x * UNITS[unit]
    return np.asarray(np.arange(len(found.heights)) * spacing[0], dtype=float)


def _spacing(found: SurfaceFile, options: ImportOptions, unit: str | None, faults: list[Fault]) -> tuple[float, ...]:
    """Return the spacing (m). Faults are added to `faults`; the returned value then has no meaning.

    unit: of x in the file, or None.
    """
    axes = found.heights.ndim
    if found.positions is not None:
        if options.resample is None:
            faults.append(_unequal(found.positions, unit))
        if options.pixel is not None:
            faults.append(_fault("pixel", "a length", STATED, LEAVE))
        return (1.0,)
    if options.pixel is not None and (found.spacing is None or found.tagged):
        if len(options.pixel) > axes:
            faults.append(_fault("pixel", f"{len(options.pixel)} lengths", "one length for a profile", "Write one."))
        return (options.pixel * axes)[:axes]
    if options.pixel is not None:
        faults.append(_fault("pixel", "a length", STATED, LEAVE))
    if found.spacing is None:
        unused = [f"{note}. " for note in found.notes if "was not used" in note]
        hint = "".join(unused) + 'Write the distance between points with its unit, such as "5 um".'
        faults.append(_fault("pixel", "nothing", "a length: the file does not state it", hint))
        return (1.0,) * axes
    if unit is None:
        return found.spacing  # the unit is missing, and `_height_factor` says so
    spacing = tuple(float(value * UNITS[unit]) for value in found.spacing)
    for value in spacing:
        if not CLOSEST <= value <= FARTHEST:
            allowed = f"a spacing from {CLOSEST:g} m to {FARTHEST:g} m"
            faults.append(_fault("file", f"a spacing of {value:g} m", allowed, "Correct the file."))
    return spacing


def _unequal(positions: Heights, unit: str | None) -> Fault:
    """Return the fault of a profile with unequal steps. unit: of `positions`."""
    steps = np.diff(positions)
    named = f" {unit}" if unit else ""
    found = f"steps of x that differ: {float(np.min(steps)):.4g} to {float(np.max(steps)):.4g}{named}"
    usual = f'"{float(np.median(steps)):.3g} {unit or "um"}"'
    hint = f"Write resample = {usual} to interpolate the profile linearly to equal steps."
    return _fault("resample", found, "equal steps of x, within 1 %, or a length", hint)


def _height_factor(
    found: SurfaceFile, options: ImportOptions, unit: str | None, spacing: tuple[float, ...], faults: list[Fault]
) -> float:
    """Return the factor from the file's heights to m. Faults are added to `faults`; the value then has no meaning.

    unit: of the heights, or None.
    """
    if options.height is not None and (found.full_scale is None or options.unit is not None):
        hint = LEAVE if found.full_scale is None else "Leave out height or unit."
        faults.append(_fault("height", "a length", "a height for displacement maps only, without a unit", hint))
    if options.unit is not None and found.no_unit:
        faults.append(_fault("unit", "a unit", f"none: {found.no_unit}", "Write height, for its full scale."))
    if unit == "pixel":
        if len(set(spacing)) > 1 and not found.spacing:
            faults.append(_fault("pixel", "two lengths", "square pixels of a normal map", "Write one length."))
        return spacing[0]
    if unit is not None:
        return UNITS[unit]
    if found.full_scale is None:
        hint = 'Write the unit of the numbers in the file, such as um; or "mm, um" for x in mm and heights in um.'
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


def _report(
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
