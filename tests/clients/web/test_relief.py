"""The lit relief of the pad: its levels, its light, the patches under a finger, and the canvas in its place."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from tests.clients.web.browser import headless, watched
from tests.clients.web.conftest import MODULES, loaded

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page, Playwright

    from tests.service.harness import Running

PERIOD, AMPLITUDE = 2e-3, 1e-4  # m
WIDTH, HEIGHT = 240, 60  # CSS px
LEVELS = "async (texture) => (await import('/web/relief/height_levels.js')).heightLevels(texture)"
DRAW = """async ({texture, metresPerPixel, finger, touch, width, height}) => {
  const {Relief} = await import("/web/relief/relief.js");
  const canvas = document.createElement("canvas");
  const relief = Relief.on(canvas);
  relief.show(texture);
  if (finger) relief.touchWith(finger, finger.length);
  if (touch) relief.touch([touch]);
  const colours = {material: [0.8, 0.8, 0.8], ground: [0.4, 0.4, 0.4], glow: [0, 1, 0], flesh: [0.6, 0.5, 0.5]};
  relief.view = {width, height, ratio: 1, metresPerPixel, colours, inset: null};
  const gl = canvas.getContext("webgl2");
  const pixels = new Uint8Array(4 * width * height);
  gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
  return [...pixels];
}"""


def cosine(count: int = 512) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Return the heights of a grating, m."""
    return np.asarray(AMPLITUDE * np.cos(2 * np.pi * np.arange(count) / count))


@pytest.fixture(scope="module")
def drawing(playwright: Playwright) -> Iterator[Browser]:
    """Yield a Chromium that draws WebGL on the processor."""
    with headless(playwright, webgl=True) as chromium:
        yield chromium


@pytest.fixture(scope="module")
def canvas_page(drawing: Browser, service: Running) -> Iterator[Page]:
    """Yield a page with the modules of the pad, for reliefs of the tests' own; the light is where its drift ends."""
    with watched(drawing, service.url + MODULES, reduced_motion="reduce") as (page, _):
        yield page


