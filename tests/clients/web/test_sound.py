"""The page plays the samples of the service bit for bit, over broken connections too."""

from __future__ import annotations

import base64
import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
import pytest
import soundfile

from tests.conftest import RunsRidgewave

if TYPE_CHECKING:
    from playwright.sync_api import Page

RATE = 48000
Samples = npt.NDArray[np.float32]

STROKE = """async ({seconds, scene}) => {
  const player = await modules.Player.open({sampleRate: 48000});
  const tap = player.tap();
  const finger = new modules.Finger({player, scene, record: true});
  const {session} = await finger.open();
  await modules.stroke(finger, seconds, (t) => ({position: 0.02 * Math.sin(4 * t), load: 0.2 + 0.1 * Math.sin(7 * t)}));
  finger.lift();
  await finger.close();
  const {runs, given, played, underruns, missing} = finger.source;
  const samples = modules.packed(await tap.take());
  const recording = await modules.recordingOf(session);
  await player.close();
  return {samples, first: tap.first, runs, given, played, underruns, missing, recording};
}"""


def unpacked(text: str) -> Samples:
    """Return the samples of `modules.packed`."""
    return np.frombuffer(base64.b64decode(text), "<f4")


def sounding(report: dict[str, Any]) -> Samples:
    """Return the frames in which the ring played samples, [frames, channels] of the mix, from a tap's report."""
    heard = unpacked(report["samples"]).reshape(-1, 2)
    starts = [(start - report["first"], frames) for start, frames in report["runs"]]
    assert all(start >= 0 and start + frames <= len(heard) for start, frames in starts)
    return np.concatenate([heard[start : start + frames] for start, frames in starts])


def test_what_left_the_ring_is_what_the_recording_renders_to(
    modules: Page, tmp_path: Path, ridgewave: RunsRidgewave
) -> None:
    report = modules.evaluate(STROKE, {"seconds": 1.2, "scene": {"texture": {"period": "1 mm"}}})
    heard = sounding(report)
    assert report["played"] == report["given"] == len(heard)
    assert np.array_equal(heard[:, 0], heard[:, 1])

    recording, out = tmp_path / "stroke.json", tmp_path / "stroke.wav"
    recording.write_text(report["recording"])
    assert json.loads(report["recording"])["frames"] == len(heard)
    done = ridgewave("render", str(recording), "-o", str(out))
    assert done.returncode == 0, done.stderr
    rendered, rate = soundfile.read(out, dtype="float32")
    assert rate == RATE
    assert np.abs(rendered).max() > 0.1
    assert np.array_equal(heard[:, 0].view(np.uint32), rendered.view(np.uint32))


STEADY = {"output": {"quantity": "displacement"}, "texture": {"period": "0.8 mm"}}  # 100 Hz at 80 mm/s
CHANGED = """async ({scene, partial}) => {
  const player = await modules.Player.open({sampleRate: 48000});
  const finger = new modules.Finger({player, scene});
  await finger.open();
  const blocks = [];
  finger.addEventListener("block", ({detail}) => blocks.push(detail));
  finger.move({speed: 0.08, load: 0.3});
  await modules.until(() => finger.connection.frame > 30000);
  const told = modules.once(finger, "scene");
  finger.connection.change(partial);
  const {frame, plan} = await told;
  await modules.until(() => finger.source.played > frame + 38000);
  const heard = new Float32Array(blocks.flatMap(({samples}) => [...samples]));
  await finger.close();
  await player.close();
  return {samples: modules.packed(heard), frame, simulated: plan.simulated.length, underruns: finger.source.underruns};
}"""


def share_of(samples: Samples, pitch: float) -> float:
    """Return the share of the energy, without the mean, that is within 4 Hz of a multiple of `pitch`, in hertz."""
    spectrum = np.abs(np.fft.rfft(samples * np.hanning(len(samples)))) ** 2
    frequencies = np.fft.rfftfreq(len(samples), 1 / RATE)
    spectrum[frequencies < 20.0] = 0.0
    near = np.abs(frequencies - pitch * np.round(frequencies / pitch)) <= 4.0
    return float(spectrum[near].sum() / spectrum.sum())


