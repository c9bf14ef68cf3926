"""The texture from above and the contact from the side: heights, scales, fingers, contact patches."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from tests.clients.web.drawn_views import label_of
from tests.few import thorough

if TYPE_CHECKING:
    from playwright.sync_api import Page

PERIOD, RIDGE, LENGTH = 0.8e-3, 0.5e-3, 10e-3  # m


def texture(points: int = 512) -> list[float]:
    """Return a period that is no sinusoid, so that a mirrored or shifted picture is another one (m)."""
    turns = np.arange(points) / points
    heights = 20e-6 * np.cos(2 * np.pi * turns + 0.4) + 6e-6 * np.cos(4 * np.pi * turns)
    return [float(height) for height in heights]


SHOW = (
    "async ([heights, period, zoom]) => { const {surface} = views; await views.drawn(surface.panel, () => {"
    " surface.show({heights, period, contactLength: 0.01}); surface.zoom(zoom); }); }"
)


@pytest.mark.parametrize("zoom", [6e-6, 2.3e-5, 1.1e-4])
def test_the_scale_bar_is_as_long_as_it_says(page: Page, zoom: float) -> None:
    page.evaluate(SHOW, [texture(), PERIOD, zoom])
    bar = page.evaluate("() => views.surface.drawn.bar")
    leading = float(f"{bar['length']:.3e}".split("e")[0])
    assert leading in (1.0, 2.0, 5.0)
    ratio = page.evaluate("() => devicePixelRatio")
    wide = int(bar["pixels"]) + 20
    box = [bar["left"] - 10, bar["top"], wide, 1]
    row = page.evaluate("(box) => views.pixels(document.getElementById('surface'), ...box)", box)
    pixels = np.array(row).reshape(int(ratio), -1, 4)[0, :, :3]
    ink = page.evaluate("() => getComputedStyle(document.documentElement).getPropertyValue('--ink').trim()")
    wanted = np.array([int(ink[place : place + 2], 16) for place in (1, 3, 5)])
    dark = int(np.count_nonzero(np.abs(pixels - wanted).max(axis=1) < 30))
    assert abs(dark / ratio - bar["length"] / zoom) <= 1.0


@pytest.mark.parametrize("zoom", [8e-6, 2.2e-5])
def test_the_heights_drawn_are_the_heights_given(page: Page, zoom: float) -> None:
    heights = np.array(texture())
    page.evaluate(SHOW, [heights.tolist(), PERIOD, zoom])
    width, ratio = page.evaluate("() => [views.surface.panel.width, devicePixelRatio]")
    row = np.array(page.evaluate("([w]) => views.pixels(document.getElementById('surface'), 0, 10, w, 1)", [width]))
    light = row.reshape(int(ratio), -1, 4)[0, :, 0].astype(float)
    x = (np.arange(light.size) + 0.5) * zoom / ratio
    at = np.interp(x / PERIOD % 1.0, np.append(np.arange(512), 512) / 512, np.append(heights, heights[0]))
    slope = np.gradient(at)
    level = np.clip((at - heights.min()) / np.ptp(heights) + 0.28 * slope / np.abs(slope).max(), 0.0, 1.0)
    valley, crest = light[np.argmin(at)], light[np.argmax(at)]
    assert crest - valley > 120
    assert np.abs(light - (valley + level * (crest - valley)))[1:-1].max() < 8.0


@pytest.mark.parametrize("zoom", [8e-6, 2.2e-5])
def test_the_heights_of_an_area_are_drawn_at_their_places(page: Page, zoom: float) -> None:
    """x is 0 at the left edge, y in the middle of the picture, and y rises."""
    count, across = 64, 1.4e-3
    turns = 2 * np.pi * np.arange(count) / count
    waves = 20e-6 * np.cos(turns)[np.newaxis], 12e-6 * np.sin(turns + 0.3)[:, np.newaxis]
    shown = {"heights": texture(count), "period": PERIOD, "area": (waves[0] + waves[1]).tolist(), "across": across}
    page.evaluate(
        "async ([shown, zoom]) => { const {surface} = views;"
        " await views.drawn(surface.panel, () => { surface.show(shown); surface.zoom(zoom); }); }",
        [shown, zoom],
    )
    width, height, ratio = page.evaluate(
        "() => [views.surface.panel.width, views.surface.panel.height, devicePixelRatio]"
    )
    light, level = [], []
    for box in ((0, 70, width, 2), (0, height - 72, width, 2), (200, 70, 2, height - 140)):  # not on bar and legend
        left, top, _wide, high = box
        pixels = page.evaluate("(box) => views.pixels(document.getElementById('surface'), ...box)", box)
        found = np.array(pixels, float).reshape(int(ratio * high), -1, 4)[:, :, 0]
        x = (left + (np.arange(found.shape[1]) + 0.5) / ratio) * zoom
        y = (height / 2 - top - (np.arange(found.shape[0]) + 0.5) / ratio) * zoom
        along, over = 2 * np.pi * x / PERIOD, 2 * np.pi * y[:, np.newaxis] / across + 0.3
        lit = (20e-6 * np.cos(along) + 12e-6 * np.sin(over) + 32e-6) / 64e-6 - 0.28 * np.sin(along)
        light.append(found.ravel())
        level.append(np.clip(lit, 0.0, 1.0).ravel())
    drawn, wanted = np.concatenate(light), np.concatenate(level)
    contrast, dark = np.polyfit(wanted, drawn, 1)
    assert contrast > 120
    assert np.abs(drawn - dark - contrast * wanted).max() < 0.013 * contrast
    label_of(page, "surface", "800 µm along and 1.4 mm across")


def test_fingers_move_without_a_drawing(pictures: Page) -> None:
    pictures.evaluate(SHOW, [texture(), PERIOD, 2e-5])
    told = pictures.evaluate(
        """async () => { const {surface} = views; const before = surface.panel.drawings;
        surface.touch([0.004, {position: 0.006, across: 0.25}]);
        await new Promise(requestAnimationFrame); await new Promise(requestAnimationFrame);
        const place = document.getElementById('surface').getBoundingClientRect();
        const marks = [...document.querySelectorAll('.finger-marks > i')].filter((mark) => !mark.hidden);
        const boxes = marks.map((mark) => mark.getBoundingClientRect());
        const middles = boxes.map(({x, y, width, height}) =>
          [x + width / 2 - place.x, y + height / 2 - place.y, width]);
        surface.touch([]);
        const left = [...document.querySelectorAll('.finger-marks > i')].filter((mark) => mark.offsetWidth).length;
        return {middles, height: place.height, drawings: surface.panel.drawings - before, left}; }"""
    )
    assert told["drawings"] == 0
    assert np.allclose(told["middles"][0], [200.0, told["height"] / 2, 500.0], atol=0.1)
    assert np.allclose(told["middles"][1], [300.0, told["height"] / 4, 500.0], atol=0.1)
    assert told["left"] == 0


def test_the_pad_is_zoomed_by_keys_and_wheel(plain: Page) -> None:
    plain.evaluate(SHOW, [texture(), PERIOD, 2e-5])
    plain.evaluate(
        "() => { window.zooms = []; document.getElementById('surface')"
        ".addEventListener('zoom', (event) => zooms.push(event.detail.metresPerPixel)); }"
    )
    plain.focus("#surface")
    plain.keyboard.press("+")
    plain.keyboard.press("-")
    plain.keyboard.press("-")
    plain.hover("#surface")
    plain.mouse.wheel(0, -100)
    plain.wait_for_function("() => zooms.length === 4")
    step = 2**0.25
    assert np.allclose(plain.evaluate("() => zooms"), [2e-5 / step, 2e-5, 2e-5 * step, 2e-5])
    plain.keyboard.press("0")
    assert plain.evaluate("() => views.surface.metresPerPixel") == pytest.approx(PERIOD / 36)


def picture(phases: int) -> dict[str, Any]:
    """Return a picture as `POST /v1/picture` answers it: two cosines, an approach of its own, and the patches."""
    points = 2048
    s, x = np.arange(points) * PERIOD / points, np.linspace(0.0, LENGTH, points)
    fine = np.linspace(0.0, LENGTH, 100_001)
    turns = np.arange(phases) / phases
    z = 46e-6 + 5e-6 * np.cos(2 * np.pi * turns)
    touching = []
    for turn, height in zip(turns, z, strict=True):
        overlap = 20e-6 * np.cos(2 * np.pi * (fine / PERIOD - turn)) - 40e-6 * np.cos(2 * np.pi * fine / RIDGE) > height
        edges = np.flatnonzero(np.diff(np.concatenate([[0], overlap.astype(int), [0]])))
        touching.append(fine[np.minimum(edges, fine.size - 1)].tolist())
    return {
        "texture": {"period": PERIOD, "heights": (20e-6 * np.cos(2 * np.pi * s / PERIOD)).tolist()},
        "finger": {"begin": 0.0, "length": LENGTH, "heights": (-40e-6 * np.cos(2 * np.pi * x / RIDGE)).tolist()},
        "response": {"load": 0.3, "foundation": 1e6, "heights": z.tolist()},
        "touching": touching,
        "left_out": [],
    }


LIT = """async ([picture, phase]) => { const {contact} = views; const {panel} = contact;
  await views.drawn(panel, () => { contact.show(picture); contact.at(phase); });
  return {drawn: contact.drawn, width: panel.width, ratio: panel.ratio,
    row: views.pixels(panel.canvas, 0, panel.height - 35, panel.width, 1)}; }"""


@pytest.mark.parametrize("index", [0, thorough(5), 13])
def test_what_is_lit_is_what_touches(page: Page, index: int) -> None:
    given = picture(16)
    told = page.evaluate(LIT, [given, 3 + index / 16])
    edges = np.array(given["touching"][index]).reshape(-1, 2)
    assert np.allclose(told["drawn"]["patches"], edges, atol=1e-12)
    assert told["drawn"]["z"] == given["response"]["heights"][index]
    row = np.array(told["row"]).reshape(int(told["ratio"]), -1, 4)[0, :, :3].astype(float)
    glow, dull = np.array([0xE8, 0x59, 0x0C]), np.array([0xE8, 0xEC, 0xF0])
    share = np.clip((row - dull) @ (glow - dull) / ((glow - dull) @ (glow - dull)), 0.0, 1.0)
    wide = (told["width"] - 24.0) * told["ratio"]
    edges_drawn = 12.0 * told["ratio"] + edges / LENGTH * wide
    pixel = np.arange(row.shape[0])
    covered = np.zeros(row.shape[0])
    for begin, end in edges_drawn:
        covered += np.clip(np.minimum(end, pixel + 1) - np.maximum(begin, pixel), 0.0, 1.0)
    inside = slice(round(12 * told["ratio"]), round(12 * told["ratio"] + wide))
    assert np.abs(share - covered)[inside].max() < 0.1
    label_of(page, "contact", f"{len(edges)} contact patch")


def test_between_two_phases_the_patches_are_those_of_the_heights(pictures: Page) -> None:
    coarse, fine = picture(16), picture(32)
    told = pictures.evaluate(LIT, [coarse, 7 / 32])
    edges = np.array(fine["touching"][7]).reshape(-1, 2)
    assert np.allclose(told["drawn"]["patches"], edges, atol=3e-6)
    blind = pictures.evaluate(LIT, [coarse | {"touching": None}, 6 / 32])
    assert np.allclose(blind["drawn"]["patches"], np.array(fine["touching"][6]).reshape(-1, 2), atol=3e-6)


def test_the_vertical_exaggeration_is_stated_and_true(pictures: Page) -> None:
    drawn = pictures.evaluate(LIT, [picture(16), 0.0])["drawn"]
    assert drawn["up"] == pytest.approx(drawn["factor"] * drawn["across"])
    label_of(pictures, "contact", f"{drawn['factor']} times more than lengths")


def test_nothing_is_drawn_while_nothing_changes(pictures: Page) -> None:
    pictures.evaluate(LIT, [picture(16), 0.25])
    again = pictures.evaluate(
        """async () => { const {contact} = views; const before = contact.panel.drawings;
        for (let turn = 0; turn < 10; turn++) { contact.at(0.25); await new Promise(requestAnimationFrame); }
        return contact.panel.drawings - before; }"""
    )
    assert again == 0
