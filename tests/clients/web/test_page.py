"""The page as a whole: size, errors, pointers, keys, recording, files, error messages."""

from __future__ import annotations

import io
import json
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
import soundfile

from tests.clients.web.browser import visited
from tests.clients.web.conftest import link_to, loaded
from tests.clients.web.form import tile
from tests.clients.web.page_service import WEB, Breaker
from tests.conftest import RunsRidgewave
from tests.service.harness import Running, kept_engine, serving

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page


LARGEST = 280_000  # bytes over the wire, before /vr: 244 kB, and on a busy machine a screen more of the wall
MOST_REQUESTS = 110  # some 20 of them are pictures of textures in view
KEY = "the-key-of-this-test-0123456789"
PLAYED = "(frames) => ridgewave.fingers.some(({source}) => source && source.played > frames)"
TOUCHING = "() => ridgewave.fingers.some(({touching}) => touching)"
LIFTED = "() => ridgewave.fingers.every(({touching}) => !touching)"


@pytest.fixture(scope="module")
def key_service() -> Iterator[Running]:
    """Yield the service with the page, which wants a key."""
    with serving(kept_engine(), web=str(WEB), api_keys=KEY) as running:
        yield running


def told(page: Page, beginning: str) -> None:
    """Return once the page has told a sentence that begins so."""
    page.wait_for_function("(text) => document.getElementById('notice').textContent.startsWith(text)", arg=beginning)


def stroke_pad(page: Page, steps: int = 30) -> None:
    """Stroke over the pad with the mouse, and lift it."""
    box = page.locator("#pad").bounding_box()
    assert box is not None
    page.mouse.move(box["x"] + 50, box["y"] + 80)
    page.mouse.down()
    page.wait_for_function(TOUCHING)
    for step in range(steps):
        page.mouse.move(box["x"] + 50 + 5 * step, box["y"] + 80)
    page.wait_for_function(PLAYED, arg=4800)
    page.mouse.up()
    page.wait_for_function(LIFTED)


def started(page: Page) -> None:
    """Press Touch and return once a stream is live."""
    page.click("#start")
    page.wait_for_function("() => document.getElementById('state').textContent === 'live'")


def test_the_page_is_small(chromium: Browser, service: Running) -> None:
    context = chromium.new_context()
    page = context.new_page()
    sizes: dict[str, float] = {}
    names: dict[str, str] = {}
    session = context.new_cdp_session(page)
    session.send("Network.enable")
    session.on("Network.requestWillBeSent", lambda event: names.update({event["requestId"]: event["request"]["url"]}))
    session.on("Network.loadingFinished", lambda event: sizes.update({event["requestId"]: event["encodedDataLength"]}))
    page.goto(service.url)
    loaded(page)
    ready = page.evaluate("() => performance.now()")
    page.click("#start")
    page.wait_for_function("() => document.getElementById('state').textContent === 'live'")
    modules = {key: size for key, size in sizes.items() if names[key].startswith(service.url)}
    page_files = sum(size for key, size in modules.items() if "/v1/" not in names[key])
    everything = sum(modules.values())
    asked = f"{everything:.0f} with what it asks for until it sounds, {len(sizes)} requests"
    print(f"{page_files:.0f} bytes of page, {asked}; ready after {ready:.0f} ms")
    context.close()
    assert everything < LARGEST
    assert len(sizes) <= MOST_REQUESTS


LAST_MOVE = """() => document.getElementById("pad").addEventListener("pointermove", ({ clientX, clientY }) => {
  const { left, top, height } = document.getElementById("pad").getBoundingClientRect();
  window.lastMove = { right: clientX - left, up: top + height / 2 - clientY };
})"""
"""Keeps where a pointer last moved to, from the middle of the left edge, in the layout of that moment (px)."""


