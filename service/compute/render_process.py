"""The processes that renders run in: copies of one that is warm, each ended the moment that nobody waits for it.

    python -m service.compute.render_process FD CACHE_BYTES    the warm one, which copies itself for whoever asks on FD

Model: a thread in the midst of a solve cannot be stopped, and holds up the end of its process; a process can be killed
    at any moment and holds up nothing. The warm process has loaded the solver's kernels, in one thread, so a copy of it
    (fork) is there in some 4 ms. A copy speaks to the service over a socket of its own: orders and "go on" come in,
    messages go out, as fast as they are read. It ends itself when that socket is closed, whether its client went, the
    service ends, or the service was killed. One that has done its order is kept for the next, with all that it has
    solved. Each order has a thread of its own there, which runs at the lowest priority once it has become long work;
    Linux lets a thread have a priority, and the next order's begins at the usual one.
Limits: fork: Linux and macOS. On macOS a whole process has a priority, so that a copy that did long work is not kept.
    What a copy solves, no other process has.
"""

from __future__ import annotations

import asyncio
import gc
import json
import os
import resource
import signal
import socket
import struct
import subprocess
import sys
import threading
import traceback
from collections.abc import Callable
from contextlib import suppress
from dataclasses import asdict
from pathlib import Path
from typing import Any

from service import problems
from service.compute.render_steps import Answer, Message, Order, Price, work
from service.problems import Problem
from synth.errors import CannotRender, Fault, RidgewaveError

ROOT = Path(__file__).resolve().parents[2]  # what the process imports, wherever it is started
HEAD = struct.Struct("!cI")  # kind and length of what follows
ORDER, GO, LOWER = b"O", b"G", b"L"
PRICE, ANSWER, BYTES, END, REFUSAL, MISTAKE = b"P", b"A", b"D", b"E", b"R", b"M"
LOWEST_PRIORITY = 19
BY_THREAD = sys.platform == "linux"  # a thread has a priority
KEPT = 2  # idle copies that are kept: as many as compute at a time, and each may hold a cache of its own
BUFFER_BYTES = 1 << 18  # of a message that the service holds before it stops reading


class RenderMistake(Exception):
    """A mistake of ours in a render process; its text is the traceback there, for the log."""


# In the service


class Copies:
    """The warm process and the copies that are idle. seconds: of processor that an order may take in all."""

    def __init__(self, cache_bytes: int, seconds: float) -> None:
        self._cache_bytes, self._seconds = cache_bytes, seconds
        self._warm: subprocess.Popen[bytes] | None = None
        self._control: socket.socket | None = None
        self._idle: list[Copy] = []
        self._lock = threading.Lock()
        self._turn = asyncio.Lock()
        self._closed = False

    def start(self) -> None:
        """Have the warm process be there and warm; for a thread, a second. Where it is being started, wait for that."""
        with self._lock:
            if self._closed or self._ready():
                return
            ours, theirs = socket.socketpair()
            path = os.pathsep.join(filter(None, (str(ROOT), os.environ.get("PYTHONPATH"))))
            arguments = [
                sys.executable,
                "-m",
                "service.compute.render_process",
                str(theirs.fileno()),
                str(self._cache_bytes),
            ]
            one_thread = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1")
            environment = {**os.environ, **one_thread, "PYTHONPATH": path}
            with theirs:
                self._warm = subprocess.Popen(
                    arguments, env=environment, stdin=subprocess.DEVNULL, pass_fds=[theirs.fileno()]
                )
            started = ours.recv(1)
            if self._closed:
                return
            if not started:
                raise RuntimeError("the process that renders are copied from did not start")
            self._control = ours

    def _ready(self) -> bool:
        return self._control is not None and self._warm is not None and self._warm.poll() is None

    async def open(self, order: Order, body: bytes) -> Copy:
        """Return a copy that works at `order`."""
        while self._idle and not self._idle[-1].there:
            self._idle.pop().end()
        copy = self._idle.pop() if self._idle else await self._copied()
        copy.begin(order, body, self._seconds)
        return copy

    async def _copied(self) -> Copy:
        if not self._ready():
            async with self._turn:  # so that one thread waits, and not one for each request
                await asyncio.to_thread(self.start)
        if self._closed or self._control is None:
            raise Problem("closing", "The service is shutting down.")
        ours, theirs = socket.socketpair()
        with theirs:
            socket.send_fds(self._control, [b"c"], [theirs.fileno()])
        reader, writer = await asyncio.open_unix_connection(sock=ours, limit=BUFFER_BYTES)
        return Copy(ours, reader, writer, self._keep)

    def _keep(self, copy: Copy) -> None:
        if len(self._idle) < KEPT and not self._closed:
            self._idle.append(copy)
        else:
            copy.end()

    def close(self) -> None:
        """End the idle copies and the warm process."""
        self._closed = True
        while self._idle:
            self._idle.pop().end()
        if self._control is not None:
            self._control.close()
            self._control = None
        if self._warm is not None:
            self._warm.kill()
            self._warm.wait()


