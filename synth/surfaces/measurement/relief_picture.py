"""A picture of a surface: an area lit from the upper left, a profile as a line.

Stage   SURFACES, from files.
Model   Brightness is the cosine of the angle between the surface's normal and the light (Lambert). Slopes are scaled to
        an rms of RMS_SHOWN, because those of most surfaces are too small to see.
        A mark below the relief says which waves of the texture are synthetic. They are not drawn: the picture shows
        what was measured. The mark is also a text of the PNG, "Description".
Limits  A picture shows the form, not the height. Large surfaces are averaged over blocks of points.
"""

from __future__ import annotations

import io
import math
from collections.abc import Mapping
from itertools import pairwise
from typing import Any

import numpy as np
from PIL import Image, ImageDraw, ImageFont
from PIL.PngImagePlugin import PngInfo

from synth.scene.quantity import Dimension, show_quantity
from synth.surfaces.readers.surface_file import Heights

WIDEST = 480  # pixels
RMS_SHOWN = 0.4
LIGHT = (-0.5, -0.5, 0.7071)  # from the upper left, 45 degrees high
MARK_HEIGHT = 16  # pixels of the mark
LINE_HEIGHT = 160  # pixels of the picture of a profile


def relief_picture(heights: Heights, spacing: tuple[float, ...], mark: str = "") -> bytes:
    """Return a PNG of `heights` (m), [n] or [rows, columns].

    spacing: m, between columns, then rows.
    mark: a line of text below it; "" for none.
    """
    grey = _line(heights) if heights.ndim == 1 else _relief(heights, spacing)
    picture = Image.fromarray(np.clip(np.rint(grey), 0, 255).astype(np.uint8))
    written, texts = io.BytesIO(), PngInfo()
    if mark:
        picture = _marked(picture, mark)
        texts.add_text("Description", mark)
    picture.save(written, "PNG", pnginfo=texts)
    return written.getvalue()


def mark_of(report: Mapping[str, Any]) -> str:
    """Return the mark of a surface with this report of its import."""
    waves = report.get("synthetic")
    if not waves:
        return ""
    longest, shortest = (show_quantity(float(f"{waves[end]:.3g}"), Dimension.LENGTH) for end in ("longest", "shortest"))
    return f"synthetic, not shown: waves of {longest} to {shortest}"


def _marked(picture: Image.Image, mark: str) -> Image.Image:
    """Return the picture above a line of text, at least as wide as the text."""
    font = ImageFont.load_default(MARK_HEIGHT - 4)
    width = max(picture.width, math.ceil(font.getlength(mark)) + 8)
    found = Image.new("L", (width, picture.height + MARK_HEIGHT), 255)
    found.paste(picture, (0, 0))
    ImageDraw.Draw(found).text((4, picture.height), mark, fill=0, font=font)
    return found


def _relief(heights: Heights, spacing: tuple[float, ...]) -> Heights:
    widest = max(1, math.ceil(max(heights.shape) / WIDEST))
    block, wide = (min(widest, count // 2) for count in heights.shape)  # two blocks at least, for a slope
    rows, columns = heights.shape[0] // block, heights.shape[1] // wide
    means = heights[: rows * block, : columns * wide].reshape(rows, block, columns, wide).mean(axis=(1, 3))
    down, across = np.gradient(means, block * spacing[1], wide * spacing[0])
    size = math.sqrt(float(np.mean(across**2 + down**2)))
    shown = RMS_SHOWN / size if size else 0.0
    normal = np.sqrt(1.0 + (shown * across) ** 2 + (shown * down) ** 2)
    lit = (-shown * across * LIGHT[0] - shown * down * LIGHT[1] + LIGHT[2]) / normal
    return np.asarray(255.0 * np.clip(lit, 0.0, 1.0))


def _line(heights: Heights) -> Heights:
    """Return the profile as a line: in each column of pixels from the lowest to the highest of its points."""
    columns = min(WIDEST, len(heights))
    edges = np.linspace(0, len(heights) - 1, columns + 1).astype(int)
    low, high = float(np.min(heights)), float(np.max(heights))
    scale = (LINE_HEIGHT - 9) / (high - low) if high > low else 0.0
    grey = np.full((LINE_HEIGHT, columns), 245.0)
    for column, (begin, end) in enumerate(pairwise(edges)):
        part = (heights[begin : end + 1] - low) * scale
        top, bottom = LINE_HEIGHT - 5 - int(np.max(part)), LINE_HEIGHT - 4 - int(np.min(part))
        grey[top : bottom + 1, column] = 40.0
    return grey