def test_a_change_of_the_scene_is_heard(modules: Page) -> None:
    report = modules.evaluate(CHANGED, {"scene": STEADY, "partial": {"texture": {"period": "0.6 mm"}}})
    heard = unpacked(report["samples"])
    before, after = heard[report["frame"] - 24000 : report["frame"]], heard[report["frame"] + 12000 :][:24000]
    assert share_of(before, 100.0) > 0.99 > share_of(before, 400.0 / 3)
    assert share_of(after, 400.0 / 3) > 0.99 > share_of(after, 100.0)
    assert report["simulated"] > 0


LIFTED = """async () => {
  const player = await modules.Player.open({sampleRate: 48000});
  const finger = new modules.Finger({player});
  await finger.open();
  const blocks = [];
  finger.addEventListener("block", ({detail}) => blocks.push(detail));
  const before = finger.source.given;
  await modules.stroke(finger, 0.3, (t) => ({position: 0.1 * t, load: 0.3}));
  finger.lift();
  const resting = () => finger.source.given === finger.source.played && finger.connection.outstanding === 0;
  const last = () => blocks.at(-1).samples.every((sample) => sample === 0);
  await modules.until(() => resting() && last());
  const {given, underruns, missing} = finger.source;
  await modules.pause(200);  // in which anything that is still granted would come
  const silent = {before, given, later: finger.source.given, underruns, missing, sent: finger.connection.frame};
  silent.missingLater = finger.source.missing;
  await modules.stroke(finger, 0.1, (t) => ({position: 0.1 * t, load: 0.3}));
  const felt = ({frame, samples}) => frame >= given && samples.some((sample) => sample !== 0);
  await modules.until(() => blocks.some(felt) && finger.source.runs.length > 1);
  const again = finger.source.given;
  const runs = finger.source.runs.length;
  await finger.close();
  await player.close();
  return {...silent, again, runs};
}"""


def test_a_lift_ends_in_silence_for_which_nothing_is_sent(modules: Page) -> None:
    report = modules.evaluate(LIFTED)
    assert report["before"] == 0, "a finger that has not touched yet is sent nothing"
    assert report["given"] == report["later"] == report["sent"]
    assert report["missing"] == report["missingLater"], "a finger that rests misses nothing"
    assert report["again"] > report["given"]
    assert report["runs"] >= 2


SEVERAL = """async () => {
  const player = await modules.Player.open({sampleRate: 48000});
  const tap = player.tap();
  const fingers = [0.3, 0.5].map((load) => [new modules.Finger({player}), load]);
  const given = [];
  for (const [finger] of fingers) {
    const {session} = await finger.open();
    const samples = [];
    finger.addEventListener("block", ({detail}) => samples.push(...detail.samples));
    given.push({session, samples});
  }
  await Promise.all(fingers.map(([finger, load]) => modules.stroke(finger, 0.5, (t) => ({position: 0.1 * t, load}))));
  for (const [finger] of fingers) finger.lift();
  await Promise.all(fingers.map(([finger]) => finger.close()));
  const mix = modules.packed(await tap.take());
  await player.close();
  return {mix, first: tap.first, fingers: fingers.map(([{source: {runs}}], index) => (
    {session: given[index].session, samples: modules.packed(new Float32Array(given[index].samples)), runs}))};
}"""


def test_several_fingers_are_several_streams_and_their_sum_is_heard(modules: Page) -> None:
    report = modules.evaluate(SEVERAL)
    assert len({finger["session"] for finger in report["fingers"]}) == 2
    heard = unpacked(report["mix"]).reshape(-1, 2)
    expected = np.zeros(len(heard), np.float32)
    for finger in report["fingers"]:
        samples, done = unpacked(finger["samples"]), 0
        assert np.abs(samples).max() > 0.05
        for start, frames in finger["runs"]:
            place = start - report["first"]
            expected[place : place + frames] += samples[done : done + frames]
            done += frames
        assert done == len(samples)
    assert np.array_equal(heard[:, 0], expected)
    assert np.array_equal(heard[:, 1], expected)


