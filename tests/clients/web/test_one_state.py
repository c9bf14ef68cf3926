"""Sliders, form, link, files, undo, views and sound agree; parts that are not updated yet are grey."""

from __future__ import annotations

import base64
import json
import threading
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import pytest

from synth.scene.scene import Scene
from synth.voice.hand_voice import HandVoice
from synth.voice.live_voice import Change
from tests.clients.web.browser import watched
from tests.clients.web.conftest import MODULES, START_SCENE, loaded, modules_loaded
from tests.clients.web.form import tile
from tests.clients.web.page_service import serving_pages
from tests.clients.web.test_accessibility import violations
from tests.service.harness import PATIENCE, Running
from tests.service.plain_engine import PlainEngine

if TYPE_CHECKING:
    from pathlib import Path

    from playwright.sync_api import Browser, Page, Request, Route

SLIDE = """([id, place]) => {
  const track = document.getElementById(id);
  track.value = place;
  for (const type of ["input", "change"]) track.dispatchEvent(new Event(type, {bubbles: true}));
}"""
STALE = "() => [...document.querySelectorAll('[data-stale]')].map((one) => one.id || one.querySelector('canvas')?.id)"
NOTE = "document.getElementById('pad-note')"
AGREED = f"() => {NOTE}.hidden"
LIVE = "() => document.getElementById('state').textContent === 'live'"


def slide(page: Page, dial: str, place: int) -> str:
    """Move the slider of `dial` to `place` of 1000 and let it go; return what stands beside it."""
    page.evaluate(SLIDE, [dial, place])
    return page.locator(f"#{dial}-value").inner_text()


def linked(page: Page) -> Any:
    """Return the scene in the page's address, None where it has none."""
    text = page.evaluate("() => location.hash").removeprefix("#scene=")
    return json.loads(base64.urlsafe_b64decode(text + "=" * (-len(text) % 4))) if text else None


def downloaded(page: Page, path: Path) -> Any:
    """Return the scene as the page saves it."""
    with page.expect_download() as download:
        page.click("#save-scene")
    download.value.save_as(path)
    return json.loads(path.read_text())


def test_sliders_link_file_undo_and_picture_agree(touch_page: Page, tmp_path: Path) -> None:
    pictured: list[Any] = []

    def note(request: Request) -> None:
        if request.url.endswith("/v1/picture"):
            pictured.append(json.loads(request.post_data or "")["scene"])

    touch_page.on("request", note)
    assert touch_page.is_disabled("#undo")
    load, speed = slide(touch_page, "load", 897), slide(touch_page, "speed", 899)
    touch_page.wait_for_function(AGREED)
    scene = touch_page.evaluate("() => ridgewave.state.scene")
    assert (load, speed) == ("7.21 N", "928 mm/s")
    assert scene == START_SCENE | {"scan": {"load": load, "speed": speed}}
    assert downloaded(touch_page, tmp_path / "scene.json") == linked(touch_page) == pictured[-1] == scene
    assert touch_page.input_value("#field-scan-load") == load
    touch_page.click("#undo")
    touch_page.wait_for_function(AGREED)
    assert touch_page.locator("#speed-value").inner_text() == "80 mm/s"
    assert linked(touch_page) == pictured[-1] == START_SCENE | {"scan": {"load": load}}
    touch_page.click("#undo")
    assert linked(touch_page) is None and touch_page.is_disabled("#undo")
    touch_page.click("#redo")
    assert touch_page.locator("#load-value").inner_text() == load


def test_after_a_reload_there_is_nothing_to_undo(comb_page: Page) -> None:
    """Undo replaced the scene of the link by the scene with which the page begins."""
    comb_page.evaluate("() => ridgewave.state.write(['texture', 'period'], '1 mm')")
    assert comb_page.is_enabled("#undo")
    comb_page.reload()
    loaded(comb_page)
    assert linked(comb_page) == {"texture": {"period": "1 mm"}} == comb_page.evaluate("() => ridgewave.state.scene")
    assert comb_page.is_disabled("#undo")


