"""The VR page: controllers, tracked hands, mouse and keys touch swatches and are heard; elsewhere there is silence."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from tests.clients.web.browser import headless
from tests.clients.web.headset import DRAW_LITTLE, at_the_table, iwer_script, three_folder
from tests.clients.web.page_service import Breaker
from tests.service.harness import Running, until

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page, Playwright

SMALL = {"width": 200, "height": 160}  # px: the emulated headset draws each of its pictures as large as the window
OPEN = "() => ridgewave.fingers.size === 1 && [...ridgewave.fingers][0].source"
SWATCH = 5  # in the second row, in reach of every hand of the tests, and of most: each asks for tables of its own

STROKE = """async ({hand, id, index, depth}) => {
  const held = device => (hand === "controller" ? device.controllers.right : device.hands.right);
  const {x, z} = tools.swatch(index);
  await tools.put(held(tools.device), id, {x: x - 0.04, y: 0.03, z});
  await tools.until(() => ridgewave.fingers.size === 1 && [...ridgewave.fingers][0].source);
  const heard = tools.listen();
  const touches = [];
  let direction;
  const felt = () => heard.peak > 0 && (hand === "hand" || tools.pulses.length > 0);
  for (let step = 0; step < 200 && !(step >= 6 && felt()); step += 1) {
    await tools.put(held(tools.device), id, {x: x - 0.04 + 0.004 * (step % 20), y: -depth, z});
    touches.push(...ridgewave.touches);
    direction = [...ridgewave.fingers][0].contact.direction;
  }
  const lifted = await tools.silence(() => (
    tools.put(held(tools.device), id, {x: x + 0.04 * Math.sin(performance.now()), y: 0.03, z})
  ));
  return {heard, touches, lifted, direction, after: ridgewave.touches, pulses: tools.pulses};
}"""


@pytest.fixture(scope="module")
def browser(playwright: Playwright) -> Iterator[Browser]:
    with headless(playwright, webgl=True) as chromium:
        yield chromium


@pytest.fixture(scope="module")
def url(service: Running) -> str:
    return service.url


@pytest.fixture(scope="module")
def three(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return three_folder(tmp_path_factory.mktemp("three"))


@pytest.fixture(scope="module")
def iwer(tmp_path_factory: pytest.TempPathFactory) -> str:
    return iwer_script(tmp_path_factory.mktemp("npm"))


@pytest.fixture(scope="module")
def own(service: Running) -> Iterator[dict[str, Any]]:
    """Yield a texture that was imported before the page was opened."""
    wave = "\n".join(str(20.0 * math.sin(0.1 * math.pi * index)) for index in range(400))
    answer = service.client.post(
        "/v1/textures", files={"file": ("own.csv", wave.encode())}, data={"unit": "um", "pixel": "20 um"}
    )
    assert answer.status_code == 201, answer.text
    try:
        yield answer.json()["scene"]["texture"]
    finally:
        service.client.delete("/v1/textures/own").raise_for_status()


@pytest.fixture(scope="module")
def kept_table(browser: Browser, url: str, three: Path, own: dict[str, Any]) -> Iterator[Page]:
    with at_the_table(browser, url, three) as (page, _):
        yield page


@pytest.fixture(scope="module")
def worn(browser: Browser, url: str, three: Path, iwer: str, own: dict[str, Any]) -> Iterator[Page]:
    with at_the_table(browser, url, three, iwer, viewport=SMALL) as (page, _):
        yield page


@pytest.fixture
def table(kept_table: Page) -> Page:
    """Return the page without a headset, where nothing is touched."""
    kept_table.mouse.move(1, 1)
    kept_table.evaluate("() => { document.activeElement.blur(); scrollTo(0, 0); }")
    no_finger(kept_table)
    return kept_table


@pytest.fixture
def headset(worn: Page) -> Iterator[Page]:
    """Yield the page with an emulated headset that has entered, in the floor's frame, with controllers held high.

    It leaves in the end: to draw for a headset takes half of a processor.
    """
    worn.click("#enter:enabled")
    held(worn, "controller")
    yield worn
    worn.evaluate("() => { tools.session?.end(); }")
    worn.wait_for_function("() => !ridgewave.session")


def held(page: Page, kind: str) -> None:
    """Have the headset's wearer hold up two of the kind: controllers, or bare hands."""
    page.evaluate(
        """(kind) => { const {device} = tools; device.primaryInputMode = kind;
             for (const {right} of [device.controllers, device.hands]) right.position.y = 2; }""",
        kind,
    )
    tips = "ridgewave.tips.filter(({id, centre}) => id.endsWith(kind) && centre.y > 0.1)"
    page.wait_for_function(f"(kind) => {tips}.length === 2", arg=kind)
    no_finger(page)


