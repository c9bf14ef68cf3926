"""The time from a pointer event over the web page to the first changed sample at the page's audio output.

Model: headless Chromium with the page's own modules, and the service in this process, over loopback. A finger either
    rests on the texture (velocity, so that rest is exact silence) until a pointer moves, or is off until a pointer
    touches. The time begins just before the event is dispatched in the page, and ends when the audio thread outputs the
    first sample that is not zero. Both are by `Date.now`, to 1 ms. The browser's own output latency is reported
    separately, as the browser reports it.
Limits: the time from a hand's motion to the event, in system and browser, is not included. A machine without a sound
    card plays into a timer. Browser, service and this process share the machine.
"""

from __future__ import annotations

import statistics
from typing import Any

from tests.bench.timing import Figure, figure
from tests.clients.web.browser import driving, headless, watched
from tests.clients.web.conftest import MODULES, modules_loaded
from tests.clients.web.page_service import serving_pages
from tests.service.harness import until

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


def figures(quick: bool) -> list[Figure]:
    """Return the lines of the page; quick: few trials."""
    trials, settle = (5, 1.0) if quick else (TRIALS, SETTLE)
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
    with serving_pages() as running, driving() as driver, headless(driver) as browser:
        until(lambda: running.service.warm, 60.0)
        with watched(browser, running.url + MODULES) as (page, _):
            modules_loaded(page)
            report: dict[str, Any] = page.evaluate(MEASURE, {"trials": trials, "settle": settle})
    for kind in ("moves", "touches"):
        report[kind] = [time if isinstance(time, int | float) and time == time else None for time in report[kind]]
    return report
