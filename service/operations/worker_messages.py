"""How the workers of one service speak to each other: a question to all the others, and their answers.

Model: each worker has a Unix datagram socket of a random name in one private folder (mode 0700), which the parent
    makes and removes. Who is there is who has a socket; one that refuses is dead, and its socket is removed. A question
    leaves before its asker does anything else, and is put again to a worker whose queue is full, so that a stop is
    lost by none that lives. Answers are waited for a bounded time.
Limits: a worker that hangs answers late, and does what it was asked when it wakes. Unix only; who may write into the
    folder (the user that the service runs as) may ask anything.
"""

from __future__ import annotations

import asyncio
import json
import logging
import os
import secrets
import socket
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from synth.errors import CannotRender

log = logging.getLogger("ridgewave.service")

FOLDER_VARIABLE = "_RIDGEWAVE_SIBLINGS"  # from the parent to its workers; no setting: nobody else has a use for it
AGAIN_SECONDS = 0.005  # until a full queue is tried again; a stop must be silence within 20 ms
GIVE_UP_TRIES = 2000  # 10 s, after which the parent has replaced a worker that hangs
LONGEST_PATH = 100  # bytes of a socket's path: 108 on Linux and 104 on macOS, with the end mark
MESSAGE_BYTES = 65_536

Answers = Mapping[str, Callable[[], dict[str, Any]]]
"""What a worker can be asked, and what it does and answers then; called in the event loop."""


class Question:
    """A question under way, and the answers that have come."""

    def __init__(self, asked: set[str]) -> None:
        self.answers: list[dict[str, Any]] = []
        self._waiting = asked
        self._all = asyncio.Event()
        self._look()

    @property
    def unanswered(self) -> int:
        """Return how many live workers have not answered."""
        return len(self._waiting)

    async def wait(self, patience: float) -> list[dict[str, Any]]:
        """Return the answers once all are there, or those that are there after `patience` seconds."""
        with suppress(TimeoutError):
            await asyncio.wait_for(self._all.wait(), patience)
        return self.answers

    def take(self, name: str, answer: dict[str, Any] | None) -> None:
        """Note the answer of a worker; None: it is dead."""
        if name in self._waiting:
            self._waiting.discard(name)
            if answer is not None:
                self.answers.append(answer)
        self._look()

    def _look(self) -> None:
        if not self._waiting:
            self._all.set()


class WorkerMessages:
    """The other workers, as one worker sees them; without a folder there are none. Of one event loop."""

    def __init__(self, folder: Path | None, answers: Answers) -> None:
        self.name = secrets.token_hex(8)
        self._folder = folder
        self._can_answer = answers
        self._socket: socket.socket | None = None
        self._questions: dict[str, Question] = {}

    def open(self) -> None:
        """Begin to answer, in the running event loop."""
        if self._folder is None:
            return
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        self._socket.bind(str(self._path(self.name)))
        asyncio.get_running_loop().add_reader(self._socket, self._read)

    def close(self) -> None:
        """Be gone; again is the same as once."""
        if self._socket is not None:
            with suppress(RuntimeError):  # the loop is closed already
                asyncio.get_running_loop().remove_reader(self._socket)
            self._socket.close()
            self._socket = None
            self._path(self.name).unlink(missing_ok=True)

    def present(self) -> set[str]:
        """Return the names of the others that have a socket."""
        if self._folder is None:
            return set()
        names = {entry.removesuffix(".sock") for entry in os.listdir(self._folder) if entry.endswith(".sock")}
        return names - {self.name}

    def ask(self, what: str) -> Question:
        """Put the question `what` to all the others; it has left, or waits for a full queue, on return."""
        others = self.present() if self._socket is not None else set()
        question, number = Question(set(others)), secrets.token_hex(8)
        if others:
            self._questions[number] = question
            asyncio.get_running_loop().call_later(GIVE_UP_TRIES * AGAIN_SECONDS, self._questions.pop, number, None)
        for name in others:
            self._send(name, {"ask": what, "number": number, "from": self.name}, question)
        return question

    def _send(self, name: str, message: dict[str, Any], question: Question | None, tries: int = 0) -> None:
        if self._socket is None:
            return
        try:
            self._socket.sendto(json.dumps(message).encode(), str(self._path(name)))
        except BlockingIOError:
            if tries < GIVE_UP_TRIES:
                loop = asyncio.get_running_loop()
                loop.call_later(AGAIN_SECONDS, self._send, name, message, question, tries + 1)
        except (ConnectionRefusedError, FileNotFoundError):
            self._path(name).unlink(missing_ok=True)
            if question is not None:
                question.take(name, None)
        except OSError:
            log.exception("our mistake: a worker could not be asked")

    def _read(self) -> None:
        """Take what has come; the loop calls it when there is something."""
        while self._socket is not None:
            try:
                text = self._socket.recv(MESSAGE_BYTES)
            except (BlockingIOError, InterruptedError):
                return
            try:
                self._take(json.loads(text))
            except Exception:
                log.exception("our mistake: a worker's message was not understood")

    def _take(self, message: dict[str, Any]) -> None:
        if "ask" in message:
            answer = self._can_answer[message["ask"]]()
            says = {"answer": answer, "number": message["number"], "from": self.name}
            self._send(message["from"], says, None)
        elif question := self._questions.get(message["number"]):
            question.take(message["from"], message["answer"])

    def _path(self, name: str) -> Path:
        assert self._folder is not None
        return self._folder / f"{name}.sock"


def check_folder(folder: Path) -> None:
    """Raise CannotRender where sockets in `folder` would have too long a path for the system."""
    if len(os.fsencode(folder)) + 1 + 16 + len(".sock") > LONGEST_PATH:
        raise CannotRender("the folder for temporary files has too long a name for sockets: set TMPDIR to a short one.")
