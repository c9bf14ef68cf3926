"""PNG and TIFF: displacement maps, real heights, normal maps, and resolution tags."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from synth.errors import InvalidRequest
from synth.surfaces.readers.file_formats import read_surface_file
from synth.surfaces.readers.normal_map import integrated

RNG = np.random.default_rng(7)
GREY = (RNG.random((5, 7)) * 65535).astype(np.uint16)


def saved(folder: Path, pixels: np.ndarray[Any, Any], name: str, **options: Any) -> Path:
    path = folder / name
    Image.fromarray(pixels).save(path, **options)
    return path


@pytest.mark.parametrize("name", ["a.png", "a.tif"])
@pytest.mark.parametrize("bits", [8, 16])
def test_a_grey_image_is_a_displacement_map(tmp_path: Path, name: str, bits: int) -> None:
    pixels = GREY if bits == 16 else (GREY >> 8).astype(np.uint8)
    found = read_surface_file(saved(tmp_path, pixels, name))
    np.testing.assert_array_equal(found.heights, pixels)
    assert found.full_scale == 2**bits - 1 and found.spacing is None and found.unit is None
    assert any("8 bits" in note for note in found.notes) == (bits == 8)


def test_a_tiff_of_real_numbers_holds_heights(tmp_path: Path) -> None:
    pixels = RNG.normal(size=(4, 6)).astype(np.float32)
    pixels[1, 2] = np.nan
    found = read_surface_file(saved(tmp_path, pixels, "a.tiff"))
    assert found.full_scale is None and found.missing.sum() == 1 and found.missing[1, 2]
    np.testing.assert_array_equal(found.heights[0], pixels[0])


def tiff(bits: int, sample_format: int = 1, photometric: int = 1, orientation: int = 1) -> bytes:
    """Return an uncompressed TIFF of 8 x 4 pixels, all of whose bytes differ (TIFF 6.0, section 2)."""
    pixels = bytes(range(8 * 4 * bits // 8))
    tags = [(256, 8), (257, 4), (258, bits), (259, 1), (262, photometric), (273, 8), (274, orientation), (277, 1)]
    tags += [(278, 4), (279, len(pixels)), (339, sample_format)]
    entries = b"".join(struct.pack("<HHII", tag, 3, 1, value) for tag, value in tags)
    return b"II*\0" + struct.pack("<I", 8 + len(pixels)) + pixels + struct.pack("<H", len(tags)) + entries + bytes(4)


@pytest.mark.parametrize("bits", [8, 16])
def test_the_numbers_of_a_tiff_are_its_heights(tmp_path: Path, bits: int) -> None:
    (tmp_path / "a.tif").write_bytes(tiff(bits))
    expected = np.arange(4 * bits, dtype=np.uint8).view(f"<u{bits // 8}").reshape(4, 8)
    np.testing.assert_array_equal(read_surface_file(tmp_path / "a.tif").heights, expected)


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (tiff(12), "a TIFF of 12 bits"),
        (tiff(4), "a TIFF of 4 bits"),
    ],
)
def test_a_tiff_whose_numbers_would_be_mistaken_is_refused(tmp_path: Path, content: bytes, says: str) -> None:
    (tmp_path / "a.tif").write_bytes(content)
    with pytest.raises(InvalidRequest, match=says):
        read_surface_file(tmp_path / "a.tif")


@pytest.mark.parametrize("bits", [8, 16])
def test_a_tiff_in_which_0_is_white_is_counted_from_the_other_end(tmp_path: Path, bits: int) -> None:
    (tmp_path / "a.tif").write_bytes(tiff(bits, photometric=0))
    (tmp_path / "b.tif").write_bytes(tiff(bits))
    found = read_surface_file(tmp_path / "a.tif")
    np.testing.assert_array_equal(found.heights, 2**bits - 1 - read_surface_file(tmp_path / "b.tif").heights)
    assert any("0 is white" in note for note in found.notes)


@pytest.mark.parametrize("compression", [None, "tiff_lzw"])
@pytest.mark.parametrize("name", ["a.tif", "a.png", "a.jpg"])
@pytest.mark.parametrize("orientation", range(1, 9))
def test_a_picture_is_turned_as_its_tag_says(
    tmp_path: Path, orientation: int, name: str, compression: str | None
) -> None:
    """Corners, named by their heights, are where the tag puts them: row 0 and column 0 of the stored picture."""
    stored = np.kron(np.array([[10, 60], [110, 160]], np.uint8), np.ones((16, 24), np.uint8))
    image = Image.fromarray(stored)
    exif = Image.Exif()
    exif[274] = orientation
    options = {"tiffinfo": {274: orientation}, "compression": compression} if name == "a.tif" else {"exif": exif}
    image.save(tmp_path / name, **options)
    found = read_surface_file(tmp_path / name).heights
    corners = [[10, 60], [110, 160]]
    seen = {
        1: corners,
        2: [[60, 10], [160, 110]],
        3: [[160, 110], [60, 10]],
        4: [[110, 160], [10, 60]],
        5: [[10, 110], [60, 160]],
        6: [[110, 10], [160, 60]],
        7: [[160, 60], [110, 10]],
        8: [[60, 160], [10, 110]],
    }[orientation]
    assert found.shape == ((32, 48) if orientation < 5 else (48, 32))
    np.testing.assert_allclose(found[[[0], [-1]], [0, -1]], seen, atol=2)


@pytest.mark.parametrize("name", ["a.png", "a.tif"])
def test_a_resolution_tag_states_the_distance_and_a_usual_setting_does_not(tmp_path: Path, name: str) -> None:
    tagged = read_surface_file(saved(tmp_path, GREY, name, dpi=(5080.0, 2540.0)))
    np.testing.assert_allclose(tagged.spacing or (), (5e-6, 10e-6), rtol=1e-5)
    usual = read_surface_file(saved(tmp_path, GREY, name, dpi=(300.0, 300.0)))
    assert usual.spacing is None and "300 dots per inch" in usual.notes[0]


def normals(heights: np.ndarray[Any, Any], spacing: float, green: float) -> np.ndarray[Any, Any]:
    """Return the normal map of periodic `heights`, from their exact slopes."""
    rows, columns = heights.shape
    wave_x = 2j * np.pi * np.fft.fftfreq(columns, spacing)[np.newaxis, :]
    wave_y = 2j * np.pi * np.fft.fftfreq(rows, spacing)[:, np.newaxis]
    of_heights = np.fft.fft2(heights)
    across, down = (np.fft.ifft2(wave * of_heights).real for wave in (wave_x, wave_y))
    vectors = np.stack([-across, green * down, np.ones_like(across)], axis=2)
    vectors /= np.linalg.norm(vectors, axis=2, keepdims=True)
    return np.asarray(np.rint((vectors + 1.0) * 127.5).astype(np.uint8))


def waves(rows: int, columns: int) -> np.ndarray[Any, Any]:
    """Return heights that differ in both directions, so that a wrong sign of green shows."""
    y, x = np.mgrid[:rows, :columns]
    return np.asarray(2.0 * np.sin(2 * np.pi * (x / columns + 2 * y / rows)) + np.cos(2 * np.pi * 3 * x / columns))


def test_a_normal_map_gives_back_its_heights_in_pixels(tmp_path: Path) -> None:
    heights = waves(48, 64)
    found = read_surface_file(saved(tmp_path, normals(heights, 1.0, 1.0), "n.png"))
    assert found.unit == "pixel" and found.layout == "a normal map, with green pointing up"
    assert np.max(np.abs(found.heights - heights)) < 0.01 * np.ptp(heights)  # 8 bits


def test_a_map_with_green_down_has_a_large_residual_and_is_told(tmp_path: Path) -> None:
    found = read_surface_file(saved(tmp_path, normals(waves(48, 64), 1.0, -1.0), "n.png"))
    assert any("may be for DirectX" in note for note in found.notes)
    right = read_surface_file(saved(tmp_path, normals(waves(48, 64), 1.0, 1.0), "m.png"))
    assert not any("DirectX" in note for note in right.notes)


def test_integration_is_exact_for_slopes_of_heights_and_tells_what_is_left() -> None:
    y, x = np.mgrid[:32, :40] * 1.0
    phase = 2 * np.pi * (3 * x / 40 + 2 * y / 32)
    across, down = 2 * np.pi * 3 / 40 / 0.5 * np.cos(phase), 2 * np.pi * 2 / 32 / 0.25 * np.cos(phase)
    heights, residual, turned = integrated(across, down, (0.5, 0.25))
    np.testing.assert_allclose(heights, np.sin(phase), atol=1e-12)
    assert residual < 1e-12 and 0.3 < turned < 1.0
    assert integrated(across, -down, (0.5, 0.25))[1] == pytest.approx(turned)


@pytest.mark.parametrize("shape", [(8, 10), (9, 11), (8, 11)])
def test_the_residual_is_that_of_the_slopes_of_the_heights(shape: tuple[int, int]) -> None:
    across, down = RNG.normal(size=(2, *shape))
    heights, residual, _ = integrated(across, down, (1.0, 1.0))
    waves = [2j * np.pi * np.fft.fftfreq(count) for count in shape]
    for wave, count in zip(waves, shape, strict=True):
        if count % 2 == 0:
            wave[count // 2] = 0.0
    of_heights = np.fft.fft2(heights)
    left_x = across - across.mean() - np.fft.ifft2(waves[1][np.newaxis, :] * of_heights).real
    left_y = down - down.mean() - np.fft.ifft2(waves[0][:, np.newaxis] * of_heights).real
    size = np.mean(across**2 + down**2)
    assert residual == pytest.approx(np.sqrt(np.mean(left_x**2 + left_y**2) / size), rel=1e-12)


@pytest.mark.parametrize(
    ("pixels", "says"),
    [
        ((RNG.random((20, 20, 3)) * 255).astype(np.uint8), "a picture in colour"),
        (np.zeros((1, 1), np.uint8), "at least 2 points"),
    ],
)
def test_pictures_without_heights_are_refused(tmp_path: Path, pixels: np.ndarray[Any, Any], says: str) -> None:
    with pytest.raises(InvalidRequest, match=says):
        read_surface_file(saved(tmp_path, pixels, "p.png"))
