"""The time from a pointer event over the web page to the first changed sample at the page's audio output.

Model: headless Chromium with the page's own modules, and the service in this process, over loopback. A finger either
    rests on the texture (velocity, so that rest is exact silence) until a pointer moves, or is off until a pointer
    touches. The time begins just before the event is dispatched in the page, and ends when the audio thread outputs the
    first sample that is not zero. Both are by `Date.now`, to 1 ms. The browser's own output latency is reported
    separately, as the browser reports it.
    For the first touch of a page, the page itself is opened with a finger that has no table in the service yet. A
    pointer touches and strokes as soon as the page is there, or after a pause. The time ends when the audio thread has
    output the first block that is not silent: up to 15 ms later than its first sample.
Limits: the time from a hand's motion to the event, in system and browser, is not included. A machine without a sound
    card plays into a timer. Browser, service and this process share the machine.
"""

from __future__ import annotations

import statistics
from itertools import count, product
from typing import TYPE_CHECKING, Any

from tests.bench.timing import Figure, figure
from tests.clients.web.browser import driving, headless, watched
from tests.clients.web.conftest import MODULES, link_to, loaded, modules_loaded
from tests.clients.web.page_service import serving_pages
from tests.service.harness import until

if TYPE_CHECKING:
    from playwright.sync_api import Browser

LIMIT = 40.0  # ms
TRIALS = 40
SETTLE = 20.0  # s of stroking first, in which the page determines how much to keep queued

MEASURE = """async ({trials, settle}) => {
  const player = await modules.Player.open({sampleRate: 48000});
  await player.context.audioWorklet.addModule("/test/detector.js");
  const detector = new AudioWorkletNode(player.context, "detector");
  const muted = new GainNode(player.context, {gain: 0});
  player.mix.connect(detector).connect(muted).connect(player.context.destination);
  const finger = new modules.Finger({player, scene: {output: {quantity: "velocity"}}});
  await finger.open();
  const pad = document.querySelector("#pad");
  Object.assign(pad.style, {width: "800px", height: "200px"});
  modules.followPointers(pad, {metresPerPixel: 1e-4, loadOf: () => 0.3,
    onMove: (id, contact) => finger.move(contact), onLift: () => finger.lift()});
  const dispatch = (type, x) => pad.dispatchEvent(new PointerEvent(type, {pointerId: 9, clientX: x, button: 0}));
  const timed = async (type, x) => {
    await modules.pause(1000 + 20 * Math.random());
    const told = new Promise((resolve) => (detector.port.onmessage = ({data}) => resolve(data.date)));
    detector.port.postMessage({arm: true});
    await modules.pause(100);
    const began = Date.now();
    dispatch(type, x);
    return await Promise.race([told, modules.pause(2000).then(() => NaN)]) - began;
  };
  const strokes = performance.now() + 1e3 * settle;
  dispatch("pointerdown", 100);
  for (let count = 0; performance.now() < strokes; count += 1) {
    await modules.pause(8);
    dispatch("pointermove", 300 + 200 * Math.sin(0.03 * count));
  }
  const {underruns, updateToSound} = finger.stats;
  const moves = [];
  for (let trial = 0; trial < trials; trial += 1) moves.push(await timed("pointermove", 100 + 20 * (trial % 3)));
  const touches = [];
  for (let trial = 0; trial < trials; trial += 1) {
    dispatch("pointerup", 100);
    touches.push(await timed("pointerdown", 100 + 10 * (trial % 3)));
  }
  const report = {moves, touches, underruns, updateToSound, outputLatency: 1e3 * player.outputLatency,
    baseLatency: 1e3 * player.context.baseLatency, depth: 1e3 * player.depth.frames / player.sampleRate,
    underrunsLater: finger.stats.underruns - underruns};
  await finger.close();
  await player.close();
  return report;
}"""


