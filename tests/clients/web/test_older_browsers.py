"""The oldest browsers of docs/touch-page.md: the pages work without what is newer, and use no newer style or syntax."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from tests.clients.web.browser import headless, watched
from tests.clients.web.conftest import DRAWER, WIDE, link_to, loaded
from tests.clients.web.form import tile
from tests.clients.web.headset import at_the_table, three_folder
from tests.clients.web.page_service import WEB

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Playwright

    from tests.service.harness import Running

NEWER = {
    "": "OffscreenCanvas AbortSignal.any AbortSignal.timeout Map.groupBy Object.groupBy Array.fromAsync "
    "Promise.withResolvers Promise.try Iterator.from URL.canParse URL.parse RegExp.escape structuredClone "
    "Error.isError Float16Array Uint8Array.fromBase64 CompressionStream DecompressionStream requestIdleCallback "
    "scheduler ViewTransition CloseWatcher URLPattern Highlight EyeDropper Sanitizer Temporal reportError",
    "Array.prototype": "findLast findLastIndex toSorted toReversed toSpliced with",
    "Float32Array.prototype": "findLast findLastIndex toSorted toReversed with",
    "Set.prototype": "union intersection difference symmetricDifference isSubsetOf isSupersetOf isDisjointFrom",
    "Map.prototype": "getOrInsert getOrInsertComputed",
    "Iterator.prototype": "map filter take drop flatMap reduce toArray forEach some every find",
    "String.prototype": "isWellFormed toWellFormed",
    "ArrayBuffer.prototype": "transfer transferToFixedLength resize",
    "HTMLElement.prototype": "showPopover hidePopover togglePopover editContext",
    "Element.prototype": "checkVisibility setHTMLUnsafe getHTML moveBefore",
    "Document.prototype": "startViewTransition caretPositionFromPoint",
    "PointerEvent.prototype": "getCoalescedEvents getPredictedEvents",
    "AudioContext.prototype": "setSinkId outputLatency",
    "Navigator.prototype": "userActivation audioSession vibrate getGamepads locks storage scheduling xr clipboard",
    "Headers.prototype": "getSetCookie",
    "Blob.prototype": "bytes",
    "Response.prototype": "bytes",
}
"""What came to a browser after 2021 or is missing in one; and what the pages use only where it is there."""
DELETED = """for (const [place, names] of Object.entries(%s)) for (const name of names.split(" ")) {
  let holder = window;
  const path = [...place.split("."), ...name.split(".")].filter(Boolean);
  for (const step of path.slice(0, -1)) holder = holder?.[step];
  if (holder) delete holder[path[path.length - 1]];
}
delete window.onpointerrawupdate;"""
OLDER = DELETED % repr(NEWER)
SYNTAX = {
    ".js": r"\bimport\s[^;]*\bwith\s*\{|\bstatic\s*\{|/[dgimsuy]*v[dgimsuy]*[;,).]|\(\?<[=!]|^\s*(await )?using\s|"
    r"#\w+ in\b|^(?:const [^=]*= )?await\b|\.hasOwn\(",
    ".css": r":has\(|@layer|@container|@scope|@property|@starting-style|color-mix\(|light-dark\(|oklch|oklab|"
    r"\d[sdl]v[hw]\b|text-wrap|field-sizing|subgrid|anchor\(|(?m:^\s*&)|\blh\b|\(width|\(height|@import",
}


def test_what_is_newer_is_there_before_it_is_deleted(chromium: Browser, service: Running) -> None:
    with watched(chromium, service.url + link_to({})) as (page, _):
        kept = page.evaluate("() => [typeof Map.groupBy, typeof OffscreenCanvas, typeof [].toSorted]")
        assert kept == ["function"] * 3
        page.evaluate(f"() => {{ {OLDER} }}")
        kept = page.evaluate("() => [typeof Map.groupBy, typeof OffscreenCanvas, typeof [].toSorted]")
        assert kept == ["undefined"] * 3


def test_the_pad_works_without_what_is_newer(chromium: Browser, service: Running) -> None:
    with watched(chromium, "about:blank", viewport=WIDE) as (page, watch):
        watch.host = service.url.removeprefix("http://")
        watch.allow("status of 422 .*dry_run")  # the file has no unit; Escape may come before that answer
        page.add_init_script(OLDER)
        page.goto(service.url + link_to({}))
        loaded(page)
        page.evaluate(DRAWER)
        page.wait_for_selector("#texture .wall-group")
        page.click("#stroke")
        page.wait_for_function("() => ridgewave.fingers[0]?.source?.played > 9600")
        page.wait_for_function("() => !document.querySelector('[data-stale]')")
        page.check(tile("grating-1mm-31um"))
        page.wait_for_function("() => ridgewave.state.scene.texture?.kind === 'grating-1mm-31um'")
        page.wait_for_function("() => !document.querySelector('[data-stale]')")
        page.click("#fold")
        page.click("#undo")
        page.wait_for_function("() => ridgewave.state.scene.texture === undefined")
        page.set_input_files("#import", {"name": "x.csv", "mimeType": "text/csv", "buffer": b"0,1\n1,2\n2,1\n"})
        page.wait_for_selector("dialog[open]")
        page.keyboard.press("Escape")
        page.evaluate("() => { document.getElementById('devices').open = true; }")
        page.check("#rumble")
        page.wait_for_function("() => document.getElementById('rumble-state').textContent")


def test_vr_works_without_what_is_newer(
    playwright: Playwright, service: Running, tmp_path_factory: pytest.TempPathFactory
) -> None:
    three = three_folder(tmp_path_factory.mktemp("three"))
    with headless(playwright, webgl=True) as browser, at_the_table(browser, service.url, three, OLDER) as (page, _):
        assert page.evaluate("() => ridgewave.room.layout.places.length") >= 12


@pytest.mark.parametrize("ending", SYNTAX)
def test_no_source_has_a_newer_syntax_or_style(ending: str) -> None:
    sources = [path for path in Path(WEB).rglob(f"*{ending}") if "vendor" not in path.parts]
    assert len(sources) > 3
    found = [
        f"{path.relative_to(WEB)}: {match[0]}"
        for path in sources
        for match in re.finditer(SYNTAX[ending], path.read_text("utf-8"), re.MULTILINE)
    ]
    assert found == []


def test_an_iphone_sounds_though_its_mute_switch_is_on(chromium: Browser, service: Running) -> None:
    with watched(chromium, "about:blank") as (page, watch):
        watch.host = service.url.removeprefix("http://")
        page.add_init_script("navigator.audioSession = {type: 'auto'}")
        page.goto(service.url + link_to({}))
        loaded(page)
        page.evaluate(DRAWER)
        assert page.evaluate("() => navigator.audioSession.type") == "auto", (
            "a silent page leaves other apps their sound"
        )
        page.click("#start")
        page.wait_for_function("() => ridgewave.fingers[0]?.source")
        assert page.evaluate("() => navigator.audioSession.type") == "playback"
        page.click("#start")
        page.wait_for_function("() => navigator.audioSession.type === 'auto'")
