"""The processes that renders run in. Each render has one, so that it can be killed at any moment.

    python -m service.compute.render_process FD CACHE_BYTES FOLDER    the template process, which forks itself

Model: a thread cannot be stopped during a solve, and delays the end of its process; a process can be killed. The
    template process has loaded the solver's kernels, so that a copy of it (fork) is ready in about 4 ms. It has one
    thread only, as fork requires. A copy and the service communicate over a socket pair: the service sends orders,
    "go on" and "lower"; the copy sends messages as fast as they are read. A copy exits when its socket is closed, even
    if the service was killed. A copy that has finished its order is kept for the next one, with its cache. Each order
    runs in a thread of the copy. Long work gets the lowest priority. On Linux only its thread gets it, so that the next
    order begins at the usual priority.
Limits: fork needs Linux or macOS. On macOS priority belongs to the whole process, so a copy that did long work is not
    kept. Copies do not share their caches.
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
from service.compute.resource_bounds import bound
from service.problems import Problem
from service.store.store import Store
from synth.errors import CannotRender, Fault, RidgewaveError
from synth.linear_algebra import ONE_THREAD
from synth.surfaces.surface_data import add_source

ROOT = Path(__file__).resolve().parents[2]  # import path of the process
HEAD = struct.Struct("!cI")  # kind and length of what follows
ORDER, GO, LOWER = b"O", b"G", b"L"
PRICE, ANSWER, BYTES, END, REFUSAL, MISTAKE = b"P", b"A", b"D", b"E", b"R", b"M"
LOWEST_PRIORITY = 19
THREAD_PRIORITY = sys.platform == "linux"  # each thread has a priority of its own
KEPT = 2  # idle copies that are kept; each may hold a full cache
BUFFER_BYTES = 1 << 18  # read ahead from a copy; a slow client must not fill the memory of the service


class RenderMistake(Exception):
    """A bug in a render process. Its text is the traceback, for the log."""


# In the service


class Copies:
    """The template process and its idle copies."""

    def __init__(self, cache_bytes: int, seconds: float, folder: Path) -> None:
        """Start nothing yet. seconds: bound on the processor time of one order. folder: of imported textures."""
        self._cache_bytes, self._seconds, self._folder = cache_bytes, seconds, folder
        self._template: subprocess.Popen[bytes] | None = None
        self._control: socket.socket | None = None
        self._idle: list[Copy] = []
        self._lock = threading.Lock()
        self._turn = asyncio.Lock()
        self._closed = False

    def start(self) -> None:
        """Start the template process, or wait until it has started. Blocks for a second: call it from a thread."""
        with self._lock:
            if self._closed or self._ready():
                return
            ours, theirs = socket.socketpair()
            path = os.pathsep.join(filter(None, (str(ROOT), os.environ.get("PYTHONPATH"))))
            arguments = [
                sys.executable,
                "-Pm",
                "service.compute.render_process",
                str(theirs.fileno()),
                str(self._cache_bytes),
                str(self._folder.absolute()),
            ]
            environment = {**os.environ, **ONE_THREAD, "PYTHONPATH": path}
            with theirs:
                self._template = subprocess.Popen(
                    arguments, env=environment, stdin=subprocess.DEVNULL, pass_fds=[theirs.fileno()]
                )
            started = ours.recv(1)
            if self._closed:
                return
            if not started:
                raise RuntimeError("the template process of the renders did not start")
            self._control = ours

    def _ready(self) -> bool:
        return self._control is not None and self._template is not None and self._template.poll() is None

    async def open(self, order: Order, body: bytes) -> Copy:
        """Return a copy that has begun `order`."""
        while self._idle and not self._idle[-1].usable:
            self._idle.pop().end()
        copy = self._idle.pop() if self._idle else await self._forked()
        copy.begin(order, body, self._seconds)
        return copy

    async def _forked(self) -> Copy:
        if not self._ready():
            async with self._turn:  # one thread waits, not one per request
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
        """End the idle copies and the template process."""
        self._closed = True
        while self._idle:
            self._idle.pop().end()
        if self._control is not None:
            self._control.close()
            self._control = None
        if self._template is not None:
            self._template.kill()
            self._template.wait()


class Copy:
    """A copy, as the service sees it. Works at one order at a time."""

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
    def usable(self) -> bool:
        """Return whether the copy runs and can take another order."""
        return not self._reader.at_eof() and self._loop is asyncio.get_running_loop()

    def begin(self, order: Order, body: bytes, seconds: float) -> None:
        """Send `order`, with the scene in `body` and its bound of processor seconds."""
        self._over = self._lowered = False
        text = json.dumps({"order": asdict(order), "seconds": seconds}).encode()
        self._tell(ORDER, struct.pack("!I", len(text)) + text + body)

    def go_on(self) -> None:
        """Let the copy continue after it has sent its price."""
        self._tell(GO)

    def lower(self) -> None:
        """Lower the copy's work to the lowest priority."""
        if not self._lowered:
            self._lowered = True
            self._tell(LOWER)

    async def next(self) -> Message:
        """Return the next message, None after the last. Raises Problem, CannotRender or RenderMistake."""
        try:
            kind, size = HEAD.unpack(await self._reader.readexactly(HEAD.size))
            content = await self._reader.readexactly(size)
        except (asyncio.IncompleteReadError, OSError):
            raise CannotRender(
                "The render was stopped: it needed more processor time or more memory than is allowed."
            ) from None
        if kind == BYTES:
            return content
        if kind == PRICE:
            return Price(**json.loads(content))
        if kind == ANSWER:
            return Answer(**json.loads(content))
        self._over = True
        if kind == REFUSAL:
            document = json.loads(content)
            raise Problem(document["kind"], document["detail"], tuple(Fault(**one) for one in document["faults"]))
        if kind == MISTAKE:
            raise RenderMistake(f"in a render process:\n{content.decode()}")
        return None

    def close(self) -> None:
        """Keep the copy for the next order if this one is over; otherwise end the copy within milliseconds."""
        if self._over and (THREAD_PRIORITY or not self._lowered):
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
    """Serve as the template process until the service closes the socket."""
    for number in (signal.SIGINT, signal.SIGTERM):  # the service handles them and ends its renders
        signal.signal(number, signal.SIG_IGN)
    signal.signal(signal.SIGCHLD, signal.SIG_IGN)  # no zombies
    control = socket.socket(fileno=int(sys.argv[1]))
    control.set_inheritable(False)
    folder = Path(sys.argv[3])
    engine, store = _loaded_engine(int(sys.argv[2]), folder), Store(folder)
    add_source(store.surface)
    gc.collect()
    gc.freeze()
    control.sendall(b"r")
    while True:
        request, descriptors, _, _ = socket.recv_fds(control, 1, 1)
        if not request:
            return
        if os.fork() == 0:
            control.close()
            _Copied(engine, store, socket.socket(fileno=descriptors[0])).run()
        os.close(descriptors[0])


