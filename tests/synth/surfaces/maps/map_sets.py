"""Sets of maps in the layouts of three libraries, made of surfaces that are known exactly."""

from __future__ import annotations

import io
import math
import zipfile
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import tifffile
from PIL import Image

Array = np.ndarray[Any, Any]
SIDE = 256  # pixels
WIDTH = 0.08  # m
PIXEL = WIDTH / SIDE
RMS_HEIGHT = 0.12e-3  # m


def surface(seed: int, hurst: float = 0.9, side: int = SIDE, rms: float = RMS_HEIGHT) -> Array:
    """Return a periodic random surface, m [side, side], with a power that falls as q^-(2 + 2 hurst)."""
    random, places = np.random.default_rng([77, seed]), np.fft.fftfreq(side)
    q = np.hypot(places[:, np.newaxis], places)
    q[0, 0] = np.inf
    heights = np.fft.ifft2(np.fft.fft2(random.normal(size=q.shape)) * q ** -(1.0 + hurst)).real
    return np.asarray(heights * rms / np.std(heights))


def slopes(heights: Array, pixel: float) -> tuple[Array, Array]:
    """Return the slopes from column to column and from row to row, exact for a sum of waves."""
    series, found = np.fft.fft2(heights), []
    for axis in (1, 0):
        waves = 2j * math.pi * np.fft.fftfreq(heights.shape[axis], pixel)
        waves[heights.shape[axis] // 2] = 0.0
        found.append(np.fft.ifft2(series * (waves if axis else waves[:, np.newaxis])).real)
    return found[0], found[1]


def whole(values: Array, bits: int) -> Array:
    """Return numbers from 0 to 1 as whole numbers."""
    return np.asarray(np.rint(values * (2**bits - 1)).astype(f"u{bits // 8}"))


def displacement(heights: Array, bits: int, middle: float = 0.5) -> Array:
    """Return a displacement map whose mean is grey `middle`."""
    return whole(middle + 0.95 * min(middle, 1.0 - middle) * heights / np.max(np.abs(heights)), bits)


def normals(heights: Array, pixel: float, green: str, bits: int) -> Array:
    """Return a normal map, rows from the top down."""
    along, down = slopes(heights, pixel)
    length = np.sqrt(1.0 + along**2 + down**2)
    vertical = down / length if green == "up" else -down / length
    return whole(0.5 + 0.5 * np.stack([-along / length, vertical, 1.0 / length], axis=2), bits)


def grey(value: float, bits: int = 8) -> Array:
    """Return a map of one number."""
    return whole(np.full((SIDE, SIDE), value), bits)


def file_of(pixels: Array, ending: str) -> bytes:
    """Return a picture file."""
    written = io.BytesIO()
    if ending in ("tif", "tiff"):
        tifffile.imwrite(written, pixels, photometric="rgb" if pixels.ndim == 3 else "minisblack")
    else:
        options = {"quality": 95, "subsampling": 2} if ending == "jpg" else {}
        Image.fromarray(pixels).save(written, "JPEG" if ending == "jpg" else "PNG", **options)
    return written.getvalue()


@dataclass(frozen=True)
class Case:
    """A set.

    files: returns the files of a surface by their names.
    zipped: whether they are packed.
    options: of the import, beside the width.
    green, residual: what the import finds; residual: the largest that is right.
    error: the largest error of the heights, rms relative to the surface's.
    slope: the largest error of the rms slope.
    """

    files: Callable[[Array], dict[str, bytes]]
    zipped: bool
    green: str | None = "up"
    residual: float | None = 0.04
    error: float = 0.005
    slope: float = 0.03
    options: dict[str, str] = field(default_factory=dict)


def made(case: Case, heights: Array, folder: Path, name: str = "Wall") -> Path:
    """Write the set of `heights` (m) into `folder`, and return its path."""
    files = case.files(heights)
    if case.zipped:
        path = folder / f"{name}.zip"
        with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as packed:
            for one, content in files.items():
                packed.writestr(one, content)
        return path
    for one, content in files.items():
        path = folder / name / one
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)
    return folder / name


def _others(begin: str, *names: str) -> dict[str, bytes]:
    colour = np.random.default_rng(5).integers(0, 255, (8, 8, 3)).astype(np.uint8)
    return {f"{begin}{name}": file_of(colour, name[-3:]) if name[-3:] in ("png", "jpg") else b"#usda" for name in names}


def poly_haven(heights: Array) -> dict[str, bytes]:
    """16-bit displacement, green up, 8-bit normals."""
    return {
        "wall_disp_2k.png": file_of(displacement(heights, 16), "png"),
        "wall_nor_gl_2k.png": file_of(normals(heights, PIXEL, "up", 8), "png"),
        "wall_rough_2k.png": file_of(grey(0.6), "png"),
        **_others("wall_", "diff_2k.jpg", "ao_2k.png"),
    }


