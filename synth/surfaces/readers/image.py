"""What PNG and TIFF images have in common: pixels as heights, and resolution tags as distances.

Stage   SURFACES, from files.
Model   A grey image of unsigned whole numbers is a displacement map: 0 is its lowest point, and the largest number of
        its type the highest. Its height in metres must be given. Other numbers are heights. Rows are along y, from the
        top of the image down.
Source  Pillow decodes the pixels. No gamma curve is undone: a displacement map holds numbers, not brightness.
Limits  Programs write resolutions of 72, 96, 150, 300, 600 or 1200 dots per inch for screens and printers. These are
        not used as distances.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image, UnidentifiedImageError

from synth.surfaces.readers.surface_file import MOST_POINTS, SurfaceFile, check_shape, finite_heights, refuse_file

INCH = 0.0254  # m
USUAL_DPI = (72.0, 96.0, 150.0, 300.0, 600.0, 1200.0)
ROUNDED_DPI = 0.02  # dots per inch: PNG stores whole dots per metre
FEW_STEPS = 256
READABLE = "grey of 8 or 16 bits, real numbers of 32 bits (TIFF), or RGB of 8 bits"
SAVE = "Save it as one of these, or copy it again."


@contextmanager
def opened(path: Path) -> Iterator[Any]:
    """Yield the image at `path`, whose pixels are not yet decoded. Raises InvalidRequest if it cannot be read."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # about damaged tags, without which the pixels can be read
            with Image.open(path, formats=("PNG", "TIFF")) as image:
                check_shape(image.size[::-1])
                yield image
    except Image.DecompressionBombError:
        refuse_file("more pixels than memory has room for", f"at most {MOST_POINTS} points", "Crop the image.")
    except UnidentifiedImageError as error:
        refuse_file("an image that is damaged, or whose kind of pixels is not supported", READABLE, SAVE, error)


def spacing_of_dpi(dpi: tuple[float, float] | None) -> tuple[tuple[float, float] | None, tuple[str, ...]]:
    """Return the distances (m) of a resolution in dots per inch, and notes. The distances are None if it has none."""
    if dpi is None or not all(np.isfinite(value) and value > 0.0 for value in dpi):
        return None, ()
    if all(min(abs(value - usual) for usual in USUAL_DPI) < ROUNDED_DPI for value in dpi):
        return None, (f"Its tag of {round(dpi[0])} dots per inch is a usual setting of programs, and was not used",)
    return (INCH / float(dpi[0]), INCH / float(dpi[1])), ()


def displacement_map(
    kind: str,
    pixels: np.ndarray[Any, Any],
    spacing: tuple[float, float] | None,
    notes: tuple[str, ...],
) -> SurfaceFile:
    """Return a grey image. Unsigned whole numbers are a displacement map, others are heights.

    spacing: m, or None.
    """
    if pixels.ndim != 2:
        refuse_file(f"{kind} with {pixels.shape[-1]} channels", "a grey image of 8 or 16 bits", "Save it as grey.")
    heights, missing = finite_heights(pixels)
    full_scale: float | None = None
    if pixels.dtype.kind != "u":
        layout = f"an image of {pixels.dtype} numbers, which are heights"
    else:
        full_scale = float(np.iinfo(pixels.dtype).max)
        layout = f"a displacement map of {8 * pixels.dtype.itemsize} bits"
    if full_scale is not None and full_scale < FEW_STEPS:
        notes = (*notes, f"A map of 8 bits has {FEW_STEPS} heights only: its steps may be felt")
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