def no_finger(page: Page) -> None:
    """End the streams of earlier tests."""
    page.evaluate("() => ridgewave.fingertips.close()")
    page.wait_for_function("() => ridgewave.fingers.size === 0")


def test_a_controller_sounds_and_vibrates_where_it_touches_until_it_lifts(headset: Page) -> None:
    headset.evaluate("() => { tools.pulses = []; tools.heed('right'); }")
    report = headset.evaluate(STROKE, {"hand": "controller", "id": "right controller", "index": SWATCH, "depth": 0.003})
    assert {touch["index"] for touch in report["touches"]} == {SWATCH}
    assert all(touch["load"] == pytest.approx(0.6, abs=0.01) for touch in report["touches"]), "3 mm at 200 N/m"
    places = [touch["position"] for touch in report["touches"][:6]]
    assert places == pytest.approx([0.03 + 0.004 * step for step in range(6)], abs=1e-4), (
        "true scale, from the left end"
    )
    assert report["heard"]["peak"] > 0
    assert report["lifted"] and report["after"] == []
    assert report["direction"] == pytest.approx(math.pi / 2, abs=0.01), "it points away from the person"
    assert all(0 <= strength <= 1 for strength in report["pulses"])
    assert max(report["pulses"]) > 0 and report["pulses"][-1] == 0


def test_the_index_finger_of_a_tracked_hand_touches_and_a_controller_taken_up_after_it_vibrates(headset: Page) -> None:
    held(headset, "hand")
    report = headset.evaluate(STROKE, {"hand": "hand", "id": "right hand", "index": SWATCH, "depth": 0.005})
    assert {touch["index"] for touch in report["touches"]} == {SWATCH}
    assert all(touch["load"] == pytest.approx(1.0, abs=0.02) for touch in report["touches"])
    assert report["direction"] == pytest.approx(math.pi / 2, abs=0.5), "away from the person, as the hand is held"
    assert report["heard"]["peak"] > 0
    assert report["lifted"] and report["after"] == []
    held(headset, "controller")
    headset.evaluate("() => { tools.pulses = []; tools.heed('right'); }")
    report = headset.evaluate(STROKE, {"hand": "controller", "id": "right controller", "index": SWATCH, "depth": 0.003})
    assert max(report["pulses"]) > 0


def test_leaving_ends_the_session_and_every_touch(headset: Page) -> None:
    put = "(y) => tools.put(tools.device.controllers.right, 'right controller', {...tools.swatch(5), y})"
    headset.evaluate(put, 0.02)
    headset.wait_for_function(OPEN)
    headset.evaluate(put, -0.004)
    headset.wait_for_function("() => [...ridgewave.fingers].some((finger) => finger.touching)")
    headset.evaluate("() => { tools.session.end(); }")
    headset.wait_for_function("() => !ridgewave.session && ridgewave.fingers.size === 0")
    assert headset.inner_text("#enter") == "Enter VR" and headset.is_enabled("#enter")
    assert headset.evaluate("() => tools.silence()")


def test_the_table_stands_before_the_person_within_reach(headset: Page) -> None:
    head, table = headset.evaluate(
        "() => [tools.device.position, ridgewave.room.table.position].map(({x, y, z}) => [x, y, z])"
    )
    assert table[0] == pytest.approx(head[0], abs=0.01)
    assert 0.3 < head[2] - table[2] < 0.6 and 0.5 < table[1] < head[1] - 0.3


