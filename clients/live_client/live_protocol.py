"""The client's side of the live protocol without a connection: what to send, what was received, where to resume.

`sync_live` and `async_live` carry the messages.

Frames are numbered from the first frame that the stream received. Only whole messages are counted in `received`. After
a break the next connection therefore requests frame `received`, and a message that was cut off changes nothing. A new
session (reconnect "new") continues the numbers; `gaps` holds the frames at which one begins.

Only the newest contact update is kept. If a read was called after it, it is sent with the credit of that read, so that
the frames of the read follow it: one message a block. A change that waits is sent between the two. Otherwise it is sent
last.

Limits: one reader. After a break, an update older than `max_silence` is not sent: it would move an actuator by an
outdated motion of the hand.
"""

from __future__ import annotations

import logging
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

from clients.client_errors import Problem, ProtocolError, ResumeLost, StreamEnded
from clients.live_client import wire_messages as wire
from clients.live_client.credit import Credit, UnderrunCounter
from clients.live_client.pending_changes import Changes
from clients.live_client.pending_contact import PendingContact
from clients.live_client.reconnection import RETRY_AFTER, Backoff, Closure
from clients.live_client.stream_request import Reconnect, StreamRequest, require_one_of
from clients.live_client.wire_messages import Applied, Ready
from clients.pcm_buffer import Block, PcmBuffer, whole_frames
from clients.scene_and_key import change_to_send
from synth.errors import Fault, InvalidRequest, shown

log = logging.getLogger("ridgewave.clients")

PROBLEMS_KEPT = 100  # the newest ones; more only take memory
REALTIME_WAITING = 1.0  # s of sound that may wait to be read; with more, the service is to see a slow reader
SCENE_REFUSALS = frozenset({"scene-refused", "fixed", "cannot-render"})  # problems that refuse a change of the scene
LEFT = "left"  # the reason if the `with` block ended before the stream
ASKED_ENDS = frozenset({"stopped", "finished", LEFT})


