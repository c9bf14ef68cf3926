"""`ridgewave play SCENE`: plays a scene on an audio device of this machine, or into a file.

The voice is faded in and out and passes the safety limiter. The device sets the pace.
"""

from __future__ import annotations

import argparse
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, Any, Protocol

from clients.command_line.exit_codes import DONE, INTERRUPTED, TERMINATED
from clients.command_line.printing import print_json, warn
from clients.command_line.scene_argument import read_scene
from service.sinks import Sink, open_sink
from synth.encode.sound_metadata import Metadata
from synth.errors import CannotRender
from synth.scene.scene import scene_document
from synth.voice.fades import reduction_warning
from synth.voice.live_voice import LiveVoice

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

BLOCK_SECONDS = 0.01  # s; longer delays Ctrl-C, shorter costs more time in Python
SWITCH_SECONDS = 0.0005  # s; with Python's default of 5 ms this thread makes the audio callback miss its deadline


class LiveSound(Protocol):
    """What `play` needs of a live voice."""

    @property
    def sample_rate(self) -> int:
        """Frames per second."""

    @property
    def finished(self) -> bool:
        """Whether the fade-out is over."""

    @property
    def reduction_db(self) -> float:
        """Largest gain reduction by the limiter in the last block, in dB."""

    def render(self, frames: int) -> npt.NDArray[np.float32]:
        """Return the next float32 block [frames, channels]."""

    def release(self) -> None:
        """Begin to fade out."""


@dataclass(frozen=True, slots=True)
class Played:
    """The number of frames played, and the largest gain reduction by the limiter, in dB."""

    frames: int
    reduction_db: float


class Stop:
    """A request to stop, and the exit code for it."""

    def __init__(self) -> None:
        self.code = DONE

    def asked(self) -> bool:
        """Return whether a signal requested a stop."""
        return self.code != DONE

    def ask(self, number: int, _frame: FrameType | None = None) -> None:
        """Note a signal. A second one ends the command at once, without the fade."""
        if self.asked():
            raise KeyboardInterrupt
        self.code = INTERRUPTED if number == signal.SIGINT else TERMINATED


def run(arguments: argparse.Namespace) -> int:
    """Carry out the command; raises InvalidRequest, CannotRender."""
    scene = read_scene(arguments)
    sink = open_sink(arguments.device, Path.cwd())
    voice = LiveVoice(scene)
    frames = None if arguments.endless else round(scene.output.duration * voice.sample_rate)
    sys.setswitchinterval(SWITCH_SECONDS)
    with stopped_by_signals() as stop:
        metadata = Metadata(voice.full_scale, voice.quantities, scene_document(scene))
        sink.start(voice.sample_rate, voice.channels, metadata)
        played = play(voice, sink, frames, stop)
    if sink.failure:
        raise CannotRender(sink.failure)
    result = {
        "device": sink.name,
        "seconds": played.frames / voice.sample_rate,
        "underruns": sink.underruns,
        "device_underflows": sink.device_underflows,
        "dropped_frames": sink.dropped_frames,
        "gain_reduction_db": played.reduction_db,
    }
    _report(result, arguments.json)
    return stop.code


def play(voice: LiveSound, sink: Sink, frames: int | None, stop: Stop) -> Played:
    """Play `frames` of `voice` (None: until stopped) into a started `sink`, then its fade-out.

    An error silences the sink at once and is raised.
    """
    played, reduction = 0, 0.0
    try:
        for block in _sound(voice, frames, stop):
            sink.write(block)
            played += len(block)
            reduction = max(reduction, voice.reduction_db)
    except BaseException:
        sink.stop()
        raise
    sink.close()
    return Played(played, reduction)


def _sound(voice: LiveSound, frames: int | None, stop: Stop) -> Iterator[npt.NDArray[np.float32]]:
    """Yield `frames` of `voice` (None: until stopped), then its fade-out."""
    size = max(1, round(BLOCK_SECONDS * voice.sample_rate))
    done = 0
    while not stop.asked() and (frames is None or done < frames):
        count = size if frames is None else min(size, frames - done)
        yield voice.render(count)
        done += count
    voice.release()
    while not voice.finished:
        yield voice.render(size)


@contextmanager
def stopped_by_signals() -> Iterator[Stop]:
    """Turn Ctrl-C and SIGTERM into a request to stop, so that the sound fades out."""
    stop = Stop()
    before = {number: signal.signal(number, stop.ask) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield stop
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _report(result: dict[str, Any], as_json: bool) -> None:
    if as_json:
        print_json(result)
        return
    print(f"played {result['seconds']:.3f} s on {result['device']}")
    if result["underruns"]:
        warn(f"{result['underruns']} underruns: this machine did not keep up, or the device stalled")
    for sentence in reduction_warning(result["gain_reduction_db"]):
        warn(sentence)
