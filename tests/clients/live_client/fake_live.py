"""A service that speaks the live protocol without I/O, and whose sound says which frame and which update it belongs to.

Every sample is a whole number of 1/32768, so that it is the same as float32 and as int16. `Service` holds what outlives
a connection; `Peer` is one connection: messages in by `receive`, answers out through `deliver`.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

RATE = 8000
BLOCK = 80
KEPT = 8000  # frames of the past that a session keeps: one second
FULL_SCALE = 12.5
MAX_SILENCE_MS = 250.0
FADE = 80
CONTACT, PLACE = struct.Struct("<BBHIddf"), struct.Struct("<BBHIdddff")
NOTHING = -1  # the number of the update before any

Message = str | bytes


@dataclass(frozen=True)
class Close:
    """The end of a connection; code None: without a close frame."""

    code: int | None
    reason: str = ""


Answer = Message | Close


def sound(first: int, frames: int, channels: int, update: int = NOTHING, scene: int = 0) -> npt.NDArray[np.float32]:
    """Return `frames` from frame `first` on, [frames, channels], under update number `update`."""
    n = np.arange(first, first + frames, dtype=np.int64)[:, np.newaxis]
    channel = np.arange(channels, dtype=np.int64)[np.newaxis, :]
    steps = (n * 7919 + channel * 104729 + (update + 1) * 1299709 + scene * 15485863) % 65536 - 32768
    return (steps / 32768.0).astype(np.float32)


def encoded(block: npt.NDArray[np.float32], sample_format: str) -> bytes:
    if sample_format == "f32le":
        return block.astype("<f4").tobytes()
    integers: bytes = np.rint(block * 32768.0).astype("<i2").tobytes()
    return integers


@dataclass
class Session:
    """A session, which outlives its connections."""

    name: str
    sample_format: str
    pacing: str
    block: int
    channels: int
    frame: int = 0
    update: int = NOTHING
    scenes: int = 0
    past: bytes = b""
    waiting: tuple[int, ...] = ()
    changed: bool = False
    notes: list[dict[str, Any]] = field(default_factory=list)
    peer: Peer | None = None

    @property
    def frame_bytes(self) -> int:
        return self.channels * (4 if self.sample_format == "f32le" else 2)


def problem(name: str, status: int, detail: str, errors: list[dict[str, str]] | None = None) -> str:
    document = {"type": "problem", "problem": f"/docs#problem-{name}", "title": name, "status": status}
    return json.dumps({**document, "detail": detail, "errors": errors or []})


def unpacked(message: bytes) -> tuple[tuple[Any, ...], int]:
    """Return the fields of a contact update by its version, and its credit."""
    form = PLACE if message[0] == 2 else CONTACT
    credit = message[form.size :]
    assert len(credit) in (0, 4)
    return form.unpack(message[: form.size]), int.from_bytes(credit, "little")


@dataclass
class Service:
    """The service. said: all messages received. full: whether a new session gets 1013. protocol: the one it speaks."""

    sessions: dict[str, Session] = field(default_factory=dict)
    said: list[Message] = field(default_factory=list)
    full: bool = False
    protocol: str = "ridgewave.v2"

    @property
    def told(self) -> dict[str, bool]:
        """What `ready` and `scene` tell in version 2 only."""
        return {} if self.protocol == "ridgewave.v1" else {"over_area": False}

    def connect(self, deliver: Callable[[Answer], None]) -> Peer:
        return Peer(self, deliver)

    def forget(self) -> None:
        """Lose all sessions, as a restart does."""
        self.sessions.clear()

    def heard(self, kind: str) -> list[dict[str, Any]]:
        """Return the text messages of a kind that were received."""
        texts = [json.loads(message) for message in self.said if isinstance(message, str)]
        return [message for message in texts if message["type"] == kind]

    def contacts(self) -> list[tuple[Any, ...]]:
        return [unpacked(message)[0] for message in self.said if isinstance(message, bytes)]


class Peer:
    """One connection."""

    def __init__(self, service: Service, deliver: Callable[[Answer], None]) -> None:
        self.service, self._deliver = service, deliver
        self.session: Session | None = None
        self.position = self.credit = 0
        self.stopping = self.closed = False

    def receive(self, message: Message) -> None:
        """Take a message of the client."""
        if self.closed:
            return
        self.service.said.append(message)
        if isinstance(message, bytes):
            self._contact(message)
        else:
            document = json.loads(message)
            getattr(self, "_" + document["type"])(document)
        if self.session is not None and self.session.pacing == "pull":
            self._pump()

    def lost(self) -> None:
        """Note that the connection broke."""
        self.closed = True
        if self.session is not None and self.session.peer is self:
            self.session.peer = None

    def tick(self, blocks: int = 1) -> None:
        """Advance the clock of the service, if it sets the pace."""
        for _ in range(blocks):
            if self.session is not None and not self.closed:
                self._block(self.session.block)
                self._end_if_stopping()

    # Messages

    def _hello(self, document: dict[str, Any]) -> None:
        resume = document.get("resume")
        if resume is not None:
            assert set(document) == {"type", "resume"}
            self._resume(str(resume["session"]), int(resume["frame"]))
            return
        scene = document["scene"]
        if self.service.full:
            self._refuse(problem("full", 503, "As many sessions as there may be."), 1013)
            return
        if "nonsense" in scene:
            fault = {"pointer": "/nonsense", "value": "1", "allowed": "a field of a scene", "hint": "Leave it out."}
            self._refuse(problem("scene-refused", 422, "nonsense", [fault]), 1008)
            return
        name = f"session-{len(self.service.sessions)}-{len(self.service.said)}"
        channels = len(scene.get("output", {}).get("channels", [0]))
        session = Session(name, document["format"], document["pacing"], document.get("block", BLOCK), channels)
        self.service.sessions[name] = session
        self._attach(session, 0)

    def _resume(self, name: str, frame: int) -> None:
        session = self.service.sessions.get(name)
        kept = 0 if session is None else len(session.past) // session.frame_bytes
        if session is None or not session.frame - kept <= frame <= session.frame:
            self._refuse(problem("not-found", 404, "No such session, or no such frame of it."), 1008)
            return
        if session.peer is not None:
            session.peer.close(1008, "policy")
        self._attach(session, frame)

    def _attach(self, session: Session, frame: int) -> None:
        self.session, self.position, session.peer = session, frame, self
        self.say(
            type="ready", session=session.name, protocol=self.service.protocol, sample_rate=RATE,
            channels=session.channels, quantities=["acceleration"] * session.channels,
            full_scale=[FULL_SCALE] * session.channels, format=session.sample_format, block=session.block,
            pacing=session.pacing, recording=False, frame=frame, max_silence_ms=MAX_SILENCE_MS,
            motion_delay_ms=8.0, plan={"scenes": session.scenes}, **self.service.told,
        )  # fmt: skip

    def _more(self, document: dict[str, Any]) -> None:
        assert document["frames"] >= 1
        self._grant(document["frames"])

    def _grant(self, frames: int) -> None:
        assert frames <= 10_000_000
        self.credit += frames
        assert self.credit <= 60 * RATE

    def _contact(self, message: bytes) -> None:
        (version, flags, finger, seq, _, value, *_, load), credit = unpacked(message)
        self._grant(credit)
        assert version == 1 or (version == 2 and self.service.protocol == "ridgewave.v2" and not flags & 1)
        assert finger == 0 and flags <= (3 if version == 1 else 7) and self.session is not None
        if load > 500.0:
            self._deliver(problem("message-refused", 422, "load: too heavy"))
        elif seq > max((self.session.update, *self.session.waiting)):
            self.session.waiting = (seq,)
            self.session.notes.append({"seq": seq, "value": value})

    def _scene(self, document: dict[str, Any]) -> None:
        assert self.session is not None
        if "nonsense" in document["scene"]:
            self._deliver(problem("scene-refused", 422, "nonsense"))
        else:
            self.session.scenes += 1
            self.session.changed = True

    def _stop(self, _: dict[str, Any]) -> None:
        self.stopping = True
        if self.session is not None and self.session.pacing == "pull":
            self._block(FADE)
            self._end_if_stopping()

    # Sound

    def _pump(self) -> None:
        session = self.session
        assert session is not None
        while self.credit and not self.closed:
            self.credit -= self._block(min(session.block, self.credit))

    def _block(self, frames: int) -> int:
        """Send the next block, of at most so many frames; return its number of frames."""
        session = self.session
        assert session is not None
        behind = session.frame - self.position
        if behind:
            frames = min(frames, behind)
            start = len(session.past) - behind * session.frame_bytes
            samples = session.past[start : start + frames * session.frame_bytes]
        else:
            self._tell(session)
            block = sound(session.frame, frames, session.channels, session.update, session.scenes)
            samples = encoded(block, session.sample_format)
            session.past = (session.past + samples)[-KEPT * session.frame_bytes :]
            session.frame += frames
        self.position += frames
        self._deliver(samples)
        return frames

    def _tell(self, session: Session) -> None:
        if session.waiting:
            session.update, session.waiting = session.waiting[0], ()
            self.say(type="applied", seq=session.update, frame=session.frame)
        if session.changed:
            session.changed = False
            self.say(type="scene", frame=session.frame, plan={"scenes": session.scenes}, **self.service.told)

    def _end_if_stopping(self) -> None:
        if self.stopping:
            self.end("stopped", 1000)

    # Ends

    def end(self, reason: str, code: int) -> None:
        self.say(type="end", reason=reason, frame=self.position)
        if self.session is not None:
            self.service.sessions.pop(self.session.name, None)
        self.close(code, reason)

    def close(self, code: int | None, reason: str = "") -> None:
        self.lost()
        self._deliver(Close(code, reason))

    def say(self, **message: Any) -> None:
        self._deliver(json.dumps(message))

    def _refuse(self, told: str, code: int) -> None:
        self._deliver(told)
        self.say(type="end", reason="policy", frame=0)
        self.close(code, "policy")
