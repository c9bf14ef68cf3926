"""The state machine of one live connection: messages and time in, actions and blocks out. No I/O, no await, no clock.

Model: the phases are HELLO -> OPENING -> STREAMING -> ENDING -> OVER. Every input may append to `actions`, which the
    connection performs. `next_block` applies the newest update and renders a whole block. For a slow voice the
    connection renders the block in a thread and calls `messages` afterwards. `now` is a time in seconds, of any clock.
Limits: slow work (opening a voice, preparing a change) is an action; its result is a later input.
"""

from __future__ import annotations

from collections.abc import Callable
from enum import Enum
from typing import Any

from service.live import contact_update, server_messages
from service.live.actions import CODES, Action, Block, Close, Detach, Finish, OpenVoice, Prepare, Resume, Send
from service.live.live_stream import LiveStream, Options
from service.live.message_checks import NotJson, check_message, credit_of, message_of, refused
from service.live.message_limits import EarlyMessages, MessageRate
from service.live.messages import Version
from service.operations.metrics import Metrics
from service.operations.settings import Settings
from service.problems import Problem
from service.sessions.pacer import Behind, Pacer
from synth.errors import shown
from synth.motion.motion import Update
from synth.scene.trajectory import is_turned

HELLO_SECONDS = 10.0  # for the first message; a connection without one occupies a place
CREDIT_SECONDS = 60.0  # of outstanding credit; with more, a change would be heard very late
FADE_BOUND_SECONDS = 0.1  # for a voice that never reports that it has faded out
WAITED_SECONDS = 1.0  # for which messages wait unread until the client is told: its motion is heard that much later
TURN_BYTES = 256  # size of a change that a contact causes, as it would be sent
PAUSE_SECONDS = 0.01  # of reading, while a voice that is being opened or a change that is being solved has no room


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
    position: frame of the next block to send. It is behind the stream's frame while kept sound is sent again.
    """

    def __init__(self, settings: Settings, now: float, version: Version, metrics: Metrics | None = None) -> None:
        self.phase, self.version = Phase.HELLO, version
        self.actions: list[Action] = []
        self.stream: LiveStream | None = None
        self.position = 0
        self.pace = Pacer(1, now, slow_reader=settings.slow_reader)
        self._settings, self._opened = settings, now
        self._metrics = metrics or Metrics()
        self.rate = MessageRate(settings.max_updates, now)
        self._early = EarlyMessages()
        self._size = 0  # bytes of the text that is being read
        self._asked, self._credit, self._warned, self._told_behind = 0, 0, False, False
        self._reason, self._code = "stopped", CODES["stopped"]
        self._fading, self._faded, self._fade_bound = False, 0, 0
        self._messages: dict[str, Callable[[dict[str, Any], float], None]] = {
            "more": self._more,
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
        try:
            self._take(stream, contact_update.from_bytes(update, self.version, stream.hand), now)
        except Problem as problem:
            self.refuse(problem)
        if credit:
            self._grant(stream, credit, "/more")
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
                self._grant_refused(message)
        else:
            self._message(message, now)

    def pause(self, clock: Callable[[], float]) -> float:
        """Return the seconds for which no message may be read, 0 if one may."""
        if self.phase is Phase.OPENING and self._early.full:
            return PAUSE_SECONDS
        return self.rate.wait(clock)

    def behind(self, seconds: float) -> None:
        """Tell the client, once, that its messages have been waiting for `seconds`."""
        if seconds > WAITED_SECONDS and not self._told_behind and self.phase is Phase.STREAMING:
            self._told_behind = True
            most = f"At most {self._settings.max_updates} a second are read (RIDGEWAVE_MAX_UPDATES)"
            rest = "and none while many changes of the scene wait. Motion and changes are heard late: send fewer."
            self._tell(Problem("too-fast", f"Messages of this client have waited for a second. {most}, {rest}"))

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

    def _more(self, message: dict[str, Any], now: float) -> None:
        assert self.stream is not None
        self._grant(self.stream, int(message["frames"]), "/frames")

    def _grant(self, stream: LiveStream, frames: int, at: str) -> None:
        """Add credit, or refuse it. at: the pointer of the field that grants it."""
        room = round(CREDIT_SECONDS * stream.rate) - self._credit
        if stream.realtime:
            self.refuse(refused(at, str(frames), "no credit with pacing realtime", "Leave it out."))
        elif frames > room:
            allowed = f"at most {room} frames now: {CREDIT_SECONDS:g} s of sound outstanding"
            self.refuse(refused(at, shown(frames), allowed, "Grant less, more often."))
        else:
            self._credit += frames

    def _grant_refused(self, message: dict[str, Any]) -> None:
        """Grant the credit in a refused contact, which is not the hand's: without it the client would wait for ever."""
        if self.stream is not None and (credit := credit_of(message)):
            self._grant(self.stream, credit, "/more")

    def _contact(self, message: dict[str, Any], now: float) -> None:
        assert self.stream is not None
        self.stream.counts.received += 1
        try:
            self._take(self.stream, contact_update.from_message(message, self.stream.hand), now)
        except Problem as problem:
            self.refuse(problem)
        if credit := credit_of(message):
            self._grant(self.stream, credit, "/more")

    def _take(self, stream: LiveStream, update: Update, now: float) -> None:
        """Keep `update`. If it turns the finger on a texture along a line, have the scene turned too.

        Until the change is heard, the finger keeps the direction of the x axis.
        """
        stream.take(update, now)
        if stream.hand.may_turn and not stream.turning and is_turned(update.direction or 0.0):
            stream.turning = True
            scan = stream.voice.scene.scan
            constant = {name: getattr(scan, name) for name in ("speed", "load", "lift_load")}
            self.actions.append(Prepare({"scan": {**constant, "direction": update.direction}}, TURN_BYTES))

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
        self.position = self._asked
        self.pace.begin(self.position, stream.rate, now)
        self._fade_bound = round(FADE_BOUND_SECONDS * stream.rate)
        root_path = self._settings.root_path
        self.actions.append(Send(stream.ready(self.position, self.version, root_path)))
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
        self.actions.append(Send(server_messages.end("policy", self.position)))
        self.actions.append(Close(CODES["policy"], "policy", at_once=True))
        self.phase, self.stream = Phase.OVER, None

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
        if self.phase is Phase.STREAMING and self.position:
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
        self.actions.append(Send(server_messages.end(self._reason, self.position)))
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
        pcm = stream.kept(self.position, frames, fading=self.phase is Phase.ENDING)
        if pcm is None and stream.can_render_here:
            pcm = stream.rendered_here(stream.render, frames)
        return Block(frames, None if pcm is None else self.messages(pcm, frames, clock()))

    def _due_frames(self, now: float) -> int:
        """Return how many frames to send now, 0 for none."""
        stream = self.stream
        if stream is None or self.phase is not Phase.STREAMING:
            return self._last_frames() if self.phase is Phase.ENDING else 0
        frames = stream.block
        if stream.realtime:
            if now < self.pace.due or self._too_slow(now):
                return 0
        else:
            frames = min(frames, self._credit)
            if not frames:
                return 0
        kept = stream.frame - self.position
        if kept:
            return min(frames, kept)
        if self._ends_by_itself(stream):
            return self._last_frames()
        stream.begin(now, now - self.pace.due + self.pace.skipped if stream.realtime else 0.0)
        return frames

    @property
    def paced(self) -> bool:
        """Return whether the server's clock decides when the next block is sent; false during the last fade."""
        return self.phase is Phase.STREAMING and self.stream is not None and self.stream.realtime

    @property
    def lacks_credit(self) -> bool:
        """Return whether the next block waits for credit."""
        if self.phase is not Phase.STREAMING or self.stream is None:
            return False
        return not self._credit and not self.stream.realtime

    def messages(self, pcm: bytes, frames: int, now: float) -> list[str | bytes]:
        """Return the messages, in order, for a block that has been rendered; none after the end."""
        stream = self.stream
        if stream is None or self.phase is Phase.OVER:
            return []
        if self.phase is Phase.ENDING:
            return self._last_block(stream, pcm, frames)
        messages: list[str | bytes] = [
            *stream.notices(self.position, self.version),
            *stream.before_limiter(self.position, frames),
            pcm,
        ]
        if skipped := self.pace.take_skipped():
            messages.insert(0, server_messages.skipped(self.position, skipped))
        self.position += frames
        self._metrics.block_sent("live", frames, now - self.pace.due if stream.realtime else None, skipped)
        if stream.realtime:
            self.pace.advance(self.position)
        else:
            self._credit -= frames
        if (limited := stream.limited(now)) is not None:
            messages.append(limited)
        return messages

    def wait(self, now: float) -> float | None:
        """Return the seconds until `next_block` may return a block, None if it first needs a message."""
        if self.phase is Phase.ENDING:
            return 0.0
        if self.phase is not Phase.STREAMING or self.stream is None:
            return None
        if self.stream.realtime:
            return max(0.0, self.pace.due - now)
        return 0.0 if self._credit else None

    def _ends_by_itself(self, stream: LiveStream) -> bool:
        if stream.voice.finished:
            self.end("finished")
        elif stream.frame >= self._settings.max_stream * stream.rate - stream.fade_frames:
            self.end("too long")
        elif stream.options.record and stream.frame >= self._settings.max_duration * stream.rate:
            problem = Problem("too-large", "A recorded session may last as long as RIDGEWAVE_MAX_DURATION.")
            self.end("too long", problem)
        return self.phase is not Phase.STREAMING

    def _last_block(self, stream: LiveStream, pcm: bytes, frames: int) -> list[str | bytes]:
        if not self._fading:  # the end was requested while the block was rendered, so the block itself must fade
            kept = min(frames, stream.fade_frames)
            pcm, frames, self._fade_bound = stream.cut(kept), kept, 0
        self._faded += frames
        self.position += frames
        self._metrics.block_sent("live", frames)
        return [pcm]

    def _last_frames(self) -> int:
        """Return the length of the next block of the fade; after the last one, end."""
        stream = self.stream
        assert stream is not None
        kept, self._fading = stream.frame - self.position, True
        if kept and not self._faded:
            self._fade_bound = 0  # the kept sound is faded in place of the voice
            return min(kept, stream.fade_frames, stream.block)
        if self._faded < self._fade_bound and not stream.voice.finished:
            stream.voice.release()
            rest = stream.fade_frames - self._faded
            return min(stream.block, rest if rest > 0 else 1 + stream.fade_frames // 5)
        if self.phase is not Phase.OVER:
            self._over()
        return 0

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
        behind = self.pace.behind(now)
        if behind is Behind.FINE:
            return False
        if behind is Behind.SLOW:
            if not self._warned:
                self._warned = True
                detail = f"The client is behind by half of the allowed {self._settings.slow_reader:g} s."
                self.refuse(Problem("slow-reader", detail))
            return False
        self._reason, self._code = "slow reader", CODES["slow reader"]
        self._over(at_once=True)
        return True
