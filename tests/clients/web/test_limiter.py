"""The lamp of the safety limiter, its announcement, and rescaling."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import pytest

from tests.clients.web.browser import kept_page, visited
from tests.clients.web.conftest import DRAWER, START_SCENE, loaded
from tests.clients.web.page_service import WEB
from tests.clients.web.test_accessibility import violations
from tests.service.harness import Running, serving, warmed_up
from tests.service.plain_engine import PlainEngine
from tests.service.plain_hand import PlainHand

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

LAMP = "document.getElementById('limiter')"
INCOMPLETE = "TypeError"  # the plain engine's pictures and plans lack what the page draws
STROKE = """() => { const pad = document.getElementById("pad"); const {left, top} = pad.getBoundingClientRect();
  window.events = [31, 32].map((pointerId) => (kind, x) => pad.dispatchEvent(new PointerEvent(kind,
    {pointerId, pointerType: "touch", button: 0, clientX: left + x, clientY: top + 50, bubbles: true})));
  for (const event of events) event("pointerdown", 20);
  window.going = setInterval(() => { for (const event of events)
    event("pointermove", 100 + 80 * Math.sin(performance.now() / 200)); }, 8); }"""
PLAYED = "() => ridgewave.fingers.every(({source, touching}) => touching && source?.played > 4800)"


class LoudHand(PlainHand):
    """A hand whose limiter turns down by 12 dB whatever has a full scale below 40."""

    def render(self, frames: int):  # type: ignore[no-untyped-def]
        self.reduction_db = 12.0 if self.full_scale[0] < 40.0 else 0.0
        return super().render(frames)


class LoudEngine(PlainEngine):
    """Opens hands that are too loud for their automatic full scale of 12.5."""

    def open_hand(self, scene, *, record=False):  # type: ignore[no-untyped-def]
        hand = LoudHand(scene, record=record)
        self.hands.append(hand)
        return hand


@pytest.fixture(scope="module")
def loud() -> Iterator[Running]:
    engine = LoudEngine()
    with serving(engine, web=str(WEB)) as running:
        warmed_up(running, engine)
        yield running


@pytest.fixture(scope="module")
def kept(chromium: Browser) -> Iterator[Page]:
    with kept_page(chromium) as one:
        yield one


@pytest.fixture
def page(kept: Page, loud: Running) -> Iterator[Page]:
    kept.emulate_media(reduced_motion="reduce")
    with visited(kept, loud.url + "/") as watch:
        watch.allow(INCOMPLETE)
        loaded(kept)
        kept.evaluate(DRAWER)
        yield kept


def limited(page: Page) -> list[str]:
    """Stroke with two fingers until the limiter acts; return the sessions."""
    page.click("#start")
    page.wait_for_function("() => document.getElementById('state').textContent === 'live'")
    page.evaluate(STROKE)
    page.wait_for_function(f"() => {LAMP}.hasAttribute('data-lit')")
    page.wait_for_function(PLAYED)
    sessions: list[str] = page.evaluate("() => ridgewave.fingers.map(({connection}) => connection.ready.session)")
    return sessions


def test_the_lamp_is_lit_read_out_once_and_dark_when_nothing_is_limited(page: Page) -> None:
    limited(page)
    assert page.locator("#limiter").inner_text() == "reduces by 12 dB"
    assert page.get_attribute("#limiter", "role") == "status"
    assert violations(page, ".limiter") == []
    page.evaluate(
        "() => { window.spoken = 0; const watch = new MutationObserver(() => (spoken += 1));"
        f" watch.observe({LAMP}, {{childList: true}}); }}"
    )
    heard = "() => new Promise((done) => ridgewave.session.addEventListener('limited', done, {once: true}))"
    page.evaluate(f"async () => {{ for (let n = 0; n < 2; n += 1) await ({heard})(); }}")
    assert page.evaluate("() => spoken") == 0, "it limits on, and the sentence is the same"
    page.evaluate("() => { clearInterval(going); for (const event of events) event('pointerup', 20); }")
    page.wait_for_function(f"() => !{LAMP}.hasAttribute('data-lit')")
    assert page.is_visible("#rescale")


def test_one_click_rescales_under_the_same_hands_at_the_same_volume(page: Page) -> None:
    page.evaluate("() => { const volume = document.getElementById('volume'); volume.value = 0.3;"
                  " volume.dispatchEvent(new Event('input')); }")  # fmt: skip
    before = limited(page)
    page.click("#rescale")
    told = "The full scale is now 62.2 m/s"
    page.wait_for_function("(told) => document.getElementById('notice').textContent.startsWith(told)", arg=told)
    page.wait_for_function(PLAYED)
    assert page.evaluate("() => [ridgewave.player.volume, ridgewave.fingers.length]") == [0.3, 2]
    ready = page.evaluate("() => ridgewave.fingers.map(({connection}) => connection.ready)")
    assert not {one["session"] for one in ready} & set(before)
    assert [one["full_scale"] for one in ready] == [[pytest.approx(12.5 * 10**0.6 * 1.25)]] * 2
    assert page.locator("#limiter").inner_text() == "–" and page.is_hidden("#rescale")
    assert page.evaluate("() => ridgewave.state.scene") == START_SCENE, (
        "the full scale is the streams', not the scene's"
    )


def test_a_full_scale_that_the_scene_names_is_taken_out_and_can_be_undone(page: Page) -> None:
    page.evaluate("() => ridgewave.state.write(['output', 'full_scale'], '5 m/s^2')")
    limited(page)
    page.click("#rescale")
    page.wait_for_function("() => ridgewave.fingers[0]?.connection.ready?.full_scale[0] === 12.5")
    assert page.evaluate("() => ridgewave.state.scene") == START_SCENE
    page.click("#undo")
    assert page.evaluate("() => ridgewave.state.scene.output") == {"full_scale": "5 m/s^2"}


def test_a_swatch_that_is_turned_down_gets_a_session_with_room(functions: Page) -> None:
    asked = functions.evaluate(
        """async () => {
          const {FingertipStream} = await import("/web/vr/fingertip_stream.js");
          const [scenes, told, fingers] = [[], [], []];
          const open = async (scene) => {
            scenes.push(scene.output?.full_scale ?? null);
            const connection = {ready: {full_scale: [scene.output?.full_scale ?? 10]}};
            const finger = Object.assign(new EventTarget(), {connection, moves: 0, closed: false,
              move() { this.moves += 1; }, lift() {}, close() { this.closed = true; }});
            fingers.push(finger);
            return finger;
          };
          const onLimited = (reduction) => told.push(reduction);
          const stream = new FingertipStream({swatches: [{scene: {}}], open, onLimited});
          const touch = (time) => stream.follow({index: 0, position: 0.01 * time, load: 0.5, height: 0}, time);
          touch(0);
          await new Promise((done) => setTimeout(done));
          touch(1);
          fingers[0].dispatchEvent(new CustomEvent("limited", {detail: {gain_reduction_db: 6}}));
          await stream.rescale();
          touch(2);
          return {scenes, told, moves: fingers.map(({moves}) => moves), closed: fingers.map(({closed}) => closed)};
        }"""
    )
    assert asked == {
        "scenes": [None, pytest.approx(10 * 10**0.3 * 1.25)],
        "told": [6],
        "moves": [1, 1],
        "closed": [True, False],
    }
