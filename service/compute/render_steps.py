"""Computes a render, a plan, an analysis or a picture: one order in, messages out. Runs in `render_process`.

Model: `work` is a generator, so that it can be stopped between two steps, and wait between its price and its sound.
    The price of a render is its predicted processor time. It is measured from the first two pieces, which are part of
    the answer. A scene that is solved frame by frame, or simulated, may take many seconds per second of sound: its
    price comes from its plan, before the first piece.
    - A sound of up to `WHOLE_SAMPLES` is encoded and sent in one piece.
    - Longer WAV and raw sounds are sent piece by piece, because the header's sizes are known beforehand.
    - Longer FLAC is first written to an unnamed file, because its header holds sizes that are known at the end.
Limits: a price measured at the beginning is too low where a recording becomes more expensive later. Then only the
    bound of the process on processor seconds stops it.
"""

from __future__ import annotations

import json
import os
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import Any, BinaryIO, cast

import numpy as np

from service.compute.area_picture import area_of
from service.compute.picture_request import read_picture, scene_in_body
from service.engine import Engine, FiniteVoice, Limiter
from service.http.content_negotiation import choose_format
from service.http.sound_headers import describe, metadata_of
from service.problems import refused
from service.store.store import Store
from synth.encode.containers import closing
from synth.encode.formats import Block, SoundFormat, block_bytes, encode_all, media_type, open_writer, stream_header
from synth.errors import CannotRender, InvalidRequest
from synth.scene.scene import Scene, channel_count, parse_scene, scene_text
from synth.scene.text import object_from_text
from synth.voice.fades import reduction_warning

WHOLE_SAMPLES = 1 << 20  # 4 MB of float32, 22 s of mono at 48 kHz; held twice while it is encoded
PIECE_SAMPLES = 1 << 16  # 256 kB per write, about a millisecond of work
FILE_BYTES = 1 << 16  # read from a finished FLAC at a time
NO_FILE = (
    "a long FLAC needs a temporary file, and none can be made or written here: request WAV, or set TMPDIR to a folder "
    "that can be written."
)
CHEAP_SECONDS = 0.5  # of processor time; work below this sends no price


@dataclass(frozen=True)
class Order:
    """What to compute.

    kind: render, explain, analyze or picture.
    wanted, accept: of a render, the format in the query and the Accept header.
    max_duration: longest sound, in seconds.
    owner: of the imported textures that the scene may name.
    recording: of an analysis of a sound file: what the query says of it; None where the body is a scene.
    """

    kind: str
    wanted: str | None = None
    accept: str | None = None
    max_duration: float = float("inf")
    owner: str = ""
    recording: dict[str, Any] | None = None


@dataclass(frozen=True)
class Price:
    """What is still to be computed: processor time, and sound, both in seconds."""

    seconds: float
    sound: float


@dataclass(frozen=True)
class Answer:
    """The head of an HTTP answer.

    whole: its body is one message.
    voice_seconds: time to open the voice; None where no voice was opened.
    """

    headers: dict[str, str]
    media_type: str
    whole: bool
    voice_seconds: float | None = None


Message = Price | Answer | bytes | None
"""None means that there is nothing to send yet; the work may be stopped here."""


@dataclass
class Stages:
    """Times of the stages of one answer, in order, for Server-Timing."""

    lines: list[str] = field(default_factory=list)
    _began: float = field(default_factory=time.perf_counter)

    def done(self, name: str) -> float:
        """End the stage `name`, begin the next, and return the seconds of the first."""
        now = time.perf_counter()
        took, self._began = now - self._began, now
        self.lines.append(f"{name};dur={took * 1e3:.3f}")
        return took

    def header(self) -> str:
        """Return the value of Server-Timing."""
        return ", ".join(self.lines)


