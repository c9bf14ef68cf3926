"""The sessions of one process, HTTP and live: opens, finds, ends and expires them.

Limits: a session belongs to one process. With several workers, HTTP sessions are refused, and a live session is
    known to one worker only. RIDGEWAVE_MAX_SESSIONS bounds the number of each kind. An idle HTTP session expires after
    RIDGEWAVE_SESSION_IDLE, a live session without a connection after RIDGEWAVE_RESUME. Only the key that opened a
    session can find it.
"""

from __future__ import annotations

import math
import time
from collections import Counter
from collections.abc import Callable
from functools import partial

from service.compute.threads import Solves
from service.engine import Engine, LiveVoice
from service.operations.metrics import Metrics
from service.operations.settings import Settings
from service.problems import Problem
from service.sessions.fixed_output import open_pinned
from service.sessions.free_memory import FreeMemory
from service.sessions.recordings import Recordings, recording_of
from service.sessions.session import Owner, Session, text_to_keep
from service.sessions.session_ids import new_id, not_found
from service.sessions.voice_stream import Kind, VoiceStream
from service.sinks.player import Player
from service.store.owned_textures import OwnedTextures
from synth.held_memory import bytes_together
from synth.scene.scene import Scene

EXPIRED_AT_A_TIME = 4  # per call of `look`; a hundred at once would delay all streams by 30 ms
FULL = {
    "http": "The service has its full number of sessions (RIDGEWAVE_MAX_SESSIONS).",
    "live": "The service has its full number of live sessions (RIDGEWAVE_MAX_SESSIONS).",
}

Opening = Callable[[str], tuple[Scene, VoiceStream]]
"""Takes the id of a new session; returns its scene, full scale written out, and its first voice. Slow."""


