"""Fixtures of the tests of the web page: the browser, the service with the page, and a page with its modules."""

from __future__ import annotations

import base64
import json
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

import pytest

from tests.clients.web.browser import driving, headless, kept_page, visited, watched
from tests.clients.web.drawn_views import drawable, opened
from tests.clients.web.page_service import serving_pages
from tests.service.harness import START, Running, kept_engine, roomy_settings, until
from tests.service.plain_engine import PlainEngine

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page, Playwright, ViewportSize

    from tests.clients.web.browser import Watch

MODULES = "/test/modules.html"
WIDE: ViewportSize = {"width": 1280, "height": 900}
START_SCENE = {"finger": {"kind": "fingertip"}, "texture": {"kind": "corduroy-8-wale"}}
"""The scene of the page where the address has none."""
DRAWER = "() => ridgewave.sheet.show('scene')"
"""Opens the drawer with the fields of the scene."""


def link_to(scene: Mapping[str, object]) -> str:
    """Return the path of the page with `scene`, as docs/touch-page.md describes it."""
    return "/#scene=" + base64.urlsafe_b64encode(json.dumps(scene).encode()).decode().rstrip("=")


@pytest.fixture(scope="package")
def playwright() -> Iterator[Playwright]:
    """Yield playwright."""
    with driving() as one:
        yield one


@pytest.fixture(scope="package")
def chromium(playwright: Playwright) -> Iterator[Browser]:
    """Yield headless Chromium."""
    with headless(playwright) as browser:
        yield browser


@pytest.fixture(scope="session")
def service(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Running]:
    """Yield the real service with the pages, warm, one for all modules."""
    with serving_pages(kept_engine(), data_folder=tmp_path_factory.mktemp("data"), **roomy_settings()) as running:
        until(lambda: running.service.warm, START)
        yield running


@pytest.fixture(scope="package")
def kept_modules(chromium: Browser) -> Iterator[Page]:
    """Yield the page that `modules` loads anew."""
    with kept_page(chromium) as page:
        yield page


@pytest.fixture
def modules(kept_modules: Page, service: Running) -> Iterator[Page]:
    """Yield a page of the real service in which `modules` holds the exports of the page's modules, and a few tools."""
    with visited(kept_modules, service.url + MODULES):
        modules_loaded(kept_modules)
        yield kept_modules


@pytest.fixture(scope="package")
def functions(chromium: Browser, service: Running) -> Iterator[Page]:
    """Yield such a page for all tests that only call what it exports, and leave it as it was."""
    with watched(chromium, service.url + MODULES) as (page, _):
        modules_loaded(page)
        yield page


def modules_loaded(page: Page) -> None:
    """Return once the modules are there."""
    page.wait_for_function("() => window.modules !== undefined")


@pytest.fixture(scope="package")
def kept_touch_page(chromium: Browser) -> Iterator[Page]:
    """Yield the page that `watched_page` loads anew."""
    with kept_page(chromium, viewport=WIDE) as page:
        yield page


@pytest.fixture
def watched_page(kept_touch_page: Page, service: Running) -> Iterator[tuple[Page, Watch]]:
    """Yield the page, loaded, and what watches it, which fails in the end if it logged an error or asked others."""
    with visited(kept_touch_page, service.url + "/") as watch:
        loaded(kept_touch_page)
        kept_touch_page.evaluate(DRAWER)
        yield kept_touch_page, watch


@pytest.fixture
def comb_page(kept_touch_page: Page, service: Running) -> Iterator[Page]:
    """Yield the page with the finger of the paper, loaded, with little motion in its views.

    The tables of that finger take a tenth of the time of a fingertip's, and its views half of what a stroke takes.
    """
    kept_touch_page.emulate_media(reduced_motion="reduce")
    with visited(kept_touch_page, service.url + link_to({})):
        loaded(kept_touch_page)
        kept_touch_page.evaluate(DRAWER)
        yield kept_touch_page


@pytest.fixture(scope="package")
def kept_still_page(chromium: Browser, service: Running) -> Iterator[Page]:
    """Yield the page that `still_page` lends to one test after another."""
    with watched(chromium, service.url + link_to({}), viewport=WIDE, reduced_motion="reduce") as (page, _):
        loaded(page)
        page.evaluate(DRAWER)
        yield page


@pytest.fixture
def still_page(kept_still_page: Page) -> Iterator[Page]:
    """Yield the page with an empty scene, for tests of its form and its parts: loaded once, and never touched."""
    kept_still_page.evaluate("() => ridgewave.state.take({})")
    yield kept_still_page
    kept_still_page.unroute_all()
    kept_still_page.set_viewport_size(WIDE)


@pytest.fixture
def touch_page(watched_page: tuple[Page, Watch]) -> Page:
    """Return the page, watched."""
    return watched_page[0]


def loaded(page: Page) -> None:
    """Return once the page is put together."""
    page.wait_for_function("() => window.ridgewave !== undefined")


@pytest.fixture(scope="package")
def pictures_url() -> Iterator[str]:
    """Yield the address of the page of pictures."""
    with serving_pages(PlainEngine()) as running:
        yield running.url + "/test/views.html"


@pytest.fixture(scope="module", params=[1, 2], ids=["one pixel", "two pixels"])
def page(request: pytest.FixtureRequest, chromium: Browser, pictures_url: str) -> Iterator[Page]:
    """Yield one page of pictures for a module, on a screen of one or two device pixels a CSS pixel."""
    with opened(chromium, pictures_url, device_scale_factor=request.param) as one:
        yield one


@pytest.fixture(scope="package")
def pictures(chromium: Browser, pictures_url: str) -> Iterator[Page]:
    """Yield one page of pictures for all tests that give it whatever they read: it is never loaded again."""
    with opened(chromium, pictures_url) as one:
        yield one


@pytest.fixture(scope="package")
def kept_pictures(chromium: Browser) -> Iterator[Page]:
    """Yield the page that `plain` loads anew."""
    with kept_page(chromium, viewport={"width": 900, "height": 700}) as page:
        yield page


@pytest.fixture
def plain(kept_pictures: Page, pictures_url: str) -> Iterator[Page]:
    """Yield the page of pictures."""
    with visited(kept_pictures, pictures_url):
        drawable(kept_pictures)
        yield kept_pictures
