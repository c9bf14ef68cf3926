"""A browser that cannot sound: the page says why and what to do, and no text of an exception reaches the reader."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import TYPE_CHECKING

import pytest

from tests.clients.web.browser import WAIT, headless, watched
from tests.clients.web.conftest import link_to, loaded
from tests.clients.web.page_service import WEB, serving_pages
from tests.service.harness import START, Running, kept_engine, roomy_settings, until

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page, Playwright

HOST = "lab.example"
SECURE = "Sound needs https or localhost. Open this page at such an address."
MISTAKE = "This page made a mistake. Reload it, then try again. The console of the browser has the details."
THROWS = "window.AudioContext = class { constructor() { throw new %s; } };"
CAUSES = {
    "not permitted": (
        THROWS % "DOMException('denied', 'NotAllowedError')",
        "The browser does not permit sound here. Permit it in the settings of the browser, then try again.",
    ),
    "a rate that it lacks": (
        THROWS % "DOMException('rate', 'NotSupportedError')",
        "This browser cannot play that sample rate. Set 48 kHz, or download the WAV.",
    ),
    "no AudioContext": (
        "delete window.AudioContext;",
        "This browser lacks what the sound needs. Update it, or use another one.",
    ),
    "no WebSocket": (
        "delete window.WebSocket;",
        "This browser opens no stream to the service. Update it, or use another one.",
    ),
    "a stream that is forbidden": (
        "window.WebSocket = class { constructor() { throw new DOMException('insecure', 'SecurityError'); } };",
        "This browser opens no stream to the service. Update it, or use another one.",
    ),
    "a mistake of the page": (THROWS % "ReferenceError('depth is not defined')", MISTAKE),
}
MESSAGE = re.compile(r"(?<!\bdata)\.message\b|[{,]\s*message\s*[:,}]|\$\{(?:error|problem)\}")
"""What reads the text of an exception."""


@pytest.fixture(scope="module")
def insecure(playwright: Playwright) -> Iterator[tuple[Browser, str]]:
    """Yield a browser and the address of a service that is neither https nor localhost."""
    settings = {**roomy_settings(), "allowed_hosts": f"{HOST},127.0.0.1"}
    rules = f"--host-resolver-rules=MAP {HOST} 127.0.0.1"
    with serving_pages(kept_engine(), **settings) as running, headless(playwright, rules) as browser:
        until(lambda: running.service.warm, START)
        yield browser, running.url.replace("127.0.0.1", HOST)


def told(page: Page, place: str, sentence: str) -> None:
    """Return once `place` says `sentence`; fail with what it says."""
    for _ in range(100):
        if page.locator(f"#{place}").text_content() == sentence:
            return
        page.wait_for_timeout(100)
    assert page.locator(f"#{place}").text_content() == sentence


def test_a_page_without_https_says_at_once_that_it_has_no_sound(insecure: tuple[Browser, str]) -> None:
    browser, url = insecure
    with watched(browser, url + link_to({})) as (page, _):
        loaded(page)
        assert page.evaluate("() => isSecureContext") is False
        told(page, "pad-note", SECURE)
        assert page.is_visible("#pad-note")
        before = page.locator("#pad").bounding_box()
        page.click("#start")
        told(page, "notice", SECURE)
        assert page.locator("#state").text_content() == "not started"
        assert page.locator("#pad").bounding_box() == before


def test_a_note_on_the_sound_fits_the_pad_of_a_phone(insecure: tuple[Browser, str]) -> None:
    browser, url = insecure
    with watched(browser, url + link_to({}), viewport={"width": 320, "height": 568}) as (page, _):
        loaded(page)
        told(page, "pad-note", SECURE)
        note, pad = (page.locator(one).bounding_box() for one in ("#pad-note span", "#pad"))
        assert note and pad
        assert note["x"] >= 0 and note["x"] + note["width"] <= 320
        assert note["y"] + note["height"] <= pad["y"] + 0.8 * pad["height"], "the scale is below"
        assert page.is_hidden("#pad-invite"), "nothing else lies there"


def test_a_table_without_https_says_so_too(insecure: tuple[Browser, str]) -> None:
    browser, url = insecure
    with watched(browser, url + link_to({})) as (page, _):
        said = page.evaluate(
            """async () => {
              const {TableSound} = await import("/web/vr/table_sound.js");
              const status = {text: "", say(text) { this.text = text; }};
              const sound = new TableSound(0.1, status);
              sound.tellSilence();
              const atOnce = status.text;
              status.text = "";
              await sound.begin();
              return [atOnce, status.text];
            }"""
        )
        assert said == [SECURE, SECURE]


@pytest.mark.parametrize("cause", CAUSES)
def test_a_cause_of_silence_is_told_in_words(chromium: Browser, service: Running, cause: str) -> None:
    script, sentence = CAUSES[cause]
    with watched(chromium, "about:blank") as (page, watch):
        watch.host = service.url.removeprefix("http://")
        watch.allow(r"ReferenceError")
        page.add_init_script(script)
        page.goto(service.url + link_to({}))
        loaded(page)
        page.click("#start")
        told(page, "notice", sentence)
        page.wait_for_function("() => document.getElementById('state').textContent === 'not started'", timeout=WAIT)
        assert page.locator("#start").text_content() == "Touch"
        assert bool(watch.wrong) == (sentence == MISTAKE), "the console has the exception"


def test_a_page_that_sounds_has_no_such_note(functions: Page) -> None:
    why = functions.evaluate("async () => (await import('/web/sound/player.js')).whySilent()")
    assert why == ""


def test_one_place_reads_the_text_of_exceptions() -> None:
    found = [
        f"{path.relative_to(WEB)}: {line.strip()}"
        for path in sorted(WEB.rglob("*.js"))
        if "vendor" not in path.parts and path.name != "explained.js"
        for line in path.read_text("utf-8").splitlines()
        if MESSAGE.search(line)
    ]
    assert found == []