@pytest.mark.slow
def test_a_mouse_that_presses_and_strokes_sounds_and_is_silent_when_it_lets_go(table: Page) -> None:
    x, y = table.evaluate(
        """async (index) => {
          const {x, z} = tools.swatch(index);
          const {Vector3} = ridgewave.room.three;
          const seen = ridgewave.room.table.localToWorld(new Vector3(x, 0, z)).project(ridgewave.room.camera);
          const {left, top, width, height} = document.querySelector("#view").getBoundingClientRect();
          return [left + (seen.x + 1) / 2 * width, top + (1 - seen.y) / 2 * height];
        }""",
        SWATCH,
    )
    table.mouse.move(x, y)
    table.evaluate(
        """() => {
          const look = () => {
            const [touch] = ridgewave.touches;
            if (touch) window.first = {...touch};
            else requestAnimationFrame(look);
          };
          window.first = null;
          look();
        }"""
    )
    table.mouse.down()
    table.wait_for_function("() => window.first && [...ridgewave.fingers].some((finger) => finger.touching)")
    first = table.evaluate("() => window.first")
    assert first["index"] == SWATCH and 0.3 <= first["load"] < 3.0
    table.evaluate("() => { window.heard = tools.listen(); }")
    turns = itertools.count()

    def heard() -> bool:
        table.mouse.move(x + 12 * (-1) ** next(turns), y, steps=4)
        return bool(table.evaluate("() => heard.peak > 0"))

    until(heard)
    table.wait_for_function("(load) => ridgewave.touches[0].load > load", arg=first["load"])  # held longer is deeper
    table.mouse.wheel(0, 100)
    table.wait_for_function("() => ridgewave.touches.length === 1")
    table.mouse.up()
    table.wait_for_function("() => ridgewave.touches.length === 0")
    assert table.evaluate("() => tools.silence()")


def test_arrow_keys_stroke_the_swatch_whose_button_has_the_focus(table: Page) -> None:
    buttons = table.locator("#list button")
    assert buttons.count() == table.evaluate("() => ridgewave.room.swatches.length") >= 10
    buttons.nth(2).focus()
    table.keyboard.press("ArrowUp")
    table.wait_for_function(OPEN)
    table.keyboard.down("ArrowRight")
    table.wait_for_function("() => [...ridgewave.fingers].some((finger) => finger.touching)")
    (touch,) = table.evaluate("() => ridgewave.touches")
    assert touch["index"] == 2 and touch["load"] == pytest.approx(0.4)
    table.wait_for_function("(position) => ridgewave.touches[0]?.position > position", arg=touch["position"])
    table.keyboard.up("ArrowRight")
    table.wait_for_function("() => ridgewave.touches.length === 0")
    assert table.evaluate("() => tools.silence()")


def test_swatches_that_the_focus_only_passes_open_no_stream(table: Page) -> None:
    """Each of them is solved by the service before the one that is wanted: 12 took 33 s in place of 10 s."""
    sockets: list[str] = []
    table.on("websocket", lambda socket: sockets.append(socket.url))
    table.evaluate(
        """async () => {
          for (const button of [...document.querySelectorAll("#list button")].slice(0, SWATCH + 1)) {
            button.focus();
            await tools.frames();
          }
        }""".replace("SWATCH", str(SWATCH))
    )
    table.wait_for_function(OPEN)
    assert len(sockets) == 1


def test_a_service_that_is_gone_is_told_until_it_is_back(browser: Browser, service: Running, three: Path) -> None:
    with Breaker(service.url) as breaker, at_the_table(browser, breaker.url, three) as (page, watch):
        watch.allow("WebSocket connection to .* failed|Failed to load resource")
        page.locator("#list button").nth(SWATCH).focus()
        page.keyboard.press("ArrowUp")
        page.wait_for_function(OPEN)
        target, breaker.target = breaker.target, None
        breaker.reset()
        page.wait_for_function("() => document.querySelector('#status').textContent.includes('connection is lost')")
        breaker.target = target
        page.keyboard.press("ArrowDown")
        page.wait_for_function("() => document.querySelector('#status').textContent === ''")
        assert page.evaluate("() => [...ridgewave.fingers].map(({connection}) => connection.state)") == ["live"]