class Copy:
    """One order under way in a copy."""

    def __init__(
        self,
        ours: socket.socket,
        reader: asyncio.StreamReader,
        writer: asyncio.StreamWriter,
        keep: Callable[[Copy], None],
    ) -> None:
        self._socket, self._reader, self._writer, self._keep = ours, reader, writer, keep
        self._loop = asyncio.get_running_loop()
        self._lowered = self._over = False

    @property
    def there(self) -> bool:
        """Return whether it can take another order."""
        return not self._reader.at_eof() and self._loop is asyncio.get_running_loop()

    def begin(self, order: Order, body: bytes, seconds: float) -> None:
        """Have it work at `order`."""
        self._over = self._lowered = False
        text = json.dumps({"order": asdict(order), "seconds": seconds}).encode()
        self._tell(ORDER, struct.pack("!I", len(text)) + text + body)

    def go_on(self) -> None:
        """Have it compute what it told the price of."""
        self._tell(GO)

    def lower(self) -> None:
        """Have it go on at the lowest priority."""
        if not self._lowered:
            self._lowered = True
            self._tell(LOWER)

    async def next(self) -> Message:
        """Return the next message, None after the last; raises Problem, or RenderMistake, where the work did."""
        try:
            kind, size = HEAD.unpack(await self._reader.readexactly(HEAD.size))
            told = await self._reader.readexactly(size)
        except (asyncio.IncompleteReadError, OSError):
            raise CannotRender(
                "The render was ended before it was done: it took more processor time, or more memory, than it may."
            ) from None
        if kind == BYTES:
            return told
        if kind == PRICE:
            return Price(**json.loads(told))
        if kind == ANSWER:
            return Answer(**json.loads(told))
        self._over = True
        if kind == REFUSAL:
            document = json.loads(told)
            raise Problem(document["kind"], document["detail"], tuple(Fault(**one) for one in document["faults"]))
        if kind == MISTAKE:
            raise RenderMistake(f"in a render process:\n{told.decode()}")
        return None

    def close(self) -> None:
        """Keep the copy where its order is over, else end it: within milliseconds it takes no processor time."""
        if self._over and (BY_THREAD or not self._lowered):
            self._keep(self)
        else:
            self.end()

    def end(self) -> None:
        """End the copy."""
        if self._loop.is_closed():
            self._socket.close()
        else:
            self._writer.transport.abort()

    def _tell(self, kind: bytes, body: bytes = b"") -> None:
        self._writer.write(HEAD.pack(kind, len(body)) + body)


# In the processes


def main() -> None:
    """Be the warm process until the service has gone."""
    for number in (signal.SIGINT, signal.SIGTERM):  # the service hears them, and has its renders end
        signal.signal(number, signal.SIG_IGN)
    signal.signal(signal.SIGCHLD, signal.SIG_IGN)  # a copy that has ended leaves nothing behind
    control = socket.socket(fileno=int(sys.argv[1]))
    control.set_inheritable(False)
    engine = _warm_engine(int(sys.argv[2]))
    gc.collect()
    gc.freeze()
    control.sendall(b"r")
    while True:
        asked, descriptors, _, _ = socket.recv_fds(control, 1, 1)
        if not asked:
            return
        if os.fork() == 0:
            control.close()
            _Copied(engine, socket.socket(fileno=descriptors[0])).run()
        os.close(descriptors[0])


def _warm_engine(cache_bytes: int) -> Any:
    from service.engine import SynthEngine
    from synth.scene.scene import parse_scene

    engine = SynthEngine(cache_bytes)
    engine.load_following()  # not for renders: the service compiles the other half of what live voices need meanwhile
    engine.open_voice(parse_scene({})).render(480)
    return engine


class _Copied:
    """The end of a copy's socket that is in the copy."""

    def __init__(self, engine: Any, peer: socket.socket) -> None:
        self._engine, self._peer = engine, peer
        self._go = threading.Event()

    def run(self) -> None:
        """Take what the service says until it closes the socket, while a thread computes."""
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        thread = threading.current_thread()
        try:
            while True:
                kind, size = HEAD.unpack(self._read(HEAD.size))
                body = self._read(size)
                if kind == ORDER:
                    self._go.clear()
                    thread = threading.Thread(target=self._work, args=(body,), daemon=True)
                    thread.start()
                elif kind == GO:
                    self._go.set()
                else:
                    with suppress(ProcessLookupError):  # the thread has just ended
                        lowered = thread.native_id if BY_THREAD else None
                        os.setpriority(os.PRIO_PROCESS, lowered or os.getpid(), LOWEST_PRIORITY)
        finally:
            os._exit(0)

    def _read(self, size: int) -> bytes:
        parts = []
        while size:
            part = self._peer.recv(size)
            if not part:
                os._exit(0)
            parts.append(part)
            size -= len(part)
        return b"".join(parts)

    def _work(self, told: bytes) -> None:
        try:
            self._answer(told)
        except Exception:
            self._tell(MISTAKE, traceback.format_exc().encode())

    def _answer(self, told: bytes) -> None:
        (size,) = struct.unpack_from("!I", told)
        asked, body = json.loads(told[4 : 4 + size]), told[4 + size :]
        used = resource.getrusage(resource.RUSAGE_SELF)
        bound = int(used.ru_utime + used.ru_stime + asked["seconds"]) + 1
        resource.setrlimit(resource.RLIMIT_CPU, (bound, resource.RLIM_INFINITY))
        try:
            for message in work(self._engine, Order(**asked["order"]), body):
                self._send(message)
        except (Problem, RidgewaveError) as error:
            problem = error if isinstance(error, Problem) else problems.of(error)
            faults = [asdict(fault) for fault in problem.faults]
            document = {"kind": problem.kind, "detail": problem.detail, "faults": faults}
            self._tell(REFUSAL, json.dumps(document).encode())
        else:
            self._tell(END)

    def _send(self, message: Message) -> None:
        if isinstance(message, bytes):
            self._tell(BYTES, message)
        elif isinstance(message, Answer):
            self._tell(ANSWER, json.dumps(asdict(message)).encode())
        elif isinstance(message, Price):
            self._tell(PRICE, json.dumps(asdict(message)).encode())
            self._go.wait()

    def _tell(self, kind: bytes, body: bytes = b"") -> None:
        try:
            self._peer.sendall(HEAD.pack(kind, len(body)) + body)
        except OSError:
            os._exit(0)  # the service has closed the socket


if __name__ == "__main__":
    main()