@dataclass
class Render:
    """One render under way."""

    voice: FiniteVoice
    blocks: Iterator[Block]  # those still to come; limited if the format holds integers
    limiter: Limiter | None
    scene: Scene
    sound_format: SoundFormat
    frames: int
    stages: Stages
    voice_seconds: float

    def answer(self, length: int, *, whole: bool = False) -> Answer:
        """Return the answer's head, with a warning if the limiter has reduced the level so far."""
        reduced = () if self.limiter is None else reduction_warning(self.limiter.take_reduction())
        sentences = " ".join([*self.voice.warnings, *reduced])
        warnings = " ".join(sentences.split()).encode("ascii", "replace").decode("ascii")
        extra = {"Ridgewave-Warning": warnings} if warnings else {}
        headers = describe(self.voice, self.sound_format) | {"Server-Timing": self.stages.header()} | extra
        return Answer(headers | {"Content-Length": str(length)}, self.media_type, whole, self.voice_seconds)

    @property
    def media_type(self) -> str:
        """Return the Content-Type; raises InvalidRequest for L16 above 48 kHz."""
        return media_type(self.sound_format, self.voice.sample_rate, self.voice.channels)


def work(engine: Engine, order: Order, body: bytes, store: Store) -> Iterator[Message]:
    """Yield the messages of `order` for the scene in `body`. Raises Problem and RidgewaveError.

    store: has the imported textures that the scene may name.
    """

    def scene_of(document: object) -> Scene:
        return parse_scene(store.owned(document, order.owner))

    if order.kind == "render":
        yield from _rendered(engine, order, lambda: scene_of(object_from_text(body)))
        return
    stages = Stages()
    if order.kind == "analyze" and order.recording is not None:
        document = _of_recording(engine, body, order.recording)
    elif order.kind == "picture":
        scene, points, phases, area = read_picture(body, scene_of)
        stages.done("scene")
        with scene_in_body():
            picture = engine.picture(scene, points, phases)
        document = picture | {"texture": picture["texture"] | area_of(scene, area)}
    else:
        scene = scene_of(object_from_text(body))
        stages.done("scene")
        document = engine.explain(scene) if order.kind == "explain" else engine.analyze(scene)
    stages.done(order.kind)
    encoded = json.dumps(document, ensure_ascii=False, allow_nan=False, separators=(",", ":")).encode()
    stages.done("encode")
    yield Answer({"Server-Timing": stages.header()}, "application/json", whole=True)
    yield encoded


def _of_recording(engine: Engine, body: bytes, told: dict[str, Any]) -> dict[str, Any]:
    """Return what is felt of the sound file in `body`. Faults name parameters of the query."""
    try:
        return engine.analyze_recording(body, **told)
    except InvalidRequest as error:
        named = {f"/{name}": f"?{name}" for name in ("quantity", "scale", "channel")}
        faults = [replace(fault, pointer=named.get(fault.pointer, fault.pointer)) for fault in error.faults]
        raise InvalidRequest(faults) from error


def check_duration(duration: float, longest: float, pointer: str, kind: str) -> None:
    """Raise Problem if `duration` exceeds `longest`, both in seconds."""
    if not duration <= longest:
        allowed = f"at most {longest:g} s (RIDGEWAVE_MAX_DURATION)"
        raise refused(pointer, f"{duration:g} s", allowed, "Render longer sounds with the command line.", kind)


def _rendered(engine: Engine, order: Order, read_scene: Callable[[], Scene]) -> Iterator[Message]:
    render = _opened(engine, order, read_scene)
    beginning: list[Block] = []
    yield from _priced(engine, render, beginning)
    if render.frames * render.voice.channels <= WHOLE_SAMPLES:
        yield from _whole(render, beginning)
    elif render.sound_format is SoundFormat.FLAC:
        yield from _flac(render, beginning)
    else:
        yield from _streamed(render, beginning)


