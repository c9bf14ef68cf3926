"""Each texture has its own level: neither the textures before it nor a rescale of them changes it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import pytest

from tests.clients.web.browser import visited, watched
from tests.clients.web.conftest import link_to, loaded
from tests.clients.web.form import tile
from tests.clients.web.test_page import started

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

    from tests.service.harness import Running

OF_SCENE = "() => ridgewave.session.soundStatus === 'current' && document.getElementById('pad-note').hidden"
SCALE = "() => ridgewave.fingers[0].connection.ready.full_scale[0]"
SESSION = "() => ridgewave.fingers[0].connection.ready.session"
TOUCHING = "() => ridgewave.fingers.filter(({touching}) => touching).length"
STEADY_RMS = """async () => {
  const samples = [];
  const hear = ({detail}) => samples.push(...detail.unlimited);
  ridgewave.session.addEventListener("block", hear);
  ridgewave.session.move("steady", {speed: 0.08, load: 0.3, time: performance.now() / 1e3});
  while (samples.length < 48000) await new Promise((done) => setTimeout(done, 20));
  ridgewave.session.lift("steady");
  ridgewave.session.removeEventListener("block", hear);
  const steady = samples.slice(24000, 48000);
  return Math.sqrt(steady.reduce((sum, one) => sum + one * one, 0) / steady.length);
}"""


SIX = (
    "grating-500um-40um",
    "sinusoid",
    "corduroy-14-wale",
    "sandpaper-p220",
    "vinyl-record-114um",
    "grating-20mm-400um",
)
"""Textures along a line, which the comb of the paper solves in a tenth of the time of a fingertip."""


def chosen(page: Page, name: str) -> float:
    """Choose a texture; return the full scale of its stream."""
    before = page.evaluate(SESSION)
    page.check(tile(name))
    page.wait_for_function(f"(before) => ({SESSION})() !== before", arg=before)
    page.wait_for_function(OF_SCENE)
    return float(page.evaluate(SCALE))


def visit(page: Page, order: Sequence[str], *, rescaled: bool) -> dict[str, float]:
    """Return the full scale of each texture, visited in this order. rescaled: with two rescales after each."""
    started(page)
    scales = {}
    for name in order:
        scales[name] = chosen(page, name)
        if rescaled:
            page.evaluate("async () => { await ridgewave.session.rescale(); await ridgewave.session.rescale(); }")
            assert page.evaluate(SCALE) >= scales[name]
    return scales


def test_levels_do_not_depend_on_the_order_of_visits(chromium: Browser, service: Running) -> None:
    scales = []
    for order, rescaled in ((SIX, False), (SIX[::-1], True)):
        with watched(chromium, service.url + link_to({}), reduced_motion="reduce") as (page, _):
            loaded(page)
            scales.append(visit(page, order, rescaled=rescaled))
    there, back = scales
    assert max(there.values()) > 5 * min(there.values())
    assert back == pytest.approx(there, rel=1e-9)


def test_the_same_stroke_is_as_loud_after_other_textures(comb_page: Page) -> None:
    started(comb_page)
    chosen(comb_page, "grating-1mm-31um")
    first = comb_page.evaluate(STEADY_RMS)
    for name in ("vinyl-record-114um", "grating-500um-40um"):
        chosen(comb_page, name)
        comb_page.evaluate("async () => { await ridgewave.session.rescale(); }")
    chosen(comb_page, "sinusoid")
    chosen(comb_page, "grating-1mm-31um")
    assert comb_page.evaluate(STEADY_RMS) == pytest.approx(first, rel=0.01)


def test_the_level_of_a_texture_does_not_depend_on_the_sliders_or_on_a_reload(comb_page: Page) -> None:
    started(comb_page)
    first = chosen(comb_page, "grating-1mm-31um")
    comb_page.evaluate("() => ridgewave.state.write(['scan', 'speed'], '2.14 mm/s')")
    comb_page.evaluate("() => ridgewave.state.write(['scan', 'load'], '1.5 N')")
    chosen(comb_page, "grating-500um-40um")
    assert chosen(comb_page, "grating-1mm-31um") == first
    comb_page.reload()
    loaded(comb_page)
    started(comb_page)
    assert comb_page.evaluate("() => ridgewave.state.scene.scan") == {"speed": "2.14 mm/s", "load": "1.5 N"}
    assert comb_page.evaluate(SCALE) == first


def test_a_choice_during_a_stroke_moves_the_hand_to_the_new_stream(comb_page: Page) -> None:
    comb_page.click("#stroke")
    comb_page.wait_for_function(f"() => ({TOUCHING})() === 1 && ridgewave.fingers[0].source.played > 4800")
    chosen(comb_page, "grating-500um-40um")
    comb_page.wait_for_function(f"() => ({TOUCHING})() === 1 && ridgewave.fingers[0].source.played > 4800")
    assert comb_page.evaluate("() => ridgewave.fingers.length") == 1


def test_of_quick_choices_the_newest_is_heard(comb_page: Page) -> None:
    started(comb_page)
    for name in ("grooves-750um", "grating-500um-40um", "grating-20mm-400um", "vinyl-record-114um"):
        comb_page.check(tile(name))
        comb_page.wait_for_timeout(100)
    comb_page.evaluate("() => ridgewave.state.write(['output', 'duration'], '3 s')")
    comb_page.wait_for_function(OF_SCENE)
    held = comb_page.evaluate("() => ridgewave.fingers.map(({scene}) => scene.held)")
    assert held == [{"texture": {"kind": "vinyl-record-114um"}, "output": {"duration": "3 s"}}]
    assert comb_page.evaluate(SCALE) == pytest.approx(4.33, rel=0.01)


def test_a_choice_that_is_refused_leaves_the_sound_and_a_correction_is_heard(
    kept_touch_page: Page, service: Running
) -> None:
    page = kept_touch_page
    with visited(page, service.url + link_to({})) as watch:
        watch.allow("status of 422")
        loaded(page)
        started(page)
        page.wait_for_function(OF_SCENE)  # before its first picture the pad has other words for a refusal
        before = page.evaluate(SESSION)
        page.evaluate("() => ridgewave.state.take({texture: {kind: 'grating', period: '1 mm', height: '-3 mm'}})")
        page.wait_for_function("() => document.getElementById('pad-note').textContent.includes('refused')")
        page.wait_for_function("() => ridgewave.session.soundStatus === 'refused'")
        assert page.evaluate(SESSION) == before
        page.evaluate("() => ridgewave.state.write(['texture', 'height'], '30 um')")
        page.wait_for_function(OF_SCENE)
        assert page.evaluate(SESSION) != before
        assert page.evaluate("() => ridgewave.fingers[0].scene.held.texture.height") == "30 um"


def test_numbers_of_a_texture_keep_its_full_scale(comb_page: Page) -> None:
    started(comb_page)
    before = comb_page.evaluate(SESSION), comb_page.evaluate(SCALE)
    comb_page.evaluate("() => ridgewave.state.write(['texture', 'amplitude'], '40 um')")
    comb_page.wait_for_function("() => ridgewave.fingers[0].scene.held.texture?.amplitude === '40 um'")
    assert (comb_page.evaluate(SESSION), comb_page.evaluate(SCALE)) == before


def test_true_ratio_keeps_the_full_scale_for_all_textures_until_it_is_unchecked(comb_page: Page) -> None:
    started(comb_page)
    loud = chosen(comb_page, "grating-500um-40um")
    comb_page.check("#true-ratio")
    comb_page.wait_for_function("() => ridgewave.fingers[0]?.connection.ready && ridgewave.state.scene.output")
    comb_page.wait_for_function(OF_SCENE)
    comb_page.check(tile("vinyl-record-114um"))
    comb_page.wait_for_function("() => ridgewave.fingers[0].scene.held.texture.kind === 'vinyl-record-114um'")
    assert comb_page.evaluate(SCALE) == pytest.approx(loud, rel=1e-3)
    comb_page.uncheck("#true-ratio")
    comb_page.wait_for_function(OF_SCENE)
    comb_page.wait_for_function(f"(loud) => ({SCALE})() < loud / 10", arg=loud)
    assert comb_page.evaluate("() => ridgewave.state.scene") == {"texture": {"kind": "vinyl-record-114um"}}


def test_a_recording_keeps_its_full_scale_when_the_texture_changes(comb_page: Page) -> None:
    comb_page.click("#record")
    comb_page.wait_for_function("() => document.getElementById('record').textContent === 'Stop recording'")
    before = comb_page.evaluate(SESSION)
    comb_page.check(tile("vinyl-record-114um"))
    comb_page.wait_for_function("() => ridgewave.fingers[0].scene.held.texture?.kind === 'vinyl-record-114um'")
    assert comb_page.evaluate(SESSION) == before


def test_a_file_says_how_loud_it_is_beside_what_was_heard(comb_page: Page) -> None:
    started(comb_page)
    heard = chosen(comb_page, "grating-1mm-31um")
    with comb_page.expect_response("**/v1/render*") as answer:
        comb_page.click("#save-wav")
    gain = 20 * math.log10(heard / float(answer.value.headers["ridgewave-full-scale"]))
    assert gain > 1.0
    said = f"It is {gain:.1f}".rstrip("0").rstrip(".") + " dB louder than what you heard."
    comb_page.wait_for_function("(said) => document.getElementById('notice').textContent.includes(said)", arg=said)
