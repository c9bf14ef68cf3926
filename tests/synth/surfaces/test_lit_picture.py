"""The picture of a surface: bright where it rises towards the light, and a PNG that other programs read."""

from __future__ import annotations

import io
import math

import numpy as np
import pytest
from PIL import Image

from synth.encode.png import png_of
from synth.scene.scene import parse_scene
from synth.surfaces import profile_of
from synth.surfaces.dots import Dots
from synth.surfaces.grating import Grating
from synth.surfaces.lit_picture import PIXELS, SIDE, lit_picture
from synth.surfaces.sinusoid import Sinusoid

FLAT = round(255 * math.cos(math.pi / 4))


def test_a_flat_surface_is_evenly_lit() -> None:
    assert np.all(lit_picture(Sinusoid(0.0, 1e-3)) == FLAT)


def test_light_comes_from_the_left() -> None:
    row = lit_picture(Grating(5e-3, 1e-3, 0.5, 1e-3, phase=math.pi))[0]  # one ridge in the middle of the picture
    left, top, right = (row[round(place * PIXELS)] for place in (0.25, 0.5, 0.75))
    assert left > top == FLAT > right


@pytest.mark.parametrize("period", [250e-6, 500e-6, 1e-3])
def test_stripes_are_to_scale(period: float) -> None:
    row = lit_picture(Sinusoid(20e-6, period, 0.3))[0].astype(float)
    strongest = int(np.argmax(np.abs(np.fft.rfft(row - row.mean()))))
    assert strongest == round(SIDE / period)


def test_a_steeper_surface_has_more_contrast() -> None:
    contrasts = [np.ptp(lit_picture(Sinusoid(height, 1e-3)).astype(int)) for height in (1e-7, 1e-6, 1e-5, 1e-4)]
    assert contrasts == sorted(contrasts) and contrasts[0] > 10 and contrasts[-1] > 2 * contrasts[0]


def test_dots_are_round_and_in_their_places() -> None:
    picture = lit_picture(Dots(2.5e-3, 2.5e-3, 0.0, 3e-4, 1e-3, 2e-4)).astype(int)  # in the corners, and in the middle
    middle, reach = PIXELS // 2, round(0.5e-3 / SIDE * PIXELS)
    dot = picture[middle - reach - 2 : middle + reach + 2, middle - reach - 2 : middle + reach + 2]
    rows, columns = np.nonzero(dot != FLAT)
    assert np.ptp(rows) == pytest.approx(2 * reach, abs=4) and np.ptp(columns) == pytest.approx(2 * reach, abs=4)
    np.testing.assert_allclose(dot, dot[::-1], atol=60)  # the same above and below, but for the steps of a pixel
    assert dot[reach, reach // 2] > FLAT > dot[reach, reach + reach // 2 + 2]


@pytest.mark.parametrize(
    "name",
    ["sandpaper-p120-area", "concrete-area", "pebbled-leather-area", "denim-72x56-area", "burlap-11-per-inch-area"],
)
def test_an_area_of_the_catalogue_is_drawn_as_an_area(name: str) -> None:
    picture = lit_picture(profile_of(parse_scene(name))).astype(float)
    along, across = (np.std(np.diff(picture, axis=axis)) for axis in (1, 0))
    assert across > 0.2 * along, "rows differ"
    assert np.all(lit_picture(profile_of(parse_scene("corduroy-14-wale"))).std(axis=0) == 0.0)


def test_a_png_holds_exactly_the_picture() -> None:
    drawn = np.random.default_rng(3).integers(0, 256, (37, 53), dtype=np.uint8)
    for picture in (drawn, lit_picture(Sinusoid(2e-5, 1e-3))):
        read = Image.open(io.BytesIO(png_of(picture)))
        assert read.mode == "L"
        np.testing.assert_array_equal(np.asarray(read), picture)
