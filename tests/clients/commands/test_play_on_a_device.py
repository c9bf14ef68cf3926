"""`ridgewave play` and `devices` with a real PortAudio device: it receives the live voice, sample for sample."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest

from synth.scene.catalogue import lookup
from synth.scene.merge import merge_patch
from synth.scene.scene import parse_scene
from synth.voice.live_voice import LiveVoice
from tests.conftest import RunsRidgewave
from tests.service.alsa_recorder import DEVICE, PIPE_BYTES, AlsaRecorder, require_portaudio, sounding

pytestmark = pytest.mark.device

NAME = "grating-1mm-31um"
RATE = 48000
BLOCK = 480  # frames: the 10 ms of `play`


@pytest.fixture
def recorder(tmp_path: Path) -> Iterator[AlsaRecorder]:
    require_portaudio()
    made = AlsaRecorder(tmp_path, fifo=True)
    yield made
    made.close()


@pytest.fixture
def with_device(recorder: AlsaRecorder, environment: dict[str, str], tmp_path: Path) -> dict[str, str]:
    return {**environment, "ALSA_CONFIG_PATH": str(tmp_path / "asound.conf")}


def player(words: list[str], folder: Path, environment: dict[str, str]) -> subprocess.Popen[str]:
    """Start `ridgewave play WORDS` on the recording device."""
    command = [sys.executable, "-m", "clients", "play", NAME, "--device", DEVICE, "--json", *words]
    return subprocess.Popen(
        command, cwd=folder, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )


def live_sound(frames: int) -> npt.NDArray[np.float32]:
    """Return what the live voice gives for `frames` and its fade-out, in the blocks of `play`."""
    voice = LiveVoice(parse_scene(merge_patch(lookup(NAME).document, {})))
    blocks = [voice.render(min(BLOCK, frames - start)) for start in range(0, frames, BLOCK)]
    voice.release()
    while not voice.finished:
        blocks.append(voice.render(BLOCK))
    return np.concatenate(blocks)


@pytest.mark.alone  # no underrun: the player must have the processor when a block is due
def test_the_device_receives_every_sample_of_the_live_voice(
    recorder: AlsaRecorder, with_device: dict[str, str], tmp_path: Path
) -> None:
    process = player(["--duration", "0.5"], tmp_path, with_device)
    recording = recorder.read_in_real_time(process, RATE * 4)
    output, message = process.communicate(timeout=300)
    assert process.returncode == 0, message
    assert json.loads(output)["underruns"] == 0
    expected = live_sound(RATE // 2)
    np.testing.assert_array_equal(sounding(recording, 1), sounding(expected.tobytes(), 1))


def test_ctrl_c_fades_out_and_ends_with_130(
    recorder: AlsaRecorder, with_device: dict[str, str], tmp_path: Path
) -> None:
    process = player(["--endless"], tmp_path, with_device)
    begun = recorder.read_in_real_time(process, RATE * 4, most=20 * PIPE_BYTES)
    process.send_signal(signal.SIGINT)
    sound = sounding(begun + recorder.read_in_real_time(process, RATE * 4), 1)
    _, message = process.communicate(timeout=300)
    assert (process.returncode, message) == (130, "")
    steps = np.abs(np.diff(sound[:, 0]))
    assert np.abs(sound).max() > 0.1
    assert abs(sound[-1, 0]) <= steps.max(), "it broke off"
    assert steps[-BLOCK:].max() < steps.max()


def test_devices_lists_the_recorder(ridgewave: RunsRidgewave, with_device: dict[str, str]) -> None:
    done = ridgewave("devices", "--json", env=with_device)
    assert done.returncode == 0, done.stderr
    listed = json.loads(done.stdout)["devices"]
    assert DEVICE in [device["name"] for device in listed]
    shown = ridgewave("devices", env=with_device).stdout.decode()
    assert all(device["name"] in shown for device in listed)


def test_an_unknown_device_is_an_invalid_request(ridgewave: RunsRidgewave, with_device: dict[str, str]) -> None:
    done = ridgewave("play", NAME, "--device", "no such device", env=with_device)
    assert done.returncode == 2
    assert DEVICE.encode() in done.stderr