def test_imported_textures_lie_beside_the_catalogue_and_sound(table: Page, own: dict[str, Any]) -> None:
    buttons = table.locator("#list button")
    last = buttons.count() - 1
    assert last == 12 and buttons.nth(last).inner_text().split("\n")[0] == "own"
    buttons.nth(last).focus()
    for key in ("ArrowUp", "ArrowDown"):  # the load stays as it was
        table.keyboard.press(key)
    table.wait_for_function(OPEN)
    table.evaluate("() => { window.heard = tools.listen(); }")
    for step in range(200):  # a stroke ends at the swatch's end, where a slow machine may not have heard it yet
        key = ("ArrowRight", "ArrowLeft")[step % 2]
        table.keyboard.down(key)
        table.wait_for_function("() => ridgewave.touches[0]?.index === 12")
        table.wait_for_function("() => ridgewave.touches.length === 0 || heard.peak > 0")
        table.keyboard.up(key)
        if table.evaluate("() => heard.peak") > 0:
            break
    assert table.evaluate("() => heard.peak") > 0
    assert table.evaluate("() => [...ridgewave.fingers][0].scene.held.texture") == own


def test_silence_takes_every_finger_off(table: Page) -> None:
    table.locator("#list button").nth(SWATCH).focus()
    for key in ("ArrowUp", "ArrowDown"):  # the load stays as it was
        table.keyboard.press(key)
    table.wait_for_function(OPEN)
    table.keyboard.down("ArrowRight")
    table.wait_for_function("() => [...ridgewave.fingers].some((finger) => finger.touching)")
    table.evaluate("() => document.querySelector('#silence').click()")
    table.wait_for_function("() => ridgewave.fingers.size === 0 && ridgewave.player.volume === 0")
    assert table.get_attribute("#silence", "aria-pressed") == "true"
    table.keyboard.up("ArrowRight")
    table.evaluate("() => document.querySelector('#silence').click()")
    assert table.get_attribute("#silence", "aria-pressed") == "false"


def test_the_table_stays_where_it_is_when_the_limiter_reports(table: Page) -> None:
    size = table.viewport_size
    assert size is not None
    for width in (900, 640):
        table.set_viewport_size({"width": width, "height": size["height"]})
        tops = []
        for words in ("The limiter reduces this swatch by 9 dB.", ""):
            table.evaluate("(words) => { document.querySelector('#limiter').textContent = words; }", words)
            table.evaluate("(hidden) => { document.querySelector('#rescale').hidden = hidden; }", not words)
            box = table.locator("#view").bounding_box()
            assert box is not None
            tops.append(box["y"])
        assert tops[0] == tops[1]
    table.set_viewport_size(size)
    table.evaluate(DRAW_LITTLE)  # a page of another size draws in full again


def test_a_button_that_cannot_enter_says_why(table: Page) -> None:
    table.evaluate("() => { window.xr = navigator.xr; }")
    for before, sentence in (
        ("navigator.xr.isSessionSupported = async () => false", "No headset was found"),
        ("Object.defineProperty(navigator, 'xr', {value: undefined})", "in the browser of a headset"),
        ("Object.defineProperty(window, 'isSecureContext', {value: false})", "over https or from localhost"),
    ):
        table.evaluate(f"() => {{ {before}; xr.dispatchEvent(new Event('devicechange')); }}")
        table.wait_for_function("(part) => document.querySelector('#why').textContent.includes(part)", arg=sentence)
        assert table.is_disabled("#enter")
        assert table.get_attribute("#enter", "aria-describedby") == "why"


def test_without_three_js_the_page_says_how_to_get_it_and_leads_to_the_pad(browser: Browser, url: str) -> None:
    with at_the_table(browser, url, None, ready="#status a") as (page, watch):
        watch.allow("vendor")
        assert "lacks three.js" in page.inner_text("#status") and "Node" in page.inner_text("#status")
        assert page.get_attribute("#status a", "href") == "/"
