"""The part of `Live` and `AsyncLive` that never waits: updates of the hand, and the state of the stream.

Opening, reading and stopping wait; `Live` waits with threads, `AsyncLive` with an event loop.
"""

from __future__ import annotations

import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager
from typing import Any, Literal, TypedDict

from clients.client_errors import ClientError, ConnectionLost, Problem
from clients.live_client.live_protocol import LiveProtocol
from clients.live_client.reconnection import Backoff
from clients.live_client.stream_request import Reconnect, StreamRequest
from clients.live_client.websocket_connection import Address
from clients.live_client.wire_messages import Applied, Ready
from clients.scene_and_key import scene_to_send
from synth.errors import Fault, InvalidRequest

DEFAULT_URL = "ws://127.0.0.1:8000/v1/live"


class LiveOptions(TypedDict, total=False):
    """The arguments of a live stream; see `LiveInterface`."""

    url: str
    key: str | None
    block: int | None
    pacing: Literal["pull", "realtime"]
    format: Literal["f32le", "s16le"]
    record: bool
    ahead: int
    reconnect: Reconnect
    backoff: Backoff | None
    clock: Callable[[], float]


class LiveInterface(ABC):
    """A live stream, opened by `with` (`async with`).

    scene: a partial scene as a mapping, or a `synth.Scene`; None is the default scene.
    url, key: address of the service, and a key if the service requires one.
    block: frames per message of the service; None: 10 ms.
    pacing: "pull", the service renders the frames that are read; "realtime", it renders by its own clock.
    format: "f32le", or "s16le" for half the bytes. Blocks are float32 either way.
    record: the service keeps a recording of the hand; see `recording`.
    ahead: frames to keep ready beyond those that are read. Each adds a frame of delay, and hides as much network delay.
    reconnect: True resumes after a break without a gap, or raises ResumeLost; "new" opens a new session if the old one
        cannot be resumed, see `gaps`; False raises ConnectionLost.
    backoff: when to connect again.
    clock: returns monotonic seconds; updates carry its time.
    Raises InvalidRequest.
    """

    def __init__(
        self,
        scene: Any = None,
        *,
        url: str = DEFAULT_URL,
        key: str | None = None,
        block: int | None = None,
        pacing: Literal["pull", "realtime"] = "pull",
        format: Literal["f32le", "s16le"] = "f32le",
        record: bool = False,
        ahead: int = 0,
        reconnect: Reconnect = True,
        backoff: Backoff | None = None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._address = Address.of(url, key)
        self._key = key
        request = StreamRequest(scene_to_send(scene), format, pacing, block, record, ahead)
        self._protocol = LiveProtocol(request, clock, reconnect, backoff)

    @abstractmethod
    def _changing(self) -> AbstractContextManager[Any]:
        """Return a context for a change of the protocol: it excludes other threads, and then wakes waiting calls."""

    # The hand

    def move(
        self,
        position: float | None = None,
        load: float | None = None,
        *,
        x: float | None = None,
        y: float | None = None,
        direction: float | None = None,
    ) -> int:
        """Move the finger, pressed with `load` (N; None keeps the last load).

        position: how far the surface has moved under the finger, m.
        x, y: instead, the place of the finger's middle on the surface, m. x is the negative of position.
        direction: with x and y on a texture over an area, see `over_area`: the angle of the finger's length from the
            x axis, rad, counter-clockwise. None keeps the last one, at first 0.

        Returns the number of the update; `applied` names it once the sound follows it. Never waits: this update
        replaces one that was not sent yet. After `max_silence` seconds without an update the service lifts the finger.
        Raises InvalidRequest; also for x and y if the service speaks only version 1 of the protocol.
        """
        with self._changing():
            if position is not None and x is None and y is None and direction is None:
                return self._protocol.update_contact(position, False, load)
            if position is None and x is not None and y is not None:
                return self._protocol.update_place((x, y), direction, load)
        raise InvalidRequest([_ways_fault(position=position, x=x, y=y, direction=direction)])

    def slide(self, speed: float, load: float | None = None) -> int:
        """Let the finger slide at `speed` (m/s), pressed with `load` (N; None keeps the last load). See `move`."""
        with self._changing():
            return self._protocol.update_contact(speed, True, load)

    def lift(self) -> int:
        """Lift the finger where it is: the sound fades with the load."""
        with self._changing():
            return self._protocol.lift()

    def change(self, partial: Mapping[str, Any]) -> None:
        """Change the scene by a partial scene, cross-faded at `changed_frame`. A refusal appears in `problems`."""
        with self._changing():
            self._protocol.change(partial)

    # The sound

    @property
    def session(self) -> str:
        """The id of the session."""
        return self._ready.session

    @property
    def sample_rate(self) -> int:
        """Frames per second."""
        return self._ready.sample_rate

    @property
    def channels(self) -> int:
        """Samples per frame."""
        return self._ready.channels

    @property
    def quantities(self) -> tuple[str, ...]:
        """The quantity of each channel."""
        return self._ready.quantities

    @property
    def full_scale(self) -> tuple[float, ...]:
        """The SI value of a sample of 1.0, per channel."""
        return self._ready.full_scale

    @property
    def block(self) -> int:
        """Frames per message of the service."""
        return self._ready.block

    @property
    def max_silence(self) -> float:
        """Seconds without an update after which the service lifts the finger."""
        return self._ready.max_silence

    @property
    def motion_delay(self) -> float:
        """Seconds by which the sound follows the hand."""
        return self._ready.motion_delay

    @property
    def plan(self) -> Mapping[str, Any]:
        """The plan: what is simulated, why, and what is left out."""
        return self._protocol.plan

    @property
    def over_area(self) -> bool:
        """Whether the finger may go anywhere over an area: `y` has an effect, and `direction` is allowed."""
        return self._protocol.over_area

    @property
    def changed_frame(self) -> int | None:
        """The frame at which the newest cross-fade to a changed scene begins; None before the first."""
        return self._protocol.changed_frame

    # The state of the stream

    @property
    def frame(self) -> int:
        """The number of the next frame to be read."""
        return self._protocol.frame

    @property
    def applied(self) -> Applied | None:
        """(seq, frame): the newest update that the sound follows, and its first frame; None before the first."""
        return self._protocol.applied

    @property
    def problems(self) -> tuple[Problem, ...]:
        """The problems that the service reported during the stream, the newest last."""
        return tuple(self._protocol.problems)

    @property
    def gain_reduction_db(self) -> float:
        """The last reduction by the safety limiter that the service reported, in dB."""
        return self._protocol.gain_reduction_db

    @property
    def skipped(self) -> float:
        """Seconds for which the service reported that it was late and silent (realtime)."""
        return self._protocol.skipped

    @property
    def underruns(self) -> int:
        """How often a device that plays each block as `read` returns it would have run dry."""
        return self._protocol.underrun_counter.underruns

    @property
    def late(self) -> float:
        """Seconds of sound received and not read: the delay that they add."""
        return self._protocol.waiting / self._ready.sample_rate

    @property
    def reconnections(self) -> int:
        """The number of reconnections."""
        return self._protocol.reconnections

    @property
    def gaps(self) -> tuple[int, ...]:
        """The frames at which a new session begins; the sound is interrupted there."""
        return self._protocol.gaps

    @property
    def _ready(self) -> Ready:
        if self._protocol.ready is None:
            raise not_open()
        return self._protocol.ready


def not_open() -> ClientError:
    """Return the exception for using a stream that is not open."""
    return ConnectionLost("the stream is not open: use it inside `with`")


def _ways_fault(**given: float | None) -> Fault:
    """Return the fault of a move that does not state in exactly one way where the finger is."""
    names = " and ".join(name for name, value in given.items() if value is not None)
    allowed = "position, or x and y; direction only with x and y"
    return Fault("", names or "no position, x or y", allowed, "Write move(x=0.01, y=0.02, load=0.3), for example.")
