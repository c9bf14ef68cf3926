"""The live stream over broken connections and restarted services; keys; ends of streams."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import quote, urlsplit

import numpy as np
import pytest
import soundfile

from tests.clients.web.browser import Watch, visited
from tests.clients.web.conftest import MODULES, modules_loaded
from tests.clients.web.page_service import Breaker, serving_pages
from tests.clients.web.test_sound import sounding
from tests.conftest import RunsRidgewave
from tests.service.harness import Running, warmed_up
from tests.service.plain_engine import PlainEngine

if TYPE_CHECKING:
    from playwright.sync_api import Page

BROKEN = r"WebSocket connection to .* failed|Failed to load resource"

BEGIN = """async ({record}) => {
  const player = await modules.Player.open({sampleRate: 48000});
  const finger = new modules.Finger({player, record});
  const events = modules.heard(finger, "ready", "broken", "resumed", "ended", "problem");
  window.run = {player, finger, events, tap: player.tap(), blocks: [], going: true};
  finger.addEventListener("block", ({detail}) => run.blocks.push([detail.frame, detail.samples.length]));
  run.session = (await finger.open()).session;
  run.stroke = (async () => {
    while (run.going) await modules.stroke(finger, 0.4, (t) => ({position: 0.02 * Math.sin(16 * t), load: 0.3}));
  })();
}"""
END = """async () => {
  const {player, finger, tap} = run;
  run.going = false;
  await run.stroke;
  finger.lift();
  await finger.close();
  const {runs, given, played} = finger.source;
  const samples = modules.packed(await tap.take());
  await player.close();
  return {samples, first: tap.first, runs, given, played, blocks: run.blocks, frame: finger.connection.frame,
    events: run.events.map(([type, {ready, ...detail}]) => ({...detail, type}))};
}"""
PLAYED = "(frames) => run.finger.source.played > frames"


@pytest.fixture
def page(kept_modules: Page) -> Page:
    """Return an empty page, one for all tests."""
    return kept_modules


@contextmanager
def modules_loaded_at(page: Page, url: str) -> Iterator[Watch]:
    """Yield what watches the page, at `url` with the modules in it."""
    with visited(page, url) as watch:
        modules_loaded(page)
        yield watch


def test_a_reset_loses_no_sample_and_doubles_none(
    page: Page, service: Running, tmp_path: Path, ridgewave: RunsRidgewave
) -> None:
    with Breaker(service.url) as breaker, modules_loaded_at(page, breaker.url + MODULES) as watch:
        watch.allow(BROKEN)
        addresses: list[str] = []
        page.on("websocket", lambda socket: addresses.append(urlsplit(socket.url).query))
        page.evaluate(BEGIN, {"record": True})
        for count in (1, 2):
            page.wait_for_function(PLAYED, arg=12_000 * count)
            breaker.reset()
            page.wait_for_function(
                "(count) => run.finger.connection.state === 'live'"
                " && run.events.filter(([name]) => name === 'resumed').length === count",
                arg=count,
            )
        page.wait_for_function(PLAYED, arg=36_000)
        report = page.evaluate(END)
        recording = page.evaluate("() => modules.recordingOf(run.session)")
        assert addresses == ["", *[f"session={page.evaluate('() => run.session')}"] * 2], "a proxy routes by the URL"
    heard = sounding(report)[:, 0]
    names = [event["type"] for event in report["events"]]
    assert names == ["ready", *["broken", "resumed"] * 2, "ended"]
    frames = np.cumsum([0, *[length for _, length in report["blocks"]]])
    assert [frame for frame, _ in report["blocks"]] == list(frames[:-1]), "each block begins where the last ended"
    assert len(heard) == report["given"] == frames[-1]

    path, out = tmp_path / "stroke.json", tmp_path / "stroke.wav"
    path.write_text(recording)
    assert json.loads(recording)["frames"] == len(heard)
    assert ridgewave("render", str(path), "-o", str(out)).returncode == 0
    rendered, _ = soundfile.read(out, dtype="float32")
    assert np.array_equal(heard.view(np.uint32), rendered.view(np.uint32))


def test_a_service_that_comes_back_at_its_port_is_found_again(page: Page) -> None:
    with ExitStack() as stack:
        first = ExitStack()
        engine = PlainEngine()
        running = first.enter_context(serving_pages(engine))
        warmed_up(running, engine)
        port = urlsplit(running.url).port
        try:
            watch = stack.enter_context(modules_loaded_at(page, running.url + MODULES))
            watch.allow(BROKEN)
            page.evaluate(BEGIN, {})
            page.wait_for_function(PLAYED, arg=4800)
        finally:
            first.close()
        page.wait_for_function("() => run.finger.connection.state === 'broken'")
        page.wait_for_function("() => run.events.filter(([name]) => name === 'broken').length > 1")
        before = page.evaluate("() => run.finger.source.given")
        stack.enter_context(serving_pages(PlainEngine(), port=port))
        page.wait_for_function("() => run.finger.connection.state === 'live'")
        page.wait_for_function(PLAYED, arg=before + 4800)
        report = page.evaluate(END)
    readies = [event for event in report["events"] if event["type"] == "ready"]
    assert [event["renewed"] for event in readies] == [False, True]
    assert report["events"][-1]["type"] == "ended"
    assert report["frame"] < report["given"], "the frames of the new session are counted from 0"
    assert len(sounding(report)) == report["given"]


def test_a_service_that_was_killed_and_forgot_the_session_gets_a_new_one(page: Page) -> None:
    with (
        serving_pages(PlainEngine()) as old,
        serving_pages(PlainEngine()) as new,
        Breaker(old.url) as breaker,
        modules_loaded_at(page, breaker.url + MODULES) as watch,
    ):
        watch.allow(BROKEN)
        page.evaluate(BEGIN, {})
        page.evaluate("() => run.finger.connection.change({texture: {period: '0.5 mm'}})")
        page.wait_for_function(PLAYED, arg=4800)
        breaker.target = None
        breaker.reset()
        page.wait_for_function("() => run.finger.connection.state === 'broken'")
        breaker.target = new.url
        page.wait_for_function("() => run.finger.connection.state === 'live'")
        page.wait_for_function(PLAYED, arg=24_000)
        hands = new.service.sessions._sessions
        periods = [session.scene.texture.period for session in hands.values()]
        report = page.evaluate(END)
    assert periods == [0.0005], "the change holds in the new session"
    assert [event["type"] for event in report["events"] if event["type"] != "broken"] == ["ready", "ready", "ended"]


DOWN = 1.5  # s
FIVE = """async () => {
  const player = await modules.Player.open({sampleRate: 48000});
  window.five = Array.from({length: 5}, () => new modules.Finger({player}));
  await Promise.all(five.map((finger) => finger.open()));
}"""


def test_a_service_that_is_gone_is_asked_for_by_one_and_ever_more_seldom(page: Page) -> None:
    with (
        serving_pages(PlainEngine()) as running,
        Breaker(running.url) as breaker,
        modules_loaded_at(page, breaker.url + MODULES) as watch,
    ):
        watch.allow(BROKEN)
        page.evaluate(FIVE)
        target, breaker.target = breaker.target, None
        breaker.reset()
        page.wait_for_function("() => five.every(({connection}) => connection.state === 'broken')")
        page.wait_for_timeout(1e3 * DOWN)
        lines = len(watch.wrong)
        breaker.target = target
        page.wait_for_function("() => five.every(({connection}) => connection.state === 'live')")
    assert lines <= 5 + 5, "one for each stream, and what was asked at 0, 0.4 and 1.2 s"


KEY = "sesam~+/&=%#?>>"


def test_a_key_in_the_address_opens_calls_and_streams_and_leaves_the_address(page: Page) -> None:
    with serving_pages(PlainEngine(), api_keys=KEY) as running:
        address = f"{running.url}{MODULES}#key={quote(KEY, safe='')}&scene=e30"
        with modules_loaded_at(page, address):
            assert page.evaluate("() => location.hash") == "#scene=e30"
            assert page.evaluate("async () => (await modules.call('GET', '/v1/textures')) !== null")
            page.evaluate(BEGIN, {})
            page.wait_for_function(PLAYED, arg=4800)
            page.evaluate(END)
            page.reload()
            modules_loaded(page)
            assert page.evaluate("async () => (await modules.call('GET', '/v1/textures')) !== null")


REFUSED = """async () => {
  const player = await modules.Player.open();
  const answers = [];
  for (const ask of [() => modules.call("GET", "/v1/textures"), () => new modules.Finger({player}).open()]) {
    try {
      await ask();
    } catch (error) {
      answers.push([error.message, error.problem?.status ?? null]);
    }
  }
  await player.close();
  return answers;
}"""


def test_without_its_key_the_page_says_what_is_wanted(page: Page) -> None:
    with (
        serving_pages(PlainEngine(), api_keys=KEY) as running,
        modules_loaded_at(page, running.url + MODULES) as watch,
    ):
        watch.allow(BROKEN)
        over_http, live = page.evaluate(REFUSED)
    assert over_http[1] == 401
    assert "Authorization" in over_http[0]
    assert live[0] == over_http[0]


ENDED = """async (scene) => {
  const player = await modules.Player.open();
  const finger = new modules.Finger({player, scene});
  const ended = modules.once(finger, "ended");
  const opened = finger.open().then(() => finger.move({position: 0, load: 0.3}), (error) => error.message);
  const {reason, problem} = await ended;
  const message = await opened;
  await finger.close();
  await player.close();
  return {reason, detail: problem?.detail ?? "", message: message ?? "", state: finger.connection.state};
}"""


def test_a_session_that_reaches_its_limit_says_so(page: Page) -> None:
    with (
        serving_pages(PlainEngine(), max_stream=0.3) as running,
        modules_loaded_at(page, running.url + MODULES),
    ):
        report = page.evaluate(ENDED, {})
    assert (report["reason"], report["state"]) == ("too long", "ended")


def test_a_scene_that_is_refused_says_which_field(modules: Page) -> None:
    report = modules.evaluate(ENDED, {"texture": {"period": "-1 mm"}})
    assert report["reason"] == "policy"
    assert "period" in report["detail"]
    assert report["message"] == report["detail"]


def test_a_stopped_stream_says_so(modules: Page, service: Running) -> None:
    modules.evaluate(BEGIN, {})
    modules.wait_for_function(PLAYED, arg=4800)
    assert service.client.post("/v1/stop").status_code == 200
    modules.wait_for_function("() => run.finger.connection.state === 'ended'")
    report = modules.evaluate(END)
    assert report["events"][-1] == {"type": "ended", "reason": "stopped", "problem": None, "frame": report["given"]}