def test_a_mouse_strokes_the_pad(comb_page: Page) -> None:
    comb_page.evaluate(LAST_MOVE)
    stroke_pad(comb_page)
    contact, last = comb_page.evaluate("() => [ridgewave.fingers[0].contact, window.lastMove]")
    assert contact["x"] > 0 and contact["y"] > 0 and contact["load"] == 0
    assert last["right"] == pytest.approx(195, abs=1)
    assert contact["y"] / contact["x"] == pytest.approx(last["up"] / last["right"], rel=1e-2)
    label = "document.getElementById('waveform').getAttribute('aria-label')"
    comb_page.wait_for_function(f"() => /acceleration: the largest value is (?!0 )/.test({label})")


def test_two_pointers_are_two_fingers(comb_page: Page) -> None:
    started(comb_page)
    comb_page.evaluate(
        """() => { const pad = document.getElementById("pad"); const {left, top} = pad.getBoundingClientRect();
             for (const pointerId of [21, 22]) pad.dispatchEvent(new PointerEvent("pointerdown",
               {pointerId, pointerType: "touch", button: 0, clientX: left + 4 * pointerId, clientY: top + 50,
                bubbles: true})); }"""
    )
    sounding = "ridgewave.fingers.filter(({touching, source}) => touching && source?.played > 4800)"
    comb_page.wait_for_function(f"() => {sounding}.length === 2")
    scales = comb_page.evaluate("() => ridgewave.fingers.map(({connection}) => connection.ready.full_scale[0])")
    assert scales[0] == scales[1]


def test_keys_move_press_and_lift_a_finger(comb_page: Page) -> None:
    comb_page.focus("#pad")
    comb_page.keyboard.press("Space")
    comb_page.wait_for_function(TOUCHING)
    comb_page.keyboard.down("ArrowRight")
    comb_page.wait_for_function(PLAYED, arg=4800)
    comb_page.keyboard.up("ArrowRight")
    load = comb_page.locator("#load-value").inner_text()
    comb_page.keyboard.press("+")
    assert (load, comb_page.locator("#load-value").inner_text()) == ("300 mN", "375 mN")
    comb_page.keyboard.press("Space")
    comb_page.wait_for_function(LIFTED)


def test_it_strokes_by_itself_and_stops(comb_page: Page) -> None:
    comb_page.click("#stroke")
    comb_page.wait_for_function(PLAYED, arg=4800)
    comb_page.click("#stroke")
    comb_page.wait_for_function(LIFTED)
    comb_page.click("#start")
    comb_page.wait_for_function("() => document.getElementById('state').textContent === 'not started'")
    assert comb_page.evaluate("() => [ridgewave.player, ridgewave.fingers.length]") == [None, 0]


def test_a_field_changes_what_is_touched_without_a_new_stream(comb_page: Page) -> None:
    comb_page.click("#stroke")
    comb_page.wait_for_function(PLAYED, arg=4800)
    before = comb_page.evaluate(
        """() => { const [finger] = ridgewave.fingers; window.crossed = false;
             finger.addEventListener("scene", () => { window.crossed = true; });
             return finger.connection.ready.session; }"""
    )
    comb_page.evaluate("() => ridgewave.state.write(['texture', 'period'], '0.5 mm')")
    comb_page.wait_for_function("() => window.crossed")
    comb_page.wait_for_function("() => document.getElementById('state').textContent === 'live'")
    assert comb_page.evaluate("() => ridgewave.fingers[0].connection.ready.session") == before


def test_what_is_fixed_for_a_stream_is_changed_by_a_new_one(comb_page: Page) -> None:
    started(comb_page)
    before = comb_page.evaluate("() => ridgewave.fingers[0].connection.ready.session")
    comb_page.evaluate("() => ridgewave.state.write(['output', 'sample_rate'], '44.1 kHz')")
    told(comb_page, "Rate, channels, quantity and full scale are fixed")
    ready = comb_page.evaluate("() => ridgewave.fingers[0].connection.ready")
    assert (ready["sample_rate"], comb_page.evaluate("() => ridgewave.player.sampleRate")) == (44100, 44100)
    assert ready["session"] != before
    comb_page.evaluate("() => ridgewave.state.write(['output', 'quantity'], 'velocity')")
    comb_page.wait_for_function("() => ridgewave.fingers[0]?.connection.ready?.quantities[0] === 'velocity'")
    stroke_pad(comb_page)


