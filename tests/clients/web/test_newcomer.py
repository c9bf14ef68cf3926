"""What a newcomer has in the first seconds, on four screens: a picture, an invitation, and sound with one gesture."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import pytest

from tests.clients.web.browser import headless, watched
from tests.clients.web.conftest import loaded
from tests.clients.web.test_first_gesture import SOUNDS, Onlooker
from tests.few import few

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Playwright

    from tests.service.harness import Running

SCREENS = {"1440 x 900": (1440, 900), "1280 x 720": (1280, 720), "390 x 844": (390, 844), "844 x 390": (844, 390)}
SEEN = """() => { const {top, bottom, left, right} = document.getElementById("pad").getBoundingClientRect();
  const invite = document.getElementById("pad-invite");
  return {inView: top >= 0 && bottom <= innerHeight && left >= 0 && right <= innerWidth,
    share: (right - left) * (bottom - top) / innerWidth / innerHeight,
    invited: invite.checkVisibility() && invite.innerText,
    wide: document.documentElement.scrollWidth - innerWidth}; }"""
PICTURED = "ridgewave.views.surface.drawn.bar !== null && !document.querySelector('#pad[data-stale]')"
HEARD = "ridgewave.fingers.some(({source}) => source?.played > 480)"
VIBRATES = "ridgewave.views.waveform.drawn?.peak > 0 || ridgewave.views.ribbon.panel.drawings > 0"
COUNT = """{ window.most = 0; const {surface} = ridgewave.views; const {touch} = surface;
  surface.touch = (all) => { most = Math.max(most, all.length); touch.call(surface, all); }; }"""
"""Keeps the largest number of fingers that the pad shows at once."""
SHOWN = "document.querySelector('.views.shown') !== null"


@pytest.fixture(scope="module")
def browser(playwright: Playwright) -> Iterator[Browser]:
    """Yield a Chromium that is silent until a gesture, as with people."""
    with headless(playwright, waits_for_a_gesture=True) as chromium:
        yield chromium


def on(screen: str) -> dict[str, Any]:
    """Return the options of a context with that screen."""
    width, height = SCREENS[screen]
    phone = width < 1000
    return {"viewport": {"width": width, "height": height}, "has_touch": phone, "is_mobile": phone}


@pytest.mark.parametrize("screen", few(SCREENS, 2))
def test_a_newcomer_sees_a_texture_and_hears_it_with_one_gesture(
    browser: Browser, service: Running, screen: str
) -> None:
    with watched(browser, service.url + "/", **on(screen)) as (page, _):
        look = Onlooker(page)
        look.until(PICTURED)
        seen = look.see(f"({SEEN})()")
        assert seen["inView"] and seen["wide"] <= 0 and seen["invited"] == "Stroke me"
        assert seen["share"] > 0.25, "of the screen"
        assert not look.see("Boolean(ridgewave.player)")
        if on(screen)["has_touch"]:
            look.drag()
            look.until("ridgewave.fingers.some(({touching}) => touching)")
            look.touch("touchEnd")
        else:
            look.press("mouse")
            for step in range(60):
                look.slide(6 * step)
        look.until(SOUNDS)
        look.until(HEARD)
        look.until(VIBRATES)


def test_the_ghost_leaves_its_waveform_and_makes_no_sound(browser: Browser, service: Running) -> None:
    with watched(browser, service.url + "/", **on("1440 x 900")) as (page, _):
        look = Onlooker(page)
        look.see(COUNT)
        look.until(SHOWN)
        look.until("ridgewave.views.waveform.drawn?.peak > 0")
        look.until("most === 1")
        look.until("/^\\d+ dB (over|under) threshold at|^Near/.test(document.getElementById('answer').textContent)")
        assert not look.see("Boolean(ridgewave.player)")
        assert look.see("document.getElementById('pad').classList.contains('touched')") is False
        look.press("key")
        look.until("ridgewave.views.surface.touching.length < 2 && Boolean(ridgewave.player)")


def test_who_wants_less_motion_gets_the_waveform_without_a_ghost(browser: Browser, service: Running) -> None:
    with watched(browser, service.url + "/", **on("1440 x 900"), reduced_motion="reduce") as (page, _):
        look = Onlooker(page)
        look.see(COUNT)
        look.until(SHOWN)
        look.until("ridgewave.views.waveform.drawn?.peak > 0")
        assert look.see("most") == 0


def test_a_touch_before_the_ghost_leaves_nothing_of_it(browser: Browser, service: Running) -> None:
    with watched(browser, "about:blank", **on("1440 x 900")) as (page, watch):
        watch.host = service.url.removeprefix("http://")
        held: list[Any] = []
        page.route("**/v1/render*", lambda route: held.append(route))
        with page.expect_request("**/v1/render*"):
            page.goto(service.url + "/")
            loaded(page)
        page.click("#start")
        page.wait_for_function("() => document.getElementById('state').textContent === 'live'")
        (render,) = held
        with page.expect_response("**/v1/render*") as answer:
            render.continue_()
        answer.value.finished()
        assert answer.value.ok
        assert page.locator(".views.shown").count() == 0


def test_a_magnified_hand_is_raised_and_one_at_true_size_is_not(comb_page: Any) -> None:
    comb_page.click("#start")
    comb_page.wait_for_function("() => document.getElementById('state').textContent === 'live'")
    gain = "() => ridgewave.player.raising.gain.value"
    for times, raised in (("5", 10), ("2", 4), ("1", 1), ("20", 10)):
        comb_page.select_option("#magnify", times)
        comb_page.wait_for_function(f"(raised) => Math.abs(({gain})() - raised) < 0.01", arg=raised)
