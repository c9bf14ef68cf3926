"""Messages between the workers of one service: a question to all others, and their answers.

Model: each worker has a Unix datagram socket with a random name in a private folder (mode 0700), which the parent makes
    and removes. Every socket in the folder is a worker. A socket that refuses belongs to a dead worker and is removed.
    `ask` sends the question before it returns. If a worker's queue is full, the question is sent again until it fits,
    so that every live worker gets a stop. Answers are awaited for a bounded time.
Limits: a worker that hangs acts on the question when it continues. Unix only. Whoever may write into the folder (the
    user of the service) may ask any question.
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

FOLDER_VARIABLE = "_RIDGEWAVE_SIBLINGS"  # set by the parent for its workers; not a setting
AGAIN_SECONDS = 0.005  # between attempts at a full queue; a stop must silence streams within 20 ms
GIVE_UP_TRIES = 2000  # 10 s
LONGEST_PATH = 100  # bytes of a socket's path; Linux permits 108, macOS 104, with the final zero
MESSAGE_BYTES = 65_536

Answers = Mapping[str, Callable[[], dict[str, Any]]]
"""The action for each question, which returns the answer. Called in the event loop."""


class Question:
    """A question, and the answers that have arrived."""

    def __init__(self, asked: set[str]) -> None:
        self.answers: list[dict[str, Any]] = []
        self._waiting = asked
        self._all = asyncio.Event()
        self._look()

    @property
    def unanswered(self) -> int:
        """Return the number of live workers that have not answered."""
        return len(self._waiting)

    async def wait(self, patience: float) -> list[dict[str, Any]]:
        """Return the answers when all have arrived, or after `patience` seconds those that have."""
        with suppress(TimeoutError):
            await asyncio.wait_for(self._all.wait(), patience)
        return self.answers

    def take(self, name: str, answer: dict[str, Any] | None) -> None:
        """Take the answer of the worker `name`; None if the worker is dead."""
        if name in self._waiting:
            self._waiting.discard(name)
            if answer is not None:
                self.answers.append(answer)
        self._look()

    def _look(self) -> None:
        if not self._waiting:
            self._all.set()


class WorkerMessages:
    """One worker's connection to the others. Without a folder there are none. For one event loop."""

    def __init__(self, folder: Path | None, answers: Answers) -> None:
        self.name = secrets.token_hex(8)
        self._folder = folder
        self._can_answer = answers
        self._socket: socket.socket | None = None
        self._questions: dict[str, Question] = {}

    def open(self) -> None:
        """Begin to answer questions, in the running event loop."""
        if self._folder is None:
            return
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        self._socket.bind(str(self._path(self.name)))
        asyncio.get_running_loop().add_reader(self._socket, self._read)

    def close(self) -> None:
        """Leave the folder. Further calls do nothing."""
        if self._socket is not None:
            with suppress(RuntimeError):  # the loop is closed
                asyncio.get_running_loop().remove_reader(self._socket)
            self._socket.close()
            self._socket = None
            self._path(self.name).unlink(missing_ok=True)

    def present(self) -> set[str]:
        """Return the names of the other workers."""
        if self._folder is None:
            return set()
        names = {entry.removesuffix(".sock") for entry in os.listdir(self._folder) if entry.endswith(".sock")}
        return names - {self.name}

    def ask(self, what: str) -> Question:
        """Send the question `what` to all others; on return it has left, except where a queue is full."""
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
        """Handle the messages that have arrived."""
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
            reply = {"answer": answer, "number": message["number"], "from": self.name}
            self._send(message["from"], reply, None)
        elif question := self._questions.get(message["number"]):
            question.take(message["from"], message["answer"])

    def _path(self, name: str) -> Path:
        assert self._folder is not None
        return self._folder / f"{name}.sock"


def check_folder(folder: Path) -> None:
    """Raise CannotRender if paths of sockets in `folder` would be too long for the system."""
    if len(os.fsencode(folder)) + 1 + 16 + len(".sock") > LONGEST_PATH:
        raise CannotRender("the path of the folder for temporary files is too long for sockets: set a shorter TMPDIR.")
