"""Sound of the real engine: renders, changes during a stream, and third-party players."""

from __future__ import annotations

import io
import os
import shutil
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
import soundfile

from synth import LiveVoice, open_voice, render
from synth.encode.formats import quantise
from synth.scene.scene import parse_scene
from tests.few import thorough
from tests.service.harness import PATIENCE, START, Running, kept_engine, serving, until

RATE = 48000


@pytest.fixture(scope="module")
def running(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Running]:
    with serving(kept_engine(), file_folder=tmp_path_factory.mktemp("recordings")) as server:
        until(lambda: server.client.get("/readyz").status_code == 200, START)
        yield server


SCENES: list[dict[str, Any]] = [
    {},
    {"output": {"duration": 0.5, "channels": ["displacement", "velocity", "acceleration"], "sample_rate": 44100}},
    {"scan": {"load": "1.5 N"}, "output": {"quantity": "displacement", "fade": 0.1}},
    {"output": {"duration": 30}},
    {"scan": {"load": 0}, "output": {"duration": 0.1}},
]


@pytest.mark.parametrize("scene", SCENES, ids=str)
def test_a_render_is_the_engines_to_the_last_bit(running: Running, scene: dict[str, Any]) -> None:
    answer = running.client.post("/v1/render", json=scene)
    samples, rate = soundfile.read(io.BytesIO(answer.content), dtype="float32", always_2d=True)
    parsed = parse_scene(scene)
    assert rate == parsed.output.sample_rate
    np.testing.assert_array_equal(samples, render(parsed).frames)
    scales = [float(text) for text in answer.headers["ridgewave-full-scale"].split(", ")]
    assert tuple(scales) == open_voice(parsed).full_scale


def test_integer_answers_are_limited_and_float_ones_are_not(running: Running) -> None:
    scene = {"output": {"full_scale": 10, "duration": 0.2, "bandwidth": "full"}}
    loud, _ = soundfile.read(io.BytesIO(running.client.post("/v1/render", json=scene).content), dtype="float32")
    assert np.abs(loud).max() > 2
    answer = running.client.post("/v1/render?format=wav16", json=scene)
    held, _ = soundfile.read(io.BytesIO(answer.content), dtype="int16")
    clipped = quantise(loud[:, np.newaxis], 16)[:, 0]
    assert np.abs(held.astype(int)).max() >= 32000
    assert (np.abs(held.astype(int)) >= 32767).sum() < (np.abs(clipped) >= 32767).sum()


def test_a_silent_scene_warns(running: Running) -> None:
    answer = running.client.post("/v1/render", json={"scan": {"load": 0}})
    assert answer.headers["ridgewave-warning"]


def test_explain_is_the_plan(running: Running) -> None:
    document = running.client.post("/v1/explain", json={}).json()
    assert set(document) >= {"scene", "simulated", "left_out", "response", "estimated_error", "cost", "warnings"}
    assert document["simulated"][0]["reason"]


