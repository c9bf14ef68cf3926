"""The views show what the finger feels, however much the limiter reduces what is heard."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
import pytest

from synth.voice.recording import Recording
from tests.clients.web.browser import visited
from tests.clients.web.conftest import link_to, loaded

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
        yield kept_touch_page


def test_the_views_show_the_values_before_the_limiter(loud_page: Page) -> None:
    document = recorded_stroke(loud_page)
    wanted, scale = felt(document), document["full_scale"][0]
    shown = scale * np.array(loud_page.evaluate("() => shown"))
    wanted = wanted[: len(shown)]
    assert np.abs(wanted).max() > 10 * scale, "the limiter takes 20 dB"
    assert np.abs(shown - wanted).max() < 1e-5 * np.abs(wanted).max(), "to the rounding of float32"
    assert rms(shown) == pytest.approx(rms(wanted), rel=1e-5)
    for drawn in loud_page.evaluate("() => drawn"):
        begin = round(drawn["begin"]) - FIRST
        if begin < 0:
            continue
        seen = wanted[begin : begin + round(drawn["span"] * 48000)]
        assert max(drawn["values"]) == pytest.approx(seen.max(), rel=0.01)
        assert min(drawn["values"]) == pytest.approx(seen.min(), rel=0.01)
        peak = max(np.abs(wanted[max(0, drawn["pushed"] - count) : drawn["pushed"]]).max() for count in (4800, 9600))
        assert np.abs(seen).max() * 0.99 <= drawn["peak"] <= 1.01 * peak <= 1.02 * drawn["range"]
