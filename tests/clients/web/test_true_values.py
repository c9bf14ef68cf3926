"""The views show what the finger feels, however much the limiter reduces what is heard."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
import pytest

from synth.voice.recording import Recording
from tests.clients.web.browser import visited
from tests.clients.web.conftest import DRAWER, link_to, loaded
from tests.clients.web.test_page import started

if TYPE_CHECKING:
    from playwright.sync_api import Page

    from tests.service.harness import Running

GRATING = {"kind": "grating", "period": "0.4 mm", "height": "30 um"}
LOUD = {
    "texture": GRATING,
    "scan": {"speed": "60 mm/s", "load": "0.5 N"},
    "output": {"full_scale": 0.25},
}
FIRST = 480  # frames of silence that the views draw before any sound
HEAR = """() => {
  const {views} = ridgewave;
  window.shown = [];
  window.drawn = [];
  const push = views.waveform.push.bind(views.waveform);
  views.waveform.push = (samples, ...rest) => { shown.push(...samples); push(samples, ...rest); };
  const say = views.waveform.panel.say.bind(views.waveform.panel);
  views.waveform.panel.say = (text) => { say(text); drawn.push({pushed: shown.length, ...views.waveform.drawn}); };
}"""
RECORDING = "() => document.getElementById('record').textContent === 'Stop recording'"
RECORDED = "() => !document.getElementById('save-recording').disabled"


def felt(document: Mapping[str, Any]) -> npt.NDArray[np.float64]:
    """Return a recording in SI, rendered with a full scale so large that the limiter never acts."""
    scale = 1e4 * document["full_scale"][0]
    replay = Recording({**document, "full_scale": [scale]}).open()
    return np.asarray(scale * replay.render(replay.frames)[:, 0], np.float64)


def rms(values: npt.NDArray[np.float64]) -> float:
    return float(np.sqrt(np.mean(values**2)))


def recorded_stroke(page: Page) -> dict[str, Any]:
    """Record half a second of the automatic stroke; return its recording."""
    page.click("#record")
    page.wait_for_function(RECORDING)
    page.evaluate(HEAR)
    page.click("#stroke")
    page.wait_for_function("() => shown.length > 36000 && drawn.length > 3")
    page.evaluate("() => { window.during = [...drawn]; }")
    page.click("#stroke")
    page.click("#record")
    page.wait_for_function(RECORDED)
    with page.expect_download() as download:
        page.click("#save-recording")
    document: dict[str, Any] = json.loads(download.value.path().read_text())
    return document


@pytest.fixture
def loud_page(kept_touch_page: Page, service: Running) -> Iterator[Page]:
    with visited(kept_touch_page, service.url + link_to(LOUD)):
        loaded(kept_touch_page)
        kept_touch_page.evaluate(DRAWER)
        yield kept_touch_page


def test_the_views_show_the_values_before_the_limiter(loud_page: Page) -> None:
    document = recorded_stroke(loud_page)
    wanted, scale = felt(document), document["full_scale"][0]
    shown = scale * np.array(loud_page.evaluate("() => shown"))
    wanted = wanted[: len(shown)]
    assert np.abs(wanted).max() > 10 * scale, "the limiter takes 20 dB"
    assert np.abs(shown - wanted).max() < 1e-5 * np.abs(wanted).max(), "to the rounding of float32"
    assert rms(shown) == pytest.approx(rms(wanted), rel=1e-5)
    for drawn in loud_page.evaluate("() => during"):
        begin = math.floor(drawn["begin"]) - FIRST
        if begin < 0:
            continue
        count = round(drawn["span"] * 48000)
        seen = wanted[begin + 1 : begin + count]
        more = wanted[begin : begin + count + count // 50]  # a pixel is drawn whole
        assert 0.99 * seen.max() <= max(drawn["values"]) <= 1.01 * more.max()
        assert 1.01 * more.min() <= min(drawn["values"]) <= 0.99 * seen.min()
        recent = wanted[max(0, drawn["pushed"] - 2 * count - 4800) : drawn["pushed"]]
        assert 0.99 * np.abs(seen).max() <= drawn["peak"] <= min(1.01 * np.abs(recent).max(), drawn["range"])


QUIET = {"texture": GRATING, "scan": {"speed": "60 mm/s", "load": "0.5 N"}}
SILENT = """() => ['waveform: no vibration', 'spectrum: silence'].every((words) => {
  const [id, said] = words.split(": ");
  return document.getElementById(id).getAttribute("aria-label").includes(said);
})"""
AT_REST = "() => [ridgewave.views.spectrum.drawn.marks.length, ridgewave.views.waveform.drawn]"


@pytest.fixture
def quiet_page(kept_touch_page: Page, service: Running) -> Iterator[Page]:
    with visited(kept_touch_page, service.url + link_to(QUIET)):
        loaded(kept_touch_page)
        kept_touch_page.evaluate(DRAWER)
        started(kept_touch_page)
        yield kept_touch_page


def stroked(page: Page) -> None:
    """Stroke with the mouse until marks and waveform show it, and stay down."""
    box = page.locator("#pad").bounding_box()
    assert box is not None
    page.mouse.move(box["x"] + 20, box["y"] + 80)
    page.mouse.down()
    for step in range(400):
        page.mouse.move(box["x"] + 20 + 3 * (step % 100), box["y"] + 80)
        if step > 50 and page.evaluate("() => ridgewave.views.spectrum.drawn?.marks.length > 0"):
            return
    pytest.fail("the stroke was never shown")


def test_a_finger_at_rest_has_no_vibration_and_no_frequency(quiet_page: Page) -> None:
    stroked(quiet_page)
    quiet_page.wait_for_function(SILENT)
    assert quiet_page.evaluate("() => ridgewave.fingers[0].touching")
    marks, drawn = quiet_page.evaluate(AT_REST)
    full = quiet_page.evaluate("() => ridgewave.fingers[0].connection.ready.full_scale[0]")
    assert marks == 0 and drawn["range"] >= full
    quiet_page.mouse.up()


def test_after_a_lift_the_last_burst_is_gone(quiet_page: Page) -> None:
    stroked(quiet_page)
    quiet_page.mouse.up()
    quiet_page.wait_for_function(SILENT)
    quiet_page.wait_for_function("() => ridgewave.views.waveform.drawn.values.every((value) => value === 0)")
    marks, drawn = quiet_page.evaluate(AT_REST)
    full = quiet_page.evaluate("() => ridgewave.fingers[0].connection.ready.full_scale[0]")
    assert marks == 0 and drawn["range"] >= full


FELT = {"texture": {"kind": "grating", "period": "1 mm", "height": "30 um"}, "output": {"full_scale": 0.2}}
RUMBLE = """async () => {
  window.played = [];
  const pad = {id: "a pad", index: 0, vibrationActuator: {effects: ["dual-rumble"],
    playEffect: async (kind, {strongMagnitude}) => { played.push(strongMagnitude); }}};
  navigator.getGamepads = () => [pad];
  dispatchEvent(new Event("gamepadconnected"));
  const {MotorStrength} = await import("/web/motors/strength.js");
  const {sample_rate: rate, quantities, full_scale: fullScale} = ridgewave.fingers[0].connection.ready;
  const how = {rate, quantities, fullScale, threshold: ridgewave.views.threshold};
  const [before, after] = [new MotorStrength(how), new MotorStrength(how)];
  window.strengths = {before: [0], after: [0]};
  ridgewave.session.addEventListener("block", ({detail}) => {
    strengths.before.push(...before.push(detail.unlimited));
    strengths.after.push(...after.push(detail.samples));
  });
}"""


def test_motors_play_the_strength_before_the_limiter(kept_touch_page: Page, service: Running) -> None:
    page = kept_touch_page
    with visited(page, service.url + link_to(FELT)):
        loaded(page)
        page.evaluate(DRAWER)
        started(page)
        page.wait_for_function("() => ridgewave.views.threshold !== null")
        page.evaluate(RUMBLE)
        page.evaluate("() => { document.querySelector('#devices').open = true; }")
        page.check("#rumble")
        page.click("#stroke")
        page.wait_for_function("() => played.length > 20 && strengths.before.length > 60")
        played, strengths = page.evaluate("() => [played, strengths]")
        page.click("#stroke")
    assert max(played) > max(strengths["after"]) + 0.1
    assert max(played) <= max(strengths["before"]) + 0.05, "to the phase of the spans of 10 ms"
