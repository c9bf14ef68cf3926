"""The units of an imported file: those that it states, those that the user gives, and its heights in metres.

Stage   SURFACES, used by `importing`.
Model   An option that contradicts the file is refused, except in place of the resolution tag of an image.
"""

from __future__ import annotations

import numpy as np

from synth.errors import Fault, InvalidRequest
from synth.surfaces.measurement.import_options import OF_SETS, WRITTEN_UNITS, ImportOptions
from synth.surfaces.readers.surface_file import UNITS, UNSTATED, Heights, SurfaceFile

CLOSEST, FARTHEST = 1e-12, 1e6  # m, allowed spacing that a file states: from a hundredth of an atom to a planet
AGREES = 1e-3  # of a distance between points: an option that says what the file states is no contradiction
STATED = "nothing here: the file states it"
LEAVE = "Leave it out."
UPWARDS = "heights that count upwards"
Units = tuple[str | None, str | None]
"""Of x and of the heights: keys of UNITS, or "pixel"; None where a unit is not known or not needed."""


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
            contradicting.append(option_fault("unit", written, f"{STATED} ({of} in {stated})", LEAVE))
    if found.unit is not None and has_x and stated_x is None and given_x is None:
        allowed = f"two units: the file states that of the heights, {found.unit}, and not that of x"
        faults.append(option_fault("unit", "nothing", allowed, f'Write both, such as "mm, {found.unit}".'))
    faults += contradicting[:1]
    along = (stated_x or given_x) if has_x else None
    return along, found.unit or given_heights


def check_no_set(options: ImportOptions) -> None:
    """Raise InvalidRequest for options that only sets of maps have."""
    given = [name for name in OF_SETS if getattr(options, name) is not None]
    hint = f"{LEAVE} A set is a folder or a ZIP file with a displacement map or a normal map."
    if given:
        raise InvalidRequest(
            [option_fault(name, "a value", "nothing: only sets of maps have it", hint) for name in given]
        )


def in_metres(found: SurfaceFile, options: ImportOptions) -> tuple[Heights, tuple[float, ...], Units]:
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
        faults.append(option_fault("resample", "a length", "nothing: only profiles are resampled", "Leave it out."))
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
    return option_fault("unit", found.doubt, "heights whose name is understood, or a unit that confirms them", hint)


def positions_of(found: SurfaceFile, spacing: tuple[float, ...], unit: str | None) -> Heights:
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
            faults.append(option_fault("pixel", "a length", STATED, LEAVE))
        return (1.0,)
    if options.pixel is not None and (found.spacing is None or found.tagged):
        if len(options.pixel) > axes:
            faults.append(
                option_fault("pixel", f"{len(options.pixel)} lengths", "one length for a profile", "Write one.")
            )
        return (options.pixel * axes)[:axes]
    if found.spacing is None:
        unused = [f"{note}. " for note in found.notes if "was not used" in note]
        hint = "".join(unused) + 'Write the distance between points with its unit, such as "5 um".'
        faults.append(option_fault("pixel", "nothing", "a length: the file does not state it", hint))
        return (1.0,) * axes
    if unit is None:
        return found.spacing  # the unit is missing, and `_height_factor` says so
    spacing = tuple(float(value * UNITS[unit]) for value in found.spacing)
    if options.pixel is not None and not np.allclose((options.pixel * axes)[:axes], spacing, rtol=AGREES, atol=0.0):
        given, stated = (" x ".join(f"{one:.6g}" for one in lengths) for lengths in (options.pixel, spacing))
        faults.append(option_fault("pixel", f"{given} m", f"{STATED} ({stated} m)", LEAVE))
    for value in spacing:
        if not CLOSEST <= value <= FARTHEST:
            allowed = f"a spacing from {CLOSEST:g} m to {FARTHEST:g} m"
            faults.append(option_fault("file", f"a spacing of {value:g} m", allowed, "Correct the file."))
    return spacing


def _unequal(positions: Heights, unit: str | None) -> Fault:
    """Return the fault of a profile with unequal steps. unit: of `positions`."""
    steps = np.diff(positions)
    named = f" {unit}" if unit else ""
    found = f"steps of x that differ: {float(np.min(steps)):.4g} to {float(np.max(steps)):.4g}{named}"
    usual = f'"{float(np.median(steps)):.3g} {unit or "um"}"'
    hint = f"Write resample = {usual} to interpolate the profile linearly to equal steps."
    return option_fault("resample", found, "equal steps of x, within 1 %, or a length", hint)


def _height_factor(
    found: SurfaceFile, options: ImportOptions, unit: str | None, spacing: tuple[float, ...], faults: list[Fault]
) -> float:
    """Return the factor from the file's heights to m. Faults are added to `faults`; the value then has no meaning.

    unit: of the heights, or None.
    """
    if options.height is not None and (found.full_scale is None or options.unit is not None):
        hint = LEAVE if found.full_scale is None else "Leave out height or unit."
        faults.append(option_fault("height", "a length", "a height for displacement maps only, without a unit", hint))
    if options.unit is not None and found.no_unit:
        faults.append(option_fault("unit", "a unit", f"none: {found.no_unit}", "Write height, for its full scale."))
    if unit == "pixel":
        if len(set(spacing)) > 1 and not found.spacing:
            faults.append(option_fault("pixel", "two lengths", "square pixels of a normal map", "Write one length."))
        return spacing[0]
    if unit is not None:
        return UNITS[unit]
    if found.full_scale is None:
        hint = 'Write the unit of the numbers in the file, such as um; or "mm, um" for x in mm and heights in um.'
        allowed = f"{', '.join(WRITTEN_UNITS)}: the file does not state its unit"
        faults.append(option_fault("unit", "nothing", allowed, hint))
    elif options.height is not None:
        return options.height / found.full_scale
    else:
        hint = 'Write the height between its lowest and its highest number, such as "120 um"; or unit for real heights.'
        faults.append(option_fault("height", "nothing", "a length: a displacement map has no height of its own", hint))
    return 1.0


def option_fault(option: str, value: str, allowed: str, hint: str) -> Fault:
    """Return the fault of an option of the import."""
    return Fault(f"/{option}", value, allowed, hint)