def test_a_service_that_goes_away_is_told_and_found_again(kept_touch_page: Page, service: Running) -> None:
    page = kept_touch_page
    with Breaker(service.url) as breaker, visited(page, breaker.url + link_to({})) as watch:
        watch.allow("ERR_|WebSocket")
        loaded(page)
        started(page)
        target, breaker.target = breaker.target, None
        breaker.reset()
        page.wait_for_function("() => document.getElementById('state').dataset.state === 'broken'")
        page.wait_for_function("() => document.getElementById('latency').textContent === '–'")
        breaker.target = target
        page.wait_for_function("() => document.getElementById('state').dataset.state === 'live'")


def test_a_picture_that_a_service_could_not_answer_is_requested_again(kept_touch_page: Page, service: Running) -> None:
    page = kept_touch_page
    agreed = "() => document.getElementById('pad-note').hidden && !document.querySelector('[data-stale]')"
    with Breaker(service.url) as breaker, visited(page, breaker.url + link_to({})) as watch:
        watch.allow("ERR_")
        loaded(page)
        page.wait_for_function(agreed)
        target, breaker.target = breaker.target, None
        breaker.reset()
        with page.expect_event("requestfailed", lambda request: request.url.endswith("/v1/picture")):
            page.check(tile("grating-1mm-31um"))
        page.wait_for_function("() => document.getElementById('notice').textContent.includes('does not answer')")
        told_away = "The service does not answer. The picture follows when it is back."
        assert page.locator("#pad-note").inner_text() == told_away
        breaker.target = target
        page.wait_for_function(agreed)


def test_a_threshold_that_a_service_could_not_answer_is_requested_again(
    kept_touch_page: Page, service: Running
) -> None:
    page = kept_touch_page
    page.route("**/v1/threshold*", lambda route: route.abort(), times=1)
    with visited(page, service.url + link_to({})) as watch:
        watch.allow("ERR_")
        loaded(page)
        page.wait_for_function("() => ridgewave.views.threshold !== null")


def test_a_stroke_is_recorded_rendered_and_replayed(comb_page: Page, tmp_path: Path, ridgewave: RunsRidgewave) -> None:
    comb_page.click("#record")
    comb_page.wait_for_function("() => document.getElementById('record').textContent === 'Stop recording'")
    stroke_pad(comb_page)
    comb_page.click("#record")
    comb_page.wait_for_function("() => !document.getElementById('replay').disabled")
    with comb_page.expect_download() as download:
        comb_page.click("#save-recording")
    path = tmp_path / "recording.json"
    download.value.save_as(path)
    recording = json.loads(path.read_text())
    contacts = [event for event in recording["events"] if event[1] == "contact"]
    assert comb_page.locator("#recording-about").inner_text() == f"Recorded {len(contacts)} contact updates."
    ridgewave("render", str(path), "-o", str(tmp_path / "stroke.wav"))
    sound, _ = soundfile.read(tmp_path / "stroke.wav", dtype="float32")
    assert len(sound) == recording["frames"]
    assert abs(sound).max() > 0.0
    comb_page.click("#replay")
    comb_page.wait_for_function(TOUCHING)
    comb_page.wait_for_function("() => document.getElementById('replay').textContent === 'Replay'")
    comb_page.wait_for_function(LIFTED)


def test_a_recording_that_is_being_prepared_says_so_and_one_of_nothing_is_none(comb_page: Page) -> None:
    words = "() => [document.getElementById('record').textContent, document.getElementById('record').disabled]"
    assert comb_page.evaluate(f"() => {{ document.getElementById('record').click(); return ({words})(); }}") == [
        "Preparing…",
        True,
    ]
    comb_page.wait_for_function("() => document.getElementById('record').textContent === 'Stop recording'")
    comb_page.click("#record")
    comb_page.wait_for_function("() => document.getElementById('recording-about').innerText.startsWith('Nothing was')")
    assert comb_page.is_disabled("#replay") and comb_page.is_disabled("#save-recording")


