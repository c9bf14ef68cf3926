"""The device sink through the real sounddevice and PortAudio, into an ALSA device that records."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest

from tests.few import thorough
from tests.service.alsa_recorder import DEVICE, AlsaRecorder, report, require_portaudio, sounding

pytestmark = pytest.mark.device


@pytest.fixture(autouse=True)
def portaudio() -> None:
    require_portaudio()


@pytest.fixture
def clocked(tmp_path: Path) -> Iterator[AlsaRecorder]:
    recorder = AlsaRecorder(tmp_path, fifo=True)
    yield recorder
    recorder.close()


def noise(frames: int, channels: int) -> npt.NDArray[np.float32]:
    samples = np.random.default_rng(7).uniform(-1.0, 1.0, (frames, channels)).astype(np.float32)
    samples[0] = samples[-1] = 1.0  # so that the ends are seen
    return samples


@pytest.mark.parametrize(
    ("channels", "rate", "device"), [thorough(1, 48000, DEVICE), (2, 44100, "default"), (3, 96000, DEVICE)]
)
def test_every_sample_reaches_the_device_unchanged(tmp_path: Path, channels: int, rate: int, device: str) -> None:
    """The device takes everything at once, so everything is queued first: 100 blocks of 10 ms."""
    recorder = AlsaRecorder(tmp_path)
    samples = noise(rate, channels)
    answer = report(recorder.play(samples, rate=rate, device=device, ring_blocks=100))
    assert (answer["error"], answer["failure"], answer["underruns"]) == (None, None, 0)
    assert answer["name"] == device
    np.testing.assert_array_equal(sounding(recorder.path.read_bytes(), channels), samples)


def test_a_sound_shorter_than_the_ring_is_played_whole(tmp_path: Path) -> None:
    recorder = AlsaRecorder(tmp_path)
    samples = noise(777, 1)
    assert report(recorder.play(samples, block=100))["failure"] is None
    np.testing.assert_array_equal(sounding(recorder.path.read_bytes(), 1), samples)


@pytest.mark.alone  # a ring of 40 ms, filled by a thread that other tests hold up for longer
def test_a_device_with_a_clock_is_fed_in_time_from_a_short_ring(clocked: AlsaRecorder) -> None:
    samples = noise(48000, 1)
    player = clocked.play(samples, block=333)
    recording = clocked.read_in_real_time(player, 48000 * 4)
    answer = report(player)
    assert (answer["error"], answer["failure"], answer["underruns"]) == (None, None, 0)
    np.testing.assert_array_equal(sounding(recording, 1), samples)
    assert 0.040 <= answer["latency"] < 0.2


@pytest.mark.alone  # silence where the writer is late, and hardly elsewhere
def test_a_writer_that_is_late_is_counted_and_heard_without_a_knock(clocked: AlsaRecorder) -> None:
    """The ring runs dry for a while: what was written is all heard, silence between softened edges in its midst."""
    samples = np.full((48000, 1), 0.5, dtype=np.float32)
    player = clocked.play(samples, late=24000)
    heard = sounding(clocked.read_in_real_time(player, 48000 * 4), 1)[:, 0]
    answer = report(player)
    assert (answer["error"], answer["failure"]) == (None, None)
    assert answer["underruns"] >= 10 and answer["dropped"] == 0
    edges = np.flatnonzero(np.diff(heard == 0.0, prepend=False, append=False)).reshape(-1, 2)  # of each silence
    first, end = edges[np.argmax(edges[:, 1] - edges[:, 0])]  # a busy machine adds shorter ones
    assert len(heard) > 48000 and first >= 24000 and end <= len(heard) - 23000
    assert np.abs(np.diff(heard)).max() < 0.003


def test_a_device_that_stalls_is_told_and_let_go(clocked: AlsaRecorder) -> None:
    """Nobody reads the FIFO."""
    answer = report(clocked.play(noise(48000, 1), timeout=0.3))
    assert "has stalled" in answer["error"] and DEVICE in answer["error"]
    assert "has stalled" in answer["failure"]
    assert answer["end_seconds"] < 30.0


def test_a_device_that_vanishes_is_told(clocked: AlsaRecorder) -> None:
    player = clocked.play(noise(480000, 1), timeout=1.0)
    received = 0
    while received < 48000 and player.poll() is None:
        received += len(clocked.read(4096))
    clocked.close()
    answer = report(player)
    assert answer["error"] is not None and DEVICE in answer["error"]
    assert answer["failure"] is not None and answer["end_seconds"] < 30.0


def test_stop_from_another_thread_fades_what_is_under_way_and_drops_the_rest(clocked: AlsaRecorder) -> None:
    """A minute is being written, five seconds ahead, when the line comes that has the player stop.

    Nothing waits for a busy machine: the ring is too long to run dry, and the sink too patient to call a stall.
    """
    ahead = 500
    samples = np.full((48000 * 60, 1), 0.5, dtype=np.float32)
    player = clocked.play(samples, block=48000, ring_blocks=ahead, patience=60.0)
    played = clocked.read_in_real_time(player, 48000 * 4, most=48000)
    assert player.stdin is not None
    player.stdin.write("stop\n")
    player.stdin.flush()
    heard = sounding(played + clocked.read_in_real_time(player, 48000 * 4), 1)[:, 0]
    answer = report(player)
    assert "is closed" in answer["error"] and answer["failure"] is None
    assert len(heard) < 480 * ahead, "what waited was dropped"
    np.testing.assert_array_equal(heard[:-300], 0.5)
    assert np.abs(np.diff(heard)).max() < 0.003 and 0.0 < heard[-1] < 0.003


def test_an_unknown_device_is_refused_with_the_names_there_are_and_the_list_names_the_default(tmp_path: Path) -> None:
    answer = report(AlsaRecorder(tmp_path).play(noise(10, 1), device="voice coil"))
    assert "voice coil" in answer["error"] and DEVICE in answer["error"] and "file:NAME.wav" in answer["error"]
    devices = {device["name"]: device for device in answer["devices"]}
    assert devices["default"]["default"] and not devices[DEVICE]["default"]
    assert devices[DEVICE]["channels"] >= 2 and devices[DEVICE]["default_sample_rate"] > 0


def test_more_channels_than_the_device_has_are_refused(tmp_path: Path) -> None:
    answer = report(AlsaRecorder(tmp_path).play(noise(10, 200)))
    assert "does not open for 200 channels at 48000 Hz" in answer["error"]
