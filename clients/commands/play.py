"""`ridgewave play SCENE`: a scene on an audio device of this machine, or into a recording in place of one.

Stage: voice -> sink, live: the voice ramps in and out and ends in the safety limiter; the device sets the pace.
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

BLOCK_SECONDS = 0.01  # s; longer makes Ctrl-C late, shorter makes Python's share of the time felt
SWITCH_SECONDS = 0.0005  # s; Python's usual 5 ms lets this thread keep the audio callback waiting past its deadline


class LiveSound(Protocol):
    """The part of a live voice that playing needs."""

    @property
    def sample_rate(self) -> int:
        """Return the frames a second."""

    @property
    def finished(self) -> bool:
        """Return whether the fade-out is over."""

    @property
    def reduction_db(self) -> float:
        """Return the largest gain reduction of the limiter in the last block, in dB."""

    def render(self, frames: int) -> npt.NDArray[np.float32]:
        """Return the next float32 block [frames, channels]."""

    def release(self) -> None:
        """Begin to fade out."""


@dataclass(frozen=True, slots=True)
class Played:
    """What was played: frames, and the largest gain reduction (dB) of the limiter."""

    frames: int
    reduction_db: float


class Stop:
    """Whether somebody asked to stop, and the exit code that this asks for."""

    def __init__(self) -> None:
        self.code = DONE

    def asked(self) -> bool:
        """Return whether to stop."""
        return self.code != DONE

    def ask(self, number: int, _frame: FrameType | None = None) -> None:
        """Take note of a signal; a second one ends at once, without the fade."""
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

    What goes wrong silences the sink at once and is raised.
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
    """Let Ctrl-C and SIGTERM ask to stop, so that the sound fades out instead of breaking off."""
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
        warn(f"the device ran dry {result['underruns']} times: this machine did not keep up, or the device stalled")
    for sentence in reduction_warning(result["gain_reduction_db"]):
        warn(sentence)
