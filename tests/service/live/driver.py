"""Drives the state machine of a connection without network and real time: a day takes a second.

`Driver` performs the actions as `Connection` does, immediately and in order. The test moves its clock.
"""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np
import numpy.typing as npt

from service.engine import Engine
from service.live.actions import Close, Detach, Finish, OpenVoice, Prepare, Resume, Send
from service.live.contact_update import IS_SPEED, LAYOUT, NO_DIRECTION, NO_LOAD, PLACE_LAYOUT
from service.live.conversation import Conversation, Phase
from service.live.live_stream import LiveStream, open_stream
from service.live.messages import V1, Version
from service.operations.settings import Settings
from service.problems import Problem, of
from service.sessions.fixed_output import changed_scene
from synth.errors import RidgewaveError
from synth.scene.scene import parse_scene
from tests.service.harness import settings_of
from tests.service.plain_engine import PlainEngine
from tests.service.plain_hand import PlainHand

RATE = 48000
BLOCK = 480
SILENCE = 0.25
DEFAULTS = settings_of(max_stream=31_536_000.0)


def contact(seq: int, *, load: float | None = 0.3, position: float = 0.0, speed: float | None = None) -> bytes:
    """Return a contact update in its binary form."""
    flags = (IS_SPEED if speed is not None else 0) | (NO_LOAD if load is None else 0)
    value = position if speed is None else speed
    return LAYOUT.pack(1, flags, 0, seq, 0.0, value, 0.0 if load is None else load)


def place(
    seq: int, x: float, y: float, *, direction: float | None = None, load: float | None = 0.3, time: float = 0.0
) -> bytes:
    """Return the binary form of a contact at a place of a texture over an area."""
    flags = (NO_DIRECTION if direction is None else 0) | (NO_LOAD if load is None else 0)
    return PLACE_LAYOUT.pack(2, flags, 0, seq, time, x, y, direction or 0.0, load or 0.0)


class Driver:
    """One connection. sent: what the client received, in order: texts as documents, PCM as bytes."""

    def __init__(
        self,
        settings: Settings | None = None,
        streams: dict[str, LiveStream] | None = None,
        now: float = 100.0,
        engine: Engine | None = None,
        version: Version = V1,
    ) -> None:
        self.now = now
        self.plain = PlainEngine()
        self.engine = engine or self.plain
        self.streams = {} if streams is None else streams
        self.machine = Conversation(settings or DEFAULTS, now, version)
        self.sent: list[dict[str, Any] | bytes] = []
        self.times: list[float] = []
        self.closed: Close | None = None
        self.finished = self.detached = False
        self.holding = False
        self.scene = parse_scene({})
        self.held: list[OpenVoice | Prepare] = []

    # In

    def say(self, kind: str, **fields: Any) -> None:
        """Send a text message."""
        self.text(json.dumps({"type": kind, **fields}))

    def text(self, text: str) -> None:
        """Send any text."""
        self.machine.text(text, self.now)
        self.perform()

    def binary(self, data: bytes) -> None:
        """Send bytes."""
        self.machine.binary(data, self.now)
        self.perform()

    def hello(self, **fields: Any) -> dict[str, Any]:
        """Say hello and return `ready`."""
        self.say("hello", **fields)
        return self.texts("ready")[0]

    # The part of `Connection`

    def perform(self) -> None:
        """Perform the actions."""
        while actions := self.machine.take_actions():
            for action in actions:
                self._perform(action)

    def _perform(self, action: Any) -> None:
        if isinstance(action, OpenVoice | Prepare) and self.holding:
            self.held.append(action)
            return
        match action:
            case Send():
                assert self.closed is None, "a message after the close"
                self.sent.append(json.loads(action.message))
                self.times.append(self.now)
            case OpenVoice():
                self._open(action)
            case Resume():
                stream = self.streams.get(action.session)
                if stream is None:
                    self.machine.end("policy", Problem("not-found", "No such session."))
                else:
                    self.machine.opened(stream, self.now)
            case Prepare():
                self._change(action)
            case Detach():
                self.detached = True
            case Finish():
                self.finished = True
            case Close():
                assert self.closed is None, "closed twice"
                self.closed = action

    def _change(self, action: Prepare) -> None:
        stream, scale = self.stream, tuple(self.stream.voice.full_scale)
        try:
            self.scene = changed_scene(self.scene, action.patch, scale)
            stream.change(stream.prepare(self.scene))
        except (RidgewaveError, Problem) as error:
            self.machine.refuse(as_problem(error))

    def _open(self, action: OpenVoice) -> None:
        try:
            self.scene, stream = open_stream(
                self.engine, f"s{len(self.streams)}", action.scene, action.options, SILENCE
            )
        except (RidgewaveError, Problem) as error:
            self.machine.end("policy", as_problem(error))
            return
        self.streams[stream.name] = stream
        if self.machine.phase is Phase.OPENING:
            self.machine.opened(stream, self.now)

    def release(self) -> None:
        """Perform the held actions."""
        self.holding = False
        held, self.held = self.held, []
        for action in held:
            self._perform(action)
        self.perform()

    def write(self, most: float = math.inf) -> int:
        """Send at most `most` of the blocks that are due; return how many were sent."""
        count = 0
        while count < most and (block := self.machine.next_block(lambda: self.now)):
            self.perform()
            messages = block.messages
            if messages is None:
                messages = self.machine.messages(self.stream.render(block.frames), block.frames, self.now)
            self.machine.blocks.pace.writing(self.now)
            for message in messages:
                self.sent.append(message if isinstance(message, bytes) else json.loads(message))
                self.times.append(self.now)
            self.machine.blocks.pace.written(self.now)
            self.perform()
            count += 1
        self.perform()
        return count

    def run(self, seconds: float) -> None:
        """Let time pass, each block sent when it is due."""
        until = self.now + seconds
        while self.machine.phase not in (Phase.OVER,):
            self.write()
            wait = self.machine.wait(self.now)
            if wait is None or self.now + wait > until:
                break
            self.now += wait
        self.now = until

    def pull(self, frames: int) -> None:
        """Grant credit and receive its blocks."""
        self.say("more", frames=frames)
        self.write()

    # Received

    @property
    def stream(self) -> LiveStream:
        """The stream of the session."""
        assert self.machine.stream is not None
        return self.machine.stream

    @property
    def hand(self) -> PlainHand:
        """The voice, of the plain engine."""
        return self.plain.hands[-1]

    def texts(self, kind: str) -> list[dict[str, Any]]:
        """Return the text messages of a kind."""
        return [message for message in self.sent if isinstance(message, dict) and message["type"] == kind]

    def blocks(self) -> list[bytes]:
        """Return the PCM messages."""
        return [message for message in self.sent if isinstance(message, bytes)]

    def pcm(self) -> npt.NDArray[np.float32]:
        """Return all of the PCM, of f32le mono."""
        return np.frombuffer(b"".join(self.blocks()), "<f4")

    def order(self) -> list[str]:
        """Return the kinds of all messages in order, "pcm" for sound."""
        return [message["type"] if isinstance(message, dict) else "pcm" for message in self.sent]


def as_problem(error: RidgewaveError | Problem) -> Problem:
    """Return a refusal as a problem."""
    return error if isinstance(error, Problem) else of(error)


def started(pacing: str = "realtime", version: Version = V1, **fields: object) -> Driver:
    """Return a connection that has received `ready`."""
    driver = Driver(version=version)
    driver.hello(pacing=pacing, **fields)
    return driver


def problem_of(driver: Driver) -> dict[str, Any]:
    """Return the newest problem."""
    return driver.texts("problem")[-1]
