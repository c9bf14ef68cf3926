"""Headless Chromium for the tests of the web page, and what watches a page: no error is logged, no other host asked.

Model: the policy of a page keeps it from asking another host for anything but a WebSocket, and the browser logs as an
    error what the policy refuses. So errors and WebSockets are watched: to hear of each request costs an eighth of
    the time that a page takes to load.
Limits: playwright's blocking interface keeps an event loop running in the thread that started it, in which
    `asyncio.run` of other tests would fail: playwright and its browsers are for this folder's tests, and end with them.
"""

from __future__ import annotations

import os
import re
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, NoReturn
from urllib.parse import urlsplit

import pytest

from tests.service.harness import PATIENCE

if TYPE_CHECKING:
    from playwright.sync_api import Browser, ConsoleMessage, Page, Playwright, WebSocket

SOUNDS = "--autoplay-policy=no-user-gesture-required"
FLAGS = (
    "--no-sandbox",
    SOUNDS,
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-default-apps",
    "--disable-sync",
    "--no-first-run",
    "--no-pings",
)
"""As root, with sound before the first click, and without calls home."""
WEBGL = ("--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader")
"""Draws WebGL on the processor: the relief of a page then takes a whole core while its light drifts."""
NO_WEBGL = ("--disable-gpu", "--disable-software-rasterizer")

WAIT = 1e3 * PATIENCE  # ms for a page or the browser to do what is asked


@contextmanager
def driving() -> Iterator[Playwright]:
    """Yield playwright; skip the test where it or Chromium is missing (in CI: fail).

    Chromium is looked for first: its Debian package brings the libraries that playwright's own program needs.
    """
    chromium_path()
    try:
        from playwright.sync_api import sync_playwright
    except ImportError:
        missing("playwright is missing: install the extra `test`")
    with sync_playwright() as playwright:
        yield playwright


@contextmanager
def headless(
    playwright: Playwright, *further: str, webgl: bool = False, waits_for_a_gesture: bool = False
) -> Iterator[Browser]:
    """Yield Chromium; skip the test where it is missing (in CI: fail).

    further: flags of the browser.
    webgl: the pad is a relief, and `/vr` has its table; without it the pad is drawn on its canvas.
    waits_for_a_gesture: no page may sound before one, as with people.
    """
    path = chromium_path()
    usual = [flag for flag in FLAGS if not (waits_for_a_gesture and flag == SOUNDS)]
    flags = [*usual, *(WEBGL if webgl else NO_WEBGL), *further]
    browser = playwright.chromium.launch(executable_path=path, headless=True, args=flags, timeout=WAIT)
    try:
        yield browser
    finally:
        browser.close()


def chromium_path() -> str:
    """Return the path of Chromium; skip the test where it is missing (in CI: fail).

    The headless shell is Chromium without its windows: the same pages take seven tenths of the processor time.
    """
    for name in ("chromium-headless-shell", "chromium", "chromium-browser"):
        if path := shutil.which(name):
            return path
    missing("Chromium is missing: install the Debian package chromium-headless-shell or chromium")


def missing(what: str) -> NoReturn:
    """Skip the test for want of `what`; in CI, fail it."""
    if os.environ.get("CI") == "true":
        pytest.fail(what)
    pytest.skip(what)


class Watch:
    """What went wrong in a page: errors on its console, uncaught exceptions, streams from another host than `url`'s."""

    def __init__(self, page: Page, url: str) -> None:
        self.host = urlsplit(url).netloc
        self.wrong: list[str] = []
        self._allowed: list[str] = []
        self._page = page
        self._hears: dict[Any, Callable[[Any], None]] = {
            "console": self._console,
            "pageerror": lambda error: self.wrong.append(f"uncaught: {error}"),
            "websocket": self._websocket,
        }
        for event, heard in self._hears.items():
            page.on(event, heard)

    def leave(self) -> None:
        """Watch no longer."""
        for event, heard in self._hears.items():
            self._page.remove_listener(event, heard)

    def allow(self, pattern: str) -> None:
        """Let errors pass that `pattern` is found in: those of a connection that a test breaks, say."""
        self._allowed.append(pattern)

    def check(self) -> None:
        """Fail if anything went wrong."""
        wrong = [text for text in self.wrong if not any(re.search(pattern, text) for pattern in self._allowed)]
        assert not wrong, "\n".join(wrong)

    def _console(self, message: ConsoleMessage) -> None:
        if message.type == "error":
            self.wrong.append(f"console: {message.text} ({message.location.get('url', '')})")

    def _websocket(self, socket: WebSocket) -> None:
        if urlsplit(socket.url).netloc != self.host:
            self.wrong.append(f"asked another host: {socket.url}")


@contextmanager
def watched(browser: Browser, url: str, **options: Any) -> Iterator[tuple[Page, Watch]]:
    """Yield a page at `url` in a profile of its own, and what watches it; fail in the end if anything went wrong."""
    context = browser.new_context(**options)
    context.set_default_timeout(WAIT)
    page = context.new_page()
    watch = Watch(page, url)
    try:
        page.goto(url)
        yield page, watch
    finally:
        context.close()
    watch.check()


@contextmanager
def visited(page: Page, url: str) -> Iterator[Watch]:
    """Yield what watches `page`, which loads `url` anew; fail in the end if anything went wrong.

    For tests that share a page: one that is opened takes two seconds of processor, one that is loaded again 0.4 s.
    """
    watch = Watch(page, url)
    try:
        page.goto(url)
        yield watch
    finally:
        watch.leave()
        page.goto("about:blank")  # what it still waits for is no affair of the next test
        page.unroute_all()
        page.emulate_media(color_scheme="null", reduced_motion="null")
    watch.check()


@contextmanager
def kept_page(browser: Browser, **options: Any) -> Iterator[Page]:
    """Yield an empty page for `visited`."""
    context = browser.new_context(**options)
    context.set_default_timeout(WAIT)
    try:
        yield context.new_page()
    finally:
        context.close()