def poly_haven_packed(heights: Array) -> dict[str, bytes]:
    """Green down, roughness in the green channel of a packed map, in a folder of the ZIP file."""
    packed = np.stack([grey(0.9), grey(0.6), grey(0.0)], axis=2)
    return {
        "textures/WALL_DISP_1K.PNG": file_of(displacement(heights, 16, 0.3), "png"),
        "textures/WALL_NOR_DX_1K.PNG": file_of(normals(heights, PIXEL, "down", 8), "png"),
        "textures/WALL_ARM_1K.PNG": file_of(packed, "png"),
        "wall.blend": b"BLENDER",
    }


def poly_haven_alone(heights: Array) -> dict[str, bytes]:
    """A displacement map alone."""
    return {"wall_disp_4k.png": file_of(displacement(heights, 16), "png"), **_others("wall_", "diff_4k.png")}


def ambient(heights: Array) -> dict[str, bytes]:
    """Both directions of green, 16-bit displacement, PNG."""
    return {
        "Wall012_2K-PNG_Displacement.png": file_of(displacement(heights, 16), "png"),
        "Wall012_2K-PNG_NormalGL.png": file_of(normals(heights, PIXEL, "up", 8), "png"),
        "Wall012_2K-PNG_NormalDX.png": file_of(normals(heights, PIXEL, "down", 8), "png"),
        "Wall012_2K-PNG_Roughness.png": file_of(grey(0.6), "png"),
        **_others("Wall012", ".png", "_2K-PNG.usda", "_2K-PNG.mtlx", "_2K-PNG_Color.png"),
    }


def ambient_jpeg(heights: Array) -> dict[str, bytes]:
    """JPEG with chroma 4:2:0, with a grey displacement as RGB."""
    depth = displacement(heights, 8)
    return {
        "Wall012_2K-JPG_Displacement.jpg": file_of(np.stack([depth] * 3, axis=2), "jpg"),
        "Wall012_2K-JPG_NormalGL.jpg": file_of(normals(heights, PIXEL, "up", 8), "jpg"),
        "Wall012_2K-JPG_Roughness.jpg": file_of(grey(0.6), "jpg"),
    }


def ambient_jpeg_normals(heights: Array) -> dict[str, bytes]:
    """A normal map alone, as JPEG."""
    return {"Wall012_2K-JPG_NormalGL.jpg": file_of(normals(heights, PIXEL, "up", 8), "jpg")}


def ambient_eight_bits(heights: Array) -> dict[str, bytes]:
    """8-bit displacement as RGB, green down."""
    depth = displacement(heights, 8)
    return {
        "Wall012_1K-PNG_Displacement.png": file_of(np.stack([depth] * 3, axis=2), "png"),
        "Wall012_1K-PNG_NormalDX.png": file_of(normals(heights, PIXEL, "down", 8), "png"),
    }


def ambient_normals(heights: Array) -> dict[str, bytes]:
    """A normal map alone, green down."""
    return {"Wall012_8K-PNG_NormalDX.png": file_of(normals(heights, PIXEL, "down", 8), "png")}


def poliigon(heights: Array) -> dict[str, bytes]:
    """TIFF of 16 bits."""
    return {
        "Poliigon_Wall_7787_Displacement.tiff": file_of(displacement(heights, 16), "tiff"),
        "Poliigon_Wall_7787_Normal.tiff": file_of(normals(heights, PIXEL, "up", 16), "tiff"),
        "Poliigon_Wall_7787_Roughness.tiff": file_of(grey(0.6, 16), "tiff"),
        **_others("Poliigon_Wall_7787_", "BaseColor.jpg", "AmbientOcclusion.jpg"),
    }


def poliigon_down(heights: Array) -> dict[str, bytes]:
    """8 bits, with green down although the name does not say so."""
    return {
        "Poliigon_Wall_7787_Displacement.png": file_of(displacement(heights, 8), "png"),
        "Poliigon_Wall_7787_Normal.png": file_of(normals(heights, PIXEL, "down", 8), "png"),
        "Poliigon_Wall_7787_Roughness.png": file_of(grey(0.6), "png"),
    }


def poliigon_normals(heights: Array) -> dict[str, bytes]:
    """A normal map of 16 bits alone, with green down although the name does not say so."""
    return {"Wall_Normal.tif": file_of(normals(heights, PIXEL, "down", 16), "tif")}


CASES = {
    "Poly Haven, folder": Case(poly_haven, False),
    "Poly Haven, packed, ZIP": Case(poly_haven_packed, True, "down"),
    "Poly Haven, displacement": Case(poly_haven_alone, False, None, None, 1e-4),
    "ambientCG, ZIP": Case(ambient, True),
    "ambientCG, JPEG, folder": Case(ambient_jpeg, False, residual=0.15, error=0.04, slope=0.1),
    "ambientCG, 8 bits, ZIP": Case(ambient_eight_bits, True, "down", 0.05, 0.02),
    "ambientCG, normals, ZIP": Case(ambient_normals, True, "down", None, 0.02),
    "Poliigon, 16 bits, folder": Case(poliigon, False, residual=0.002, error=0.002),
    "Poliigon, green down, ZIP": Case(poliigon_down, True, "down", 0.05, 0.02),
    "Poliigon, normals, folder": Case(poliigon_normals, False, "down", None, 0.002),
    "ambientCG, JPEG normals, ZIP": Case(ambient_jpeg_normals, True, residual=None, error=0.06, slope=0.15),
}
