"""Both pages in Chromium under a path of a real nginx: they work, and ask for nothing outside of the path."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import urlsplit

import httpx
import pytest
import soundfile

from tests.clients.web.browser import headless, watched
from tests.clients.web.conftest import DRAWER, WIDE, link_to, loaded
from tests.clients.web.form import tile
from tests.clients.web.headset import at_the_table, three_folder
from tests.clients.web.page_service import Breaker, serving_pages
from tests.clients.web.test_page import started, stroke_pad
from tests.clients.web.test_vr import OPEN
from tests.few import thorough
from tests.service.harness import PATIENCE, START, kept_engine, roomy_settings, until
from tests.service.nginx import nginx, under_a_path

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Playwright

PREFIX = "/a/b"
LOGGED = re.compile(r'"[A-Z]+ (\S+) HTTP/1\.1" (\d+)')
PICTURE = "() => { const shown = document.getElementById('texture-picture'); return shown && shown.naturalWidth > 0; }"
LIVE = "() => ridgewave.fingers.length === 1 && ridgewave.fingers[0].connection.state === 'live'"
RESUMED = "() => ridgewave.fingers[0].connection.addEventListener('resumed', () => { window.resumed = true; })"
ASKED = "() => performance.getEntriesByType('resource').map(({name}) => name)"


@dataclass
class Site:
    """A host that offers the service under PREFIX alone. folder: of nginx, with its log."""

    breaker: Breaker
    folder: Path

    @property
    def url(self) -> str:
        """The address of the page, without its slash."""
        return self.breaker.url + PREFIX

    def asked(self) -> list[tuple[str, int]]:
        """Return the path and the status of every request that has ended."""
        log = (self.folder / "access.log").read_text()
        return [(path, int(status)) for path, status in LOGGED.findall(log)]

    def check(self) -> None:
        """Fail if a request was outside of PREFIX, or not answered well."""
        assert all((path.startswith(f"{PREFIX}/") and status < 400) or status == 499 for path, status in self.asked())


@pytest.fixture(scope="module", params=["removed", thorough("kept"), thorough("removed, and not set")])
def site(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Site]:
    """Yield the real service behind nginx, which removes the prefix or passes it on."""
    folder = tmp_path_factory.mktemp("nginx")
    configuration = under_a_path(folder, PREFIX, removed=request.param != "kept")
    root_path = None if "not set" in request.param else PREFIX
    settings = roomy_settings() | {"data_folder": tmp_path_factory.mktemp("data"), "root_path": root_path}
    with serving_pages(kept_engine(), **settings) as running:
        until(lambda: running.service.warm, START)
        with (
            nginx(folder, urlsplit(running.url).port or 0, configuration=configuration) as port,
            Breaker(f"http://127.0.0.1:{port}") as breaker,
        ):
            yield Site(breaker, folder)


def test_the_page_plays_resumes_and_downloads_under_a_path_of_nginx(
    chromium: Browser, site: Site, tmp_path: Path
) -> None:
    sockets: list[str] = []
    asked: list[str] = []
    url = site.url + link_to({"output": {"duration": "0.2 s"}})
    with watched(chromium, "about:blank", viewport=WIDE, reduced_motion="reduce") as (page, watch):
        watch.host = urlsplit(url).netloc
        page.on("websocket", lambda socket: sockets.append(socket.url))
        page.on("request", lambda request: asked.append(request.url))
        page.goto(url)
        loaded(page)
        page.evaluate(DRAWER)
        page.check(tile("grating-1mm-31um"))
        page.wait_for_function(PICTURE)
        started(page)
        stroke_pad(page)

        page.wait_for_function(LIVE)
        page.evaluate(RESUMED)
        watch.allow("WebSocket connection to .* failed|net::ERR_CONNECTION_RESET")
        site.breaker.reset()
        page.wait_for_function("() => window.resumed === true")
        stroke_pad(page)

        with page.expect_download() as download:
            page.click("#save-wav")
        download.value.save_as(tmp_path / "touch.wav")
        sound, rate = soundfile.read(tmp_path / "touch.wav", dtype="float32")
        assert (len(sound), rate) == (9600, 48000) and abs(sound).max() > 0.1

        for name, path in (("API", "/docs"), ("VR", "/vr")):
            assert page.get_by_role("link", name=name).evaluate("(link) => link.href") == site.url + path
        page.get_by_role("link", name="API").click()
        page.get_by_role("link", name="OpenAPI").click()
        page.wait_for_url(f"{site.url}/openapi.json")
        everything = [*asked, *sockets, page.url]
    live = urlsplit(site.url)._replace(scheme="ws").geturl() + "/v1/live"
    assert sockets[0] == live and sockets[-1].startswith(f"{live}?session="), "a proxy routes by the address"
    own = [one for one in everything if urlsplit(one).scheme in ("http", "https", "ws", "wss")]
    outside = [one for one in own if not urlsplit(one).path.startswith(f"{PREFIX}/")]
    assert outside == [] and len(own) > 30
    site.check()


@pytest.fixture(scope="module")
def drawing(playwright: Playwright) -> Iterator[Browser]:
    """Yield Chromium that draws WebGL."""
    with headless(playwright, webgl=True) as browser:
        yield browser


def test_the_table_is_drawn_under_a_path_of_nginx(
    drawing: Browser, site: Site, tmp_path_factory: pytest.TempPathFactory
) -> None:
    with at_the_table(drawing, site.url, three_folder(tmp_path_factory.mktemp("three"))) as (page, _):
        swatches = page.locator("#list button")
        assert swatches.count() == page.evaluate("() => ridgewave.room.swatches.length") >= 10
        sockets: list[str] = []
        page.on("websocket", lambda socket: sockets.append(socket.url))
        swatches.nth(2).focus()
        page.keyboard.press("ArrowUp")  # a gesture: sound is permitted
        page.wait_for_function(OPEN)
        assert [urlsplit(one).path for one in sockets] == [f"{PREFIX}/v1/live"]
        asked = [urlsplit(one).path for one in page.evaluate(ASKED)]
        assert len(asked) > 30 and all(path.startswith(f"{PREFIX}/") for path in asked)
        assert page.get_by_role("link", name="Pad").evaluate("(link) => link.href") == f"{site.url}/"
    site.check()


def test_the_path_without_its_slash_leads_to_the_page(chromium: Browser, site: Site) -> None:
    with watched(chromium, site.url) as (page, _):
        loaded(page)
        page.evaluate(DRAWER)
        assert page.url == f"{site.url}/"


def test_outside_of_the_path_there_is_no_service(site: Site) -> None:
    for path in ("/", "/v1/textures", "/vr", "/web/page.js"):
        assert httpx.get(site.breaker.url + path, timeout=PATIENCE).status_code in (403, 404), path  # of nginx