def test_the_sliders_tell_what_the_scene_holds(still_page: Page) -> None:
    """Beyond the sliders, below them, a stroke, and a recorded motion."""
    scans: list[tuple[Any, tuple[str, str]]] = [
        ({"load": "50 N", "speed": "9 m/s"}, ("50 N", "9 m/s")),
        ({"load": 0, "speed": "-0.5 mm/s"}, ("0 N", "-500 um/s")),
        ({"stroke": {"load": "2 N", "speed": "0.3 m/s", "length": "40 mm"}}, ("2 N", "300 mm/s")),
        ({"trajectory": [[0, 0, 0.3], [0.1, 0.01, 0.3], [0.2, 0.02, 0.3], [0.3, 0.03, 0.3]]}, ("as recorded",) * 2),
    ]
    for scan, shown in scans:
        still_page.evaluate("(scan) => ridgewave.state.take({scan})", scan)
        for dial, words in zip(("load", "speed"), shown, strict=True):
            assert still_page.locator(f"#{dial}-value").inner_text() == words
            assert still_page.get_attribute(f"#{dial}", "aria-valuetext") == words


def test_a_slider_writes_into_the_stroke_that_the_scene_has(still_page: Page) -> None:
    still_page.evaluate("() => ridgewave.state.take({scan: {stroke: {length: '40 mm'}}})")
    load = slide(still_page, "load", 800)
    assert still_page.evaluate("() => ridgewave.state.scene.scan") == {"stroke": {"length": "40 mm", "load": load}}


def test_a_hand_presses_with_the_load_of_the_scene(comb_page: Page) -> None:
    comb_page.evaluate("() => ridgewave.state.write(['scan', 'load'], '1.5 N')")
    comb_page.evaluate(
        """() => { window.loads = []; const {move} = ridgewave.session;
             ridgewave.session.move = (id, contact) => { loads.push(contact.load); };
             const box = document.getElementById("pad").getBoundingClientRect();
             document.getElementById("pad").dispatchEvent(new PointerEvent("pointerdown", {pointerId: 7, button: 0,
               pointerType: "touch", clientX: box.left + 9, clientY: box.top + 9, bubbles: true})); }"""
    )
    assert comb_page.evaluate("() => loads") == [1.5]


def test_a_picture_that_is_not_yet_of_the_scene_is_grey_and_says_so(comb_page: Page) -> None:
    held: list[Route] = []
    comb_page.wait_for_function(AGREED)
    comb_page.route("**/v1/picture", lambda route: held.append(route))
    with comb_page.expect_request("**/v1/picture"):
        comb_page.check(tile("grating-500um-40um"))
    assert {"pad", "contact"} <= set(comb_page.evaluate(STALE))
    assert comb_page.locator("#pad-note").inner_text() == "Not updated yet: picture."
    assert violations(comb_page) == []
    held[0].continue_()
    comb_page.wait_for_function(AGREED)
    comb_page.wait_for_function("() => !document.querySelector('[data-stale]')")


def test_a_picture_and_a_plan_that_nobody_wants_any_more_are_ended(comb_page: Page) -> None:
    held: list[Route] = []
    comb_page.wait_for_function(AGREED)
    for path in ("picture", "explain"):
        comb_page.route(f"**/v1/{path}", lambda route: held.append(route))
    comb_page.check(tile("grating-500um-40um"))
    wait_until(comb_page, lambda: len(held) == 2)
    comb_page.check(tile("grating-1mm-31um"))
    wait_until(comb_page, lambda: all(route.request.failure is not None for route in held[:2]))
    wait_until(comb_page, lambda: len(held) == 4)
    for route in held[2:]:
        route.continue_()
    comb_page.wait_for_function(AGREED)
    comb_page.unroute_all()


def wait_until(page: Page, condition: Callable[[], bool]) -> None:
    """Wait until `condition` holds, 20 s at most."""
    for _ in range(2000):
        if condition():
            return
        page.wait_for_timeout(10)
    pytest.fail("It never held.")


