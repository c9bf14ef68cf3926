"""Write a sound file block by block, with constant memory. The file has its name only when it is complete.

Stage: part of STAGE 4 (encode), its only part with state.
Model: a writer has an encoder and a place. The encoder is for WAV or raw (here) or FLAC (`synth.encode.flac`). The
    place is a path (`synth.encode.part_file`) or a binary stream that the caller owns. Blocks are encoded 65536 frames
    at a time, so an hour takes no more memory than a second. If the header of a WAV does not state the actual number
    of frames, it is written again at the end.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from pathlib import Path
from types import TracebackType
from typing import BinaryIO, Self

from synth.encode.containers import closing, opening
from synth.encode.flac import FlacEncoder
from synth.encode.part_file import PartFile, cannot_write
from synth.encode.samples import Block, SoundFormat, block_bytes
from synth.encode.sound_metadata import Metadata
from synth.errors import CannotRender

CHUNK_FRAMES = 65536  # frames encoded at a time: large enough to be fast, small enough to stay in the cache


class LentStream:
    """A binary stream that the caller owns, with the interface of a `PartFile`. It stays open.

    After a failure it keeps what was written so far.
    """

    def __init__(self, stream: BinaryIO) -> None:
        self.stream = stream
        name = getattr(stream, "name", None)  # a temporary file has its descriptor, a number, as name
        self.shown = name if isinstance(name, str) else "the sound"
        self.target = None

    def commit(self) -> None:
        """Flush the stream."""
        self.stream.flush()

    def discard(self) -> None:
        """Do nothing."""


class PcmEncoder:
    """Encodes WAV and raw formats: the opening of the container, the samples, and the closing (`containers`)."""

    def __init__(
        self,
        stream: BinaryIO,
        sound_format: SoundFormat,
        sample_rate: int,
        channels: int,
        metadata: Metadata | None,
        frames: int | None,
    ) -> None:
        """Write the header.

        frames: length of the sound; None for an endless header, which `finish` corrects if `stream` can seek.
        """
        self._stream, self._format, self._sample_rate = stream, sound_format, sample_rate
        self._channels, self._metadata = channels, metadata
        self._promised, self._frames = frames, 0
        self._seekable = stream.seekable()
        self._start = stream.tell() if self._seekable else 0
        self._header = self._header_for(frames)
        stream.write(self._header)

    def _header_for(self, frames: int | None) -> bytes:
        reserve = frames is not None or self._seekable
        return opening(self._format, self._sample_rate, self._channels, self._metadata, frames, reserve)

    def write(self, block: Block) -> None:
        """Write `block` [frames, channels]."""
        self._stream.write(block_bytes(block, self._format))
        self._frames += len(block)

    def finish(self) -> None:
        """Write the closing, and correct the number of frames in the header if it is wrong."""
        self._stream.write(closing(self._format, self._frames * self._channels * self._format.bytes_per_sample))
        if not self._header:
            return
        if not self._seekable:
            assert self._promised in (None, self._frames), f"{self._promised} frames promised, {self._frames} written"
            return
        header = self._header_for(self._frames)
        if header != self._header:
            assert len(header) == len(self._header), "a header keeps its length"
            end = self._stream.tell()
            self._stream.seek(self._start)
            self._stream.write(header)
            self._stream.seek(end)

    def discard(self) -> None:
        """Do nothing: the place discards what was written."""


class Writer:
    """A sound file that is being written. `write` blocks, then `close`; or `abort` to remove the file.

    As a context manager it closes on success and aborts on any exception. A failure of the file system raises
    CannotRender, removes the file and closes the writer.
    """

    def __init__(
        self,
        place: PartFile | LentStream,
        sound_format: SoundFormat,
        sample_rate: int,
        channels: int,
        metadata: Metadata | None,
        frames: int | None,
    ) -> None:
        """Use `open_writer` instead."""
        self._place = place
        self._channels = channels
        self._encoder: FlacEncoder | PcmEncoder | None = None
        self._open = True
        self.frames = 0
        with self._undone_on_failure():
            if sound_format is SoundFormat.FLAC:
                if not place.stream.seekable():
                    name = place.shown or place.target
                    raise CannotRender(f"cannot write FLAC to {name}: it cannot seek. Write a file, or WAV.")
                self._encoder = FlacEncoder(place.stream, sample_rate, channels, metadata)
            else:
                self._encoder = PcmEncoder(place.stream, sound_format, sample_rate, channels, metadata, frames)

    def write(self, block: Block) -> None:
        """Append `block`, float32 [frames, channels], of any number of frames, including none."""
        assert self._open and self._encoder is not None, "the writer is closed"
        assert block.ndim == 2 and block.shape[1] == self._channels, f"not [frames, {self._channels}]: {block.shape}"
        with self._undone_on_failure():
            for start in range(0, len(block), CHUNK_FRAMES):
                self._encoder.write(block[start : start + CHUNK_FRAMES])
        self.frames += len(block)

    def close(self) -> None:
        """Complete the file and give it its name. A second call does nothing."""
        if not self._open:
            return
        assert self._encoder is not None
        with self._undone_on_failure():
            self._encoder.finish()
            self._open = False
            self._place.commit()

    def abort(self) -> None:
        """Remove what was written, except from a stream of the caller. After `close`, do nothing."""
        if self._open:
            self._undo()

    def _undo(self) -> None:
        self._open = False
        if self._encoder is not None:
            self._encoder.discard()
        self._place.discard()

    @contextlib.contextmanager
    def _undone_on_failure(self) -> Iterator[None]:
        try:
            yield
        except OSError as error:
            self._undo()
            raise cannot_write(self._place.target, error, self._place.shown) from error
        except BaseException:
            self._undo()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if kind is None:
            self.close()
        else:
            self.abort()


def open_writer(
    target: str | Path | BinaryIO,
    sound_format: SoundFormat,
    sample_rate: int,
    channels: int,
    metadata: Metadata | None = None,
    *,
    frames: int | None = None,
    exclusive: bool = False,
    shown: str | None = None,
) -> Writer:
    """Return a writer to a path or a binary stream.

    target: a path, where the file appears when it is complete (`synth.encode.part_file`), or a stream, which stays
        open.
    frames: number of frames, if it is known. Without it, a WAV on a stream that cannot seek is endless.
    exclusive: whether to refuse a name that exists or is being written.
    shown: name of the file in errors; None for its path.
    Raises CannotRender if the target cannot be written, before anything is rendered.
    """
    if isinstance(target, str | Path):
        place: PartFile | LentStream = PartFile(Path(target), exclusive=exclusive, shown=shown)
    else:
        place = LentStream(target)
    return Writer(place, sound_format, sample_rate, channels, metadata, frames)
