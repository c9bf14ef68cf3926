"""The options of an import: units, distances, height, levelling, missing points, and those of sets of maps.

Stage   SURFACES, from files. The command line and the service read the same options.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from synth.errors import Fault, InvalidRequest, shown
from synth.scene.quantity import Dimension, QuantityError, parse_quantity, show_quantity
from synth.surfaces.readers.surface_file import UNITS, unit_named

WRITTEN_UNITS = ("m", "cm", "mm", "um", "nm", "inch")
LEVELS = ("none", "tilt", "curvature")
RULES = ("refuse", "fill", "crop")
SMALLEST, LARGEST = 1e-9, 0.1  # m between points
NARROWEST, WIDEST = 1e-4, 10.0  # m, of the sample that a set of maps shows
SMALLEST_WAVE = 1e-6  # m, of synthetic waves
STEEPEST_SLOPE = 5.0  # rms slope of synthetic waves: that of a rough texture
OF_SETS = ("width", "part", "slope", "hurst", "shortest")
HIGHEST = 0.02  # m; the height of a displacement map: ten times that of the highest texture


@dataclass(frozen=True, slots=True)
class ImportOptions:
    """The options of an import.

    unit: units of the numbers in the file, or None: one of all, or one of x and y and one of the heights.
    pixel: distance between neighbouring columns, then rows (m), or None; one value applies to both.
    height: height of a displacement map from its lowest to its highest number (m), or None.
    level: the form that is removed: "none", "tilt" (a plane) or "curvature" (a surface of second order).
    missing: what is done about missing points: "refuse", "fill" or "crop".
    resample: distance between points to which a profile is interpolated linearly (m), or None.
    width: of the sample that a set of maps shows, along its rows (m), or None.
    part: side of the square in the middle of a set that is kept (m), or None for all of it.
    slope, hurst: rms slope along one axis, or Hurst exponent, of synthetic waves below the pixel of a set, or None.
    shortest: the shortest of these waves (m), or None.
    """

    unit: tuple[str, ...] | None = None
    pixel: tuple[float, ...] | None = None
    height: float | None = None
    level: str = "none"
    missing: str = "refuse"
    resample: float | None = None
    width: float | None = None
    part: float | None = None
    slope: float | None = None
    hurst: float | None = None
    shortest: float | None = None


def read_options(fields: Mapping[str, Any]) -> ImportOptions:
    """Return the options in `fields`. None means that an option is not given. Raises InvalidRequest with every fault.

    height: a number in m, or text with a unit.
    unit: one unit, or two separated by a comma: of x and y, and of the heights.
    pixel: as height, or two lengths in one text, separated by a comma, for unequal distances.
    """
    faults: list[Fault] = []
    values: dict[str, Any] = {}
    for name, value in fields.items():
        if value is None:
            continue
        if name not in READERS:
            known = ", ".join(READERS)
            faults.append(Fault(f"/{name[:40]}", "an unknown option", f"the options {known}", "Leave it out."))
            continue
        try:
            values[name] = READERS[name](value)
        except QuantityError as error:
            faults.append(Fault(f"/{name}", shown(value), error.reason, error.hint))
    if faults:
        raise InvalidRequest(faults)
    return ImportOptions(**values)


def _choice(names: tuple[str, ...]) -> Callable[[Any], str]:
    """Return a reader of one of `names`."""

    def read(value: Any) -> str:
        if value not in names:
            raise QuantityError(", ".join(names), f"Write {names[0]}.")
        return str(value)

    return read


def _length(low: float, high: float) -> Callable[[Any], float]:
    """Return a reader of a length (m) from `low` to `high`."""
    allowed = f"{show_quantity(low, Dimension.LENGTH)} to {show_quantity(high, Dimension.LENGTH)}"

    def read(value: Any) -> float:
        try:
            number = parse_quantity(value, Dimension.LENGTH)
        except QuantityError as error:
            raise QuantityError(allowed, error.hint) from error
        if not low <= number <= high:
            raise QuantityError(allowed, 'Write a length with its unit, such as "5 um".')
        return number

    return read


def _number(high: float) -> Callable[[Any], float]:
    """Return a reader of a number from 0 to `high`, also written as text."""

    def read(value: Any) -> float:
        try:
            number = math.nan if isinstance(value, bool) else float(value)
        except (TypeError, ValueError):
            number = math.nan
        if not 0.0 <= number <= high:
            raise QuantityError(f"0 to {high:g}", "Write a number between them.")
        return number

    return read


def _units(value: Any) -> tuple[str, ...]:
    parts = tuple(unit_named(part) or part.strip() for part in value.split(",")) if isinstance(value, str) else (value,)
    parts = tuple("um" if part == "µm" else part for part in parts)
    if len(parts) > 2 or not all(part in WRITTEN_UNITS for part in parts):
        raise QuantityError(", ".join(WRITTEN_UNITS), 'Write "um", or "mm, um" for x in mm and heights in um.')
    return parts


def _pixel(value: Any) -> tuple[float, ...]:
    parts = value.split(",") if isinstance(value, str) else [value]
    if len(parts) > 2:
        raise QuantityError("one length, or two separated by a comma", 'Write "5 um", or "5 um, 10 um".')
    return tuple(_length(SMALLEST, LARGEST)(part) for part in parts)


READERS: Mapping[str, Callable[[Any], Any]] = {
    "unit": _units,
    "pixel": _pixel,
    "height": _length(SMALLEST, HIGHEST),
    "level": _choice(LEVELS),
    "missing": _choice(RULES),
    "resample": _length(SMALLEST, LARGEST),
    "width": _length(NARROWEST, WIDEST),
    "part": _length(NARROWEST, WIDEST),
    "slope": _number(STEEPEST_SLOPE),
    "hurst": _number(1.0),
    "shortest": _length(SMALLEST_WAVE, LARGEST),
}
assert set(WRITTEN_UNITS) <= set(UNITS)