@pytest.mark.parametrize("touching", [False, True], ids=["no finger down", "a finger down"])
def test_the_message_ends_when_the_change_is_applied(
    comb_page: Page, service: Running, touching: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    gate, prepare = threading.Event(), HandVoice.prepare

    def slowly(voice: HandVoice, scene: Scene) -> Change:
        gate.wait(PATIENCE)
        return prepare(voice, scene)

    comb_page.click("#stroke" if touching else "#start")
    comb_page.wait_for_function(LIVE)
    monkeypatch.setattr(HandVoice, "prepare", slowly)
    comb_page.evaluate("() => ridgewave.state.write(['output', 'duration'], '3 s')")
    comb_page.wait_for_function("() => document.getElementById('state').textContent === 'solving the contact…'")
    comb_page.wait_for_function(f"() => {NOTE}.textContent === 'Not updated yet: sound.'")
    assert {"pad", "waveform", "spectrum"} <= set(comb_page.evaluate(STALE))
    gate.set()
    comb_page.wait_for_function(LIVE)
    comb_page.wait_for_function(AGREED)
    (session,) = (one for one in service.service.sessions._sessions.values() if one.peer is not None)
    assert session.stream is not None and session.stream.coming is None, "it is applied, not only prepared"
    assert session.scene.output.duration == 3.0


BECOME = """async () => {
  const player = await modules.Player.open({sampleRate: 48000});
  const finger = new modules.Finger({player});
  const [states, heard] = [[], modules.heard(finger, "scene")];
  finger.addEventListener("sceneStatus", () => states.push(finger.scene.isCurrent));
  const {session} = await finger.open();
  for (let step = 1; step <= 150; step += 1) finger.change({texture: {period: `${step} mm`}});
  await modules.until(() => finger.scene.isCurrent);
  const played = finger.source.given;
  await finger.close();
  await player.close();
  return {session, states, answers: heard.length, played, held: finger.scene.held};
}"""


def test_of_many_changes_the_last_is_applied_and_only_then_all_agree(chromium: Browser) -> None:
    engine = PlainEngine()
    with serving_pages(engine) as running, watched(chromium, running.url + MODULES) as (page, _):
        modules_loaded(page)
        report = page.evaluate(BECOME)
    assert engine.hands[-1].scene.texture.period == pytest.approx(0.15)
    assert report["held"] == {"texture": {"period": "150 mm"}}
    assert report["states"].index(True) == len(report["states"]) - 1, "until then none said so"
    assert report["answers"] == 2, "the first is prepared, and then the last"
    assert report["played"] == 0, "what is asked for without a touch is not heard"


def test_a_scene_that_is_refused_leaves_the_one_before_and_says_so(watched_page: Any) -> None:
    page, watch = watched_page
    watch.allow("status of 422")
    page.click("#start")
    page.wait_for_function(LIVE)
    page.wait_for_function(AGREED)  # the first picture may come after the first sound
    page.evaluate("() => ridgewave.state.write(['finger', 'contact_length'], '1 um')")
    page.wait_for_function(f"() => {NOTE}.textContent.startsWith('This scene is refused')")
    page.click("#undo")
    page.wait_for_function(AGREED)


def test_what_the_plan_warns_of_is_told_under_the_pad(still_page: Page) -> None:
    def warn(route: Route) -> None:
        answer = route.fetch()
        route.fulfill(response=answer, json=answer.json() | {"warnings": ["Nobody can feel this."]})

    still_page.route("**/v1/explain", warn)
    still_page.evaluate("() => ridgewave.state.write(['texture', 'amplitude'], '19 um')")
    still_page.wait_for_function("() => document.getElementById('warnings').innerText === 'Nobody can feel this.'")


def test_the_names_of_the_textures_fit_their_tiles(still_page: Page) -> None:
    cut = """() => [...document.querySelectorAll(".tile-name")]
      .filter((name) => name.scrollHeight > name.clientHeight + 1 || name.scrollWidth > name.clientWidth)
      .map(({textContent}) => textContent)"""
    assert still_page.evaluate(cut) == []
    still_page.set_viewport_size({"width": 360, "height": 740})
    assert still_page.evaluate(cut) == []


def test_what_the_page_says_covers_no_picture(still_page: Page) -> None:
    covered = """() => { const at = document.getElementById("notice").getBoundingClientRect();
      return [...document.querySelectorAll("canvas")].filter((canvas) => { const box = canvas.getBoundingClientRect();
        return at.height && box.top < at.bottom && box.bottom > at.top && box.left < at.right && box.right > at.left;
      }).map(({id}) => id); }"""
    for width, height in ((1280, 900), (390, 800)):
        still_page.set_viewport_size({"width": width, "height": height})
        still_page.evaluate("() => ridgewave.state.write(['texture', 'amplitude'], '19 um')")
        still_page.click("#undo")
        assert still_page.is_visible("#notice")
        assert still_page.evaluate(covered) == []
