"""A real PortAudio device without hardware: ALSA's file plug-in over its null plug-in records every sample.

Model: PortAudio reads the ALSA configuration named by ALSA_CONFIG_PATH when it is loaded, so a test plays in a
    subprocess (this module, run with `-m`). Into a plain file the device records at once, as fast as it is fed;
    into a FIFO whose pipe holds 4096 bytes it goes at the pace of whoever reads, which makes it a device that keeps
    time, stalls or vanishes.
Limits: Linux with libportaudio2. Where that is missing the tests fail on CI and are skipped elsewhere.
"""

from __future__ import annotations

import ctypes.util
import fcntl
import json
import math
import os
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from service.sinks import DeviceSink, Sink, audio_device, list_devices
from synth.errors import RidgewaveError

ROOT = Path(__file__).resolve().parents[2]
DEVICE = "ridgewave_recorder"
PIPE_BYTES = 4096  # the smallest pipe that Linux makes
F_SETPIPE_SZ = 1031

CONFIGURATION = """
pcm.ridgewave_nowhere {{ type null }}
pcm.!default {{
    type plug
    slave.pcm {device}
}}
"""
DEVICE_CONFIGURATION = """
pcm.{device} {{
    type file
    slave.pcm ridgewave_nowhere
    file "{recording}"
    format raw
}}
"""


def require_portaudio() -> None:
    """Skip the test where PortAudio is missing; fail it on CI, which installs PortAudio."""
    if ctypes.util.find_library("portaudio") is None:
        reason = "libportaudio2 is not installed: no audio device can be opened"
        if os.environ.get("CI") == "true":
            pytest.fail(reason)
        pytest.skip(reason)


