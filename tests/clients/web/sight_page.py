"""The page of the pictures, in headless Chromium: clients/web and the tests' own pages, from a thread on loopback.

Limits: playwright's blocking interface keeps an event loop running in its thread: a browser is for one module of tests.
"""

from __future__ import annotations

import functools
import os
import shutil
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

import pytest

from tests.conftest import ROOT

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

PAGES = Path(__file__).parent / "pages"
POLICY = (
    "default-src 'self'; connect-src 'self' ws: wss:; img-src 'self' data: blob:; media-src 'self' blob:; "
    "worker-src 'self' blob:; object-src 'none'; base-uri 'none'; frame-ancestors 'none'"
)
PATIENCE = 20_000  # ms


class Files(SimpleHTTPRequestHandler):
    """`/web/...` from clients/web, `/test/...` from the tests' pages, under the page's policy."""

    def translate_path(self, path: str) -> str:
        folder = PAGES if path.startswith("/test/") else ROOT / "clients" / "web"
        return str(folder / path.split("?")[0].split("/", 2)[-1])

    def end_headers(self) -> None:
        """Add the page's policy."""
        self.send_header("Content-Security-Policy", POLICY)
        super().end_headers()

    def log_message(self, format: str, *args: Any) -> None:
        """Say nothing."""


@contextmanager
def served() -> Iterator[str]:
    """Yield the address of the page of pictures."""
    server = ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Files, directory=str(ROOT)))
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    try:
        yield f"http://127.0.0.1:{server.server_address[1]}/test/sight.html"
    finally:
        server.shutdown()
        thread.join()
        server.server_close()


@contextmanager
def chromium() -> Iterator[Browser]:
    """Yield headless Chromium; skip the test where it, or playwright, is missing (in CI: fail)."""
    try:
        from playwright.sync_api import sync_playwright
    except ImportError:
        _missing("playwright is missing: install the extra `test`")
    path = shutil.which("chromium")
    if path is None:
        _missing("Chromium is missing: install the Debian package chromium")
    flags = ["--no-sandbox", "--disable-gpu", "--disable-background-networking", "--disable-component-update"]
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=path, headless=True, args=flags)
        try:
            yield browser
        finally:
            browser.close()


@contextmanager
def opened(browser: Browser, url: str, **options: Any) -> Iterator[Page]:
    """Yield the page, once its pictures are there; fail in the end if it logged an error."""
    wrong: list[str] = []
    context = browser.new_context(**{"viewport": {"width": 900, "height": 700}, **options})
    page = context.new_page()
    page.set_default_timeout(PATIENCE)
    page.on("console", lambda message: wrong.append(message.text) if message.type == "error" else None)
    page.on("pageerror", lambda error: wrong.append(str(error)))
    try:
        page.goto(url)
        page.wait_for_function("() => window.sight !== undefined")
        yield page
    finally:
        context.close()
    assert not wrong, "\n".join(wrong)


def _missing(what: str) -> NoReturn:
    if os.environ.get("CI") == "true":
        pytest.fail(what)
    pytest.skip(what)
