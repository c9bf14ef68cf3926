"""Finite renders: a scene's text in, an answer with exact sizes out.

Model: all that computes runs in one pool of threads, whose work releases the GIL, so streams keep their deadlines.
    - Up to `WHOLE_SAMPLES` the sound is rendered and encoded in one hop to a thread and sent in one piece.
    - Longer, WAV and raw are sent piece by piece as they are rendered: the header's sizes are known before the samples.
    - Longer FLAC is written to a file without a name first, since its header counts bytes that only the end knows.
Limits: a render that fails after its header was sent ends the connection early, which Content-Length lets a reader see.
"""

from __future__ import annotations

import asyncio
import os
import tempfile
import time
from collections.abc import AsyncGenerator, Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import Any, TypeVar

import numpy as np
from starlette.responses import Response

from service.engine import Engine, FiniteVoice, Limiter
from service.metrics import Metrics
from service.negotiation import choose_format
from service.problems import Problem, refused
from service.pumping import PumpedResponse
from service.settings import Settings
from service.sound import describe, metadata_of
from synth.encode import Block, SoundFormat, encode_all, media_type, open_writer, stream_block
from synth.output import reduction_warning
from synth.riff import padding, wav_header
from synth.scene import Scene, channel_count, parse_scene_text

WHOLE_SAMPLES = 1 << 20  # 4 MB of float32, 22 s of mono at 48 kHz: some 20 ms of work, small enough to hold twice
PIECE_SAMPLES = 1 << 16  # of a long render: 256 kB a write, about a millisecond of work
FILE_BYTES = 1 << 16  # read at a time of a finished FLAC

Result = TypeVar("Result")


@dataclass
class Stages:
    """Times of the stages of one answer, for Server-Timing, in the order they ran."""

    lines: list[str] = field(default_factory=list)
    _began: float = field(default_factory=time.perf_counter)

    def done(self, name: str) -> None:
        """End the stage `name`; the next one begins."""
        now = time.perf_counter()
        self.lines.append(f"{name};dur={(now - self._began) * 1e3:.3f}")
        self._began = now

    def header(self) -> str:
        """Return the value of Server-Timing."""
        return ", ".join(self.lines)


@dataclass
class Render:
    """One render under way: the blocks that are still to come, and what the answer will look like."""

    voice: FiniteVoice
    blocks: Iterator[Block]  # limited where the format holds integers
    limiter: Limiter | None
    scene: Scene
    sound_format: SoundFormat
    frames: int
    stages: Stages

    def piece(self) -> bytes:
        """Return the bytes of the next block, b"" after the last."""
        block = next(self.blocks, None)
        return b"" if block is None else stream_block(block, self.sound_format)

    def headers(self) -> dict[str, str]:
        """Return the answer's headers but for its length; they tell of the limiter what it has done so far."""
        turned_down = () if self.limiter is None else reduction_warning(self.limiter.take_reduction())
        sentences = " ".join([*self.voice.warnings, *turned_down])
        warnings = " ".join(sentences.split()).encode("ascii", "replace").decode("ascii")
        extra = {"Ridgewave-Warning": warnings} if warnings else {}
        return describe(self.voice, self.sound_format) | {"Server-Timing": self.stages.header()} | extra

    @property
    def media_type(self) -> str:
        """Return the Content-Type; raises AskedWrong for L16 above 48 kHz."""
        return media_type(self.sound_format, self.voice.sample_rate, self.voice.channels)


