"""Nothing moves under a held finger, whatever status the page shows, and a phone has its pad in view."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import pytest

from tests.clients.web.browser import watched
from tests.clients.web.conftest import link_to, loaded
from tests.clients.web.form import tile
from tests.clients.web.page_service import Breaker
from tests.few import few
from tests.service.harness import Running

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

SCREENS = {"390 x 844": (390, 844), "844 x 390": (844, 390), "360 x 640": (360, 640), "1280 x 900": (1280, 900)}
LOUD = {"output": {"full_scale": "0.05 m/s^2"}}
"""A full scale that every stroke exceeds."""
HOLD = """() => { const pad = document.getElementById("pad"); const {left, top} = pad.getBoundingClientRect();
  const event = (kind, x) => pad.dispatchEvent(new PointerEvent(kind,
    {pointerId: 31, pointerType: "touch", button: 0, clientX: left + x, clientY: top + 50, bubbles: true}));
  event("pointerdown", 20);
  window.going = setInterval(() => event("pointermove", 100 + 80 * Math.sin(performance.now() / 200)), 8);
  window.lift = () => { clearInterval(going); event("pointerup", 20); }; }"""
WATCH = """() => {
  window.shifts = [];
  window.boxes = new Set();
  new PerformanceObserver((list) => {
    for (const {value, sources} of list.getEntries())
      shifts.push([value, ...sources.map(({node}) => node?.id || node?.parentElement?.id || String(node?.nodeName))]);
  }).observe({type: "layout-shift"});
  const box = () => {
    const {left, top, width, height} = document.getElementById("pad").getBoundingClientRect();
    boxes.add([left, top, width, height].join(" "));
    requestAnimationFrame(box);
  };
  box();
}"""
STATES = """async () => {
  const {STATE_WORDS} = await import("/web/page/status_texts.js");
  for (const state of Object.keys(STATE_WORDS)) {
    ridgewave.session.dispatchEvent(new CustomEvent("state", {detail: {state}}));
    await new Promise(requestAnimationFrame);
  }
  for (const reduction of [0, 3, 100, 0]) {
    ridgewave.session.dispatchEvent(new CustomEvent("limited", {detail: {reduction}}));
    await new Promise(requestAnimationFrame);
  }
  for (const sentence of ["Undone.", "A long sentence of the page, which takes more than one line. ".repeat(3)]) {
    ridgewave.session.dispatchEvent(new CustomEvent("problem", {detail: {problem: null, sentence}}));
    await new Promise(requestAnimationFrame);
  }
}"""
NOTED = "() => !document.getElementById('pad-note').hidden"
QUIET = "() => document.getElementById('pad-note').hidden && !document.querySelector('[data-stale]')"
WARNED = {"finger": {"contact_length": "8 mm"}}
ANOTHER = {"texture": {"period": "0.5 mm"}, "finger": {"ridge_period": "0.41 mm"}}


@contextmanager
def on_screen(browser: Browser, url: str, size: tuple[int, int]) -> Iterator[Page]:
    phone = size[0] < 1000
    options: dict[str, Any] = {"viewport": {"width": size[0], "height": size[1]}, "reduced_motion": "reduce"}
    with watched(browser, url, has_touch=phone, is_mobile=phone, **options) as (page, watch):
        watch.allow("ERR_|WebSocket|status of")
        loaded(page)
        yield page


@pytest.mark.parametrize("screen", few(SCREENS, 2))
def test_no_status_moves_the_pad_under_a_finger(chromium: Browser, service: Running, screen: str) -> None:
    with (
        Breaker(service.url) as breaker,
        on_screen(chromium, breaker.url + link_to(LOUD), SCREENS[screen]) as page,
    ):
        page.wait_for_function(QUIET)
        page.evaluate("() => document.getElementById('start').click()")
        page.wait_for_function("() => document.getElementById('state').textContent === 'live'")
        page.evaluate(WATCH)
        page.evaluate(HOLD)
        page.wait_for_function("() => document.getElementById('limiter').hasAttribute('data-lit')")
        assert page.is_visible("#rescale")
        page.evaluate("(scene) => ridgewave.state.take(scene)", {**LOUD, **ANOTHER})
        page.wait_for_function(NOTED)
        page.wait_for_function(QUIET)
        target, breaker.target = breaker.target, None
        breaker.reset()
        page.wait_for_function("() => document.getElementById('state').dataset.state === 'broken'")
        breaker.target = target
        page.wait_for_function(QUIET)
        page.evaluate(STATES)
        shifts, boxes = page.evaluate("() => [shifts, [...boxes]]")
        assert shifts == []
        assert len(boxes) == 1
        page.evaluate("() => lift()")


def test_warnings_wait_until_the_finger_lifts(chromium: Browser, service: Running) -> None:
    with on_screen(chromium, service.url + link_to({}), SCREENS["390 x 844"]) as page:
        page.wait_for_function(QUIET)
        page.evaluate("() => document.getElementById('start').click()")
        page.wait_for_function("() => document.getElementById('state').textContent === 'live'")
        assert page.is_hidden("#warnings")
        page.evaluate(HOLD)
        with page.expect_response("**/v1/explain") as answer:
            page.evaluate("() => ridgewave.state.write(['finger', 'contact_length'], '8 mm')")
        warnings = answer.value.json()["warnings"]
        assert warnings, "the comb cancels the line at u / lambda2"
        page.wait_for_function(QUIET)
        assert page.is_hidden("#warnings")
        page.evaluate("() => lift()")
        page.wait_for_selector("#warnings:not([hidden])")
        assert page.locator("#warnings p").all_inner_texts() == warnings


TOUCHED = ["texture", "pad", "load", "speed", "stroke", "true-ratio", "record"]
"""What a hand reaches for while it compares textures."""
PLACES = "(ids) => ids.map((id) => { const {x, y, width, height} = document.getElementById(id)" \
         ".getBoundingClientRect(); return [x, y + scrollY, width, height].join(' '); })"  # fmt: skip


@pytest.mark.parametrize("screen", few(SCREENS, 2))
def test_no_texture_and_no_warning_moves_what_is_touched(chromium: Browser, service: Running, screen: str) -> None:
    """The descriptions have one to five lines, and a plan has no warnings or several."""
    with on_screen(chromium, service.url + link_to({}), SCREENS[screen]) as page:
        page.wait_for_function(QUIET)
        names = page.evaluate("() => [...document.querySelectorAll('#texture input')].map((one) => one.value)")
        places, heights = set(), set()
        for name in names[:: 1 + len(names) // 30]:
            page.evaluate("(selector) => document.querySelector(selector).click()", tile(name))
            places.add(tuple(page.evaluate(PLACES, TOUCHED)))
            heights.add(page.locator("#texture-about").evaluate("(about) => about.offsetHeight"))
        assert len(heights) > 1, "the descriptions differ in length"
        for scene, hidden in ((WARNED, "false"), ({}, "true")):
            page.evaluate("(scene) => ridgewave.state.take(scene)", scene)
            page.wait_for_function(f"() => document.getElementById('warnings').hidden === {hidden}")
            places.add(tuple(page.evaluate(PLACES, TOUCHED)))
        assert len(places) == 1


def test_a_shift_would_be_seen(chromium: Browser, service: Running) -> None:
    with on_screen(chromium, service.url + link_to({}), SCREENS["390 x 844"]) as page:
        page.evaluate(WATCH)
        page.evaluate("() => document.querySelector('.bar').after(Object.assign(document.createElement('p'),"
                      " {textContent: 'A status that takes a row of its own, as the lamp once did.'}))")  # fmt: skip
        page.wait_for_function("() => shifts.length > 0 && boxes.size > 1")


@pytest.mark.parametrize(("screen", "top", "bottom"), [
    ("390 x 844", 320, 844), ("844 x 390", 150, 390), ("360 x 640", 320, 640)])  # fmt: skip
def test_a_phone_has_its_pad_in_view(chromium: Browser, service: Running, screen: str, top: int, bottom: int) -> None:
    with on_screen(chromium, service.url + link_to({}), SCREENS[screen]) as page:
        box = page.locator("#pad").bounding_box()
        assert box is not None
        assert box["y"] <= top and box["y"] + box["height"] <= bottom and box["height"] >= 200
        wide = page.evaluate("() => document.documentElement.scrollWidth <= innerWidth")
        assert wide, "nothing is wider than the screen"


SIZES = [(320, 568), (390, 844), (600, 800), (480, 320), (568, 320), (844, 390), (1100, 400), (861, 700), (1000, 800)]
LIMITED = "(reduction) => ridgewave.session.dispatchEvent(new CustomEvent('limited', {detail: {reduction}}))"
TAKEN = """() => {
  const box = (selector) => document.querySelector(selector).getBoundingClientRect();
  const [pad, lamp, button] = [box("#pad"), box(".limiter"), box("#rescale")];
  const taken = [];
  for (let x = pad.left + 5; x < pad.right; x += 10)
    for (let y = pad.top + 5; y < pad.bottom; y += 10)
      if (document.elementFromPoint(x, y).closest(".bar")) taken.push([x, y]);
  const apart = lamp.left >= pad.right || lamp.top >= pad.bottom || lamp.bottom <= pad.top;
  const on = document.elementFromPoint(button.left + button.width / 2, button.top + button.height / 2);
  const inside = lamp.left >= 0 && lamp.right <= innerWidth && lamp.bottom <= innerHeight;
  return {taken, apart, pressed: on.id, inside, pad: [pad.left, pad.top, pad.width, pad.height]};
}"""


def test_the_lamp_leaves_the_whole_pad_to_strokes(chromium: Browser, service: Running) -> None:
    with on_screen(chromium, service.url + link_to({}), SIZES[0]) as page:
        for width, height in SIZES:
            page.set_viewport_size({"width": width, "height": height})
            page.evaluate(LIMITED, 0)
            dark = page.evaluate("() => [document.getElementById('pad').getBoundingClientRect()].map((box) =>"
                                 " [box.left, box.top, box.width, box.height])[0]")  # fmt: skip
            page.evaluate(LIMITED, 12)
            seen = page.evaluate(TAKEN)
            assert seen == {"taken": [], "apart": True, "pressed": "rescale", "inside": True, "pad": dark}, width


def test_an_open_sheet_has_no_rescale_on_its_tabs(chromium: Browser, service: Running) -> None:
    with on_screen(chromium, service.url + link_to({}), SIZES[0]) as page:
        page.evaluate(LIMITED, 12)
        page.click(".tabs [data-tab=plot]")
        for tab in ("scene", "feel", "plot"):
            page.click(f".tabs [data-tab={tab}]")  # fails where something lies over it


def test_the_bar_of_a_phone_has_room_for_fingers(chromium: Browser, service: Running) -> None:
    with on_screen(chromium, service.url + link_to({}), SIZES[0]) as page:
        for width in (320, 360, 390, 412, 440, 441, 600, 601, 860, 1280):
            page.set_viewport_size({"width": width, "height": 700})
            slider = page.locator("#volume").bounding_box()
            assert slider is not None and slider["width"] >= 80, width
            for link in page.locator(".bar nav a").all():
                box = link.bounding_box()
                assert box is not None and min(box["width"], box["height"]) >= 24, width
            assert page.evaluate("() => document.documentElement.scrollWidth <= innerWidth"), width
