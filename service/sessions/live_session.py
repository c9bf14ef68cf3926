"""The live sessions of one process: opened, resumed, taken over, expired, stopped; and their recordings.

Model: a session is a stream and whoever is connected to it. One whose connection broke is kept for RIDGEWAVE_RESUME,
    not rendering; a second connection to one that looks alive takes it over, since half-open connections look alive.
Limits: a session lives in one process: of several workers only the one that has it resumes it, or has its recording.
    A recording is kept for RIDGEWAVE_SESSION_IDLE after its session's end. A session, and its recording, belong to the
    key that opened it: to another key they are not there.
"""

from __future__ import annotations

import asyncio
import json
import logging
import time
from collections.abc import Callable, Coroutine, Sequence
from concurrent.futures import Executor
from functools import partial
from typing import Any, NamedTuple, Protocol

from service.compute.threads import Solves, ThreadWork
from service.engine import Engine
from service.live.block_timer import Ticker
from service.live.changes import as_problem, open_stream, prepare_change
from service.live.live_stream import Options, Stream
from service.operations.metrics import Metrics
from service.operations.settings import Settings
from service.problems import Problem
from service.sessions.scene_changes import Changes, Waiting
from service.sessions.session_ids import new_id, not_found
from synth.errors import RidgewaveError

log = logging.getLogger("ridgewave.service")

WATCH_SECONDS = 0.05  # between two looks at what only time tells: late hellos, slow readers, expiry
EXPIRED_AT_A_TIME = 4  # a look: a hundred whose network broke at once would make those who play late by 30 ms
PER_SESSION = 2  # connections a session: one, and one that takes it over


class Peer(Protocol):
    """A connection, as the sessions see it."""

    @property
    def owner(self) -> int | None:
        """Return the number of its key, None where no keys are set."""

    @property
    def ending(self) -> bool:
        """Return whether its stream fades out or has ended."""

    @property
    def client(self) -> str:
        """Return whom its work is counted for."""

    def check(self, now: float) -> None:
        """Look at what only time tells."""

    def refuse(self, problem: Problem) -> None:
        """Tell of a problem that leaves the stream going."""

    def failed(self) -> None:
        """End, because of the exception that is being handled: our mistake."""

    def displaced(self) -> None:
        """End: another connection has the session now."""

    def end(self, reason: str, *, at_once: bool = False) -> None:
        """Fade out and end; at_once: a peer that does not read gets 10 ms."""


class Recording(NamedTuple):
    """The recording of a session that has ended: whose it is, until when it is kept, and its JSON once it is made."""

    owner: int | None
    until: float
    made: asyncio.Future[bytes]


class LiveSession:
    """One session; its methods run in the event loop."""

    def __init__(self, stream: Stream, peer: Peer, metrics: Metrics, solves: Solves) -> None:
        self.stream, self._metrics, self._solves, self._client = stream, metrics, solves, peer.client
        self.owner = peer.owner
        self.peer: Peer | None = peer
        self.detached_at: float | None = None
        self.turn = asyncio.Lock()  # held while a thread renders
        self._changes = Changes(self._apply)

    async def render(self, frames: int, pool: Executor) -> bytes:
        """Return the PCM of the next block, rendered here while the voice is quick and in `pool` while it is not."""
        stream = self.stream
        async with self.turn:
            return await stream.quickness.rendered(stream.render, frames, pool)

    @property
    def ready(self) -> bool:
        """Return whether `render_now` may be called: the voice is quick, and nobody else is at it."""
        return self.stream.quickness.quick and not self.turn.locked()

    def render_now(self, frames: int) -> bytes:
        """Do as `render`, in the event loop; only where it is `ready`."""
        return self.stream.quickness.rendered_here(self.stream.render, frames)

    def change(self, patch: dict[str, Any], size: int) -> None:
        """Have the scene changed by `patch`, of so many bytes, together with those that wait already."""
        self._changes.add(Waiting(lambda: patch, size, self._settle))

    def drop_changes(self) -> None:
        """Forget the changes that wait: the connection that sent them has gone."""
        self._changes.drop()

    def _settle(self, error: Exception | None) -> None:
        if isinstance(error, RidgewaveError | Problem) and self.peer is not None:
            self.peer.refuse(as_problem(error))

    async def _apply(self, batch: Sequence[Waiting]) -> None:
        try:
            made, seconds = await self._solves.run(self._client, prepare_change, self.stream, batch)
        except Exception:
            if self.peer is not None:
                self.peer.failed()
            else:
                log.exception("our mistake: a change of a live session whose connection is gone")
            return
        if made.coming is not None:
            self.stream.scene, self.stream.coming = made.coming[0], made.coming
            self._metrics.built("change", seconds)
        for place, one in enumerate(batch):
            one.settle(made.refused.get(place))


