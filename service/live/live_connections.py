"""The live connections of one process: admitted, given a session, watched, ended.

Model: a session whose connection broke is kept for RIDGEWAVE_RESUME, not rendering; a second connection to one that
    looks alive takes it over, since half-open connections look alive.
"""

from __future__ import annotations

from concurrent.futures import Executor
from functools import partial
from typing import Any

from service.live.live_stream import LiveStream, Options, open_stream
from service.operations.settings import Settings
from service.problems import Problem
from service.sessions.pacer import BlockTimer
from service.sessions.session import Owner, Peer, Session
from service.sessions.session_ids import not_found
from service.sessions.session_registry import Sessions
from synth.scene.scene import Scene

PER_SESSION = 2  # connections a session: one, and one that takes it over


class LiveConnections:
    """The connections; blocks: the threads for voices that are not quick."""

    def __init__(self, sessions: Sessions, settings: Settings, blocks: Executor) -> None:
        self.sessions, self.settings, self.blocks = sessions, settings, blocks
        self.metrics = sessions.metrics
        self.timer = BlockTimer()
        self._peers: set[Peer] = set()

    def admit(self) -> None:
        """Raise Problem where one more connection is too many."""
        self.sessions.require_open()
        if len(self._peers) >= PER_SESSION * self.settings.max_sessions:
            raise Problem("full", "As many live connections as there may be.", headers={"Retry-After": "1"})

    def enter(self, peer: Peer) -> None:
        """Look after `peer` until `leave`."""
        self._peers.add(peer)

    def leave(self, peer: Peer) -> None:
        """Forget `peer`."""
        self._peers.discard(peer)

    def check(self, now: float) -> None:
        """Have every connection look at what only time tells: late hellos, slow readers."""
        for peer in list(self._peers):
            peer.check(now)

    def end_all(self, reason: str, *, at_once: bool = False) -> None:
        """End every connection, also those without a session."""
        for peer in list(self._peers):
            peer.end(reason, at_once=at_once)

    async def open(self, document: dict[str, Any], options: Options, peer: Peer) -> Session:
        """Return a new session of `peer`; raises Problem (full, closing), SceneError, CannotRender."""
        engine, metrics, silence = self.sessions.engine, self.metrics, self.settings.max_silence

        def opening(name: str) -> tuple[Scene, LiveStream]:
            return metrics.timed("voice", partial(open_stream, engine, name, document, options, silence))

        session = await self.sessions.open("live", Owner(peer.client, peer.owner), opening)
        session.peer = peer
        return session

    async def resume(self, name: str, frame: int, peer: Peer) -> Session:
        """Return the session of that id, taken from whoever is connected to it.

        Raises Problem (not-found) where there is none that the peer's key opened, or it does not keep `frame` any more.
        """
        session = self.sessions.get("live", name, peer.owner)
        if session is None or (session.peer is not None and session.peer.ending):
            sentence = "No such session: it has ended, expired or was stopped, or was never there."
            raise not_found(name, sentence, self.settings)
        stream = session.stream
        assert isinstance(stream, LiveStream)
        stream.require_kept(frame)
        earlier, session.peer = session.peer, peer
        if earlier is not None:
            earlier.displaced()
        async with stream.turn:  # the block that a thread renders for the earlier connection
            return session
