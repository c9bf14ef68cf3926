"""What pictures have in common: pixels as heights, resolution tags as distances, and what the form of a picture costs.

Stage   SURFACES, from files.
Model   A grey picture of unsigned whole numbers is a displacement map: 0 is its lowest point, and the largest number of
        its type the highest. Its height in metres must be given. Other numbers are heights. Three equal channels are
        one. A picture in colour is a normal map if its colours are unit vectors. Pixels that are wholly transparent are
        missing points. Rows are along y, from the top of the picture down.
Source  Pillow decodes the pixels. No gamma curve and no colour profile is applied: a displacement map holds numbers,
        not brightness.
Limits  Programs write resolutions for screens and printers that nobody measured. A resolution is used as a distance
        only from LEAST_DPI on.
"""

from __future__ import annotations

import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image, UnidentifiedImageError

from synth.surfaces.readers import normal_map
from synth.surfaces.readers.surface_file import MOST_POINTS, SurfaceFile, check_shape, finite_heights, refuse_file

INCH = 0.0254  # m
LEAST_DPI = 2540.0  # 10 um a pixel: coarser ones, 72 to 2400, are those of screens, printers and scanners' defaults
ROUNDED_DPI = 0.02  # dots per inch: PNG stores whole dots per metre
BYTE = 8  # bits
LOSSY_GREY = 6  # of 255: permitted difference of the channels of a grey picture that was compressed with loss
PICTURES = ("PNG", "TIFF", "JPEG", "BMP", "DIB", "WEBP", "PPM")
READABLE = "grey of 1 to 16 bits, real numbers of 32 or 64 bits (TIFF), or RGB of 8 or 16 bits"
SAVE = "Save it as one of these, or copy it again."


