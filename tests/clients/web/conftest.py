"""Fixtures of the web page's tests: the browser, the service with the pages, and a page with the modules in it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import pytest

from tests.clients.web.browser import headless, watched
from tests.clients.web.places import serving_pages
from tests.service.harness import PATIENCE, Running, until

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

HOUSE = "/test/house.html"


@pytest.fixture(scope="module")
def chromium() -> Iterator[Browser]:
    """Yield headless Chromium."""
    with headless() as browser:
        yield browser


@pytest.fixture(scope="module")
def service() -> Iterator[Running]:
    """Yield the real service, warm."""
    with serving_pages() as running:
        until(lambda: running.service.warm, 60.0)
        yield running


@pytest.fixture
def house(chromium: Browser, service: Running) -> Iterator[Page]:
    """Yield a page of the real service in which `house` holds the exports of the page's modules, and a few tools."""
    with watched(chromium, service.url + HOUSE) as (page, _):
        moved_in(page)
        yield page


def moved_in(page: Page) -> None:
    """Return once the modules are there."""
    page.set_default_timeout(1e3 * PATIENCE)
    page.wait_for_function("() => window.house !== undefined")
