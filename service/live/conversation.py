"""The state machine of one live connection: messages and time in, actions and blocks out. No I/O, no await, no clock.

Model: the phases are HELLO -> OPENING -> STREAMING -> ENDING -> OVER. Every input may append to `actions`, which the
    connection performs. `next_block` applies the newest update and renders a whole block. For a slow voice the
    connection renders the block in a thread and calls `messages` afterwards. `now` is a time in seconds, of any clock.
Limits: slow work (opening a voice, preparing a change) is an action; its result is a later input.
"""

from __future__ import annotations

from collections.abc import Callable
from enum import Enum
from functools import partial
from typing import Any

from service.live import contact_update, server_messages
from service.live.actions import CODES, Action, Block, Close, Detach, Finish, OpenVoice, Prepare, Resume, Send
from service.live.live_stream import LiveStream, Options
from service.live.message_checks import NotJson, check_message, credit_of, message_of, refused
from service.live.message_limits import PAUSE_SECONDS, EarlyMessages, MessageRate
from service.live.messages import Version
from service.live.outgoing_blocks import OutgoingBlocks
from service.operations.metrics import Metrics
from service.operations.settings import Settings
from service.problems import Problem
from service.sessions.pacer import Behind, Pacer
from synth.errors import shown
from synth.motion.motion import Update

HELLO_SECONDS = 10.0  # for the first message; a connection without one occupies a place
TURN_BYTES = 256  # size of a change that a contact causes, as it would be sent


class Phase(Enum):
    """The phase of a connection."""

    HELLO = "waits for hello"
    OPENING = "the voice is being opened"
    STREAMING = "blocks are sent"
    ENDING = "the last blocks fade out"
    OVER = "nothing more is sent"


