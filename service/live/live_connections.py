"""The live connections of one process: admits them, opens and resumes their sessions, checks and ends them.

Model: a session whose connection broke is kept for RIDGEWAVE_RESUME; it renders nothing meanwhile. A connection that
    resumes a session takes it over even if the earlier connection seems open: a half-open connection seems open too.
"""

from __future__ import annotations

from concurrent.futures import Executor
from functools import partial
from typing import Any

from service.live.live_stream import LiveStream, Options, open_stream
from service.operations.settings import Settings
from service.problems import Problem
from service.sessions.admission import stream_admitted
from service.sessions.pacer import BlockTimer
from service.sessions.session import Owner, Peer, Session
from service.sessions.session_ids import not_found
from service.sessions.session_registry import Sessions
from synth.scene.scene import Scene

PER_SESSION = 2  # connections per session: the present one, and one that takes over


class LiveConnections:
    """The connections. blocks: threads for slow voices."""

    def __init__(self, sessions: Sessions, settings: Settings, blocks: Executor) -> None:
        self.sessions, self.settings, self.blocks = sessions, settings, blocks
        self.metrics = sessions.metrics
        self.timer = BlockTimer()
        self._peers: set[Peer] = set()

    def admit(self) -> None:
        """Raise Problem (full, closing) if no further connection is allowed."""
        self.sessions.require_open()
        if len(self._peers) >= PER_SESSION * self.settings.max_sessions:
            raise Problem("full", "The service has its full number of live connections.", headers={"Retry-After": "1"})

    def enter(self, peer: Peer) -> None:
        """Include `peer` in checks and ends until `leave`."""
        self._peers.add(peer)

    def leave(self, peer: Peer) -> None:
        """Forget `peer`."""
        self._peers.discard(peer)

    def check(self, now: float) -> None:
        """Check every connection for a late hello and for a slow reader."""
        for peer in list(self._peers):
            peer.check(now)

    def end_all(self, reason: str, *, at_once: bool = False) -> None:
        """End every connection, with or without a session."""
        for peer in list(self._peers):
            peer.end(reason, at_once=at_once)

    async def open(self, document: dict[str, Any], options: Options, peer: Peer) -> Session:
        """Return a new session of `peer`; raises Problem (full, closing), SceneError, CannotRender.

        Waits for its turn where many streams begin."""
        engine, metrics, silence = self.sessions.engine, self.metrics, self.settings.max_silence

        def opening(name: str) -> tuple[Scene, LiveStream]:
            asked = self.sessions.textures.named(document, peer.owner)
            return metrics.timed("voice", partial(open_stream, engine, name, asked, options, silence))

        await stream_admitted(metrics.load, self.settings.full_at)
        session = await self.sessions.open("live", Owner(peer.client, peer.owner), opening)
        session.peer = peer
        return session

    async def resume(self, name: str, frame: int, peer: Peer) -> Session:
        """Return the session `name`, taken over from its present connection.

        Raises Problem (not-found) if the key of `peer` opened no such session, or the session no longer keeps `frame`.
        """
        session = self.sessions.get("live", name, peer.owner)
        if session is None or (session.peer is not None and session.peer.ending):
            sentence = "No such session: it has ended, has expired, was stopped, or never existed."
            raise not_found(name, sentence, self.settings)
        stream = session.stream
        assert isinstance(stream, LiveStream)
        stream.require_kept(frame)
        earlier, session.peer = session.peer, peer
        if earlier is not None:
            earlier.displaced()
        async with stream.turn:  # a thread may still render for the earlier connection
            return session