@contextmanager
def opened(path: Path) -> Iterator[Any]:
    """Yield the picture at `path`, whose pixels are not yet decoded. Raises InvalidRequest if it cannot be read."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # about damaged tags, without which the pixels can be read
            with Image.open(path, formats=PICTURES) as image:
                check_shape(image.size[::-1])
                yield image
    except Image.DecompressionBombError:
        refuse_file("more pixels than memory has room for", f"at most {MOST_POINTS} points", "Crop the image.")
    except UnidentifiedImageError as error:
        refuse_file("an image that is damaged, or whose kind of pixels is not supported", READABLE, SAVE, error)


def wide_pixels(path: Path) -> np.ndarray[Any, Any]:
    """Return the pixels of a picture in colour of 16 bits a channel, uint16 [rows, columns, channels].

    Pillow keeps 8 bits of a channel, and decodes the bytes that a raw mode names. So the picture is decoded twice: for
    the high bytes, and for the low ones. Grey with alpha has the size of four channels of 8 bits, and is decoded once.
    """
    halves = []
    for swapped in (False, True):
        with opened(path) as image:
            raw_mode = image.tile[0].args if isinstance(image.tile[0].args, str) else image.tile[0].args[0]
            if raw_mode == "LA;16B":
                _set_raw_mode(image, "RGBA")
                four = np.asarray(image).astype(np.uint16)
                return four[:, :, ::2] << 8 | four[:, :, 1::2]
            if swapped:
                order = {"B": "L", "L": "B", "N": "B" if sys.byteorder == "little" else "L"}
                if raw_mode[-4:-1] != ";16":
                    refuse_file("colours of 16 bits in an unusual order", READABLE, SAVE)
                _set_raw_mode(image, raw_mode[:-1] + order[raw_mode[-1]])
            halves.append(np.asarray(image).astype(np.uint16))
    return halves[0] << 8 | halves[1]


def _set_raw_mode(image: Any, raw_mode: str) -> None:
    image.tile = [
        tile._replace(args=raw_mode if isinstance(tile.args, str) else (raw_mode, *tile.args[1:]))
        for tile in image.tile
    ]


def spacing_of_dpi(dpi: tuple[float, float] | None) -> tuple[tuple[float, float] | None, tuple[str, ...]]:
    """Return the distances (m) of a resolution in dots per inch, and notes. The distances are None if it has none."""
    if dpi is None or not all(np.isfinite(value) and value > 0.0 for value in dpi):
        return None, ()
    if max(dpi) <= 1.0:
        return None, ()  # what programs write that know none
    shown = " x ".join(f"{value:.5g}" for value in dict.fromkeys(dpi))
    if min(dpi) < LEAST_DPI - ROUNDED_DPI:
        return None, (f"Its tag of {shown} dots per inch may be a setting of a program, and was not used",)
    note = f"The distance between its pixels is that of its resolution tag, {shown} dots per inch"
    return (INCH / float(dpi[0]), INCH / float(dpi[1])), (note,)


def surface_of_pixels(
    kind: str,
    pixels: np.ndarray[Any, Any],
    spacing: tuple[float, float] | None,
    notes: tuple[str, ...],
    lossy: bool = False,
    bits: int | None = None,
    most: int | None = None,
    halved: tuple[bool, bool] = (False, False),
) -> SurfaceFile:
    """Return the surface in a picture.

    pixels: [rows, columns], or [rows, columns, channels]: grey and alpha, RGB, or RGB and alpha.
    spacing: m, or None.
    lossy: whether the picture was compressed with loss.
    bits: of a grey below 8 bits that was spread over 8; the heights are its own numbers.
    most: the number of full scale, where it is not the largest one of the type.
    halved: whether its colours were kept at half the resolution along x, and along the columns.
    """
    clear = None
    if pixels.ndim == 3 and pixels.shape[2] in (2, 4):
        alpha, pixels = pixels[:, :, -1], pixels[:, :, :-1]
        clear, notes = _clear(alpha, notes)
    if pixels.ndim == 3 and pixels.shape[2] == 1:
        pixels = pixels[:, :, 0]
    if lossy:
        notes = (*notes, f"{kind} is compressed with loss: its blocks and waves are heights now")
    if pixels.ndim == 3:
        grey = _grey(pixels, lossy)
        if grey is None:
            return normal_map.surface_of(kind, pixels, spacing, notes, halved)
        pixels, notes = grey, (*notes, "Its three channels are equal, and were read as one")
    found = displacement_map(kind, pixels, spacing, notes, bits, most)
    return found if clear is None else replace(found, missing=found.missing | clear)


def _clear(alpha: np.ndarray[Any, Any], notes: tuple[str, ...]) -> tuple[Any, tuple[str, ...]]:
    """Return which pixels are wholly transparent, or None, and the notes with one about the others."""
    opaque = np.iinfo(alpha.dtype).max if alpha.dtype.kind == "u" else 1
    if np.all(alpha == opaque):
        return None, notes
    clear = alpha == 0
    if np.any((alpha != opaque) & ~clear):
        notes = (*notes, "Its transparency was not used, but for pixels that are wholly transparent: they are missing")
    if np.all(clear):
        return None, (*notes, "All its pixels are transparent: the transparency was not used")
    return clear, notes


def _grey(pixels: np.ndarray[Any, Any], lossy: bool) -> np.ndarray[Any, Any] | None:
    """Return the grey of pixels [rows, columns, 3] whose channels are equal, or None."""
    low, high = np.min(pixels, axis=2), np.max(pixels, axis=2)
    if not lossy:
        return pixels[:, :, 1] if np.array_equal(low, high) else None
    return pixels[:, :, 1] if np.max(high - low) <= LOSSY_GREY else None


def displacement_map(
    kind: str,
    pixels: np.ndarray[Any, Any],
    spacing: tuple[float, float] | None,
    notes: tuple[str, ...],
    bits: int | None = None,
    most: int | None = None,
) -> SurfaceFile:
    """Return a grey image. Unsigned whole numbers are a displacement map, others are heights.

    spacing: m, or None.
    bits, most: as for `surface_of_pixels`.
    """
    if pixels.ndim != 2:
        refuse_file(f"{kind} with {pixels.shape[-1]} channels", "a grey image of 8 or 16 bits", "Save it as grey.")
    heights, missing = finite_heights(pixels)
    full_scale: float | None = None
    bits = bits or 8 * pixels.dtype.itemsize
    counted = "1 bit" if bits == 1 else f"{bits} bits"
    if pixels.dtype.kind == "u":
        full_scale = float(most or np.iinfo(pixels.dtype).max)
        if bits < BYTE and not most:
            heights, full_scale = np.rint(heights * (2**bits - 1) / full_scale), 2.0**bits - 1.0
        layout = f"a displacement map of {counted}"
        if most:
            layout += f", from 0 to {most}"
    else:
        layout = f"an image of {pixels.dtype} numbers, which are heights"
        if pixels.dtype.kind == "f" and np.min(heights) >= 0.0 and 0.0 < np.max(heights) <= 1.0:
            full_scale = 1.0
            layout = f"an image of {pixels.dtype} numbers from 0 to 1: heights, or a displacement map"
    if pixels.dtype.kind == "u" and bits <= 8:
        notes = (
            *notes,
            f"A map of {counted} has {2**bits} heights only: its steps may be felt",
        )
    unit = None if spacing is None else "m"
    return SurfaceFile(
        kind,
        layout,
        heights,
        missing,
        spacing=spacing,
        spacing_unit=unit,
        full_scale=full_scale,
        tagged=True,
        notes=notes,
    )
