"""The file sink: recordings in one folder.

Model: NAME is `[A-Za-z0-9][A-Za-z0-9._-]*\\.(wav|flac)`, at most 200 characters: no separator, no parent folder, no
    hidden file. The sink writes NAME.part, which must not exist before, and renames it when it is closed, so that an
    unfinished recording is never taken for a finished one. An existing NAME (a file, a folder, a link, even a dangling
    link) is refused: no request overwrites a recording, and no link leads out of the folder. WAV holds float32, FLAC
    24 bit integers. Refusals name file:NAME, not the folder, which clients need not know.
Limits: with `realtime`, `write` waits so that a second of sound takes a second. The clock starts with the first write.
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
NAME_LENGTH = 200  # characters; NAME.part must stay below the 255 bytes of usual file systems


class FileSink:
    """Writes blocks to NAME in `folder`."""

    underruns = device_underflows = dropped_frames = 0
    latency = 0.0

    def __init__(self, folder: Path, name: str, *, realtime: bool = False) -> None:
        """Raise InvalidRequest for an invalid name. Nothing is created before `start`."""
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
        """Create the file. Raises CannotRender if the name is taken or the folder cannot be written."""
        assert self._writer is None, "a sink starts once"
        self._sample_rate = sample_rate
        sound_format = choose_format(self.path)
        self._writer = open_writer(
            self.path, sound_format, sample_rate, channels, metadata, exclusive=True, shown=self.name
        )

    def write(self, block: Block, timeout: float = WRITE_TIMEOUT_S) -> None:
        """Append `block`; with `realtime`, return when its last frame is due. `timeout` is ignored."""
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
        """Complete the file. If that fails, no file is left and `failure` reports why."""
        self._closed.set()
        with self._lock:
            if self._writer is None or self.failure is not None:
                return
            try:
                self._writer.close()
            except CannotRender as error:
                self.failure = error.reason
