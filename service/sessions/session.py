"""A session: its scene, voices, owner, changes and end.

Model: there are two kinds. An HTTP session opens a new voice at frame 0 for each reader and each play. A live session
    has one voice, which follows a hand and outlives its connection. A change of scene reaches every playing voice.
    Rate, channels, quantities and full scale are fixed (`fixed_output`). Access needs the id, which has 128 random
    bits, and the key that opened the session.
Limits: an HTTP stream begins at frame 0 of the scene, not where an earlier one ended.
"""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

from service.compute.threads import Solves
from service.engine import Engine
from service.operations.metrics import Metrics
from service.operations.settings import Settings
from service.problems import Problem
from service.sessions.fixed_output import changed_scene
from service.sessions.scene_changes import WAITING_BYTES, Changes, Waiting, merged
from service.sessions.voice_stream import Kind, VoiceStream
from service.sinks.player import Player
from synth.errors import RidgewaveError
from synth.held_memory import Held
from synth.scene.scene import Scene, scene_text
from synth.scene.text import json_text, object_from_text

log = logging.getLogger("ridgewave.service")


class StreamReader(Protocol):
    """The reader of an HTTP session."""

    stream: VoiceStream | None
    left: asyncio.Event
    """Set at the end of the response."""

    def end(self, *, at_once: bool = False) -> None:
        """Fade out and end. at_once: cut off a reader that does not read for 10 ms."""


class Peer(Protocol):
    """A live connection."""

    @property
    def owner(self) -> int | None:
        """Return the number of its key, None without keys."""

    @property
    def ending(self) -> bool:
        """Return whether the stream fades out or has ended."""

    @property
    def client(self) -> str:
        """Return the name under which the client's work is limited."""

    def check(self, now: float) -> None:
        """End or warn the connection if it is too late by the clock."""

    def refuse(self, problem: RidgewaveError | Problem) -> None:
        """Report a problem; the stream continues."""

    def failed(self) -> None:
        """End because of the exception that is being handled, a mistake of the service."""

    def displaced(self) -> None:
        """End, because another connection has taken over the session."""

    def end(self, reason: str, *, at_once: bool = False) -> None:
        """Fade out and end. at_once: cut off a client that does not read for 10 ms."""


@dataclass(frozen=True, slots=True)
class Owner:
    """Who opens a session. client: name under which the work is limited. key: number of the key, None without keys."""

    client: str
    key: int | None


def text_to_keep(scene: Scene, kind: Kind) -> bytes:
    """Return the JSON of `scene` for the answers of an HTTP session; a live session has none. Slow."""
    return scene_text(scene) if kind == "http" else b""


