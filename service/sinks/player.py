"""Plays a session into a sink of this machine: a device, or a file in the folder for recordings.

Model: each play has a thread that takes blocks from the session and writes them to the sink, which sets the pace. When
    a play is ended, it fades out in 10 ms; the sink then plays or stores what it holds, and closes. A stop drops what
    a device holds. If the sink fails, the play ends; the session, its stream and later plays continue. A device
    that stalled for 2 s has failed, and does not play again by itself when it comes back.
Limits: a play ends by itself after RIDGEWAVE_MAX_DURATION. Errors during a play (a device that vanished, a full disk)
    are reported by `document` and the log.
"""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

from service.operations.metrics import Metrics
from service.operations.settings import Settings
from service.sessions.voice_stream import VoiceStream
from service.sinks import Claims, FileSink, Sink, open_sink
from synth.encode.formats import Metadata
from synth.errors import CannotRender, RidgewaveError

log = logging.getLogger("ridgewave.service")


class Player:
    """One play of one session."""

    def __init__(
        self,
        device: str | int | None,
        settings: Settings,
        metrics: Metrics,
        claims: Claims,
        over: Callable[[], None] = lambda: None,
    ) -> None:
        """Open nothing yet; set `stream` before `start`.

        device: as in the request.
        claims: the devices in use.
        over: called once, from the play's thread, when a play that began is over.
        Raises InvalidRequest for an invalid file name.
        """
        folder = Path(settings.file_folder)
        self.stream: VoiceStream | None = None
        self.frames = 0
        self.failure: str | None = None
        self._sink: Sink = open_sink(device, folder, claims)
        self._folder = folder
        self._settings = settings
        self._metrics, self._on_over = metrics, over
        self._underruns = 0
        self._ending, self._over = threading.Event(), threading.Event()
        self._dropping = False
        self._thread = threading.Thread(target=self._run, name="play", daemon=True)

    @property
    def playing(self) -> bool:
        """Return whether the play is neither over nor has failed."""
        return self.failure is None and not self._over.is_set()

    def start(self, metadata: Metadata) -> None:
        """Open the sink and begin. Blocks: call it from a thread. Raises CannotRender or InvalidRequest."""
        assert self.stream is not None
        if isinstance(self._sink, FileSink):
            _make_folder(self._folder)
        try:
            self._sink.start(self.stream.sample_rate, self.stream.channels, metadata)
        except BaseException:
            self._over.set()
            raise
        self._metrics.stream_opened("play")
        self._thread.start()

    def end(self, *, at_once: bool = False) -> None:
        """Fade out and end. at_once: a device drops what it still holds."""
        self._ending.set()
        if at_once and self._thread.is_alive() and not isinstance(self._sink, FileSink):
            self._dropping = True
            threading.Thread(target=self._sink.stop, name="play-stop", daemon=True).start()

    def wait(self, timeout: float) -> bool:
        """Return whether the play is over, after at most `timeout` seconds. Call it from a thread."""
        return self._over.wait(timeout)

    def document(self) -> dict[str, Any]:
        """Return the play's part of the session's document."""
        return {
            "device": self._sink.name,
            "state": "failed" if self.failure else "playing" if self.playing else "finished",
            "frames": self.frames,
            "underruns": self._sink.underruns,
            "device_underflows": self._sink.device_underflows,
            "dropped_frames": self._sink.dropped_frames,
            "gain_reduction_db": 0.0 if self.stream is None else self.stream.largest_reduction_db,
            "failure": self.failure,
        }

    def _run(self) -> None:
        try:
            self._play()
        except RidgewaveError as error:
            if not self._dropping:
                self.failure = str(error)
        except Exception:
            log.exception("our mistake: a play ended")
            self.failure = "an error of the service; the log has the details"
        finally:
            self._sink.close()
            self.failure = self.failure or (None if self._dropping else self._sink.failure)
            self._count(0)
            self._metrics.stream_closed("play")
            self._on_over()
            if self.failure is not None:
                log.warning("a play on %s failed: %s", self._sink.name, self.failure)
            self._over.set()

    def _play(self) -> None:
        assert self.stream is not None
        size = max(1, round(self._settings.stream_block * self.stream.sample_rate))
        longest = round(self._settings.max_duration * self.stream.sample_rate) - self.stream.fade_frames
        while not self._ending.is_set() and self.frames < longest:
            block = self.stream.next_block(min(size, longest - self.frames))
            self._sink.write(block)
            self._count(len(block))
            if self.stream.reduction_db > 0.0:
                self._metrics.limited(self.stream.reduction_db, len(block) / self.stream.sample_rate)
        last = self.stream.last(self.stream.fade_frames)
        self._sink.write(last)
        self._count(len(last))

    def _count(self, frames: int) -> None:
        """Count `frames` more in the sink, and its underruns since the last call."""
        self.frames += frames
        if frames:
            self._metrics.block_sent("play", frames)
        underruns = self._sink.underruns
        self._metrics.underran(underruns - self._underruns)
        self._underruns = underruns


def _make_folder(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise CannotRender(
            f"the folder for recordings cannot be made: {error.strerror or 'the system refuses it'}. Set "
            "RIDGEWAVE_FILE_FOLDER to a folder that can be written."
        ) from error