def drawn(page: Page, metres_per_pixel: float, **other: Any) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Return the picture of a relief of the grating: [rows from below, columns, red green blue], 0 to 255."""
    told = {"texture": {"heights": cosine().tolist(), "period": PERIOD}, "metresPerPixel": metres_per_pixel}
    pixels = page.evaluate(DRAW, told | {"width": WIDTH, "height": HEIGHT} | other)
    return np.array(pixels, float).reshape(HEIGHT, WIDTH, 4)[:, :, :3]


def test_the_levels_of_a_line_keep_its_mean_height_and_its_slopes(functions: Page) -> None:
    found = functions.evaluate(LEVELS, {"heights": cosine().tolist(), "period": PERIOD})
    steepest = 2 * np.pi * AMPLITUDE / PERIOD
    texels = [np.array(level["texels"]).reshape(-1, 4) for level in found["levels"]]
    assert [len(level) for level in texels] == [512 >> power for power in range(10)]
    turns = 2 * np.pi * np.arange(512) / 512
    assert np.allclose(texels[0][:, 1], -steepest * np.sin(turns), atol=1e-4 * steepest)
    for level in texels:
        assert level[:, 0].mean() == pytest.approx(0.5, abs=1e-5)
        assert level[:, 3].mean() == pytest.approx(steepest**2 / 2, rel=1e-4)
    assert found["slope"] == pytest.approx(steepest / np.sqrt(2), rel=1e-4)


def test_the_levels_of_an_area_have_both_slopes(functions: Page) -> None:
    x, y = np.meshgrid(2 * np.pi * np.arange(64) / 64, 2 * np.pi * np.arange(32) / 32)
    area = (AMPLITUDE * (np.cos(x) + 0.5 * np.sin(y))).tolist()
    texture = {"heights": area[0], "period": PERIOD, "area": area, "across": 3 * PERIOD}
    level = functions.evaluate(LEVELS, texture)["levels"][0]
    texels = np.array(level["texels"]).reshape(level["height"], level["width"], 4)
    steepest = 2 * np.pi * AMPLITUDE / PERIOD
    coarse = np.sinc(2 / 64), np.sinc(2 / 32)  # of a difference over two steps
    assert np.allclose(texels[:, :, 1], -np.sin(x) * steepest * coarse[0], atol=1e-5 * steepest)
    assert np.allclose(texels[:, :, 2], np.cos(y) * steepest / 6 * coarse[1], atol=1e-5 * steepest)


def test_slopes_that_face_the_light_are_brighter(canvas_page: Page) -> None:
    """The light has come to rest on the left."""
    light = drawn(canvas_page, PERIOD / 48).mean(axis=(0, 2))[100:]
    slope = -np.sin(2 * np.pi * (np.arange(100, WIDTH) + 0.5) / 48)
    assert np.corrcoef(light, slope)[0, 1] > 0.5
    assert light.max() - light.min() > 60


@pytest.mark.parametrize("pixels", [1.6, 0.7, 0.11])
def test_ridges_that_are_finer_than_a_pixel_make_no_stripes(canvas_page: Page, pixels: float) -> None:
    coarse = drawn(canvas_page, PERIOD / 48).mean(axis=(0, 2))
    fine = drawn(canvas_page, PERIOD / pixels).mean(axis=(0, 2))
    stripes = (fine - np.convolve(fine, np.full(9, 1 / 9), "same"))[9:-9]  # without the light's own shade
    assert stripes.std() < 0.04 * coarse.std()


def test_the_patches_of_a_finger_are_lit_where_it_overlaps_the_texture(canvas_page: Page) -> None:
    length = 3.2 * PERIOD
    finger = {"begin": 0, "length": length, "heights": [0.0] * 256}
    place = 2.5 * PERIOD  # the middle of the pad, in a valley
    touch = {"position": place, "y": 0, "z": 0.5 * AMPLITUDE, "size": 1}
    picture = drawn(canvas_page, PERIOD / 48, finger=finger, touch=touch)
    green = picture[HEIGHT // 2, :, 1] - picture[HEIGHT // 2, :, 0]
    x = (np.arange(WIDTH) + 0.5) / 48  # periods
    overlap = np.cos(2 * np.pi * x) - 0.5
    inside = np.abs(x - 2.5) < 0.95 * 1.6
    sure = np.abs(overlap) > 0.15
    assert (green[inside & sure & (overlap > 0)] > 60).all()
    assert (green[inside & sure & (overlap < 0)] < 20).all()
    assert (green[np.abs(x - 2.5) > 1.05 * 1.6] < 20).all()


def test_the_pad_is_a_relief_until_the_browser_takes_its_context_away(drawing: Browser, service: Running) -> None:
    with watched(drawing, service.url + "/", reduced_motion="reduce") as (page, _):
        loaded(page)
        page.wait_for_function("() => ridgewave.views.surface.relief?.drawings > 0")
        assert page.is_visible("#true-size")
        page.click("#true-size")
        assert page.input_value("#magnify") == "1" and page.is_hidden("#true-size")
        page.evaluate("""() => { const {canvas} = ridgewave.views.surface.relief;
          canvas.getContext("webgl2").getExtension("WEBGL_lose_context").loseContext(); }""")
        page.wait_for_function("() => ridgewave.views.surface.relief === null")
        filled = "() => document.getElementById('surface').getContext('2d').getImageData(300, 20, 1, 1).data[3]"
        page.wait_for_function(f"() => ({filled})() === 255")


def test_without_webgl_the_pad_is_drawn_on_its_canvas(chromium: Browser, service: Running) -> None:
    with watched(chromium, "about:blank") as (page, watch):
        watch.host = service.url.removeprefix("http://")
        page.add_init_script("""{ const given = HTMLCanvasElement.prototype.getContext;
          HTMLCanvasElement.prototype.getContext = function (kind, ...rest) {
            return kind === "webgl2" ? null : given.call(this, kind, ...rest); }; }""")
        page.goto(service.url + "/")
        loaded(page)
        page.wait_for_function("() => ridgewave.views.surface.drawn.bar !== null")
        assert page.evaluate("() => ridgewave.views.surface.relief") is None
        assert page.is_hidden("#true-size")
        filled = "() => document.getElementById('surface').getContext('2d').getImageData(300, 20, 1, 1).data[3]"
        assert page.evaluate(filled) == 255