def heard_across(running: Running, scene: dict[str, Any], patch: dict[str, Any]) -> tuple[npt.NDArray[Any], float]:
    """Return three channels before and after `patch`, and the latest promised time of the change in seconds."""
    session = running.open_session(scene)
    began = time.perf_counter()  # no later than the stream's own clock
    with running.listening(session, channels=3) as listener:
        before = listener.frames(RATE // 4)
        answer = running.client.patch(f"/v1/sessions/{session}", json=patch)
        answered = time.perf_counter() - began
        assert answer.status_code == 200, answer.text
        after = listener.frames(RATE)
    return np.concatenate([before, after]), answered + answer.json()["heard_within"]


@pytest.mark.parametrize(
    "patch",
    [
        {"scan": {"speed": "40 mm/s"}},
        thorough({"scan": {"speed": "160 mm/s"}}),
        {"scan": {"speed": "-80 mm/s"}},
        thorough({"scan": {"load": "0.05 N"}}),
        {"scan": {"load": "1 N"}},
        thorough({"texture": {"period": "0.6 mm"}}),
        {"texture": {"period": "2 mm", "amplitude": "40 um"}},
        {"finger": {"ridge_period": "0.4 mm"}},
    ],
    ids=str,
)
def test_a_change_in_mid_stream_comes_in_time_and_without_a_click(running: Running, patch: dict[str, Any]) -> None:
    """The full scales leave room for the louder of the two scenes, so that the limiter has no part in it."""
    channels = [
        {"quantity": "displacement", "full_scale": "100 um"},
        {"quantity": "velocity", "full_scale": "0.2 m/s"},
        {"quantity": "acceleration", "full_scale": "500 m/s^2"},
    ]
    scene: dict[str, Any] = {"output": {"channels": channels}}
    heard, promised = heard_across(running, scene, patch)
    unchanged = unpatched(scene, len(heard))
    for channel in range(3):
        was, now = unchanged[:, channel], heard[:, channel]
        changed = int(np.argmax(np.abs(now - was) > 1e-6))
        assert 0 < changed <= promised * RATE
        largest = max(steepest(was[RATE // 10 :]), steepest(now[-RATE // 2 :]))
        assert steepest(now[RATE // 10 :]) <= 1.001 * largest


def steepest(samples: npt.NDArray[Any]) -> float:
    """Return the largest step from a sample to the next."""
    return float(np.abs(np.diff(samples)).max())


def unpatched(scene: dict[str, Any], frames: int) -> npt.NDArray[np.float32]:
    """Return what the stream would have been without its change, [frames, channels]."""
    return LiveVoice(parse_scene(scene)).render(frames)


def test_many_changes_in_a_row_do_not_click(running: Running) -> None:
    """A hand on a slider: a change every 20 ms or so, each before the last has been faded in.

    At full band the last scene, the fastest, is the steepest; in a narrower one a slower scene keeps more harmonics.
    """
    session = running.open_session({"output": {"quantity": "displacement", "bandwidth": "full"}})
    with running.listening(session) as listener:
        parts = [listener.frames(RATE // 4)]
        for step in range(20):
            speed = 0.08 + 0.004 * step
            assert running.client.patch(f"/v1/sessions/{session}", json={"scan": {"speed": speed}}).status_code == 200
            parts.append(listener.frames(960))
        parts.append(listener.frames(RATE))
    heard = np.concatenate(parts)
    assert steepest(heard[RATE // 10 :]) <= 1.001 * steepest(heard[-RATE // 2 :])


def test_a_moving_scan_streams_too(running: Running) -> None:
    recorded = [[0, 0, 0.3], [0.1, 0.01, 0.3], [0.2, 0.02, 0.3], [0.3, 0.01, 0.3], [0.4, 0.0, 0.3]]
    scans: list[dict[str, Any]] = [{"stroke": {}}, {"trajectory": recorded}]
    for scan in scans:
        session = running.open_session({"scan": scan})
        with running.listening(session, "format=f32le&duration=0.5") as listener:
            samples = listener.rest()
        assert len(samples) == RATE // 2 and samples.any() and np.abs(samples).max() <= 1.0


def tool(name: str) -> str:
    """Return the path of a program; on CI it must be there, elsewhere its absence skips the test."""
    found = shutil.which(name)
    if found is None:
        reason = f"{name} is not installed: what it makes of a stream cannot be tested"
        if os.environ.get("CI") == "true":
            pytest.fail(reason)
        pytest.skip(reason)
    return found


@pytest.mark.parametrize("name", ["wav", "wav16", thorough("wav24")])
def test_curl_saves_a_stream_that_others_read(running: Running, tmp_path: Path, name: str) -> None:
    """curl is stopped after a second, so the file is incomplete; its header must allow that."""
    saved, raw = tmp_path / "stream.wav", tmp_path / "samples.f32"
    session = running.open_session()
    url = f"{running.url}/v1/sessions/{session}/stream?format={name}"
    saving = [tool("curl"), "-sS", "--max-time", "1", "-o", str(saved), url]
    curl = subprocess.run(saving, timeout=PATIENCE, check=False)
    assert curl.returncode == 28, "curl did not run into its time limit"
    size, tolerance = {"wav": (4, 1e-7), "wav16": (2, 2e-5), "wav24": (3, 2e-7)}[name]
    for program, words in {
        "ffmpeg": ["-v", "error", "-y", "-i", str(saved), "-f", "f32le", str(raw)],
        "sox": ["-V1", "--ignore-length", str(saved), "-t", "f32", str(raw)],
    }.items():
        done = subprocess.run([tool(program), *words], capture_output=True, timeout=PATIENCE, check=False)
        assert done.returncode == 0, done.stderr
        read = np.fromfile(raw, "<f4")
        assert len(read) >= (saved.stat().st_size - 4096) // size > 0
        np.testing.assert_allclose(read, unpatched({}, len(read))[:, 0], atol=tolerance)


def test_curl_renders_and_ffprobe_knows_the_length(running: Running, tmp_path: Path) -> None:
    saved = tmp_path / "render.flac"
    command = [tool("curl"), "-sSf", "-H", "Content-Type: application/json", "-H", "Accept: audio/flac", "-d", "{}"]
    subprocess.run([*command, "-o", str(saved), f"{running.url}/v1/render"], timeout=PATIENCE, check=True)
    probe = [tool("ffprobe"), "-v", "error", "-show_entries", "format=duration", "-of", "csv=p=0", str(saved)]
    assert float(subprocess.run(probe, capture_output=True, timeout=PATIENCE, check=True).stdout) == 2.0
