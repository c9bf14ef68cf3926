"""Sound begins with the gesture for which the browser waits; for a finger that is its lift."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import pytest

from tests.clients.web.browser import headless, watched
from tests.clients.web.page_service import WEB
from tests.service.harness import PATIENCE, serving, until, warmed_up
from tests.service.plain_engine import PlainEngine

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page, Playwright

PHONE: dict[str, Any] = {"viewport": {"width": 390, "height": 800}, "has_touch": True, "is_mobile": True}
SOUNDS = "ridgewave.player?.context.state === 'running'"
NOTE = "document.getElementById('pad-note').innerText"
INCOMPLETE = "TypeError"  # the plain engine's pictures and plans lack what the page draws


@pytest.fixture(scope="module")
def browser(playwright: Playwright) -> Iterator[Browser]:
    with headless(playwright, waits_for_a_gesture=True) as chromium:
        yield chromium


@pytest.fixture(scope="module")
def url() -> Iterator[str]:
    engine = PlainEngine()
    with serving(engine, web=str(WEB)) as running:
        warmed_up(running, engine)
        yield running.url


class Onlooker:
    """Looks at a page without waking it: playwright's own evaluation counts as a gesture of a person."""

    def __init__(self, page: Page) -> None:
        self._session = page.context.new_cdp_session(page)
        self.until("window.ridgewave !== undefined")

    def see(self, expression: str) -> Any:
        """Return the value of `expression`."""
        asked = {"expression": expression, "returnByValue": True, "awaitPromise": True, "userGesture": False}
        return self._session.send("Runtime.evaluate", asked)["result"].get("value")

    def until(self, expression: str) -> None:
        """Return once `expression` holds."""
        until(lambda: bool(self.see(expression)), PATIENCE)

    def touch(self, kind: str, *place: float) -> None:
        """Dispatch a real touch event of one finger at (x, y), or of none."""
        points = [{"x": place[0], "y": place[1]}] if place else []
        self._session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})

    def drag(self) -> None:
        """Drag a finger over the pad, and leave it there."""
        x, y = self.see(
            "(({left, top}) => [left + 40, top + 90])(document.getElementById('pad').getBoundingClientRect())"
        )
        self.touch("touchStart", x, y)
        for step in range(30):
            self.touch("touchMove", x + 6 * step, y)

    def press(self, gesture: str) -> None:
        """Press a key, or the button of a mouse, over the pad."""
        x, y = self.see(
            "(({left, top}) => [left + 40, top + 90])(document.getElementById('pad').getBoundingClientRect())"
        )
        if gesture == "key":
            self.see("document.getElementById('pad').focus()")
            self._session.send("Input.dispatchKeyEvent", {"type": "keyDown", "key": " ", "code": "Space", "text": " "})
        else:
            mouse = {"type": "mousePressed", "x": x, "y": y, "button": "left", "clickCount": 1}
            self._session.send("Input.dispatchMouseEvent", mouse)

    def slide(self, x: float) -> None:
        """Move the pressed mouse to x (px) from where `press` put it."""
        left, top = self.see(
            "(({left, top}) => [left + 40, top + 90])(document.getElementById('pad').getBoundingClientRect())"
        )
        mouse = {"type": "mouseMoved", "x": left + x, "y": top, "button": "left", "buttons": 1}
        self._session.send("Input.dispatchMouseEvent", mouse)


def test_a_drag_with_a_finger_wakes_the_sound_as_it_lifts(browser: Browser, url: str) -> None:
    with watched(browser, url + "/", **PHONE) as (page, watch):
        watch.allow(INCOMPLETE)
        look = Onlooker(page)
        look.drag()
        look.until("Boolean(ridgewave.player)")
        look.until(f"{NOTE}.startsWith('The browser keeps')")
        look.until("document.getElementById('state').textContent === 'waiting for a click'")
        assert not look.see(SOUNDS), "no browser lets a page sound while the first finger is down"
        look.touch("touchEnd")
        look.until(SOUNDS)
        look.until("document.getElementById('state').textContent === 'live'")
        assert not look.see(f"{NOTE}.startsWith('The browser keeps')")
        look.drag()
        look.until("ridgewave.fingers.some(({source}) => source.played > 2400)")
        look.touch("touchEnd")


@pytest.mark.parametrize("gesture", ["mouse", "key"])
def test_a_mouse_and_a_key_wake_it_with_their_press(browser: Browser, url: str, gesture: str) -> None:
    with watched(browser, url + "/") as (page, watch):
        watch.allow(INCOMPLETE)
        look = Onlooker(page)
        look.press(gesture)
        look.until(SOUNDS)


def test_a_page_that_was_opened_without_a_gesture_wakes_at_the_next_one(browser: Browser, url: str) -> None:
    with watched(browser, url + "/", **PHONE) as (page, watch):
        watch.allow(INCOMPLETE)
        look = Onlooker(page)
        look.see("void ridgewave.session.start()")
        look.until(f"{NOTE}.startsWith('The browser keeps')")
        look.touch("touchStart", 20, 300)
        look.touch("touchEnd")
        look.until(SOUNDS)
