"""Displacement maps in the kinds of pictures that programs and material libraries write: every one with its heights."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tifffile
from PIL import Image

from synth.errors import InvalidRequest
from synth.surfaces.measurement.import_options import ImportOptions
from synth.surfaces.measurement.importing import import_surface

HEIGHT, SPACING = 120e-6, 50e-6
GREY = np.arange(40, dtype=float).reshape(5, 8) / 39.0
"""Heights from 0 to 1, none twice, so that any turn or loss of bits shows."""


def png(pixels: np.ndarray[Any, Any], bits: int, colour: int) -> bytes:
    """Return a PNG of 8 or 16 bits, written here: colour 0 grey, 2 RGB, 4 grey with alpha, 6 RGBA."""
    rows = pixels.astype(">u2" if bits == 16 else "u1")
    raw = b"".join(b"\0" + row.tobytes() for row in rows)
    header = struct.pack(">IIBBBBB", pixels.shape[1], pixels.shape[0], bits, colour, 0, 0, 0)
    parts = ((b"IHDR", header), (b"IDAT", zlib.compress(raw)), (b"IEND", b""))
    chunks = (struct.pack(">I", len(d)) + k + d + struct.pack(">I", zlib.crc32(k + d)) for k, d in parts)
    return b"\x89PNG\r\n\x1a\n" + b"".join(chunks)


def whole(bits: int) -> np.ndarray[Any, Any]:
    return np.asarray(np.round(GREY * (2**bits - 1)))


def rgb(bits: int) -> np.ndarray[Any, Any]:
    return np.repeat(whole(bits)[..., np.newaxis], 3, axis=2)


def with_alpha(values: np.ndarray[Any, Any], bits: int) -> np.ndarray[Any, Any]:
    stacked = values if values.ndim == 3 else values[..., np.newaxis]
    return np.concatenate([stacked, np.full((*values.shape[:2], 1), 2**bits - 1)], axis=2)


def saved(mode: str, **how: Any) -> Callable[[Path], None]:
    return lambda path: Image.fromarray(whole(8).astype(np.uint8)).convert(mode).save(path, **how)


def palette(path: Path) -> None:
    """A palette whose greys fall while its indices rise."""
    image = Image.fromarray((39 - np.arange(40).reshape(5, 8)).astype(np.uint8), mode="P")
    greys = np.round(np.arange(40)[::-1] / 39.0 * 255.0).astype(int)
    image.putpalette(np.repeat(greys, 3).tolist())
    image.save(path)


KINDS: dict[str, tuple[str, Callable[[Path], Any], float]] = {
    "grey of 8 bits": ("a.png", lambda p: p.write_bytes(png(whole(8), 8, 0)), 1 / 255),
    "grey of 16 bits": ("a.png", lambda p: p.write_bytes(png(whole(16), 16, 0)), 1 / 65535),
    "RGB of 8 bits": ("a.png", lambda p: p.write_bytes(png(rgb(8), 8, 2)), 1 / 255),
    "RGB of 16 bits": ("a.png", lambda p: p.write_bytes(png(rgb(16), 16, 2)), 1 / 65535),
    "RGBA of 8 bits": ("a.png", lambda p: p.write_bytes(png(with_alpha(rgb(8), 8), 8, 6)), 1 / 255),
    "RGBA of 16 bits": ("a.png", lambda p: p.write_bytes(png(with_alpha(rgb(16), 16), 16, 6)), 1 / 65535),
    "grey with alpha, 8 bits": ("a.png", lambda p: p.write_bytes(png(with_alpha(whole(8), 8), 8, 4)), 1 / 255),
    "grey with alpha, 16 bits": ("a.png", lambda p: p.write_bytes(png(with_alpha(whole(16), 16), 16, 4)), 1 / 65535),
    "palette of greys": ("a.png", palette, 1 / 255),
    "named as another format": ("a.jpg", lambda p: p.write_bytes(png(whole(16), 16, 0)), 1 / 65535),
    "BMP": ("a.bmp", saved("L"), 1 / 255),
    "BMP in RGB": ("a.bmp", saved("RGB"), 1 / 255),
    "WebP without loss": ("a.webp", saved("RGB", lossless=True), 1 / 255),
    "JPEG": ("a.jpg", saved("L", quality=100, subsampling=0), 3 / 255),
    "JPEG in RGB": ("a.jpeg", saved("RGB", quality=100, subsampling=0), 3 / 255),
    "PGM": ("a.pgm", saved("L"), 1 / 255),
    "TIFF of 16 bits": ("a.tif", lambda p: tifffile.imwrite(p, whole(16).astype(np.uint16)), 1 / 65535),
    "TIFF of 16 bits, Deflate": (
        "a.tif",
        lambda p: tifffile.imwrite(p, whole(16).astype(np.uint16), compression="zlib"),
        1 / 65535,
    ),
    "TIFF where 0 is white": (
        "a.tif",
        lambda p: tifffile.imwrite(p, (65535 - whole(16)).astype(np.uint16), photometric="miniswhite"),
        1 / 65535,
    ),
    "TIFF of 8 bits, LZW": ("a.tif", saved("L", compression="tiff_lzw"), 1 / 255),
}


@pytest.mark.parametrize("kind", KINDS)
def test_a_displacement_map_has_its_heights_in_every_kind_of_picture(kind: str, tmp_path: Path) -> None:
    name, write, step = KINDS[kind]
    write(tmp_path / name)
    options = ImportOptions(pixel=(SPACING, SPACING), height=HEIGHT, level="none")
    found = import_surface(tmp_path / name, options, "map")
    heights = np.asarray(found.heights, dtype=float)
    wanted = HEIGHT * (GREY - GREY.mean())
    flipped = [wanted, wanted[::-1]]  # rows from the top down or the bottom up, as the surface keeps them
    assert min(float(np.max(np.abs(heights - one))) for one in flipped) <= HEIGHT * step


@pytest.mark.parametrize("dpi", [1, 72, 96, 144, 180, 300, 360, 400, 2400])
def test_a_resolution_for_printers_is_no_distance_between_points(dpi: int, tmp_path: Path) -> None:
    path = tmp_path / "print.tif"
    tifffile.imwrite(path, whole(16).astype(np.uint16), resolution=(dpi, dpi), resolutionunit="INCH")
    with pytest.raises(InvalidRequest, match="pixel"):
        import_surface(path, ImportOptions(height=HEIGHT), "map")
