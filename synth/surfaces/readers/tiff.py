"""TIFF: a displacement map of whole numbers, or an image of real numbers, which are heights.

Stage   SURFACES, from files.
Model   tifffile decodes the pixels as they are stored, of any number of bits; what it cannot unpack alone (LZW, JPEG
        and others) is decoded by Pillow. What tags state of the numbers is used (`tiff_tags`): missing points, factor,
        unit, distances and orientation. If 0 is white, whole numbers are counted from the other end. Files of Park
        microscopes are TIFF too, and are read by `topography_package`.
Source  TIFF 6.0; BigTIFF.
Limits  Only the first page is read. Compressed images of 64-bit numbers and of 12 bits are refused, unless the
        compression is Deflate or PackBits.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from synth.surfaces.readers import topography_package
from synth.surfaces.readers.image import BYTE, READABLE, SAVE, opened, surface_of_pixels, wide_pixels
from synth.surfaces.readers.picture import turned
from synth.surfaces.readers.surface_file import SurfaceFile, check_shape, refuse_file
from synth.surfaces.readers.tiff_tags import Stated, stated_of

BEGINNINGS = (b"II*\0", b"MM\0*", b"II+\0", b"MM\0+")
OF_PACKAGE = (".lext", ".oir", ".poir", ".flt", ".lsm")
PARK = 50432  # magic tag of Park microscopes
ZERO_IS_WHITE, RGB, PALETTE, MASK, CMYK, YCBCR = 0, 2, 3, 4, 5, 6
JPEG = 6, 7  # compressions with loss


def fits(head: bytes, ending: str) -> bool:
    """Return whether the file begins as TIFF does and has no ending of a microscope."""
    return head.startswith(BEGINNINGS) and ending not in OF_PACKAGE


def read(path: Path, ending: str) -> SurfaceFile:
    """Return the contents. Raises InvalidRequest, and what DAMAGED lists for a damaged file."""
    import tifffile

    with tifffile.TiffFile(path) as file:
        page: Any = file.pages[0]
        if PARK in page.tags:
            return topography_package.read(path, ending)
        check_shape((page.imagelength, page.imagewidth))
        stated = stated_of(page.tags)
        notes = stated.notes
        if (pages := len(file.pages)) > 1:
            notes = (*notes, f"Of its {pages} pages the first was read")
        pixels, is_turned = _pixels(page, path)
        photometric = int(page.photometric)
        colours = page.colormap if photometric == PALETTE else None
        lossy = int(page.compression) in JPEG
        bits = _bits(page)
    if colours is not None:
        pixels = np.stack([colour[pixels] for colour in _of_8_bits(np.asarray(colours, np.uint16))], axis=2)
    no_unit = "its numbers are places in a palette" if colours is not None else ""
    if photometric == ZERO_IS_WHITE and pixels.dtype.kind == "u":
        no_unit = "in it 0 is white, and its numbers were counted from the other end"
        pixels = np.iinfo(pixels.dtype).max - pixels
        notes = (*notes, "In it 0 is white: its numbers were counted from the other end, so that white is high")
    if stated.orientation != 1:
        pixels = pixels if is_turned else turned(pixels, stated.orientation)
        notes = (*notes, "It was turned as its orientation tag says")
    is_packed = bits < 8 and pixels.dtype == np.uint8 and pixels.ndim == 2
    if stated.is_upwards:
        pixels, notes = pixels[::-1], (*notes, "Its last row was read first: it has the least y")
    most = 2**bits - 1 if pixels.dtype.kind == "u" and BYTE < bits < BYTE * pixels.dtype.itemsize else None
    own_bits = bits if is_packed else None
    found = surface_of_pixels("TIFF", pixels, stated.turned_spacing, notes, lossy, own_bits, most)
    found = _with_numbers(found, pixels, replace(stated, notes=()))
    return replace(found, no_unit=no_unit if found.full_scale is not None else "")


def _bits(page: Any) -> int:
    return int(page.bitspersample if isinstance(page.bitspersample, int) else page.bitspersample[0])


def _of_8_bits(colours: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    """Return the colours of a palette, which TIFF has in 16 bits, in 8 bits if they have no more."""
    factor = next((factor for factor in (257, 256) if not np.any(colours % factor)), None)
    return colours if factor is None else (colours // factor).astype(np.uint8)


def _pixels(page: Any, path: Path) -> tuple[np.ndarray[Any, Any], bool]:
    """Return the pixels as stored, [rows, columns] or [rows, columns, channels], and whether they are turned."""
    bits, channels, photometric = _bits(page), int(page.samplesperpixel), int(page.photometric)
    if page.dtype is None or page.dtype.kind not in "uifb" or channels > 4 or page.imagedepth > 1:
        refuse_file(f"a TIFF of {channels} channels of {bits} bits", READABLE, SAVE)
    if photometric == CMYK or photometric > YCBCR:
        refuse_file("a TIFF in CMYK or another space of colours", READABLE, "Save it as grey.")
    if photometric == YCBCR:
        return _by_pillow(path, bits, page.dtype, channels), True
    try:
        pixels = page.asarray()
    except (ValueError, ImportError, RuntimeError) as error:  # imagecodecs, a large package, would unpack it
        if "imagecodecs" not in str(error):
            raise
        return _by_pillow(path, bits, page.dtype, channels), True
    if channels > 1 and page.axes.startswith("S"):
        pixels = np.moveaxis(pixels, 0, -1)
    if pixels.dtype == np.bool_ or (pixels.dtype == np.uint8 and bits < 8):
        pixels = pixels.astype(np.uint8) * np.uint8(255 // (2**bits - 1))
    return pixels, False


def _by_pillow(path: Path, bits: int, kind: Any, channels: int) -> np.ndarray[Any, Any]:
    """Return the pixels of a file that tifffile cannot unpack, turned as its tag says."""
    with opened(path) as image:
        if image.mode == "1":
            grey = np.asarray(image).astype(np.uint8) * np.uint8(255)
            return np.uint8(255) - grey if image.tag_v2.get(262) == ZERO_IS_WHITE else grey
        if image.mode not in ("L", "LA", "I", "I;16", "I;16B", "F", "RGB", "RGBA") or bits not in (8, 16, 32):
            refuse_file(f"a TIFF of {bits} bits (mode {image.mode})", READABLE, "Save it as grey, without compression.")
        if image.mode in ("RGB", "RGBA") and bits == 16:
            if image.tag_v2.get(274, 1) != 1:
                refuse_file("a turned TIFF of 16-bit colours", READABLE, "Save it as grey, without compression.")
            return wide_pixels(path)
        if image.tag_v2.get(262) == ZERO_IS_WHITE and bits == 8 and channels == 1:
            return np.uint8(255) - np.asarray(image)  # Pillow inverts these, and no others
        return np.asarray(image).astype(kind if bits == 8 * kind.itemsize else f"u{bits // 8}")


def _with_numbers(found: SurfaceFile, pixels: np.ndarray[Any, Any], stated: Stated) -> SurfaceFile:
    """Return a grey surface with what the tags state of its numbers."""
    if found.unit == "pixel":
        return found
    missing = found.missing
    if stated.no_data is not None:
        missing = missing | (found.heights == float(np.asarray(stated.no_data, np.float64).astype(pixels.dtype)))
    heights = np.where(missing, 0.0, found.heights)
    if not stated.has_heights:
        return replace(found, heights=heights, missing=missing)
    heights = np.where(missing, 0.0, heights * stated.scale + stated.offset)
    layout = f"an image of {pixels.dtype} numbers, which are heights with a factor of {stated.scale:g}"
    return replace(found, layout=layout, heights=heights, missing=missing, unit=stated.unit, full_scale=None)