class Session:
    """One session. Its methods run in the event loop and pass slow work to `solver`."""

    def __init__(
        self,
        name: str,
        owner: Owner,
        scene: Scene,
        scene_text: bytes,
        stream: VoiceStream,
        engine: Engine,
        solver: Solves,
        metrics: Metrics,
        named: Callable[[Any], Any],
        require_room: Callable[..., None],
    ) -> None:
        """Make a session.

        scene_text: JSON of the scene of an HTTP session.
        stream: the voice of a live session; in an HTTP session, the voice for the first listener.
        named: replaces the name of an imported texture in a partial scene.
        require_room: raises Problem (full) if all sessions, with the streams that it is given, take too much memory.
        """
        self._named, self._require_room = named, require_room
        self.id, self.owner, self.kind = name, owner.key, stream.kind
        self.scene, self.scene_text = scene, scene_text
        self.stream: VoiceStream | None = stream
        self.sample_rate, self.channels = stream.sample_rate, stream.channels
        self.full_scale, self.quantities = tuple(stream.voice.full_scale), tuple(stream.voice.quantities)
        self.reader: StreamReader | None = None
        self.player: Player | None = None
        self.peer: Peer | None = None
        self.ended = False
        self.touched = time.monotonic()
        self._engine, self._solver, self._metrics, self._client = engine, solver, metrics, owner.client
        self._lock = asyncio.Lock()  # no voice is opened during a change of scene
        self._changes = Changes(self._apply)

    @property
    def active(self) -> bool:
        """Return whether the session has a reader, a play or a connection."""
        playing = self.player is not None and self.player.playing
        return playing or self.reader is not None or self.peer is not None

    @property
    def held(self) -> list[Held]:
        """Return the memory of its voices."""
        return [held for stream in {self.stream, *self.streams} if stream is not None for held in stream.held]

    @property
    def streams(self) -> list[VoiceStream]:
        """Return the voices that play, or that may play again after a resume."""
        if self.kind == "live":
            return [] if self.stream is None else [self.stream]
        playing = self.player if self.player is not None and self.player.playing else None
        return [holder.stream for holder in (self.reader, playing) if holder is not None and holder.stream is not None]

    def touch(self) -> None:
        """Restart the idle time."""
        self.touched = time.monotonic()

    def expires_in(self, idle: float) -> float | None:
        """Return the seconds until the session expires, None while it is active."""
        return None if self.active else max(0.0, self.touched + idle - time.monotonic())

    async def open_stream(self) -> VoiceStream:
        """Return a new voice of an HTTP session, at frame 0."""
        async with self._lock:
            stream, self.stream = self.stream, None
            if stream is None:
                stream = await self._solver.run(self._client, self._open, self.scene)
                self._require_room(stream)
        if self.ended:
            raise Problem("not-found", "The session has ended.")
        return stream

    async def change(self, body: bytes) -> None:
        """Merge the partial scene in `body`; every voice cross-fades to the result from its next block on.

        Raises SceneError for an invalid scene, Problem (fixed) for a scene that changes a fixed value. Then nothing
        has changed.
        """
        settled: asyncio.Future[None] = asyncio.get_running_loop().create_future()

        def settle(error: Exception | None) -> None:
            """Wake the caller of `change`, with `error` if the change was refused."""
            if settled.done():
                return
            if error is None:
                settled.set_result(None)
            else:
                settled.set_exception(error)

        self._changes.add(Waiting(lambda: object_from_text(body), len(body), settle))
        await settled

    def change_live(self, patch: Mapping[str, Any], size: int) -> None:
        """Do the same for a live session. size: of the text of `patch`, in bytes. The connection reports a refusal."""
        self._changes.add(Waiting(lambda: patch, size, self._tell_peer))

    def has_too_many_changes(self, size: int) -> bool:
        """Return whether so many changes wait that one more of `size` bytes could displace one."""
        return self._changes.waiting_bytes > max(0, WAITING_BYTES - size)

    def detach(self, peer: Peer) -> None:
        """Release the session from `peer`, whose connection broke, and drop its waiting changes."""
        if self.peer is peer:
            self.peer = None
            self.touch()
            self._changes.drop()

    def end(self, reason: str = "stopped", *, at_once: bool = False) -> None:
        """Fade out and end everything that plays. at_once: a device drops its buffered samples."""
        self.ended = True
        if self.kind == "live":
            self._changes.drop()  # no caller waits for an answer
        if self.reader is not None:
            self.reader.end(at_once=at_once)
        if self.player is not None:
            self.player.end(at_once=at_once)
        if self.peer is not None:
            self.peer.end(reason, at_once=at_once)

    def document(self, settings: Settings) -> bytes:
        """Return the answer of `GET /v1/sessions/{id}`, JSON. The part of the scene is kept: it may have a megabyte."""
        rest = {
            "sample_rate": self.sample_rate,
            "channels": self.channels,
            "quantities": list(self.quantities),
            "full_scale": list(self.full_scale),
            "streaming": self.reader is not None,
            "play": None if self.player is None else self.player.document(),
            "expires_in": self.expires_in(settings.session_idle),
            "heard_within": settings.lead + settings.stream_block + self._engine.live_delay,
            "stream": f"{settings.root_path}/v1/sessions/{self.id}/stream",
        }
        return b"".join((json_text({"id": self.id})[:-1], b',"scene":', self.scene_text, b",", json_text(rest)[1:]))

    async def _apply(self, batch: Sequence[Waiting]) -> None:
        """Solve all of `batch` and pass the result to the voices, or keep it for the next voice."""
        async with self._lock:
            streams = self.streams

            def change(scene: Scene, patch: Mapping[str, object]) -> Scene:
                """Return `scene` with `patch` merged into it."""
                return changed_scene(scene, self._named(patch), self.full_scale)

            def prepare(scene: Scene) -> tuple[bytes, list[Any]]:
                """Return the JSON to keep, and what each stream needs for `scene`; without one, a voice to keep."""
                text = text_to_keep(scene, self.kind)
                if not streams:
                    return text, [self._open(scene)]
                return text, [self._metrics.timed("change", stream.prepare, scene) for stream in streams]

            made = await self._solver.run(self._client, merged, self.scene, batch, change, prepare)
            full = None if made.coming is None else self._no_room(streams, made.coming[1][1])
            if made.coming is not None and full is None:
                self.scene, (self.scene_text, prepared) = made.coming
                if not streams:
                    self.stream = prepared[0]
                elif self.kind == "http":
                    self.stream = None
                for stream, coming in zip(streams, prepared, strict=False):
                    stream.change(coming)
        for place, one in enumerate(batch):
            one.settle(made.refused.get(place) or full)

    def _no_room(self, streams: Sequence[VoiceStream], prepared: Sequence[Any]) -> Problem | None:
        """Return why `streams` may not take the changes in `prepared`, which they then forget; None if they may.

        prepared: without a stream the new voice.
        """
        try:
            self._require_room(*([] if streams else prepared))
        except Problem as full:
            for stream in streams:
                stream.refuse_change()
            return full
        return None

    def _open(self, scene: Scene) -> VoiceStream:
        return VoiceStream(self._metrics.timed("voice", self._engine.open_live, scene))

    def _tell_peer(self, error: Exception | None) -> None:
        if error is None:
            return
        refused = isinstance(error, RidgewaveError | Problem)
        if self.peer is None:
            if not refused:
                log.error("our mistake: a change of a live session whose connection is gone", exc_info=error)
        elif isinstance(error, RidgewaveError | Problem):
            self.peer.refuse(error)
        elif not self.peer.ending:
            self.peer.failed()
