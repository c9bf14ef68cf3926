"""PNG, JPEG, BMP, WebP and PNM: grey displacement maps, or normal maps in colour.

Stage   SURFACES, from files.
Model   Grey of any number of bits, palettes of greys, grey with alpha, and RGB with three equal channels are a
        displacement map (`image`). Colours that are unit vectors are a normal map (`normal_map`). Any other picture is
        refused. The orientation tag (EXIF) is applied. A colour or grey that a PNG declares transparent is a missing
        point.
Source  PNG (ISO/IEC 15948): IHDR, pHYs for dots per metre, and sCAL for the size of a pixel.
Limits  Of an animation the first picture is read. PNG, JPEG and WebP may have a colour profile, which is not applied.
"""

from __future__ import annotations

import re
import struct
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from PIL import ExifTags, JpegImagePlugin

from synth.surfaces.readers.image import READABLE, SAVE, opened, spacing_of_dpi, surface_of_pixels, wide_pixels
from synth.surfaces.readers.surface_file import SurfaceFile, check_shape, refuse_file

PNG = b"\x89PNG\r\n\x1a\n"
BITMAP_HEADERS = (12, 40, 52, 56, 64, 108, 124)
GREYMAPS, BITMAPS = (b"P2", b"P5"), (b"P1", b"P4")
LONGEST_HEADER = 4096  # bytes of a PGM, with its comments
METRES = 1  # unit of sCAL
HALF_WIDTH, HALF_BOTH = 1, 2  # Pillow's numbers for the chroma 4:2:2 and 4:2:0


def fits(head: bytes, _ending: str) -> bool:
    """Return whether the file begins as one of the formats does."""
    is_bitmap = head.startswith(b"BM") and struct.unpack("<I", head[14:18].ljust(4, b"\0"))[0] in BITMAP_HEADERS
    is_netpbm = head[:1] == b"P" and head[1:2] in b"12456f" and head[2:3].isspace() and len(head) > 2
    is_webp = head[:4] == b"RIFF" and head[8:12] == b"WEBP"
    return head.startswith((PNG, b"\xff\xd8\xff")) or is_bitmap or is_netpbm or is_webp


def read(path: Path, _ending: str) -> SurfaceFile:
    """Return the contents. Raises InvalidRequest, and OSError, SyntaxError or ValueError for a damaged file."""
    with path.open("rb") as file:
        header = file.read(32)
    bits, scale = 0, None
    if header.startswith(PNG):
        if len(header) < 26 or header[12:16] != b"IHDR":
            raise ValueError("it has no header")
        width, height, bits = struct.unpack(">IIB", header[16:25])
        check_shape((height, width))
        scale = _pixel_size(path)
    with opened(path) as image:
        kind = {"PPM": "PNM", "DIB": "BMP"}.get(image.format, str(image.format))
        dpi = image.info.get("dpi")
        exif = image.getexif()
        if kind == "JPEG" and not image.info.get("jfif_unit") and exif.get(ExifTags.Base.ResolutionUnit) == 1:
            dpi = None  # a ratio, without a unit
        spacing, notes = spacing_of_dpi(dpi) if dpi else (None, ())
        spacing = scale or spacing
        notes += _notes(image)
        orientation = exif.get(ExifTags.Base.Orientation, 1)
        pixels = wide_pixels(path) if bits == 16 and image.mode in ("RGB", "RGBA") else _pixels(image)
        no_unit = _no_unit(image, header)
        transparent = image.info.get("transparency") if image.mode != "P" else None
        lossy = kind == "JPEG" or (kind == "WEBP" and b"VP8 " in path.read_bytes()[:64])
        halved = _halved(image, lossy)
    found_bits = bits if bits and pixels.ndim == 2 and pixels.dtype == np.uint8 else 1 if header[:2] == b"P4" else None
    if isinstance(transparent, int | tuple) and pixels.dtype.kind == "u":
        pixels = _with_alpha(pixels, transparent, found_bits)
    if orientation != 1:
        pixels = turned(pixels, orientation)
        halved = halved[::-1] if orientation >= 5 else halved
        spacing = spacing and (spacing[::-1] if orientation >= 5 else spacing)
        notes = (*notes, "It was turned as its orientation tag says")
    most = _full_scale(path) if kind == "PNM" and header[:2] in GREYMAPS else None
    if most:
        pixels = np.rint(pixels * (most / np.iinfo(pixels.dtype).max)).astype(pixels.dtype)
    found = surface_of_pixels(kind, pixels, spacing, notes, lossy, found_bits, most, halved)
    return replace(found, no_unit=no_unit)


