"""What a person holds of a live stream, with or without threads: the hand that moves, and what is known of the sound.

Model: `LiveHand` is the part of `Live` and `AsyncLive` that never waits: it tells the core under the shell's guard and
    rouses whoever sends. What waits (opening, reading, stopping) is each shell's own.
"""

from __future__ import annotations

import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager
from typing import Any, Literal, TypedDict

from clients.client_errors import Problem
from clients.live_client.live_protocol import LiveCore, Reconnect, Wish, not_open
from clients.live_client.ready_message import Applied, Ready
from clients.live_client.reconnection import Backoff
from clients.live_client.websocket_connection import Address
from clients.live_client.wire_messages import document_of

DEFAULT_URL = "ws://127.0.0.1:8000/v1/live"


class LiveOptions(TypedDict, total=False):
    """The arguments of a live stream; see `LiveHand`."""

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


class LiveHand(ABC):
    """A live stream, opened by `with` (`async with`).

    scene: a partial scene as a mapping, or a `synth.Scene`; None is the default scene.
    url, key: where the service is, and the key if it wants one.
    format: "f32le", or "s16le" for half the bytes; blocks are float32 either way. block: frames of the service's blocks
    (None: 10 ms). pacing: "pull", the service renders what is read; "realtime", by its own clock.
    record: the service keeps what the hand did; see `recording`.
    ahead: frames to have ready beyond what is read; each delays the hand by as much, and hides as much of the network.
    reconnect: True goes on after a break without a gap, or raises ResumeLost; "new" opens a new session where that
    cannot be, and says so in `gaps`; False raises ConnectionLost. backoff: when to try again.
    clock: monotonic seconds, which also date the contacts.
    Raises InvalidRequest for arguments that cannot be.
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
        wish = Wish(document_of(scene), format, pacing, block, record, ahead)
        self._core = LiveCore(wish, clock, reconnect, backoff)

    @abstractmethod
    def _guarded(self) -> AbstractContextManager[Any]:
        """Return what keeps others out of the core, and rouses whoever waits for a change of it, on leaving."""

    # The hand

    def move(self, position: float, load: float | None = None) -> int:
        """Put the finger at `position` (m), pressed with `load` (N; None keeps the last).

        Returns the number of the update, which `applied` names once the sound follows it. Never waits: an update that
        was not sent yet gives way to this one. After `max_silence` seconds without one the service lifts the finger.
        """
        with self._guarded():
            return self._core.touch(position, False, load)

    def slide(self, speed: float, load: float | None = None) -> int:
        """Let the finger slide at `speed` (m/s), pressed with `load` (N; None keeps the last); else as `move`."""
        with self._guarded():
            return self._core.touch(speed, True, load)

    def lift(self) -> int:
        """Take the finger off, where it is: the sound fades with the load."""
        with self._guarded():
            return self._core.lift()

    def change(self, partial: Mapping[str, Any]) -> None:
        """Change the scene by a partial scene, cross-faded; `changed_frame` tells when. A refusal is in `problems`."""
        with self._guarded():
            self._core.change(partial)

    # The sound

    @property
    def session(self) -> str:
        """Return the id of the session."""
        return self._ready.session

    @property
    def sample_rate(self) -> int:
        """Return frames a second."""
        return self._ready.sample_rate

    @property
    def channels(self) -> int:
        """Return samples a frame."""
        return self._ready.channels

    @property
    def quantities(self) -> tuple[str, ...]:
        """Return the quantity of each channel."""
        return self._ready.quantities

    @property
    def full_scale(self) -> tuple[float, ...]:
        """Return the SI value of a sample of 1.0, one a channel."""
        return self._ready.full_scale

    @property
    def block(self) -> int:
        """Return the frames of the service's blocks."""
        return self._ready.block

    @property
    def max_silence(self) -> float:
        """Return the seconds without an update after which the service lifts the finger."""
        return self._ready.max_silence

    @property
    def motion_delay(self) -> float:
        """Return the seconds by which the sound follows the hand."""
        return self._ready.motion_delay

    @property
    def plan(self) -> Mapping[str, Any]:
        """Return what is simulated, why, and what is left out."""
        return self._core.plan

    @property
    def changed_frame(self) -> int | None:
        """Return the frame at which the cross-fade to the newest changed scene begins; None before any."""
        return self._core.changed_frame

    # How it goes

    @property
    def frame(self) -> int:
        """Return the number of the next frame to be read."""
        return self._core.frame

    @property
    def applied(self) -> Applied | None:
        """Return (seq, frame): the newest update that the sound follows, and its first frame; None before any."""
        return self._core.applied

    @property
    def problems(self) -> tuple[Problem, ...]:
        """Return what the service found wrong while the stream went on, the newest last."""
        return tuple(self._core.problems)

    @property
    def gain_reduction_db(self) -> float:
        """Return the largest reduction of the safety limiter that the service last told."""
        return self._core.gain_reduction_db

    @property
    def skipped(self) -> float:
        """Return the seconds for which the service said that it was late and silent (realtime)."""
        return self._core.skipped

    @property
    def underruns(self) -> int:
        """Return how often a device that plays each block as `read` returns it would have run dry."""
        return self._core.playout.underruns

    @property
    def late(self) -> float:
        """Return the seconds of sound that came and wait to be read: so much later is it heard."""
        return self._core.waiting / self._ready.sample_rate

    @property
    def reconnections(self) -> int:
        """Return how often the connection was made again."""
        return self._core.reconnections

    @property
    def gaps(self) -> tuple[int, ...]:
        """Return the frames at which a new session begins; the sound does not join there."""
        return self._core.gaps

    @property
    def _ready(self) -> Ready:
        if self._core.ready is None:
            raise not_open()
        return self._core.ready
