"""The client's side of the live protocol without a connection: what to send, what was received, where to resume.

`sync_live` and `async_live` carry the messages.

Frames are numbered from the first frame that the stream received. Only whole messages are counted in `received`. After
a break the next connection therefore asks for frame `received`, and a message that was cut off changes nothing. A new
session (reconnect "new") continues the numbers; `gaps` holds the frames at which one begins.

Only the newest contact update is kept. It is sent before the credit of a read that was called after it, so that the
frames of this read follow it. Otherwise it is sent last.

Limits: one reader. After a break, an update older than `max_silence` is not sent: it would move an actuator by an
outdated motion of the hand.
"""

from __future__ import annotations

import logging
import operator
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Literal

from clients.client_errors import ClientError, ConnectionLost, Problem, ProtocolError, ResumeLost, StreamEnded
from clients.live_client import wire_messages as wire
from clients.live_client.credit import Credit, Playout
from clients.live_client.pending_changes import Changes
from clients.live_client.ready_message import Applied, Ready
from clients.live_client.reconnection import POLICY_CODE, RETRY_AFTER, Backoff, Closure
from clients.pcm_buffer import Block, PcmBuffer
from synth.errors import Fault, InvalidRequest, shown

log = logging.getLogger("ridgewave.clients")

Reconnect = Literal["new"] | bool

PROBLEMS_KEPT = 100  # the newest; a client that is told more does not read them
REALTIME_WAITING = 1.0  # s of sound that may wait to be read; past it the service sees a slow reader, as there is one
SCENE_REFUSALS = frozenset({"scene-refused", "fixed", "cannot-render"})  # problems that answer a change of the scene
LEFT = "left"  # the reason where `with` ended before the stream
ASKED_ENDS = frozenset({"stopped", "finished", LEFT})
ENDS = {1000: "stopped", 1001: "shutting down", 1008: "policy", 1009: "too large", 4408: "slow reader"}


@dataclass(frozen=True, slots=True)
class Wish:
    """What a stream is asked to be; the words of `hello`. ahead: frames of credit kept beyond what is read."""

    scene: Mapping[str, Any]
    sample_format: str = "f32le"
    pacing: str = "pull"
    block: int | None = None
    record: bool = False
    ahead: int = 0

    def __post_init__(self) -> None:
        _one_of("format", self.sample_format, ("f32le", "s16le"))
        _one_of("pacing", self.pacing, ("pull", "realtime"))
        _whole("ahead", self.ahead)
        wire.text_of(self.scene)