class Listening:
    """Reads a recorder's FIFO in a thread, as fast as a device of one channel at 48 kHz plays; may stall, or vanish."""

    def __init__(self, recorder: AlsaRecorder) -> None:
        self.recording = bytearray()
        self._stalled = threading.Event()
        self._recorder = recorder
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    @property
    def frames(self) -> int:
        """How many frames were heard so far."""
        return len(self.recording) // 4

    def _run(self) -> None:
        due = time.perf_counter()
        while not self._over.wait(max(0.0, due - time.perf_counter())):
            if not self._stalled.is_set():
                self.recording += self._recorder.read(PIPE_BYTES // 4)
            due = max(due + PIPE_BYTES // 4 / (4 * 48000), time.perf_counter() - 0.005)

    @contextmanager
    def stalling(self) -> Iterator[None]:
        """Take nothing meanwhile."""
        self._stalled.set()
        try:
            yield
        finally:
            self._stalled.clear()

    def vanish(self) -> None:
        """End, and close the FIFO: for who plays, the device is gone."""
        self._over.set()
        self._thread.join()
        self._recorder.close()

    def end(self) -> npt.NDArray[np.float32]:
        """Return all that was heard, what the device took and the pipe still holds included, silence around it not."""
        self._over.set()
        self._thread.join()
        while chunk := self._recorder.read(PIPE_BYTES):
            self.recording += chunk
        return sounding(bytes(self.recording), 1)[:, 0]


class AlsaRecorder:
    """A recording device of one test, in `folder`; the first is the default, others have names of their own."""

    def __init__(self, folder: Path, *, fifo: bool = False, name: str = DEVICE) -> None:
        self.name = name
        self.path = folder / f"{name}.f32"
        self._configuration = folder / "asound.conf"
        with self._configuration.open("a") as configuration:
            if not configuration.tell():
                configuration.write(CONFIGURATION.format(device=name))
            configuration.write(DEVICE_CONFIGURATION.format(device=name, recording=self.path))
        self._folder = folder
        self.pipe = -1
        if fifo:
            os.mkfifo(self.path)
            self.pipe = os.open(self.path, os.O_RDONLY | os.O_NONBLOCK)
            fcntl.fcntl(self.pipe, F_SETPIPE_SZ, PIPE_BYTES)

    def play(self, samples: npt.NDArray[np.float32], **settings: Any) -> subprocess.Popen[str]:
        """Start a process that plays `samples` [frames, channels] on the device and prints a report (see `main`)."""
        samples_path = self._folder / "samples.npy"
        np.save(samples_path, samples)
        environment = {**os.environ, "ALSA_CONFIG_PATH": str(self._configuration), "PYTHONPATH": str(ROOT)}
        command = [sys.executable, "-m", "tests.service.alsa_recorder", str(samples_path), json.dumps(settings)]
        return subprocess.Popen(
            command, env=environment, cwd=ROOT, text=True, stdin=subprocess.PIPE, stdout=subprocess.PIPE
        )

    def read(self, count: int) -> bytes:
        """Return up to `count` bytes that wait in the FIFO, b"" where none do."""
        if self.pipe < 0:
            return b""
        try:
            return os.read(self.pipe, count)
        except BlockingIOError:
            return b""

    def read_in_real_time(
        self, player: subprocess.Popen[str], bytes_per_second: float, most: float = math.inf
    ) -> bytes:
        """Read the FIFO as a device with a clock would, until `player` has ended or `most` bytes came; return them.

        A reader that the machine holds up lets its clock slip rather than catch up, which no device does.
        """
        recording = bytearray()
        due = time.perf_counter()
        while True:
            ended = player.poll() is not None
            chunk = self.read(PIPE_BYTES if ended else PIPE_BYTES // 4)
            recording += chunk
            if (ended and not chunk) or len(recording) >= most:
                return bytes(recording)
            if not ended:
                due = max(due + (len(chunk) or 64) / bytes_per_second, time.perf_counter() - 0.005)
                time.sleep(max(0.0, due - time.perf_counter()))

    def close(self) -> None:
        """Close the FIFO: for the player, the device vanishes."""
        if self.pipe >= 0:
            os.close(self.pipe)
            self.pipe = -1


def report(player: subprocess.Popen[str], seconds: float = 60.0) -> dict[str, Any]:
    """Return what `player` printed once it has ended; kills it, and fails, after `seconds`."""
    try:
        output, _ = player.communicate(timeout=seconds)
    except subprocess.TimeoutExpired:
        player.kill()
        player.communicate()
        pytest.fail(f"the player did not end within {seconds} s")
    assert player.returncode == 0, output
    document: dict[str, Any] = json.loads(output.splitlines()[-1])
    return document


def sounding(recording: bytes, channels: int) -> npt.NDArray[np.float32]:
    """Return the recorded frames [frames, channels] without the silence around them."""
    frames = np.frombuffer(recording[: len(recording) // (4 * channels) * 4 * channels], "<f4").reshape(-1, channels)
    loud = np.flatnonzero(frames.any(axis=1))
    return frames[loud[0] : loud[-1] + 1] if len(loud) else frames[:0]


def stop_on_input(sink: Sink) -> None:
    """Stop `sink` when something comes on standard input."""
    if os.read(0, 1):
        sink.stop()


def main() -> None:
    """Play a .npy file: argv is its path and JSON settings; print {failure, error, underruns, ...} as JSON.

    Settings: rate, device, block (frames a write), ring_blocks, timeout (seconds a write may wait), late (the frame
    whose write comes half a second late), patience (seconds without a callback before the device has stalled). A line
    on standard input stops the sink from another thread.
    """
    samples = np.load(sys.argv[1])
    settings = json.loads(sys.argv[2])
    audio_device.STALLED_SECONDS = settings.get("patience", audio_device.STALLED_SECONDS)
    sink = DeviceSink(settings.get("device", DEVICE), ring_blocks=settings.get("ring_blocks", 4))
    answer: dict[str, Any] = {"devices": list_devices(), "error": None}
    block = settings.get("block", 480)
    try:
        sink.start(settings.get("rate", 48000), samples.shape[1])
        threading.Thread(target=stop_on_input, args=(sink,), daemon=True).start()
        for start in range(0, len(samples), block):
            if start == settings.get("late"):
                time.sleep(0.5)
            sink.write(samples[start : start + block], timeout=settings.get("timeout", 5.0))
    except RidgewaveError as error:
        answer["error"] = str(error)
    began = time.monotonic()
    sink.close()
    answer |= {"end_seconds": time.monotonic() - began, "failure": sink.failure, "underruns": sink.underruns}
    answer |= {
        "dropped": sink.dropped_frames,
        "latency": sink.latency,
        "name": sink.name,
        "underflows": sink.device_underflows,
    }
    print(json.dumps(answer), flush=True)


if __name__ == "__main__":
    main()