def _opened(engine: Engine, order: Order, read_scene: Callable[[], Scene]) -> Render:
    stages = Stages()
    scene = read_scene()
    check_duration(scene.output.duration, order.max_duration, "/output/duration", "scene-refused")
    rate, channels = scene.output.sample_rate, channel_count(scene)
    sound_format = choose_format(order.wanted, order.accept, rate, channels)
    media_type(sound_format, rate, channels)
    stages.done("scene")
    voice = engine.open_voice(scene)
    voice_seconds = stages.done("voice")
    limiter = None if sound_format.is_float else engine.limiter(channels, rate)
    blocks = engine.blocks(voice, max(1, PIECE_SAMPLES // channels))
    if limiter is not None:
        blocks = limiter.limited(blocks)
    frames = round(scene.output.duration * rate)
    return Render(voice, blocks, limiter, scene, sound_format, frames, stages, voice_seconds)


def _priced(engine: Engine, render: Render, beginning: list[Block]) -> Iterator[Message]:
    """Yield the price if it is above CHEAP_SECONDS. Pieces that are rendered to measure it go into `beginning`."""
    planned = engine.planned_seconds(render.voice)
    if planned is not None:
        if planned > CHEAP_SECONDS:
            yield Price(planned, render.frames / render.voice.sample_rate)
        return
    times, done = [], 0
    for _ in range(2):
        began = time.thread_time()
        block = next(render.blocks, None)
        if block is None:
            return
        beginning.append(block)
        done += len(block)
        times.append((time.thread_time() - began) / max(1, len(block)))
        yield None
    left = render.frames - done
    seconds = min(times) * left
    if seconds > CHEAP_SECONDS:
        yield Price(seconds, left / render.voice.sample_rate)


def _blocks(render: Render, beginning: list[Block]) -> Iterator[Block]:
    while beginning:
        yield beginning.pop(0)
    yield from render.blocks


def _whole(render: Render, beginning: list[Block]) -> Iterator[Message]:
    parts = []
    for block in _blocks(render, beginning):
        parts.append(block)
        yield None
    block = parts[0] if len(parts) == 1 else np.concatenate(parts)
    render.stages.done("render")
    body = encode_all(
        block, render.sound_format, render.voice.sample_rate, metadata_of(render.voice, scene_text(render.scene))
    )
    render.stages.done("encode")
    yield render.answer(len(body), whole=True)
    yield body


def _streamed(render: Render, beginning: list[Block]) -> Iterator[Message]:
    voice, sound_format, metadata = (
        render.voice,
        render.sound_format,
        metadata_of(render.voice, scene_text(render.scene)),
    )
    samples = render.frames * voice.channels * sound_format.bytes_per_sample
    header = stream_header(sound_format, voice.sample_rate, voice.channels, metadata, render.frames)
    end = closing(sound_format, samples)
    render.limiter = None  # its reduction is not known before the head is sent
    yield render.answer(len(header) + samples + len(end))
    yield header
    for block in _blocks(render, beginning):
        yield block_bytes(block, sound_format)
    yield end


def _flac(render: Render, beginning: list[Block]) -> Iterator[Message]:
    """Yield a long FLAC, from a temporary file that is deleted with the answer."""
    with _temporary_file() as store:
        metadata = metadata_of(render.voice, scene_text(render.scene))
        with open_writer(store, SoundFormat.FLAC, render.voice.sample_rate, render.voice.channels, metadata) as writer:
            for block in _blocks(render, beginning):
                writer.write(block)
                yield None
        length = store.seek(0, os.SEEK_END)
        store.seek(0)
        render.stages.done("render")
        yield render.answer(length)
        while chunk := store.read(FILE_BYTES):
            yield chunk


@contextmanager
def _temporary_file() -> Iterator[BinaryIO]:
    """Yield a temporary file. Raises CannotRender where it cannot be made, or closed: closing writes what it holds."""
    try:
        with tempfile.TemporaryFile(prefix="ridgewave-") as file:
            yield cast(BinaryIO, file)
    except OSError as error:
        raise CannotRender(NO_FILE) from error
