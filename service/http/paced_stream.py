"""The stream of a session over HTTP, sent in real time to one reader.

Model: a header, then blocks at absolute deadlines, `lead` ahead of the clock (`sessions.pacer`). Every stream ends with
    a fade of 10 ms. A finite stream (`?duration=`) that ends early is filled with silence up to its promised length,
    as fast as the reader takes it.
Limits: one reader per session. The server holds one rendered block, the one that is being sent. It cannot reach sound
    in the reader's buffers.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncGenerator
from concurrent.futures import Executor

from service.operations.metrics import Metrics
from service.operations.settings import Settings
from service.sessions.pacer import Bell, Pacer
from service.sessions.voice_stream import VoiceStream, grace_seconds
from synth.encode.containers import closing
from synth.encode.formats import Block, SoundFormat, block_bytes
from synth.voice.fades import faded

SILENCE_BYTES = 1 << 16  # of one chunk of the silence that fills a finite stream


class Reader:
    """The reader of a session, from its request to the end of its answer."""

    def __init__(self, metrics: Metrics) -> None:
        self.stream: VoiceStream | None = None
        self.left = asyncio.Event()
        self._metrics = metrics
        self._bell = Bell()
        self._grace = grace_seconds(at_once=False)

    def end(self, *, at_once: bool = False) -> None:
        """Fade the stream out and end it."""
        if at_once:
            self._grace = grace_seconds(at_once=True)
        self._bell.ring()

    async def ended(self) -> float:
        """Wait until the stream is to end; return for how many seconds the reader may still take a block."""
        await self._bell.wait()
        return self._grace

    async def chunks(
        self,
        sound_format: SoundFormat,
        header: bytes,
        frames: int | None,
        settings: Settings,
        pool: Executor,
    ) -> AsyncGenerator[bytes, None]:
        """Yield the bytes of the answer, `header` first; frames: the length, None for an endless stream."""
        assert self.stream is not None
        channels, sent = self.stream.channels, 0
        yield header
        async for block in self._blocks(frames, settings, pool):
            sent += len(block)
            yield block_bytes(block, sound_format)
        if frames is not None:
            frame_bytes = channels * sound_format.bytes_per_sample
            for begin in range(sent * frame_bytes, frames * frame_bytes, SILENCE_BYTES):
                yield bytes(min(SILENCE_BYTES, frames * frame_bytes - begin))
            yield closing(sound_format, frames * frame_bytes)

    async def _blocks(self, frames: int | None, settings: Settings, pool: Executor) -> AsyncGenerator[Block, None]:
        """Yield each block when it is due; the last one fades out."""
        stream = self.stream
        assert stream is not None
        size = max(1, round(settings.stream_block * stream.sample_rate))
        most = (round(settings.max_stream * stream.sample_rate) if frames is None else frames) - stream.fade_frames
        pacer, sent = Pacer(stream.sample_rate, time.perf_counter(), lead=settings.lead), 0
        while not self._bell.rung and sent < most:
            count = min(size, most - sent)
            now = time.perf_counter()
            pacer.behind(now)  # restarts the clock if far behind
            await self._bell.sleep(pacer.due - now)
            if self._bell.rung:
                break
            block = await stream.rendered(stream.next_block, count, pool)
            if self._bell.rung:  # during the render: the block must not be sent at full level
                yield faded(block, stream.fade_frames)
                return
            self._count(block, stream, pacer.own_late(time.perf_counter()), pacer.take_skipped(own=True))
            sent += count
            pacer.advance(sent)
            pacer.writing(time.perf_counter())
            yield block
            pacer.written(time.perf_counter())
        last = stream.fade_frames if frames is None else min(stream.fade_frames, frames - sent)
        yield faded(await stream.rendered(stream.next_block, last, pool), last)

    def _count(self, block: Block, stream: VoiceStream, late: float, skipped: float) -> None:
        self._metrics.block_sent("http", len(block), late, skipped)
        if stream.reduction_db > 0.0:
            self._metrics.limited(stream.reduction_db, len(block) / stream.sample_rate)


def stream_length(sound_format: SoundFormat, header_bytes: int, channels: int, frames: int) -> int:
    """Return the number of bytes of a finite stream, with its header and its closing."""
    samples = frames * channels * sound_format.bytes_per_sample
    return header_bytes + samples + len(closing(sound_format, samples))
