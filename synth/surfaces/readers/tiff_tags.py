"""What the tags of a TIFF state of its numbers: missing points, factor, unit, distances and orientation.

Stage   SURFACES, from files.
Model   Distances come from ModelPixelScale (GeoTIFF), from the description that OME or ImageJ writes, or from the
        resolution tags. GDAL writes the number of missing points, and factor, offset and unit of the heights; ImageJ
        writes a straight line of calibration.
Source  TIFF 6.0, tags 270, 274, 282, 283 and 296; GeoTIFF 1.1 (OGC 19-008), tags 33550, 34264 and 34735; GDAL, tags
        42112 and 42113; ImageJ's description; OME-XML, PhysicalSizeX.
Limits  Distances in degrees are not used, and a note says so. A rotated GeoTIFF is refused.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any

from synth.surfaces.readers.image import INCH, spacing_of_dpi
from synth.surfaces.readers.surface_file import UNITS, refuse_file, unit_named

DESCRIPTION, ORIENTATION, X_RESOLUTION, Y_RESOLUTION, RESOLUTION_UNIT = 270, 274, 282, 283, 296
PIXEL_SCALE, TRANSFORMATION, GEO_KEYS = 33550, 34264, 34735
GDAL_METADATA, GDAL_NO_DATA = 42112, 42113
BY_INCH, BY_CENTIMETRE = 2, 3
MODEL_TYPE, GEOGRAPHIC, LINEAR_UNITS = 1024, 2, 3076
GEO_UNITS = {9001: 1.0, 9002: 0.3048, 9003: 1200.0 / 3937.0}
Spacing = tuple[float, float] | None


@dataclass(frozen=True, slots=True)
class Stated:
    """What tags state.

    spacing: m, along the rows and columns as they are stored, or None.
    orientation: 1 to 8.
    no_data: number of missing points, or None.
    scale, offset, unit: of the heights; unit is a key of UNITS or None.
    notes: for the user.
    is_upwards: whether y rises from the last row to the first, as in a GeoTIFF with the north above.
    """

    spacing: Spacing
    orientation: int
    no_data: float | None
    scale: float
    offset: float
    unit: str | None
    notes: tuple[str, ...]
    is_upwards: bool = False

    @property
    def has_heights(self) -> bool:
        """Whether the tags state what the numbers are in a unit."""
        return self.unit is not None or self.scale != 1.0 or self.offset != 0.0

    @property
    def turned_spacing(self) -> Spacing:
        """The distances once the image is turned."""
        return self.spacing[::-1] if self.spacing is not None and self.orientation >= 5 else self.spacing


def stated_of(tags: Any) -> Stated:
    """Return what the tags of a page state. tags: of tifffile."""
    description = str(_value(tags, DESCRIPTION) or "")
    spacing, notes = _spacing(tags, description)
    scale, offset, unit = _numbers(tags, description)
    no_data = _no_data(tags)
    orientation = int(_value(tags, ORIENTATION) or 1)
    matrix = _value(tags, TRANSFORMATION)
    is_map = spacing is not None and (PIXEL_SCALE in tags or matrix is not None)
    is_upwards = is_map and (PIXEL_SCALE in tags or matrix[5] < 0.0)
    orientation = orientation if 1 <= orientation <= 8 else 1
    return Stated(spacing, orientation, no_data, scale, offset, unit, notes, is_upwards)


def _value(tags: Any, code: int) -> Any:
    return tags[code].value if code in tags else None


def _no_data(tags: Any) -> float | None:
    """Return the number of missing points that GDAL states; None if it is nan, which is missing in any case."""
    text = str(_value(tags, GDAL_NO_DATA) or "").strip("\0 ").replace(",", ".")
    if not text or text.lower().lstrip("+-") in ("nan", "inf"):
        return None
    try:
        return float(text)
    except ValueError:
        refuse_file(f"a number of missing points {text[:20]!r}", "a number", "Correct the tag 42113.")


def _numbers(tags: Any, description: str) -> tuple[float, float, str | None]:
    """Return factor, offset and unit of the heights."""
    metadata = str(_value(tags, GDAL_METADATA) or "")
    found = {role.lower(): text.strip() for role, text in re.findall(r'role="(\w+)"[^>]*>([^<]*)</Item>', metadata)}
    scale, offset, unit = _real(found.get("scale"), 1.0), _real(found.get("offset"), 0.0), found.get("unittype", "")
    if description.startswith("ImageJ="):
        line = dict(re.findall(r"^(cf|c0|c1|vunit)=(.*)$", description, re.MULTILINE))
        if line.get("cf", "").strip() == "0" and "c1" in line:
            scale, offset = _real(line["c1"], 1.0), _real(line.get("c0"), 0.0)
        elif "cf" in line:
            refuse_file("a calibration of ImageJ that is no straight line", "heights", "Apply it, and save again.")
        unit = line.get("vunit", "")
    named = unit_named(unit.replace("\\u00B5", "u")) if unit else None
    if unit and named is None and unit.strip().lower() not in ("gray value", "grey value", "pixel", "pixels"):
        refuse_file(f"heights in {unit[:20]}", "heights in a unit of length", "Export them in um.")
    return scale, offset, named


def _real(text: str | None, default: float) -> float:
    if text is None:
        return default
    try:
        return float(text)
    except ValueError:
        refuse_file(f"a factor or offset {text[:20]!r}", "a number", "Correct the tags of the TIFF.")


def _spacing(tags: Any, description: str) -> tuple[Spacing, tuple[str, ...]]:
    """Return the distances (m), or None, and notes."""
    if PIXEL_SCALE in tags or TRANSFORMATION in tags:
        return _of_map(tags)
    sizes = {axis: re.search(rf"PhysicalSize{axis}=[\"']([0-9.eE+-]+)[\"']", description) for axis in "XY"}
    if sizes["X"] and sizes["Y"]:
        metres = []
        for axis, size in sizes.items():
            unit = re.search(rf"PhysicalSize{axis}Unit=[\"']([^\"']+)[\"']", description)
            named = unit_named(unit[1]) if unit else "um"  # the default of OME
            if named is None or size is None:
                return None, (f"Its distance between pixels is in {unit[1] if unit else ''}, and was not used",)
            metres.append(float(size[1]) * UNITS[named])
        return (metres[0], metres[1]), ()
    return _of_resolution(tags, description)


def _of_map(tags: Any) -> tuple[Spacing, tuple[str, ...]]:
    """Return the distances of a GeoTIFF."""
    keys = tuple(_value(tags, GEO_KEYS) or ())
    if not keys:
        return None, ("Its distance between pixels has no unit, and was not used",)
    values = {keys[place]: keys[place + 3] for place in range(4, len(keys) - 3, 4)}
    if values.get(MODEL_TYPE) == GEOGRAPHIC:
        return None, ("Its distance between pixels is in degrees, and was not used",)
    metres = GEO_UNITS.get(values.get(LINEAR_UNITS, 9001))
    if metres is None:
        return None, ("Its distance between pixels is in an unusual unit, and was not used",)
    if PIXEL_SCALE in tags:
        along_x, along_y = _value(tags, PIXEL_SCALE)[:2]
    else:
        matrix = _value(tags, TRANSFORMATION)
        if matrix[1] or matrix[4]:
            refuse_file("a GeoTIFF that is rotated", "rows along x", "Resample it to rows along x.")
        along_x, along_y = abs(matrix[0]), abs(matrix[5])
    if not (along_x > 0.0 and along_y > 0.0):
        return None, ()
    unstated = ("Its distance between pixels has no unit: metres, as GeoTIFF says of that",)
    return (float(along_x) * metres, float(along_y) * metres), () if LINEAR_UNITS in values else unstated


def _of_resolution(tags: Any, description: str) -> tuple[Spacing, tuple[str, ...]]:
    """Return the distances of the resolution tags: per inch, per centimetre, or in the unit that ImageJ writes."""
    ratios = [_value(tags, code) for code in (X_RESOLUTION, Y_RESOLUTION)]
    if any(ratio is None or not all(ratio) for ratio in ratios):
        return None, ()
    per_x, per_y = (ratio[0] / ratio[1] for ratio in ratios)
    stated = dict(re.findall(r"^(y?unit)=(.+)$", description, re.MULTILINE))  # yunit only if it is another one
    of_x = unit_named(stated.get("unit", ""))
    of_y = unit_named(stated.get("yunit", "")) or of_x
    if of_x is not None and of_y is not None:
        return (UNITS[of_x] / per_x, UNITS[of_y] / per_y), ()
    stored = _value(tags, RESOLUTION_UNIT)
    unit = BY_INCH if stored is None else int(stored)  # tifffile's 1, for no unit, is falsy
    if unit == BY_INCH:
        return spacing_of_dpi((per_x, per_y))
    if unit == BY_CENTIMETRE:
        return spacing_of_dpi((per_x * INCH / 0.01, per_y * INCH / 0.01))
    return None, ()
