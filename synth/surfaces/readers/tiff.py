"""TIFF: a displacement map of 8 or 16 bits, or an image of real numbers, which are heights.

Stage   SURFACES, from files.
Model   The distances come from the resolution tags: per inch, per centimetre, or in the unit that ImageJ writes. Files
        of Park microscopes are TIFF too, and are read by `topography_package`.
Source  TIFF 6.0, tags 282, 283, 296 and 339; ImageJ's description (tag 270).
Limits  Only the first page is read. Real numbers must have 32 bits, because Pillow supports no others. Refused are
        whole numbers of other sizes than 8, 16 and 32 bits; maps in which 0 is white, because Pillow inverts those of 8
        bits and no others; and images that a tag turns by 90 degrees, because Pillow mixes up the rows of uncompressed
        ones.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np

from synth.surfaces.readers import normal_map, topography_package
from synth.surfaces.readers.image import INCH, READABLE, displacement_map, opened, spacing_of_dpi
from synth.surfaces.readers.surface_file import UNITS, SurfaceFile, refuse_file

BEGINNINGS = (b"II*\0", b"MM\0*", b"II+\0", b"MM\0+")
DESCRIPTION, X_RESOLUTION, Y_RESOLUTION, RESOLUTION_UNIT, SAMPLE_FORMAT = 270, 282, 283, 296, 339
BITS, PHOTOMETRIC, ORIENTATION = 258, 262, 274
ZERO_IS_WHITE = 0
TURNED = 5  # and above: an orientation that exchanges rows and columns
PARK = 50432  # magic tag of Park microscopes
UNSIGNED, BY_INCH, BY_CENTIMETRE = 1, 2, 3


def fits(head: bytes, ending: str) -> bool:
    """Return whether the file begins as TIFF does and has an ending of TIFF or none. Microscopes use others."""
    return head.startswith(BEGINNINGS) and ending in (".tif", ".tiff", "")


def read(path: Path, ending: str) -> SurfaceFile:
    """Return the contents. Raises InvalidRequest, and OSError, SyntaxError or ValueError for a damaged file."""
    with opened(path) as image:
        tags: Any = image.tag_v2
        if PARK in tags:
            return topography_package.read(path, ending)
        spacing, notes = _spacing(tags)
        pages = getattr(image, "n_frames", 1)
        if pages > 1:
            notes = (*notes, f"Of its {pages} pages the first was read")
        pixels = _pixels(image, tags)
    if pixels.ndim == 3 and pixels.dtype == np.uint8:
        return normal_map.surface_of("TIFF", pixels[:, :, :3], spacing, notes)
    return displacement_map("TIFF", pixels, spacing, notes)


def _pixels(image: Any, tags: Any) -> np.ndarray[Any, Any]:
    """Return the pixels with the type that the file states. Pillow reads whole numbers above 8 bits as int32."""
    bits = int(tags.get(BITS, (8,))[0])
    if image.mode not in ("L", "I", "I;16", "I;16B", "F", "RGB") or bits not in (8, 16, 32):
        refuse_file(f"a TIFF of {bits} bits (mode {image.mode})", READABLE, "Save it as grey of 16 bits.")
    if image.mode not in ("F", "RGB") and tags.get(PHOTOMETRIC) == ZERO_IS_WHITE:
        refuse_file(
            "a TIFF in which 0 is white", "a displacement map in which 0 is black", "Invert it, and save it again."
        )
    if tags.get(ORIENTATION, 1) >= TURNED:
        refuse_file(
            "a TIFF that its orientation tag turns", "an image without that tag", "Turn the image, and save it again."
        )
    pixels = np.asarray(image)
    if pixels.dtype.kind == "f" or pixels.ndim == 3:
        return pixels
    signed = tags.get(SAMPLE_FORMAT, (UNSIGNED,))[0] != UNSIGNED
    return pixels.astype(np.dtype(f"{'i' if signed else 'u'}{bits // 8}"))


def _spacing(tags: Any) -> tuple[tuple[float, float] | None, tuple[str, ...]]:
    """Return the distances (m), or None, and notes."""
    if X_RESOLUTION not in tags or Y_RESOLUTION not in tags:
        return None, ()
    per_x, per_y = float(tags[X_RESOLUTION]), float(tags[Y_RESOLUTION])
    if not (0.0 < per_x < np.inf and 0.0 < per_y < np.inf):
        return None, ()
    unit = tags.get(RESOLUTION_UNIT, BY_INCH)
    stated = re.search(r"^unit=(.+)$", str(tags.get(DESCRIPTION, "")), re.MULTILINE)
    name = stated.group(1).strip().replace("\\u00B5", "u") if stated else None
    if name in UNITS:
        return (UNITS[name] / per_x, UNITS[name] / per_y), ()
    if unit == BY_INCH:
        return spacing_of_dpi((per_x, per_y))
    if unit == BY_CENTIMETRE:
        return spacing_of_dpi((per_x * INCH / 0.01, per_y * INCH / 0.01))
    return None, ()