def _halved(image: Any, lossy: bool) -> tuple[bool, bool]:
    """Return whether the colours of a picture are kept at half the resolution along x, and along the columns."""
    if image.format != "JPEG":
        return lossy, lossy  # WebP has no other choice
    sampling = JpegImagePlugin.get_sampling(image)
    return sampling in (HALF_WIDTH, HALF_BOTH), sampling == HALF_BOTH


def _full_scale(path: Path) -> int | None:
    """Return the greatest number that a PGM states, or None if it is that of 8 or 16 bits, which Pillow keeps."""
    with path.open("rb") as file:
        words = re.sub(rb"#[^\n]*", b" ", file.read(LONGEST_HEADER)).split()
    most = int(words[3])
    return None if most in (255, 65535) else most


def _no_unit(image: Any, header: bytes) -> str:
    """Return why the numbers of a picture cannot be heights in a unit, or "": Pillow gives other ones than the file."""
    if image.mode in ("P", "PA") or (header.startswith(b"BM") and image.mode == "1"):
        return "its numbers are places in a palette"
    if header[:2] in BITMAPS:
        return "in it 1 is black and 0 is white"
    is_colour = header[:2] in (b"P3", b"P6")
    return "a PPM has three numbers at each point" if is_colour else ""


def turned(pixels: np.ndarray[Any, Any], orientation: int) -> np.ndarray[Any, Any]:
    """Return pixels [rows, columns, ...] as a tag of EXIF or TIFF says: 1 to 8. Others leave them as they are."""
    if orientation in (5, 6, 7, 8):
        pixels = np.swapaxes(pixels, 0, 1)
    if orientation in (2, 3, 6, 7):
        pixels = pixels[:, ::-1]
    if orientation in (3, 4, 7, 8):
        pixels = pixels[::-1]
    return pixels


def _pixels(image: Any) -> np.ndarray[Any, Any]:
    """Return the pixels, [rows, columns] or [rows, columns, channels]."""
    if image.mode == "1":
        return np.asarray(image).astype(np.uint8) * np.uint8(255)
    if image.mode in ("P", "PA"):
        is_clear = "transparency" in image.info or image.mode == "PA"
        return np.asarray(image.convert("RGBA" if is_clear else "RGB"))
    if image.mode == "I":  # PNM above 8 bits, which Pillow spreads over 16
        return np.asarray(image).astype(np.uint16)
    if image.mode in ("L", "LA", "RGB", "RGBA", "I;16", "I;16B", "F"):
        pixels = np.asarray(image)
        return pixels.astype(pixels.dtype.newbyteorder("="))
    refuse_file(f"a picture with pixels of the kind {image.mode}", READABLE, SAVE)


def _with_alpha(pixels: np.ndarray[Any, Any], clear: int | tuple[int, ...], bits: int | None) -> np.ndarray[Any, Any]:
    """Return pixels with an alpha channel that is 0 where they have the grey or the colour `clear`.

    bits: of a grey below 8 bits, which Pillow spreads over 8, and the transparent one with them.
    """
    highest = np.iinfo(pixels.dtype).max
    grey = clear * (highest // (2**bits - 1)) if isinstance(clear, int) and bits and bits < 8 else clear
    same = pixels == np.asarray(grey)
    channels = pixels if pixels.ndim == 3 else pixels[:, :, np.newaxis]
    same = np.all(same, axis=2) if same.ndim == 3 else same
    return np.dstack([channels, np.where(same, 0, highest).astype(pixels.dtype)])


def _notes(image: Any) -> tuple[str, ...]:
    """Return notes about what the picture states and what is not used."""
    notes: tuple[str, ...] = ()
    gamma = image.info.get("gamma")
    if "icc_profile" in image.info or (gamma and abs(gamma - 1.0) > 0.01):
        notes += ("Its colour profile was not applied: the numbers of a map of heights are linear",)
    aspect = image.info.get("aspect")
    if aspect and aspect[0] != aspect[1]:
        notes += (f"It states pixels that are not square ({aspect[1]} to {aspect[0]}): give two distances",)
    if getattr(image, "n_frames", 1) > 1:
        notes += (f"Of its {image.n_frames} pictures the first was read",)
    return notes


def _pixel_size(path: Path) -> tuple[float, float] | None:
    """Return the size of a pixel (m) that the chunk sCAL of a PNG states, or None."""
    with path.open("rb") as file:
        file.seek(len(PNG))
        while len(begin := file.read(8)) == 8:
            length, name = struct.unpack(">I4s", begin)
            if name == b"IDAT":
                return None
            if name == b"sCAL" and length < 100:
                unit, sizes = file.read(1), file.read(length - 1).split(b"\0")
                if unit == bytes([METRES]) and len(sizes) == 2 and all(float(size) > 0.0 for size in sizes):
                    return float(sizes[0]), float(sizes[1])
                return None
            file.seek(length + 4, 1)
    return None
