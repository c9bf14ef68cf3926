"""Normal maps whose colours are kept at half the resolution, as JPEG and WebP do: heights and slopes of known surfaces.

The surfaces reach up to the wave number of the pixel. The bounds are those of docs/import.md.
"""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from synth.errors import InvalidRequest
from synth.surfaces.measurement.import_options import read_options
from synth.surfaces.measurement.import_report import ImportedSurface
from synth.surfaces.measurement.importing import import_surface
from tests.synth.surfaces.maps.map_sets import PIXEL, SIDE, WIDTH, Array, displacement, normals, slopes, surface

JPEG: dict[str, Any] = {"format": "JPEG", "quality": 95, "subsampling": 2}


def picture(pixels: Array, **how: Any) -> bytes:
    written = io.BytesIO()
    Image.fromarray(pixels).save(written, **how)
    return written.getvalue()


def imported(folder: Path, **files: bytes) -> ImportedSurface:
    for name, content in files.items():
        (folder / name.replace("__", ".")).write_bytes(content)
    return import_surface(folder, read_options({"width": WIDTH}))


def steep(seed: int, slope: float) -> Array:
    """Return a surface with the rms slope `slope` along each axis, m."""
    heights = surface(seed, hurst=0.7)
    return heights * slope / float(np.std(slopes(heights, PIXEL)))


def band_error(found: Array, own: Array, low: float, high: float) -> float:
    """Return the rms error of the waves with `low` to `high` cycles a pixel, relative to their own rms."""
    q = np.hypot(np.fft.fftfreq(SIDE), np.fft.fftfreq(SIDE)[:, np.newaxis])
    one, two = (np.fft.fft2(heights)[(q > low) & (q <= high)] for heights in (found - own, own))
    return float(np.linalg.norm(one) / np.linalg.norm(two))


BOUNDS = [(0.04, 0.025, 0.11, 0.75), (0.08, 0.015, 0.06, 0.5), (0.3, 0.015, 0.06, 0.5), (0.5, 0.045, 0.06, 0.5)]
"""rms slope, and the greatest errors: of the rms height, of the rms slope, and of waves of 2 to 4 pixels."""


@pytest.mark.parametrize("bounds", BOUNDS, ids=lambda bounds: f"slope {bounds[0]}")
@pytest.mark.parametrize("green", ["up", "down"])
@pytest.mark.parametrize(
    "how",
    [JPEG, {**JPEG, "subsampling": 1}, {"format": "WEBP", "quality": 98}],
    ids=["4:2:0", "4:2:2", "WebP"],
)
def test_normals_alone_give_heights_and_slopes(
    how: dict[str, Any], green: str, bounds: tuple[float, ...], tmp_path: Path
) -> None:
    slope, of_height, of_slope, of_finest = bounds
    heights = steep(1, slope)
    name = f"wall_nor_{'gl' if green == 'up' else 'dx'}__{how['format'].lower()}"
    found = imported(tmp_path, **{name: picture(normals(heights, PIXEL, green, 8), **how)})
    assert np.std(found.heights) == pytest.approx(np.std(heights), rel=of_height)
    for one, own in zip(slopes(found.heights, PIXEL), slopes(heights, PIXEL), strict=True):
        assert np.std(one) == pytest.approx(np.std(own), rel=of_slope)
    assert band_error(found.heights, heights, 0.25, 0.5) < of_finest
    assert any("half the resolution" in note for note in found.report["notes"])


@pytest.mark.parametrize(("slope", "error"), [(0.02, 0.025), (0.04, 0.015), (0.08, 0.015), (0.3, 0.015), (0.5, 0.04)])
def test_a_displacement_gets_its_height(slope: float, error: float, tmp_path: Path) -> None:
    heights = steep(2, slope)
    depth = np.stack([displacement(heights, 8)] * 3, axis=2)
    colours = normals(heights, PIXEL, "up", 8)
    found = imported(tmp_path, W_Displacement__jpg=picture(depth, **JPEG), W_NormalGL__jpg=picture(colours, **JPEG))
    assert np.std(found.heights) == pytest.approx(np.std(heights), rel=error)


def test_waves_of_twelve_pixels_give_the_height_as_longer_ones_do(tmp_path: Path) -> None:
    """A cloth without longer waves."""
    place = np.arange(240) * 2.0 * np.pi / 12.0
    heights = 0.2e-3 * (np.sin(place) + np.cos(place)[:, np.newaxis])
    depth, colours = displacement(heights, 16), normals(heights, WIDTH / 240, "up", 8)
    found = imported(tmp_path, cloth_disp__png=picture(depth, format="PNG"), cloth_nor_gl__jpg=picture(colours, **JPEG))
    assert np.std(found.heights) == pytest.approx(np.std(heights), rel=0.03)


def test_without_halved_colours_nothing_is_restored(tmp_path: Path) -> None:
    heights = steep(3, 0.08)
    found = imported(tmp_path, wall_nor_gl__jpg=picture(normals(heights, PIXEL, "up", 8), **{**JPEG, "subsampling": 0}))
    assert not any("half the resolution" in note for note in found.report["notes"])


def test_a_photograph_is_refused_whatever_its_name_says(tmp_path: Path) -> None:
    """Grey stone in warm light, with shadows."""
    light = surface(4) / np.ptp(surface(4)) + 0.5
    photograph = np.rint(255 * np.clip(light[:, :, np.newaxis] * np.array([1.0, 0.9, 0.8]), 0, 1)).astype(np.uint8)
    with pytest.raises(InvalidRequest, match="a picture in colour"):
        imported(tmp_path, wall_nor_gl__jpg=picture(photograph, **JPEG))


def test_a_lone_picture_has_to_be_nearer_to_unit_vectors(tmp_path: Path) -> None:
    path = tmp_path / "some.jpg"
    path.write_bytes(picture(normals(steep(1, 0.3), PIXEL, "up", 8), **JPEG))
    with pytest.raises(InvalidRequest, match=r"not unit vectors.*wall_nor_gl\.jpg"):
        import_surface(path, read_options({"pixel": PIXEL}))