FIRST_TOUCH = """async (pause) => {
  const ready = performance.now();
  const later = (time) => new Promise((done) => setTimeout(done, time));
  await later(pause);
  const pad = document.getElementById("pad");
  const {left, top} = pad.getBoundingClientRect();
  const event = (kind, x) => pad.dispatchEvent(new PointerEvent(kind,
    {pointerId: 9, pointerType: "touch", button: 0, clientX: left + x, clientY: top + 50, bubbles: true}));
  const sounds = new Promise((done) => ridgewave.session.addEventListener("block", ({detail: {finger, samples}}) => {
    if (samples.some((sample) => sample !== 0)) done(finger);
  }));
  const began = performance.now();
  event("pointerdown", 100);
  const stroke = setInterval(() => event("pointermove", 200 + 100 * Math.sin(performance.now() / 200)), 8);
  const {source} = await sounds;
  const given = source.given;
  while (source.played < given) await later(4);
  clearInterval(stroke);
  return {ready, sound: performance.now() - began};
}"""
FIRST_TRIALS = 5
PAUSES = {"at once": 0.0, "2 s later": 2000.0}  # ms between the page and the touch


def first_touches(trials: int) -> list[Figure]:
    """Return the lines of the first touch of a page, with a fingertip and with a comb."""
    lines, numbers = [], count(1)
    with serving_pages() as running, driving() as driver, headless(driver, webgl=True) as browser:
        until(lambda: running.service.warm, 60.0)
        for kind, (told, pause) in product(("fingertip", "comb"), PAUSES.items()):
            reports = [first_touch(browser, running.url, kind, next(numbers), pause) for _ in range(trials)]
            ready = statistics.median(report["ready"] for report in reports)
            how = f"no table of this {kind} yet, median of {trials}; the page is there {ready:.0f} ms after its load"
            sounds = [report["sound"] for report in reports]
            lines.append(figure(f"page, first touch of a {kind} {told}, to sound", sounds, "ms", None, how))
    return lines


def first_touch(browser: Browser, url: str, kind: str, number: int, pause: float) -> dict[str, float]:
    """Return the time at which the page is there and that from touch to sound (ms).

    number: of the trial; each has a finger of its own.
    pause: ms between the page and the touch.
    """
    scene = {"finger": {"kind": kind, "contact_length": 0.01 + 1e-6 * number}}
    with watched(browser, url + link_to(scene)) as (page, _):
        loaded(page)
        report: dict[str, float] = page.evaluate(FIRST_TOUCH, pause)
        return report


def figures(quick: bool) -> list[Figure]:
    """Return the lines of the page; quick: few trials."""
    trials, settle = (5, 1.0) if quick else (TRIALS, SETTLE)
    return [*first_touches(2 if quick else FIRST_TRIALS), *strokes(trials, settle)]


def strokes(trials: int, settle: float) -> list[Figure]:
    """Return the lines of moves and touches while the page is in use; settle: s of stroking first."""
    report = measured(trials, settle)
    how = f"headless Chromium, service in the same process, after {settle:g} s of stroking, median of {trials}"
    lines = []
    for name, kind in (("a move of a resting finger", "moves"), ("a touch", "touches")):
        times = [time for time in report[kind] if time is not None]
        ninth = statistics.quantiles(times, n=10)[-1]
        told = f"{how}; a tenth takes longer than {ninth:.0f} ms; {trials - len(times)} were never heard"
        lines.append(figure(f"page, {name} to sample", times, "ms", LIMIT, told))
    ran_dry = f"{report['underruns']} underruns while stroking, {report['underrunsLater']} later"
    for name, value, how in (
        ("kept queued", report["depth"], ran_dry),
        ("update to sample, by itself", 1e3 * report["updateToSound"], "the page's own figure, while stroking"),
        (
            "output latency",
            report["outputLatency"],
            f"as the browser reports it; its base {report['baseLatency']:.1f} ms",
        ),
    ):
        lines.append(Figure(f"page, {name}", value, value, "ms", None, how))
    return lines


def measured(trials: int, settle: float) -> dict[str, Any]:
    """Return the page's measurements; times in ms, None where nothing was heard."""
    with serving_pages() as running, driving() as driver, headless(driver, webgl=True) as browser:
        until(lambda: running.service.warm, 60.0)
        with watched(browser, running.url + MODULES) as (page, _):
            modules_loaded(page)
            report: dict[str, Any] = page.evaluate(MEASURE, {"trials": trials, "settle": settle})
    for kind in ("moves", "touches"):
        report[kind] = [time if isinstance(time, int | float) and time == time else None for time in report[kind]]
    return report