class Conversation:
    """The state of one connection.

    version: of the protocol, on this connection. Another connection may resume the session in another version.
    """

    def __init__(self, settings: Settings, now: float, version: Version, metrics: Metrics | None = None) -> None:
        self.phase, self.version = Phase.HELLO, version
        self.actions: list[Action] = []
        self.stream: LiveStream | None = None
        self._settings, self._opened = settings, now
        self._metrics = metrics or Metrics()
        self.blocks = OutgoingBlocks(Pacer(1, now, slow_reader=settings.slow_reader), version, self._metrics)
        self.rate = MessageRate(settings.max_updates, now)
        self._early = EarlyMessages()
        self._size = 0  # bytes of the text that is being read
        self._asked, self._warned = 0, False
        self._reason, self._code = "stopped", CODES["stopped"]
        self._messages: dict[str, Callable[[dict[str, Any], float], None]] = {
            "more": lambda message, _now: self._grant(int(message["frames"]), "/frames"),
            "contact": self._contact,
            "scene": lambda message, _now: self.actions.append(Prepare(message["scene"], self._size)),
            "stop": lambda _message, _now: self.end("stopped"),
        }

    def take_actions(self) -> list[Action]:
        """Return the actions, and clear them."""
        taken, self.actions = self.actions, []
        return taken

    # Messages in

    def binary(self, data: bytes, now: float) -> bool:
        """Receive a binary message, a contact update; return whether credit came with it."""
        stream = self.stream
        if stream is not None:
            stream.counts.received += 1
        if self.phase is not Phase.STREAMING or stream is None:
            self._out_of_turn(data)
            return False
        update, credit = contact_update.split(data)
        self._take(stream, partial(contact_update.from_bytes, update, self.version, stream.hand), now)
        self._grant(credit, "/more")
        return credit > 0

    def text(self, text: str, now: float) -> None:
        """Receive a text message."""
        if self.phase not in (Phase.HELLO, Phase.STREAMING):
            self._out_of_turn(text)
            return
        self._size = len(text)
        message: dict[str, Any] = {}
        try:
            message = message_of(text)
            check_message(message, self.version)
        except NotJson:
            problem = refused("", "text that is not JSON", "one JSON object per message", "Correct the text.")
            self.end("policy", problem, code=1007)
        except Problem as problem:
            if self.phase is Phase.HELLO:
                self.end("policy", problem)
            else:
                self.refuse(problem)
                self._grant(credit_of(message), "/more")  # without it the client would wait for ever
        else:
            self._message(message, now)

    def pause(self, clock: Callable[[], float]) -> float:
        """Return the seconds for which no message may be read, 0 if one may."""
        if self.phase is Phase.OPENING and self._early.full:
            return PAUSE_SECONDS
        return self.rate.wait(clock)

    def behind(self, seconds: float) -> None:
        """Tell the client, once, that its messages have been waiting for `seconds`."""
        if self.phase is Phase.STREAMING and (problem := self.rate.behind(seconds)) is not None:
            self._tell(problem)

    def refuse(self, problem: Problem) -> None:
        """Report a problem to the client; the stream continues."""
        self.rate.refused()
        if self.phase is not Phase.OVER:
            self._tell(problem)

    def _tell(self, problem: Problem) -> None:
        self._metrics.refused(problem.kind)
        self.actions.append(Send(server_messages.problem(problem, self._settings.root_path)))

    def _message(self, message: dict[str, Any], now: float) -> None:
        kind = message["type"]
        if self.phase is Phase.HELLO:
            if kind == "hello":
                self._hello(message)
            else:
                self.end("policy", refused("/type", shown(kind), "hello", "Say hello first."))
        elif kind == "hello":
            self.end("policy", refused("/type", "hello again", "hello once", "Open another connection."))
        else:
            self._messages[kind](message, now)

    def _hello(self, message: dict[str, Any]) -> None:
        self.phase = Phase.OPENING
        resume = message.get("resume")
        if resume is not None:
            self._asked = int(resume["frame"])
            self.actions.append(Resume(resume["session"], self._asked))
            return
        self.actions.append(OpenVoice(message.get("scene", {}), Options.of(message)))

    def _out_of_turn(self, message: str | bytes) -> None:
        """Keep a message that comes during the opening; drop one after the end; end at a binary one before hello."""
        if self.phase is Phase.OPENING:
            self._early.keep(message)
        elif self.phase is Phase.HELLO:
            self.end("policy", refused("", "a binary message", "hello", "Say hello first."))

    def _grant(self, frames: int, at: str) -> None:
        """Add credit, or refuse it. at: the pointer of the field that grants it."""
        if self.stream is None or not frames:
            return
        try:
            self.blocks.grant(self.stream, frames, at)
        except Problem as problem:
            self.refuse(problem)

    def _contact(self, message: dict[str, Any], now: float) -> None:
        assert self.stream is not None
        self.stream.counts.received += 1
        self._take(self.stream, partial(contact_update.from_message, message, self.stream.hand), now)
        self._grant(credit_of(message), "/more")

    def _take(self, stream: LiveStream, read: Callable[[], Update], now: float) -> None:
        """Keep the update that `read` returns. If it turns the finger on a texture along a line, turn the scene too.

        Until that change is heard, the finger keeps the direction of the x axis.
        """
        try:
            update = read()
        except Problem as problem:
            self.refuse(problem)
            return
        stream.take(update, now)
        if (turned := stream.turned_by(update)) is not None:
            self.actions.append(Prepare(turned, TURN_BYTES))

    # The session

    def opened(self, stream: LiveStream, now: float) -> None:
        """Begin the stream that OpenVoice or Resume returned. End the connection if its frame is no longer kept."""
        assert self.phase is Phase.OPENING
        try:
            stream.require_kept(self._asked)
        except Problem as problem:
            self.actions.append(Detach())
            self.end("policy", problem)
            return
        self.stream, self.phase = stream, Phase.STREAMING
        self.blocks.begin(stream, self._asked, now)
        self.actions.append(Send(stream.ready(self._asked, self.version, self._settings.root_path)))
        for message in self._early.take():
            if isinstance(message, str):
                self.text(message, now)
            else:
                self.binary(message, now)

    def displaced(self) -> None:
        """End this connection, because another one has taken over the session."""
        if self.phase is Phase.OVER:
            return
        self._tell(Problem("busy", "Another connection has resumed the session."))
        self.stream = None  # the session goes on
        self._reason, self._code = "policy", CODES["policy"]
        self._over(at_once=True)

    def lost(self) -> None:
        """Record that the connection is gone."""
        if self.phase is Phase.STREAMING:
            self.actions.append(Detach())
        elif self.phase is Phase.ENDING:
            self.actions.append(Finish())
        self.phase = Phase.OVER

    # Ends

    def end(self, reason: str, problem: Problem | None = None, *, code: int | None = None) -> None:
        """Report `problem`, fade out, and end."""
        if self.phase in (Phase.ENDING, Phase.OVER):
            return
        if problem is not None:
            self._tell(problem)
        self._reason, self._code = reason, CODES[reason] if code is None else code
        if self.phase is Phase.STREAMING and self.blocks.position:
            self.phase = Phase.ENDING
        else:
            self._over()

    def broken(self, problem: Problem, reason: str = "our mistake") -> None:
        """End without a fade, because the voice has failed."""
        if self.phase is not Phase.OVER:
            self._tell(problem)
            self._reason, self._code = reason, CODES[reason]
            self._over()

    def cut(self) -> None:
        """End now, without the remaining fade, because the client does not read."""
        if self.phase is Phase.ENDING:
            self._over(at_once=True)

    def _over(self, *, at_once: bool = False) -> None:
        self.phase = Phase.OVER
        self.actions.append(Send(server_messages.end(self._reason, self.blocks.position)))
        if self.stream is not None:
            self.actions.append(Finish())
        self.actions.append(Close(self._code, self._reason, at_once))

    # Blocks out

    def next_block(self, clock: Callable[[], float]) -> Block | None:
        """Return the block to send now, or None. The newest update and a prepared change are applied before it."""
        frames = self._due_frames(clock())
        if not frames:
            return None
        stream = self.stream
        assert stream is not None
        pcm = stream.kept(self.blocks.position, frames, fading=self.phase is Phase.ENDING)
        if pcm is None and stream.can_render_here:
            pcm = stream.rendered_here(stream.render, frames)
        return Block(frames, None if pcm is None else self.messages(pcm, frames, clock()))

    def _due_frames(self, now: float) -> int:
        """Return how many frames to send now, 0 for none."""
        stream = self.stream
        if stream is None or self.phase is not Phase.STREAMING:
            return self._last_frames() if self.phase is Phase.ENDING else 0
        frames = self.blocks.due_frames(stream, now)
        if not frames or (stream.realtime and self._too_slow(now)):
            return 0
        kept = stream.frame - self.blocks.position
        if kept:
            return min(frames, kept)
        if (own_end := stream.own_end(self._settings)) is not None:
            self.end(*own_end)
            return self._last_frames()
        stream.begin(now, self.blocks.lateness(stream, now))
        return frames

    def _last_frames(self) -> int:
        """Return the length of the next block of the fade; after the last one, end."""
        assert self.stream is not None
        frames = self.blocks.last_frames(self.stream)
        if not frames and self.phase is not Phase.OVER:
            self._over()
        return frames

    @property
    def paced(self) -> bool:
        """Return whether the server's clock decides when the next block is sent; false during the last fade."""
        return self.phase is Phase.STREAMING and self.stream is not None and self.stream.realtime

    @property
    def lacks_credit(self) -> bool:
        """Return whether the next block waits for credit."""
        return self.phase is Phase.STREAMING and self.stream is not None and self.blocks.lack_credit(self.stream)

    def messages(self, pcm: bytes, frames: int, now: float) -> list[str | bytes]:
        """Return the messages, in order, for a block that has been rendered; none after the end."""
        stream = self.stream
        if stream is None or self.phase is Phase.OVER:
            return []
        if self.phase is Phase.ENDING:
            return self.blocks.last_messages(stream, pcm, frames)
        return self.blocks.messages(stream, pcm, frames, now)

    def wait(self, now: float) -> float | None:
        """Return the seconds until `next_block` may return a block, None if it first needs a message."""
        if self.phase is Phase.ENDING:
            return 0.0
        if self.phase is not Phase.STREAMING or self.stream is None:
            return None
        return self.blocks.wait(self.stream, now)

    # Time

    def check(self, now: float) -> None:
        """End the connection for a late hello, too long a stream, or a client that does not read."""
        if self.phase is Phase.HELLO and now - self._opened > HELLO_SECONDS:
            self.end("policy", refused("", "no hello", f"hello within {HELLO_SECONDS:g} s", "Say hello first."))
        elif self.phase is Phase.STREAMING and self.stream is not None:
            if now - self._opened > self._settings.max_stream + HELLO_SECONDS:
                self.end("too long")  # a client that pulls nothing would never reach the end
            elif self.stream.realtime:
                self._too_slow(now)

    def _too_slow(self, now: float) -> bool:
        """Return whether the client read too slowly, which ends the connection; warn it at half of the bound."""
        behind = self.blocks.pace.behind(now)
        if behind is Behind.SLOW and not self._warned:
            self._warned = True
            detail = f"The client is behind by half of the allowed {self._settings.slow_reader:g} s."
            self.refuse(Problem("slow-reader", detail))
        if behind is not Behind.TOO_SLOW:
            return False
        self._reason, self._code = "slow reader", CODES["slow reader"]
        self._over(at_once=True)
        return True