class Sessions:
    """The sessions of one process."""

    def __init__(self, engine: Engine, settings: Settings, solver: Solves, metrics: Metrics) -> None:
        self.metrics = metrics
        self.recordings = Recordings(settings.session_idle)
        self.engine, self._settings, self._solver = engine, settings, solver
        self.textures = OwnedTextures(settings)
        self._sessions: dict[str, Session] = {}
        self._opening: Counter[Kind] = Counter()
        self._free_memory = FreeMemory()
        self._closed = False

    def __len__(self) -> int:
        return len(self._sessions)

    def count(self, kind: Kind) -> int:
        """Return the number of sessions of a kind."""
        return sum(session.kind == kind for session in self._sessions.values())

    @property
    def used_bytes(self) -> int:
        """Return the bytes of all sessions and of kept recordings. What several voices share counts once."""
        return self._bytes_with()

    def require_open(self) -> None:
        """Raise Problem (closing) during a shutdown."""
        if self._closed:
            raise Problem("closing", "The service is shutting down.")

    # One session

    async def create(self, body: bytes, client: str, key: int | None) -> Session:
        """Return a new HTTP session of the scene in `body`. Raises the same as `open`, and SceneError."""
        self._refuse_workers()

        def opening(_name: str) -> tuple[Scene, VoiceStream]:
            """Return the scene of `body` with its full scale written out, and its stream. Slow."""

            def open_voice(scene: Scene) -> LiveVoice:
                return self.metrics.timed("voice", self.engine.open_live, scene)

            scene, voice = open_pinned(self.textures.scene(body, key), open_voice)
            return scene, VoiceStream(voice)

        return await self.open("http", Owner(client, key), opening)

    async def open(self, kind: Kind, owner: Owner, opening: Opening) -> Session:
        """Return a new session of `owner`. Raises Problem (full, closing) and what `opening` raises."""
        self.require_open()
        if self.count(kind) + self._opening[kind] >= self._settings.max_sessions:
            raise Problem("full", FULL[kind], headers={"Retry-After": self._retry_after()})
        self._opening[kind] += 1
        name = new_id(self._settings.node)

        def opened() -> tuple[Scene, bytes, VoiceStream]:
            scene, stream = opening(name)
            return scene, text_to_keep(scene, kind), stream

        try:
            scene, text, stream = await self._solver.run(owner.client, opened)
        finally:
            self._opening[kind] -= 1
        self._require_room(stream)
        named = partial(self.textures.named, key=owner.key)
        session = Session(
            name, owner, scene, text, stream, self.engine, self._solver, self.metrics, named, self._require_room
        )
        self._sessions[name] = session
        return session

    def find(self, name: str, key: int | None) -> Session:
        """Return the HTTP session `name`; restart its idle time. Raises Problem (not-found), also for another key."""
        self._refuse_workers()
        session = self.get("http", name, key)
        if session is None or session.expires_in(self._settings.session_idle) == 0.0:
            sentence = "No such session: it never existed, was deleted or stopped, or has expired."
            raise not_found(name, sentence, self._settings)
        session.touch()
        return session

    def get(self, kind: Kind, name: str, key: int | None) -> Session | None:
        """Return the session of that kind and id if `key` opened it, otherwise None."""
        session = self._sessions.get(name)
        return session if session is not None and (session.kind, session.owner) == (kind, key) else None

    def delete(self, name: str, key: int | None) -> None:
        """Fade out, end and remove an HTTP session. Raises Problem (not-found)."""
        self._end(self.find(name, key))

    def finish(self, session: Session) -> None:
        """Remove an ended live session. Its recording is kept for a while."""
        if self._sessions.pop(session.id, None) is None or session.stream is None:
            return
        session.peer = None
        session.end()
        session.stream.tell_counts(self.metrics, ended=True)
        if session.stream.records:
            self.recordings.keep(session, session.stream)
        self._let_go(session)

    async def recording(self, name: str, key: int | None) -> bytes:
        """Return the JSON of a live session's recording. Raises Problem (not-found), also for another key."""
        session = self.get("live", name, key)
        if session is not None and session.stream is not None and session.stream.records:
            return await recording_of(session.stream)
        kept = await self.recordings.find(name, key)
        if kept is None:
            sentence = "No recording: the live session did not request one, or ended too long ago."
            raise not_found(name, sentence, self._settings)
        return kept

    # All of them

    def end_all(self, reason: str = "stopped", *, at_once: bool = False) -> dict[str, int]:
        """End every session; return the counts. A session with a connection is removed once it has faded out."""
        sessions = list(self._sessions.values())
        counts = {
            "sessions": len(sessions),
            "streams": sum(session.reader is not None or session.peer is not None for session in sessions),
            "plays": sum(session.player is not None and session.player.playing for session in sessions),
        }
        for session in sessions:
            if session.peer is not None:
                session.end(reason, at_once=at_once)
            else:
                self._end(session, at_once=at_once)
        return counts

    def close(self) -> list[Player]:
        """End all sessions and refuse new ones; return the plays whose ends the caller should await."""
        self._closed = True
        players = [session.player for session in self._sessions.values() if session.player is not None]
        self.end_all("shutting down")
        return players

    def look(self) -> None:
        """Update the metrics, end expired sessions, and bound the memory."""
        over = []
        for session in self._sessions.values():
            if session.stream is not None:
                session.stream.tell_counts(self.metrics)
            patience = self._settings.session_idle if session.kind == "http" else self._settings.resume
            if session.expires_in(patience) == 0.0:
                over.append(session)
        for session in over[:EXPIRED_AT_A_TIME]:
            self._end(session)
        self.recordings.expire(time.monotonic())
        self._free_memory.look(time.monotonic())
        if not self._has_room(self.used_bytes):
            for session in self._sessions.values():
                if session.stream is not None and session.stream.records:
                    session.stream.voice.end_recording()

    def _end(self, session: Session, *, at_once: bool = False) -> None:
        """End and remove `session`, which has no connection."""
        if session.kind == "live":
            self.finish(session)
        else:
            self._sessions.pop(session.id, None)
            session.end(at_once=at_once)
            self._let_go(session)

    def _let_go(self, session: Session) -> None:
        """Let the memory of an ended session be freed now, not when Python next collects cycles."""
        self._free_memory.ended(bytes_together(session.held))
        session.stream = None

    def _bytes_with(self, *streams: VoiceStream) -> int:
        """Return the bytes of all sessions, of kept recordings, and of `streams`."""
        sessions = self._sessions.values()
        held = [held for session in sessions for held in session.held]
        own = [session.stream.used_bytes for session in sessions if session.stream is not None]
        own += [stream.used_bytes for stream in streams]
        held += [held for stream in streams for held in stream.held]
        return sum(own) + bytes_together(held) + self.recordings.used_bytes

    def _require_room(self, *streams: VoiceStream) -> None:
        """Raise Problem (full) if all sessions, with `streams`, take more memory than they may."""
        before, needed = self.used_bytes, self._bytes_with(*streams)
        if not self._has_room(needed):
            limit = self._settings.live_bytes
            asked = f"needs {needed - before} bytes" if streams else "needs more"
            sentence = f"This stream {asked}, and the sessions of this worker would take {needed} of {limit} bytes "
            sentence += "(RIDGEWAVE_LIVE_BYTES). End other streams, or write a smaller texture."
            raise Problem("full", sentence, headers={"Retry-After": self._retry_after()})

    def _has_room(self, needed: int) -> bool:
        """Return whether `needed` bytes in all are allowed, if necessary after the removal of the oldest recordings."""
        return self.recordings.free(needed - self._settings.live_bytes) <= 0

    def _retry_after(self) -> str:
        waits = [session.expires_in(self._settings.session_idle) for session in self._sessions.values()]
        soonest = min((wait for wait in waits if wait is not None), default=self._settings.session_idle)
        return str(max(1, math.ceil(soonest)))

    def _refuse_workers(self) -> None:
        if self._settings.workers > 1:
            raise Problem("one-worker", "Sessions live in one process: start the service with RIDGEWAVE_WORKERS=1.")