def test_the_wav_is_that_of_the_scene(still_page: Page, service: Running, tmp_path: Path) -> None:
    scene = {"texture": {"period": "1 mm"}, "output": {"duration": "0.2 s"}}
    still_page.evaluate("(scene) => ridgewave.state.take(scene)", scene)
    with still_page.expect_download() as download:
        still_page.click("#save-wav")
    download.value.save_as(tmp_path / "touch.wav")
    rendered = service.client.post("/v1/render?format=wav", json=scene).content
    wanted, _ = soundfile.read(io.BytesIO(rendered), dtype="float32")
    found, _ = soundfile.read(tmp_path / "touch.wav", dtype="float32")
    assert (found == wanted).all()


def test_a_scene_is_kept_as_a_file_and_opened_again(still_page: Page, tmp_path: Path) -> None:
    scene: dict[str, Any] = {"finger": {"contact_length": "8 mm"}, "effects": {"curvature": "auto"}}
    still_page.evaluate("(scene) => ridgewave.state.take(scene)", scene)
    with still_page.expect_download() as download:
        still_page.click("#save-scene")
    path = tmp_path / "scene.json"
    download.value.save_as(path)
    still_page.evaluate("() => ridgewave.state.take({})")
    still_page.set_input_files("#open-scene", path)
    still_page.wait_for_function("() => ridgewave.state.scene.effects?.curvature === 'auto'")
    assert still_page.evaluate("() => ridgewave.state.scene") == scene
    path.write_text("[1]")
    still_page.set_input_files("#open-scene", path)
    told(still_page, "This file does not contain a scene")


def test_a_gamepad_rumbles_along(comb_page: Page) -> None:
    comb_page.evaluate(
        """() => { window.rumbled = 0;
             const pad = {id: "Pad of the test", index: 0, vibrationActuator: {
               playEffect: async (_, {strongMagnitude}) => {
               window.rumbled = Math.max(window.rumbled, strongMagnitude); }}};
             navigator.getGamepads = () => [pad]; dispatchEvent(new Event("gamepadconnected")); }"""
    )
    comb_page.evaluate("() => { document.getElementById('devices').open = true; }")
    assert comb_page.locator("#gamepad option").inner_text() == "Pad of the test"
    comb_page.check("#rumble")
    comb_page.click("#stroke")
    comb_page.wait_for_function("() => window.rumbled > 0.05")


@pytest.mark.parametrize(
    ("missing", "told"),
    [
        (
            "**/page/touch_session.js",
            "Part of the page did not load. Check that the service is running, then reload the page.",
        ),
        ("**/v1/textures", "The service does not answer. Check that it is running"),
    ],
)
def test_what_does_not_load_is_told(kept_touch_page: Page, service: Running, missing: str, told: str) -> None:
    page = kept_touch_page
    page.route(missing, lambda route: route.abort())
    with visited(page, service.url + "/") as watch:
        watch.allow("ERR_FAILED|dynamically imported module|ServiceProblem")
        page.wait_for_function("() => document.getElementById('loading').getAttribute('role') === 'alert'")
        assert page.locator("#loading").inner_text().startswith(told)


def test_without_javascript_the_page_says_what_to_do(chromium: Browser, service: Running) -> None:
    context = chromium.new_context(java_script_enabled=False)
    page = context.new_page()
    page.goto(service.url)
    text = page.locator("noscript").inner_text()
    context.close()
    assert "This page needs JavaScript. Allow it for this site and reload the page." in text


def test_a_service_with_a_key_asks_for_it(kept_touch_page: Page, key_service: Running) -> None:
    page = kept_touch_page
    with visited(page, key_service.url + link_to({})) as watch:
        watch.allow("status of 401")
        page.locator("#key-text").fill("ключ\u200b")
        page.keyboard.press("Enter")
        page.wait_for_function("() => document.getElementById('key-fault').textContent.includes('visible ASCII')")
        page.locator("#key-text").fill("wrong")
        page.keyboard.press("Enter")
        page.wait_for_function("() => document.getElementById('key-fault').textContent.includes('does not accept')")
        assert page.input_value("#key-text") == "wrong", "it can be mended where it stands"
        page.locator("#key-text").fill(KEY)
        page.keyboard.press("Enter")
        loaded(page)
        started(page)