PLAYED = """async ({chunks, channels}) => {
  const player = await modules.Player.open({sampleRate: 48000});
  const tap = player.tap();
  const source = player.source(channels);
  const sent = [];
  const onceAllIsThere = 1e6; // frames: sound begins with `rest`, however late that follows on a busy machine
  source.ahead = onceAllIsThere;
  for (const frames of chunks) {
    const samples = Float32Array.from({length: frames * channels}, () => 2 * Math.random() - 1);
    sent.push(...samples);
    source.play(samples);
  }
  source.rest();
  await modules.until(() => source.played === source.given);
  const first = {underruns: source.underruns, missing: source.missing, runs: source.runs.length};
  source.ahead = 0;
  source.play(new Float32Array(1000 * channels));
  await modules.until(() => source.underruns > 0);
  source.ahead = onceAllIsThere;
  source.play(new Float32Array(300 * channels));
  source.rest();
  await modules.until(() => source.played === source.given && source.missing > 0);
  const samples = modules.packed(await tap.take());
  const {runs, underruns, missing, played} = source;
  await player.close();
  const counts = {underruns, missing, played};
  return {sent: modules.packed(new Float32Array(sent)), samples, first: tap.first, counts: first, runs, ...counts};
}"""


@pytest.mark.parametrize("channels", [1, 2])
def test_the_ring_plays_each_sample_once_and_counts_what_it_lacks(modules: Page, channels: int) -> None:
    chunks = [1, 127, 128, 129, 480, 7, 3000, 64]
    report = modules.evaluate(PLAYED, {"chunks": chunks, "channels": channels})
    sent, heard = unpacked(report["sent"]).reshape(-1, channels), unpacked(report["samples"]).reshape(-1, 2)
    places = [(start - report["first"], frames) for start, frames in report["runs"]]
    count = report["counts"]["runs"]
    assert report["counts"]["underruns"] == count - 1, "the end that was told of is none; quanta left out are"
    played = np.concatenate([heard[start : start + frames] for start, frames in places[:count]])
    assert np.array_equal(played, np.broadcast_to(sent, (len(sent), 2)))
    assert np.count_nonzero(heard) == np.count_nonzero(played), "all else is zeros"
    assert report["underruns"] == len(places) - 2, "each gap between runs but for the one that was told of"
    (second, length), (third, _) = places[-2:]
    if len(places) == count + 2:  # no quantum was left out
        assert report["missing"] - report["counts"]["missing"] == third - second - length
    assert report["played"] == len(sent) + 1300


LOUD = """async ({volume, raised, size}) => {
  const player = await modules.Player.open({sampleRate: 48000});
  player.volume = volume;
  player.raised = raised;
  const source = player.source(1);
  const samples = new Float32Array(48000).fill(size);
  source.play(samples);
  source.rest();
  await modules.until(() => source.played > 24000);
  const tap = player.tap("output");
  await modules.until(() => source.played === source.given);
  const heard = await tap.take();
  await player.close();
  return modules.packed(heard);
}"""


@pytest.mark.parametrize(
    ("volume", "raised", "size", "heard"),
    [(1.0, 1, 0.9, 0.9), (0.1, 10, 0.02, 0.02), (0.1, 10, 1.0, 0.3), (1.0, 10, 1.0, 0.3)],
    ids=["true size", "raised and quiet", "raised and loud", "raised, at the largest volume"],
)
def test_a_raised_sound_is_bent_before_it_is_loud(
    modules: Page, volume: float, raised: float, size: float, heard: float
) -> None:
    samples = unpacked(modules.evaluate(LOUD, {"volume": volume, "raised": raised, "size": size}))
    largest = float(np.max(np.abs(samples)))
    if heard < 0.3:
        assert largest == pytest.approx(heard, rel=0.01)
    elif raised > 1:
        assert 0.2 < largest <= heard
    else:
        assert largest == pytest.approx(heard, rel=1e-4)


LEFT_OUT = """async ({frames, rest, at}) => {
  const last = {};
  const kinds = {};
  globalThis.AudioWorkletProcessor = class { port = {postMessage: (report) => Object.assign(last, report)}; };
  globalThis.registerProcessor = (name, kind) => { kinds[name] = kind; };
  await import("/web/sound/ring_buffer.js");
  const ring = new kinds["ridgewave-ring"]({processorOptions: {channels: 1}});
  ring.take({samples: Float32Array.from({length: frames}, (_, n) => n + 1), ahead: 1});
  if (rest) ring.take({rest: true});
  const heard = [];
  for (const frame of at) {
    const output = new Float32Array(128);
    globalThis.currentFrame = frame;
    ring.process([], [[output]]);
    heard.push(...output);
  }
  return {heard, ...last};
}"""