def _loaded_engine(cache_bytes: int, folder: Path) -> Any:
    from service.synth_engine import SynthEngine
    from synth.scene.scene import parse_scene

    engine = SynthEngine(cache_bytes, folder)
    engine.load_following()  # for live voices: the service compiles the other half meanwhile
    engine.open_voice(parse_scene({})).render(480)
    return engine


class _Copied:
    """A copy, as the process itself sees it."""

    def __init__(self, engine: Any, store: Store, peer: socket.socket) -> None:
        self._engine, self._store, self._peer = engine, store, peer
        self._go = threading.Event()

    def run(self) -> None:
        """Receive the orders of the service until it closes the socket; a thread computes meanwhile."""
        bound(resource.RLIMIT_CORE, 0)
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
                        lowered = thread.native_id if THREAD_PRIORITY else None
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

    def _work(self, request: bytes) -> None:
        try:
            self._answer(request)
        except Exception:
            self._tell(MISTAKE, traceback.format_exc().encode())

    def _answer(self, request: bytes) -> None:
        (size,) = struct.unpack_from("!I", request)
        settings, body = json.loads(request[4 : 4 + size]), request[4 + size :]
        used = resource.getrusage(resource.RUSAGE_SELF)
        bound(resource.RLIMIT_CPU, int(used.ru_utime + used.ru_stime + settings["seconds"]) + 1)
        try:
            for message in work(self._engine, Order(**settings["order"]), body, self._store):
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
