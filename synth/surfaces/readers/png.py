"""PNG: a grey displacement map of 8 or 16 bits, or a normal map in RGB.

Stage   SURFACES, from files.
Model   A grey PNG is a displacement map (`image`). A PNG in colour is a normal map if its colours are unit vectors
        (`normal_map`). Any other picture is refused.
Source  PNG (ISO/IEC 15948): the header chunk IHDR, and pHYs for the resolution.
Limits  Palettes, fewer than 8 bits and transparent grey are refused. Only the upper 8 bits of a 16-bit normal map are
        read.
"""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np

from synth.surfaces.readers import normal_map
from synth.surfaces.readers.image import displacement_map, opened, spacing_of_dpi
from synth.surfaces.readers.surface_file import SurfaceFile, check_shape, refuse_file

SIGNATURE = b"\x89PNG\r\n\x1a\n"
GREY, COLOUR, COLOUR_AND_ALPHA = 0, 2, 6


def fits(head: bytes, _ending: str) -> bool:
    """Return whether the file begins as PNG does."""
    return head.startswith(SIGNATURE)


def read(path: Path, _ending: str) -> SurfaceFile:
    """Return the contents. Raises InvalidRequest, and OSError, SyntaxError or ValueError for a damaged file."""
    with path.open("rb") as file:
        header = file.read(26)
    if len(header) < 26 or header[12:16] != b"IHDR":
        raise ValueError("it has no header")
    width, height, bits, colour = struct.unpack(">IIBB", header[16:26])
    check_shape((height, width))
    if colour not in (GREY, COLOUR, COLOUR_AND_ALPHA) or bits not in (8, 16):
        refuse_file(f"a PNG of {bits} bits and colour type {colour}", "grey or RGB of 8 or 16 bits", "Save it as grey.")
    with opened(path) as image:
        spacing, notes = spacing_of_dpi(image.info.get("dpi"))
        if colour == GREY:
            pixels = np.asarray(image)
            return displacement_map("PNG", pixels.astype(f"u{bits // 8}"), spacing, notes)
        pixels = np.asarray(image.convert("RGB"))
    if bits == 16:
        notes = (*notes, "Of its 16 bits the upper 8 were read")
    return normal_map.surface_of("PNG", pixels, spacing, notes)
