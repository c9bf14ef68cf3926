"""`ridgewave play`: the sound, its fade-out, and its end by a signal or a failure."""

from __future__ import annotations

import signal
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
import soundfile

from clients.command_line.exit_codes import DONE, INTERRUPTED, TERMINATED
from clients.commands.play import Stop, play, stopped_by_signals
from service.sinks import FileSink
from synth.encode.formats import Metadata
from synth.errors import CannotRender

Block = npt.NDArray[np.float32]
RATE = 1000
FADE = 25  # frames


class Tone:
    """A live voice: ones, then from `release` on a ramp to zero of FADE frames."""

    sample_rate = RATE
    reduction_db = 0.0

    def __init__(self, stop: Stop | None = None, stop_after: int = 0) -> None:
        self.rendered = 0
        self.left: int | None = None
        self._stop, self._stop_after = stop, stop_after

    @property
    def finished(self) -> bool:
        return self.left == 0

    def render(self, frames: int) -> Block:
        self.rendered += frames
        if self._stop is not None and self.rendered >= self._stop_after and not self._stop.asked():
            self._stop.ask(signal.SIGINT)
        if self.left is None:
            return np.ones((frames, 1), dtype=np.float32)
        ramp = np.maximum(np.arange(self.left - 1, self.left - 1 - frames, -1), 0) / FADE
        self.left = max(0, self.left - frames)
        return ramp.astype(np.float32)[:, np.newaxis]

    def release(self) -> None:
        self.left = FADE


def started(folder: Path) -> FileSink:
    sink = FileSink(folder, "played.wav")
    sink.start(RATE, 1, Metadata((1.0,), ("displacement",), {}))
    return sink


def test_a_sound_plays_whole_and_then_fades_out(tmp_path: Path) -> None:
    played = play(Tone(), started(tmp_path), 105, Stop())
    sound, rate = soundfile.read(tmp_path / "played.wav")
    assert rate == RATE
    assert played.frames == len(sound)
    assert np.all(sound[:105] == 1.0)
    assert np.all(np.diff(sound[105 : 105 + FADE]) < 0)
    assert sound[-1] == 0.0


def test_a_stop_fades_an_endless_sound_out(tmp_path: Path) -> None:
    stop = Stop()
    play(Tone(stop, stop_after=50), started(tmp_path), None, stop)
    sound, _ = soundfile.read(tmp_path / "played.wav")
    assert np.all(sound[:50] == 1.0)
    assert np.all(np.diff(sound[50 : 50 + FADE]) < 0)
    assert len(sound) == 80  # the fade in whole blocks of 10 ms


def test_a_failing_sink_is_reported(tmp_path: Path) -> None:
    sink = started(tmp_path)
    sink.stop()
    with pytest.raises(CannotRender, match="closed"):
        play(Tone(), sink, 100, Stop())


@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, INTERRUPTED), (signal.SIGTERM, TERMINATED)])
def test_a_signal_requests_a_stop_and_a_second_one_forces_it(number: signal.Signals, code: int) -> None:
    before = signal.getsignal(number)
    with stopped_by_signals() as stop:
        assert (stop.asked(), stop.code) == (False, DONE)
        signal.raise_signal(number)
        assert (stop.asked(), stop.code) == (True, code)
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(number)
    assert signal.getsignal(number) == before