class LiveSessions:
    """The live sessions of one process."""

    def __init__(
        self,
        engine: Engine,
        settings: Settings,
        solves: Solves,
        blocks: Executor,
        metrics: Metrics | None = None,
    ) -> None:
        self.settings, self.solves, self.blocks = settings, solves, blocks
        self.metrics = metrics or Metrics()
        self.ticker = Ticker()
        self._engine = engine
        self._peers: set[Peer] = set()
        self._sessions: dict[str, LiveSession] = {}
        self._recordings: dict[str, Recording] = {}
        self._opening = 0
        self._closed = False
        self._tasks: set[asyncio.Task[None]] = set()

    def __len__(self) -> int:
        return len(self._sessions)

    @property
    def connected(self) -> int:
        """Return how many sessions have a connection."""
        return sum(session.peer is not None for session in self._sessions.values())

    @property
    def used_bytes(self) -> int:
        """Return the memory of all sessions beside their voices, and of the recordings that are kept."""
        kept = [entry.made.result() for entry in self._recordings.values() if _is_made(entry)]
        return sum(session.stream.used_bytes for session in self._sessions.values()) + sum(map(len, kept))

    # Connections

    def admit(self) -> None:
        """Raise Problem where one more connection is too many."""
        if self._closed:
            raise Problem("closing", "The service is shutting down.")
        if len(self._peers) >= PER_SESSION * self.settings.max_sessions:
            raise Problem("full", "As many live connections as there may be.", headers={"Retry-After": "1"})

    def enter(self, peer: Peer) -> None:
        """Look after `peer` until `leave`."""
        self._peers.add(peer)

    def leave(self, peer: Peer) -> None:
        """Forget `peer`."""
        self._peers.discard(peer)

    # Sessions

    async def open(self, document: dict[str, Any], options: Options, peer: Peer) -> LiveSession:
        """Return a new session of `peer`; raises Problem (full, closing), SceneError, CannotRender."""
        if self._closed:
            raise Problem("closing", "The service is shutting down.")
        if len(self._sessions) + self._opening >= self.settings.max_sessions:
            raise Problem("full", "As many live sessions as there may be (RIDGEWAVE_MAX_SESSIONS).")
        self._opening += 1
        name, silence = new_id(self.settings.node), self.settings.max_silence
        try:
            opening = (open_stream, self._engine, name, document, options, silence)
            stream = await self.solves.run(peer.client, self.metrics.timed, "voice", *opening)
        finally:
            self._opening -= 1
        if not self._has_room(stream.used_bytes):
            sentence = f"The memory for live sessions (RIDGEWAVE_LIVE_BYTES) has no {stream.used_bytes} bytes left."
            raise Problem("full", sentence)
        session = self._sessions[name] = LiveSession(stream, peer, self.metrics, self.solves)
        return session

    async def resume(self, name: str, frame: int, peer: Peer) -> LiveSession:
        """Return the session of that id, taken from whoever is connected to it.

        Raises Problem (not-found) where there is none that the peer's key opened, or it does not keep `frame` any more.
        """
        session = self._sessions.get(name)
        ending = session is not None and session.peer is not None and session.peer.ending
        if session is None or session.owner != peer.owner or ending:
            sentence = "No such session: it has ended, expired or was stopped, or was never there."
            raise not_found(name, sentence, self.settings)
        session.stream.require_kept(frame)
        earlier, session.peer, session.detached_at = session.peer, peer, None
        if earlier is not None:
            earlier.displaced()
        async with session.turn:  # the block that a thread renders for the earlier connection
            return session

    def detach(self, session: LiveSession, peer: Peer) -> None:
        """Keep `session`, whose connection `peer` broke, for a while."""
        if session.peer is peer:
            session.peer, session.detached_at = None, time.monotonic()
            session.drop_changes()

    def finish(self, session: LiveSession) -> None:
        """Forget `session`, which has ended; its recording stays for a while."""
        if self._sessions.pop(session.stream.name, None) is None:
            return
        session.drop_changes()
        session.stream.tell_counts(self.metrics, ended=True)
        recorded: asyncio.Future[bytes] | None = None
        if session.stream.options.record:
            recorded = asyncio.get_running_loop().create_future()
            until = time.monotonic() + self.settings.session_idle
            self._recordings[session.stream.name] = Recording(session.owner, until, recorded)
        self._start(self._let_go(session, recorded))

    async def recording(self, name: str, owner: int | None) -> bytes:
        """Return the JSON of a session's recording; raises Problem (not-found), also for another's session."""
        session = self._sessions.get(name)
        if session is not None and session.owner == owner and session.stream.options.record:
            made: bytes = await self._in_thread(_recording, session.stream)
            return made
        kept = self._recordings.get(name)
        if kept is None or kept.owner != owner:
            sentence = "No recording: the live session did not ask for one, or ended long ago."
            raise not_found(name, sentence, self.settings)
        return await asyncio.shield(kept.made)

    def end_all(self, reason: str, *, at_once: bool = False) -> dict[str, int]:
        """End every session; return how many there were, and how many of them were connected."""
        counts = {"sessions": len(self), "streams": self.connected}
        for peer in list(self._peers):
            peer.end(reason, at_once=at_once)
        for session in list(self._sessions.values()):
            if session.peer is None:
                self.finish(session)
        return counts

    def close(self) -> None:
        """End everything for good."""
        self._closed = True
        self.end_all("shutting down")

    async def settle(self, seconds: float) -> None:
        """Return once what has ended is let go of, or after so long."""
        if self._tasks:
            await asyncio.wait(self._tasks, timeout=seconds)

    async def watch(self) -> None:
        """Look at what only time tells, until cancelled."""
        while True:
            await asyncio.sleep(WATCH_SECONDS)
            now, wall = time.perf_counter(), time.monotonic()
            for peer in list(self._peers):
                peer.check(now)
            for session in self._sessions.values():
                session.stream.tell_counts(self.metrics)
            self._expire(wall)

    def _expire(self, now: float) -> None:
        over = [
            session
            for session in self._sessions.values()
            if session.detached_at is not None and now - session.detached_at > self.settings.resume
        ]
        for session in over[:EXPIRED_AT_A_TIME]:
            self.finish(session)
        for name, kept in list(self._recordings.items()):
            if now > kept.until:
                del self._recordings[name]
        if not self._has_room(0):
            for session in self._sessions.values():
                session.stream.voice.end_recording()

    def _has_room(self, more: int) -> bool:
        """Return whether so many bytes more may be used, once the oldest recordings are forgotten where need be."""
        excess = self.used_bytes + more - self.settings.live_bytes
        for name in [name for name, kept in self._recordings.items() if _is_made(kept)]:
            if excess > 0:
                excess -= len(self._recordings.pop(name).made.result())
        return excess <= 0

    async def _let_go(self, session: LiveSession, recorded: asyncio.Future[bytes] | None) -> None:
        async with session.turn:
            try:
                if recorded is not None:
                    recorded.set_result(await self._in_thread(_recording, session.stream))
            except Exception:
                log.exception("our mistake: a live session that has ended")
            finally:
                if recorded is not None and not recorded.done():
                    recorded.cancel()
                    self._recordings.pop(session.stream.name, None)

    def _start(self, work: Coroutine[Any, Any, None]) -> None:
        task = asyncio.get_running_loop().create_task(work)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    async def _in_thread(self, work: Callable[..., Any], *arguments: Any) -> Any:
        return await ThreadWork(partial(work, *arguments), "live").done


def _is_made(kept: Recording) -> bool:
    return kept.made.done() and not kept.made.cancelled()


def _recording(stream: Stream) -> bytes:
    return json.dumps(stream.voice.recording(), allow_nan=False).encode("ascii")