class LiveProtocol:
    """The protocol of one stream.

    over: the exception that ended the stream; None while it runs.
    received: the number of frames received so far.
    """

    def __init__(
        self,
        request: StreamRequest,
        clock: Callable[[], float],
        reconnect: Reconnect = True,
        backoff: Backoff | None = None,
    ) -> None:
        require_one_of("reconnect", reconnect, (True, "new", False))
        self.request, self.clock, self.reconnect = request, clock, reconnect
        self.ready: Ready | None = None
        self.plan: Mapping[str, Any] = {}
        self.over_area = False
        self.applied: Applied | None = None
        self.changed_frame: int | None = None
        self.gain_reduction_db = 0.0
        self.skipped = 0.0
        self.problems: deque[Problem] = deque(maxlen=PROBLEMS_KEPT)
        self.gaps: tuple[int, ...] = ()
        self.reconnections = 0
        self.received = 0
        self.over: Exception | None = None
        self.underrun_counter = UnderrunCounter()
        self._backoff = backoff or Backoff()
        self._changes = Changes()
        self._attached = False  # `ready` was received on this connection
        self._new_session = True  # the next connection opens a new session
        self._offset = 0  # number of a frame in the stream, less its number in the session
        self._closure: Closure | None = None
        self._last_problem: Problem | None = None  # on this connection
        self._contact = PendingContact()
        self._seq = 0
        self._wanted = 0
        self._stopping = self._stop_unsent = False

    # The connection

    def next_try(self) -> float | None:
        """Return the seconds to wait before connecting; None if the stream is over."""
        if self.over is None and self._closure is not None:
            rest = (self._closure.retry_after or RETRY_AFTER) if self._closure.full else 0.0
            delay = self._backoff.delay(self.clock(), rest)
            if delay is not None:
                return delay
            self.over = self._closure.error(self._last_problem)
        return None if self.over is not None else 0.0

    @property
    def resume_url(self) -> str:
        """Return the path and query at which to resume, as `ready` gave them; "" if any connection will do."""
        return "" if self._new_session or self.ready is None else self.ready.resume_url

    def hello(self) -> str:
        """Return the first message of a new connection."""
        self._attached, self._last_problem = False, None
        if self._new_session or self.ready is None:
            request = self.request
            return wire.hello(request.scene, request.sample_format, request.pacing, request.block, request.record)
        return wire.resume(self.ready.session, self.received - self._offset)

    def receive(self, message: str | bytes) -> None:
        """Take one message of the service. An invalid message ends the stream; after the end messages are ignored."""
        if self.over is not None:
            return
        try:
            if isinstance(message, bytes):
                self._receive_samples(message)
            else:
                self._receive_text(wire.read_text(message))
        except ProtocolError as error:
            self.over = error
        except (KeyError, TypeError, ValueError) as error:
            self.over = ProtocolError(f"the service sent an incomplete message: {error!r}")

    def lost(self, closure: Closure) -> None:
        """Decide what the end of a connection, or a failed attempt to connect, means for the stream."""
        attached, self._attached = self._attached, False
        self._closure = closure
        if self.over is not None:
            return
        if self.ready is None:
            self.over = closure.error(self._last_problem)
        elif closure.worth_another_try and self.reconnect:
            log.info("live stream: connection lost at frame %d: %s", self.received, closure)
        elif attached and not closure.broken:
            self.over = StreamEnded(closure.end_reason, self.received, self._last_problem)
        elif attached or not closure.tells_session_is_gone(self._last_problem):
            self.over = closure.error(self._last_problem)
        elif self._stopping:
            self.over = StreamEnded("stopped", self.received)  # the service does not keep a session that was stopped
        elif self.reconnect == "new":
            self._new_session = True
        else:
            detail = self._last_problem.detail if self._last_problem else closure.reason
            self.over = ResumeLost(f"the service cannot resume at frame {self.received}: {detail}")

    def leave(self) -> str | None:
        """End the stream from this side and discard unread frames; return the message to send first, if any."""
        if self.ready is not None:
            self._buffer.take(self._buffer.frames)
        if self.over is not None:
            return None
        self.over = StreamEnded(LEFT, self.received)
        return wire.stop() if self._attached else None

    def next_message(self) -> str | bytes | None:
        """Return the next message and mark it as sent; None if there is none."""
        if not self._attached or self.over is not None:
            return None
        if self._stop_unsent:
            self._stop_unsent = False
            return wire.stop()
        if self._contact.first:
            return self._contact.message(0 if self._changes.waits else self._granted())
        change = self._changes.next_to_send()
        if change is not None:
            return wire.scene_change(change)
        granted = self._granted()
        if granted:
            return wire.more(granted)
        return self._contact.message() if self._contact.unsent else None

    def _granted(self) -> int:
        """Return the frames of credit to grant now."""
        return self._credit.grant(self._missing) if self.request.pacing == "pull" else 0

    @property
    def congested(self) -> bool:
        """Return whether so many frames wait to be read that none should be received."""
        if self.ready is None or self.request.pacing == "pull":
            return False  # the credit bounds it
        return self._buffer.frames >= max(self._wanted, round(REALTIME_WAITING * self.ready.sample_rate))

    # For the user

    def update_contact(self, value: float, is_speed: bool, load: float | None) -> int:
        """Send an update of the hand; return its number. Raises InvalidRequest."""
        return self._update(wire.contact(self._seq, self.clock(), value, is_speed, load))

    def update_place(self, at: tuple[float, float], direction: float | None, load: float | None) -> int:
        """Send an update of the hand at (x, y), m; return its number. Raises InvalidRequest."""
        update = wire.place(self._seq, self.clock(), at, direction, load)
        if self.ready is not None and self.ready.protocol == wire.FIRST:
            allowed = f"position or speed: this service speaks {wire.FIRST} only"
            raise InvalidRequest([Fault("/x", shown(at[0]), allowed, "Write position=-x, or use a newer service.")])
        return self._update(update)

    def _update(self, update: wire.Contact | wire.Place) -> int:
        self._contact.put(update)
        self._seq += 1
        return update.seq

    def lift(self) -> int:
        """Lift the finger where it is."""
        last = self._contact.newest
        if last is None:
            return self.update_contact(0.0, True, 0.0)
        return self._update(replace(last, seq=self._seq, time=self.clock(), load=0.0))

    def change(self, partial: Mapping[str, Any]) -> None:
        """Send a change of the scene. Raises InvalidRequest unless it is a mapping that JSON can hold."""
        self._changes.ask(change_to_send(partial))

    def stop(self) -> None:
        """Request the end of the stream; the fade before it needs no credit."""
        if not self._stopping:
            self._stopping = self._stop_unsent = True
            self._wanted = 0

    def want(self, frames: int) -> int:
        """Request `frames` for the next read; return them as an int. Raises InvalidRequest."""
        self._wanted = whole_frames("frames", frames)
        self._contact.first = self._contact.unsent
        return self._wanted

    def may_take(self, frames: int) -> bool:
        """Return whether `take` would return or raise now."""
        return self._buffer.frames >= frames or self.over is not None

    def take(self, frames: int) -> Block:
        """Return the next `frames`; if there are fewer, raise the exception that ended the stream."""
        if self._buffer.frames < frames:
            assert self.over is not None, "nothing to take yet"
            self._raise_end()
        self._wanted = 0
        if frames:
            self.underrun_counter.play(frames / self._rate, self.clock())
        return self._buffer.take(frames)

    def take_rest(self) -> Block:
        """Return the unread frames of a stopped stream; if it ended otherwise, raise that exception."""
        assert self.over is not None, "the stream is not over"
        if not (isinstance(self.over, StreamEnded) and self.over.reason in ASKED_ENDS):
            self._raise_end()
        return self._buffer.take(self._buffer.frames)

    @property
    def frame(self) -> int:
        """The number of the next frame to be read."""
        return self.received - self.waiting

    @property
    def waiting(self) -> int:
        """The number of frames received and not read."""
        return 0 if self.ready is None else self._buffer.frames

    # Inside

    @property
    def _rate(self) -> int:
        assert self.ready is not None
        return self.ready.sample_rate

    @property
    def _missing(self) -> int:
        ahead = 0 if self._stopping else self.request.ahead
        return self._wanted + ahead - self._buffer.frames

    def _raise_end(self) -> None:
        assert self.over is not None
        if not isinstance(self.over, StreamEnded):
            raise self.over
        rest = self._buffer.take(self._buffer.frames)
        raise StreamEnded(self.over.reason, self.over.frame, self.over.problem, rest)

    def _receive_samples(self, samples: bytes) -> None:
        if not self._attached or len(samples) % self._buffer.frame_bytes:
            raise ProtocolError("the service sent samples before `ready`, or not in whole frames")
        frames = len(samples) // self._buffer.frame_bytes
        self._buffer.append(samples)
        self._credit.spend(frames)
        self.received += frames
        self._backoff.settle()

    def _receive_text(self, message: Mapping[str, Any]) -> None:
        kind = message["type"]
        if kind == "ready":
            self._begin(Ready.read(message))
        elif kind == "applied":
            self.applied = Applied(int(message["seq"]), int(message["frame"]) + self._offset)
        elif kind == "scene":
            self.plan, self.changed_frame = dict(message["plan"]), int(message["frame"]) + self._offset
            self.over_area = message.get("over_area") is True
            self._changes.answered()
        elif kind == "limited":
            self.gain_reduction_db = float(message["gain_reduction_db"])
        elif kind == "skipped":
            self.skipped += float(message["seconds"])
            log.warning("live stream: the service was late and silent for %.3f s", float(message["seconds"]))
        elif kind == "problem":
            self._note(Problem.read({**message, "type": message.get("problem", "about:blank")}))
        elif kind == "end" and self._attached:
            reason = str(message["reason"])
            problem = None if reason in ASKED_ENDS else self._last_problem
            self.over = StreamEnded(reason, int(message["frame"]) + self._offset, problem)

    def _begin(self, ready: Ready) -> None:
        """Take a `ready`: of the first session, of a resumed one, or of a new one in place of a lost one."""
        if self.ready is None:
            self._buffer = PcmBuffer(self.request.sample_format, ready.channels)
            self._credit = Credit(ready.sample_rate)
            self._offset = -ready.frame
        else:
            ready.check_like(self.ready)
            self.reconnections += 1
            if self._new_session:
                self.gaps = (*self.gaps, self.received)
                self._offset = self.received - ready.frame
                self.applied = None
                self._changes.begin_new_session()
            elif ready.frame != self.received - self._offset:
                raise ProtocolError(f"asked to resume at frame {self.received - self._offset}, got {ready.frame}")
            else:
                self._changes.resume()
            applied = None if self.applied is None else self.applied.seq
            self._contact.connect_again(applied, self.clock() - ready.max_silence)
        if isinstance(self._contact.newest, wire.Place) and ready.protocol == wire.FIRST:
            self._contact.drop()  # this service cannot read it; the next place is refused
        self.ready, self.plan, self.over_area = ready, ready.plan, ready.over_area
        self._credit.reset()
        self._stop_unsent = self._stopping
        self._attached, self._new_session, self._last_problem = True, False, None

    def _note(self, problem: Problem) -> None:
        log.warning("live stream: %s: %s", problem.title, problem.sentence())
        self.problems.append(problem)
        self._last_problem = problem
        if self._attached and problem.kind in SCENE_REFUSALS:
            self._changes.refused(fault.pointer for fault in problem.faults)
