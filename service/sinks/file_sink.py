"""The file sink: a recording in one folder and nowhere else, for the server and for tests in place of a device.

Model: NAME is `[A-Za-z0-9][A-Za-z0-9._-]*\\.(wav|flac)`, 200 characters at most: no separator, no parent, no hidden
    file. It is written as NAME.part, created only where that does not exist, and renamed when closed, so an
    unfinished recording is never taken for a finished one. A name that exists (a file, a folder, a link, even one
    that dangles) is refused: no request overwrites a recording, and no link leads out of the folder. WAV holds
    float32, FLAC 24 bit integers. Refusals call it file:NAME: whoever asks for it need not know where the folder is.
Limits: `realtime` sleeps so that a second of sound takes a second; the first write starts the clock.
"""

from __future__ import annotations

import re
import threading
import time
from pathlib import Path

from service.sinks.sink import WRITE_TIMEOUT_S
from synth.encode.formats import Block, Metadata, Writer, choose_format, open_writer
from synth.errors import CannotRender, Fault, InvalidRequest, shown

NAME_PATTERN = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]*\.(wav|flac)", re.ASCII)
NAME_LENGTH = 200  # characters; NAME.part stays below the 255 bytes of usual file systems


class FileSink:
    """Writes what it is given to NAME in `folder`."""

    underruns = device_underflows = dropped_frames = 0
    latency = 0.0

    def __init__(self, folder: Path, name: str, *, realtime: bool = False) -> None:
        """Raise InvalidRequest for a name that is not allowed. Nothing is touched before `start`."""
        if not isinstance(name, str) or len(name) > NAME_LENGTH or NAME_PATTERN.fullmatch(name) is None:
            allowed = f"letters, digits, '.', '_' and '-', first a letter or digit, at most {NAME_LENGTH} characters"
            hint = "Write a plain name that ends in .wav or .flac, such as file:stroke.wav."
            raise InvalidRequest([Fault("/device", shown(name), allowed, hint)])
        self.name = f"file:{name}"
        self.path = folder / name
        self.failure: str | None = None
        self._realtime = realtime
        self._writer: Writer | None = None
        self._lock = threading.Lock()  # `close` may come from another thread than `write`
        self._closed = threading.Event()
        self._began: float | None = None
        self._sample_rate = 1

    def start(self, sample_rate: int, channels: int, metadata: Metadata | None = None) -> None:
        """Reserve the name; raises CannotRender where it is taken or the folder cannot be written."""
        assert self._writer is None, "a sink starts once"
        self._sample_rate = sample_rate
        sound_format = choose_format(self.path)
        self._writer = open_writer(
            self.path, sound_format, sample_rate, channels, metadata, exclusive=True, shown=self.name
        )

    def write(self, block: Block, timeout: float = WRITE_TIMEOUT_S) -> None:
        """Append `block`; in real time, return when its last frame is due. `timeout` has no meaning for a file."""
        with self._lock:
            if self._closed.is_set() or self._writer is None:
                raise CannotRender(self.failure or f"{self.name} is closed.")
            try:
                self._writer.write(block)
            except CannotRender as error:
                self.failure = error.reason
                self._closed.set()
                raise
            frames = self._writer.frames
        if self._realtime:
            self._began = time.perf_counter() if self._began is None else self._began
            self._closed.wait(max(0.0, self._began + frames / self._sample_rate - time.perf_counter()))

    def stop(self) -> None:
        """Complete the file with what was written so far."""
        self.close()

    def close(self) -> None:
        """Complete the file; where that fails nothing is left and `failure` says why."""
        self._closed.set()
        with self._lock:
            if self._writer is None or self.failure is not None:
                return
            try:
                self._writer.close()
            except CannotRender as error:
                self.failure = error.reason

    def discard(self) -> None:
        """Leave nothing of the recording, unless it is complete already."""
        self._closed.set()
        with self._lock:
            if self._writer is not None:
                self._writer.abort()