class Renders:
    """The renders of one process, as many at a time as the settings allow."""

    def __init__(self, engine: Engine, settings: Settings, metrics: Metrics) -> None:
        self._engine = engine
        self._settings = settings
        self._metrics = metrics
        self.under_way = 0
        self.pool = ThreadPoolExecutor(max(2, os.cpu_count() or 2), thread_name_prefix="render")

    def close(self) -> None:
        """Let the threads end; work that has not begun is dropped."""
        self.pool.shutdown(wait=False, cancel_futures=True)

    async def run(self, work: Callable[..., Result], *arguments: Any) -> Result:
        """Return what `work` returns, in a thread, within the number of renders that is allowed."""
        self._enter()
        try:
            return await asyncio.get_running_loop().run_in_executor(self.pool, work, *arguments)
        finally:
            self._leave()

    async def answer(self, body: bytes, wanted: str | None, accept: str | None) -> Response:
        """Return the sound of the scene that `body` describes, in the format that was asked for."""
        made = await self.run(self._make, body, wanted, accept)
        if isinstance(made, Response):
            return made
        headers = made.headers() | {"Content-Length": str(_length(made))}
        kind = made.media_type
        self._enter()
        return PumpedResponse(self._pieces(made), headers, kind, released=self._leave)

    def explain(self, body: bytes) -> dict[str, Any]:
        """Return the plan of the scene that `body` describes; for a thread."""
        return self._engine.explain(parse_scene_text(body))

    def _enter(self) -> None:
        if self.under_way >= self._settings.max_renders:
            raise Problem("full", "Too many renders at one time.", headers={"Retry-After": "1"})
        self.under_way += 1

    def _leave(self) -> None:
        self.under_way -= 1

    def _make(self, body: bytes, wanted: str | None, accept: str | None) -> Response | Render:
        """Return the answer where it is short or FLAC, else the render from whose pieces it will be made."""
        render = self._open(body, wanted, accept)
        if render.frames * render.voice.channels <= WHOLE_SAMPLES:
            return _whole(render)
        return _flac(render) if render.sound_format is SoundFormat.FLAC else render

    def _open(self, body: bytes, wanted: str | None, accept: str | None) -> Render:
        stages = Stages()
        scene = parse_scene_text(body)
        check_duration(scene.output.duration, self._settings.max_duration, "/output/duration", "scene-refused")
        rate, channels = scene.output.sample_rate, channel_count(scene)
        sound_format = choose_format(wanted, accept, rate, channels)
        media_type(sound_format, rate, channels)
        stages.done("scene")
        voice = self._metrics.timed("voice", self._engine.open_voice, scene)
        stages.done("voice")
        limiter = None if sound_format.is_float else self._engine.limiter(channels, rate)
        self._metrics.render_began()
        frames = round(scene.output.duration * rate)
        whole = frames * channels <= WHOLE_SAMPLES
        blocks = self._engine.blocks(voice, frames if whole else max(1, PIECE_SAMPLES // channels))
        if limiter is not None:
            blocks = limiter.limited(blocks)
        return Render(voice, blocks, limiter, scene, sound_format, frames, stages)

    async def _pieces(self, render: Render) -> AsyncGenerator[bytes, None]:
        loop = asyncio.get_running_loop()
        yield _header(render)
        while piece := await loop.run_in_executor(self.pool, render.piece):
            yield piece
        yield _padding(render)


def check_duration(duration: float, longest: float, pointer: str, kind: str) -> None:
    """Raise Problem where `duration` (s) is beyond what the service sends."""
    if not duration <= longest:
        allowed = f"at most {longest:g} s (RIDGEWAVE_MAX_DURATION)"
        raise refused(pointer, f"{duration:g} s", allowed, "Render longer sounds with the command line.", kind)


def _whole(render: Render) -> Response:
    parts = list(render.blocks)
    block = parts[0] if len(parts) == 1 else np.concatenate(parts)
    render.stages.done("render")
    body = encode_all(block, render.sound_format, render.voice.sample_rate, metadata_of(render.voice, render.scene))
    render.stages.done("encode")
    return Response(body, 200, render.headers(), media_type=render.media_type)


def _flac(render: Render) -> Response:
    """Return a long FLAC, written to a file that vanishes with the answer."""
    store = tempfile.TemporaryFile(prefix="ridgewave-")  # noqa: SIM115 - closed when the answer is over
    try:
        metadata = metadata_of(render.voice, render.scene)
        with open_writer(store, SoundFormat.FLAC, render.voice.sample_rate, render.voice.channels, metadata) as writer:
            for block in render.blocks:
                writer.write(block)
        length = store.seek(0, os.SEEK_END)
        store.seek(0)
    except BaseException:
        store.close()
        raise
    render.stages.done("render")

    async def chunks() -> AsyncGenerator[bytes, None]:
        while chunk := store.read(FILE_BYTES):
            yield chunk

    headers = render.headers() | {"Content-Length": str(length)}
    return PumpedResponse(chunks(), headers, render.media_type, released=store.close)


def _sample_bytes(render: Render) -> int:
    return render.frames * render.voice.channels * render.sound_format.bytes_per_sample


def _header(render: Render) -> bytes:
    if render.sound_format.container == "raw":
        return b""
    metadata = metadata_of(render.voice, render.scene)
    return wav_header(render.sound_format, render.voice.sample_rate, render.voice.channels, metadata, render.frames)


def _padding(render: Render) -> bytes:
    return b"" if render.sound_format.container == "raw" else padding(_sample_bytes(render))


def _length(render: Render) -> int:
    return len(_header(render)) + _sample_bytes(render) + len(_padding(render))