@pytest.mark.parametrize("rest", [True, False])
def test_quanta_that_the_browser_leaves_out_break_the_sound_and_are_counted(modules: Page, rest: bool) -> None:
    report = modules.evaluate(LEFT_OUT, {"frames": 300, "rest": rest, "at": [0, 128, 640, 768]})
    assert report["heard"] == [*range(1, 301), *[0] * 212], "no sample is lost"
    assert (report["underruns"], report["missing"]) == (1, 384) if rest else (2, 384 + 84)
    assert (report["from"], report["run"]) == (640, 44)


@pytest.mark.parametrize("frames", [256, 300])
def test_quanta_left_out_behind_an_end_that_was_told_of_lack_nothing(modules: Page, frames: int) -> None:
    report = modules.evaluate(
        LEFT_OUT, {"frames": frames, "rest": True, "at": [0, 128, 256 if frames > 256 else 640, 768]}
    )
    assert (report["underruns"], report["missing"], report["played"]) == (0, 0, frames)


PAUSED = """async () => {
  const player = await modules.Player.open({sampleRate: 48000});
  const finger = new modules.Finger({player});
  await finger.open();
  finger.move({speed: 0.08, load: 0.3});
  const plays = (frames) => modules.until(() => finger.source.played > frames);
  await plays(4800);
  const states = [];
  player.context.addEventListener("statechange", () => states.push(player.context.state));
  await player.context.suspend();
  await plays(finger.source.played + 9600);
  await finger.close();
  await player.close();
  return {states};
}"""


def test_a_sound_that_the_system_has_paused_goes_on(modules: Page) -> None:
    report = modules.evaluate(PAUSED)
    assert report["states"][:2] == ["suspended", "running"]


VOLUME = """async () => {
  const player = await modules.Player.open({sampleRate: 48000});
  const tap = player.tap("volume");
  const source = player.source(1);
  source.play(new Float32Array(96000).fill(0.5));
  const begins = player.volume;
  await modules.until(() => source.played > 4800);
  player.volume = 0.6;
  await modules.until(() => source.played > 14000);
  player.volume = 7;
  const held = player.volume;
  player.volume = 0;
  await modules.until(() => source.played > 32000);
  source.level = 0.5;
  player.volume = 0.2;
  await modules.until(() => source.played === 96000);
  const samples = modules.packed(await tap.take());
  await player.close();
  return {samples, first: tap.first, runs: source.runs, begins, held};
}"""


def test_the_volume_begins_low_and_moves_without_clicks(modules: Page) -> None:
    report = modules.evaluate(VOLUME)
    assert report["begins"] == 0.1
    assert report["held"] == 1
    heard = sounding(report)[:, 0]
    assert np.allclose(heard[:2000], 0.05, atol=1e-6)
    assert np.isclose(heard.max(), 0.3, atol=1e-3)
    assert np.abs(heard).min() < 1e-4
    assert np.isclose(heard[-1], 0.05, atol=1e-3)
    steepest = 0.5 * 0.6 / (0.01 * RATE)  # of an exponential of 10 ms over the largest step
    assert np.abs(np.diff(heard)).max() <= 1.01 * steepest


CHANNELS = """async (channels) => {
  const player = await modules.Player.open({sampleRate: 48000});
  player.useChannels(channels);
  player.volume = 1;
  const tap = player.tap("volume");
  const source = player.source(2);
  source.play(Float32Array.from({length: 24000}, (_, place) => (place % 2 ? 0.25 : 0.5)));
  await modules.until(() => source.played === 12000);
  const samples = modules.packed(await tap.take());
  let refusal = "";
  try {
    player.useChannels([0, player.outputChannels]);
  } catch (error) {
    refusal = error.message;
  }
  const outputs = await player.outputs();
  await player.close();
  return {samples, first: tap.first, runs: source.runs, refusal, outputs, chosen: player.canChooseOutput};
}"""


def test_the_channels_of_the_output_can_be_chosen(modules: Page) -> None:
    report = modules.evaluate(CHANNELS, [1, 0])
    heard = sounding(report)
    assert np.allclose(heard[-1], [0.25, 0.5], atol=1e-3)
    assert "choose from these" in report["refusal"]
    assert all(set(output) == {"id", "label"} for output in report["outputs"])