class LiveCore:
    """The protocol of one stream. `over` is what ended it, an exception; None while it goes on."""

    def __init__(
        self, wish: Wish, clock: Callable[[], float], reconnect: Reconnect = True, backoff: Backoff | None = None
    ) -> None:
        self.wish, self.clock, self.reconnect = wish, clock, reconnect
        self.ready: Ready | None = None
        self.plan: Mapping[str, Any] = {}
        self.applied: Applied | None = None
        self.changed_frame: int | None = None
        self.gain_reduction_db = 0.0
        self.skipped = 0.0
        self.problems: deque[Problem] = deque(maxlen=PROBLEMS_KEPT)
        self.gaps: tuple[int, ...] = ()
        self.reconnections = 0
        self.heard = 0
        self.over: Exception | None = None
        self.playout = Playout()
        self._backoff = backoff or Backoff()
        self._changes = Changes()
        self._attached = False  # `ready` has come on the present connection
        self._anew = True  # the next connection opens a new session
        self._offset = 0  # the stream's number of a frame, less the session's
        self._closure: Closure | None = None
        self._told: Problem | None = None  # on the present connection
        self._contact: wire.Contact | None = None
        self._contact_unsent = self._contact_first = False
        self._seq = 0
        self._wanted = 0
        self._stopping = self._stop_unsent = False

    # The connection

    def next_try(self) -> float | None:
        """Return the seconds to wait before connecting, None where the stream is over."""
        if self.over is None and self._closure is not None:
            rest = (self._closure.retry_after or RETRY_AFTER) if self._closure.full else 0.0
            delay = self._backoff.delay(self.clock(), rest)
            if delay is not None:
                return delay
            self.over = self._closure.error(self._told)
        return None if self.over is not None else 0.0

    @property
    def resume_url(self) -> str:
        """Return where the next connection is to be made, as `ready` told; "" where any will do."""
        return "" if self._anew or self.ready is None else self.ready.resume_url

    def hello(self) -> str:
        """Return the first message of a connection that has just been made."""
        self._attached, self._told = False, None
        if self._anew or self.ready is None:
            wish = self.wish
            return wire.hello(wish.scene, wish.sample_format, wish.pacing, wish.block, wish.record)
        return wire.hello_again(self.ready.session, self.heard - self._offset)

    def receive(self, message: str | bytes) -> None:
        """Heed one message of the service; what cannot be right ends the stream, and nothing is heard after an end."""
        if self.over is not None:
            return
        try:
            if isinstance(message, bytes):
                self._hear(message)
            else:
                self._heed(wire.read_text(message))
        except ProtocolError as error:
            self.over = error
        except (KeyError, TypeError, ValueError) as error:
            self.over = ProtocolError(f"the service sent a message that lacks something: {error!r}")

    def lost(self, closure: Closure) -> None:
        """Note that the connection ended, or was not made, and decide what that means."""
        attached, self._attached = self._attached, False
        self._closure = closure
        if self.over is not None:
            return
        if self.ready is None:
            self.over = closure.error(self._told)
        elif closure.worth_another_try and self.reconnect:
            log.info("live stream: connection lost at frame %d: %s", self.heard, closure)
        elif attached and not closure.broken:
            reason = ENDS.get(closure.code or 0, closure.reason)
            self.over = StreamEnded(reason, self.heard, self._told)
        elif attached or not self._forgotten(closure):
            self.over = closure.error(self._told)
        elif self._stopping:
            self.over = StreamEnded("stopped", self.heard)  # a session that was told to stop is not kept
        elif self.reconnect == "new":
            self._anew = True
        else:
            detail = self._told.detail if self._told else closure.reason
            self.over = ResumeLost(f"the service cannot go on from frame {self.heard}: {detail}")

    def leave(self) -> str | None:
        """End the stream from this side, and drop what was not read; return what is to be said first, if anything."""
        if self.ready is not None:
            self._buffer.take(self._buffer.frames)
        if self.over is not None:
            return None
        self.over = StreamEnded(LEFT, self.heard)
        return wire.stop() if self._attached else None

    def next_message(self) -> str | bytes | None:
        """Return what to send now, which counts as sent; None where there is nothing."""
        if not self._attached or self.over is not None:
            return None
        if self._stop_unsent:
            self._stop_unsent = False
            return wire.stop()
        if self._contact_unsent and self._contact_first:
            return self._contact_message()
        change = self._changes.next_to_send()
        if change is not None:
            return wire.scene_change(change)
        granted = self._credit.grant(self._missing) if self.wish.pacing == "pull" else 0
        if granted:
            return wire.more(granted)
        return self._contact_message() if self._contact_unsent else None

    @property
    def congested(self) -> bool:
        """Return whether so much waits to be read that no more is to be received."""
        if self.ready is None or self.wish.pacing == "pull":
            return False  # in pull the credit bounds it
        return self._buffer.frames >= max(self._wanted, round(REALTIME_WAITING * self.ready.sample_rate))

    # The person

    def touch(self, value: float, is_speed: bool, load: float | None) -> int:
        """Take what the hand does now; return the number of the update. Raises InvalidRequest."""
        self._contact = wire.contact(self._seq, self.clock(), value, is_speed, load)
        self._contact_unsent = True
        self._seq += 1
        return self._contact.seq

    def lift(self) -> int:
        """Take the hand off the surface, where it is."""
        last = self._contact
        return self.touch(0.0, True, 0.0) if last is None else self.touch(last.value, last.is_speed, 0.0)

    def change(self, partial: Mapping[str, Any]) -> None:
        """Take a change of the scene. Raises InvalidRequest where it is not JSON."""
        wire.text_of(partial)
        self._changes.ask(partial)

    def stop(self) -> None:
        """Ask for the end; the fade that comes before it needs no credit."""
        if not self._stopping:
            self._stopping = self._stop_unsent = True
            self._wanted = 0

    def want(self, frames: int) -> None:
        """Note that `frames` are to be read next. Raises InvalidRequest for what is not a number of frames."""
        self._wanted = _whole("frames", frames)
        self._contact_first = self._contact_unsent

    def may_take(self, frames: int) -> bool:
        """Return whether `take` would answer, or raise, at once."""
        return self._buffer.frames >= frames or self.over is not None

    def take(self, frames: int) -> Block:
        """Return the next `frames`; raises what ended the stream where there are fewer."""
        if self._buffer.frames < frames:
            assert self.over is not None, "nothing to take yet"
            self._raise_end()
        self._wanted = 0
        if frames:
            self.playout.play(frames / self._rate, self.clock())
        return self._buffer.take(frames)

    def take_rest(self) -> Block:
        """Return what is left of a stream that was stopped; raises what else ended it."""
        assert self.over is not None, "the stream goes on"
        if not (isinstance(self.over, StreamEnded) and self.over.reason in ASKED_ENDS):
            self._raise_end()
        return self._buffer.take(self._buffer.frames)

    @property
    def frame(self) -> int:
        """Return the number of the next frame to be read."""
        return self.heard - self.waiting

    @property
    def waiting(self) -> int:
        """Return how many frames have come and were not read."""
        return 0 if self.ready is None else self._buffer.frames

    # Inside

    @property
    def _rate(self) -> int:
        assert self.ready is not None
        return self.ready.sample_rate

    @property
    def _missing(self) -> int:
        ahead = 0 if self._stopping else self.wish.ahead
        return self._wanted + ahead - self._buffer.frames

    def _raise_end(self) -> None:
        assert self.over is not None
        if not isinstance(self.over, StreamEnded):
            raise self.over
        rest = self._buffer.take(self._buffer.frames)
        raise StreamEnded(self.over.reason, self.over.frame, self.over.problem, rest)

    def _contact_message(self) -> bytes:
        assert self._contact is not None
        self._contact_unsent = self._contact_first = False
        return self._contact.message()

    def _hear(self, samples: bytes) -> None:
        if not self._attached or len(samples) % self._buffer.frame_bytes:
            raise ProtocolError("the service sent samples that are not whole frames of a stream that is ready")
        frames = len(samples) // self._buffer.frame_bytes
        self._buffer.append(samples)
        self._credit.spend(frames)
        self.heard += frames
        self._backoff.settle()

    def _heed(self, message: Mapping[str, Any]) -> None:
        kind = message["type"]
        if kind == "ready":
            self._begin(Ready.read(message))
        elif kind == "applied":
            self.applied = Applied(int(message["seq"]), int(message["frame"]) + self._offset)
        elif kind == "scene":
            self.plan, self.changed_frame = dict(message["plan"]), int(message["frame"]) + self._offset
            self._changes.answered()
        elif kind == "limited":
            self.gain_reduction_db = float(message["gain_reduction_db"])
        elif kind == "skipped":
            self.skipped += float(message["seconds"])
            log.warning("live stream: the service was late, and silent for %.3f s", float(message["seconds"]))
        elif kind == "problem":
            self._note(Problem.read({**message, "type": message.get("problem", "about:blank")}))
        elif kind == "end" and self._attached:
            reason = str(message["reason"])
            told = None if reason in ASKED_ENDS else self._told
            self.over = StreamEnded(reason, int(message["frame"]) + self._offset, told)

    def _begin(self, ready: Ready) -> None:
        """Take a `ready`: of the first connection, of one that goes on, or of a new session after a lost one."""
        if self.ready is None:
            self._buffer = PcmBuffer(self.wish.sample_format, ready.channels)
            self._credit = Credit(ready.sample_rate)
            self._offset = -ready.frame
        else:
            ready.check_like(self.ready)
            self.reconnections += 1
            if self._anew:
                self.gaps = (*self.gaps, self.heard)
                self._offset = self.heard - ready.frame
                self.applied = None
                self._changes.begin_anew()
            elif ready.frame != self.heard - self._offset:
                raise ProtocolError(f"asked to go on at frame {self.heard - self._offset}, got {ready.frame}")
            else:
                self._changes.resume()
            self._recall(ready)
        self.ready, self.plan = ready, ready.plan
        self._credit.reset()
        self._stop_unsent = self._stopping
        self._attached, self._anew, self._told = True, False, None

    def _recall(self, ready: Ready) -> None:
        """Decide after a break whether the newest contact is to be said, again or at last."""
        last = self._contact
        applied = self.applied is not None and last is not None and self.applied.seq >= last.seq
        fresh = last is not None and self.clock() - last.time <= ready.max_silence
        self._contact_unsent = fresh and not applied
        self._contact_first = self._contact_unsent

    def _note(self, problem: Problem) -> None:
        log.warning("live stream: %s: %s", problem.title, problem.sentence())
        self.problems.append(problem)
        self._told = problem
        if self._attached and problem.kind in SCENE_REFUSALS:
            self._changes.refused()

    def _forgotten(self, closure: Closure) -> bool:
        """Return whether a connection that was to go on was refused because the session, or its past, is gone."""
        told = self._told or closure.problem
        return closure.code == POLICY_CODE and told is not None and told.kind == "not-found"


def not_open() -> ClientError:
    """Return the exception for the use of a stream that is not open."""
    return ConnectionLost("the stream is not open: use it inside `with`")


def _one_of(name: str, value: object, allowed: tuple[str, ...]) -> None:
    if value not in allowed:
        raise InvalidRequest([Fault("/" + name, shown(value), " or ".join(allowed), f"Write {allowed[0]}.")])


def _whole(name: str, value: object) -> int:
    try:
        whole = operator.index(value)  # type: ignore[arg-type]
    except TypeError:
        whole = -1
    if whole < 0:
        raise InvalidRequest([Fault("/" + name, shown(value), "a whole number from 0 on", "Write a number of frames.")])
    return whole
