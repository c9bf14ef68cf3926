"""The service of `fake_live` behind a WebSocket on loopback, and a proxy that resets connections at a given byte."""

from __future__ import annotations

import asyncio
import contextlib
import json
import socket
import struct
import threading
from collections.abc import Iterable, Iterator
from contextlib import contextmanager

from websockets.asyncio.server import ServerConnection, serve
from websockets.datastructures import Headers
from websockets.exceptions import ConnectionClosed
from websockets.http11 import Request, Response
from websockets.typing import Subprotocol

from tests.clients.live_client.fake_live import RATE, Answer, Close, Peer, Service

PATIENCE = 20.0


class LoopbackService:
    """Serves `service` in a thread; key: the key that a client must offer. requests: the opening requests received."""

    def __init__(self, service: Service, key: str | None = None) -> None:
        self.service, self.key = service, key
        self.requests: list[Request] = []
        self.url = self.http = ""
        self._loop = asyncio.new_event_loop()
        self._started = threading.Event()
        self._stop = asyncio.Event()
        self._thread = threading.Thread(target=self._loop.run_until_complete, args=(self._serve(),), daemon=True)

    def __enter__(self) -> LoopbackService:
        self._thread.start()
        assert self._started.wait(PATIENCE)
        return self

    def __exit__(self, *_: object) -> None:
        self._loop.call_soon_threadsafe(self._stop.set)
        self._thread.join(PATIENCE)
        assert not self._thread.is_alive()
        self._loop.close()

    async def _serve(self) -> None:
        names = [Subprotocol(self.service.protocol)]
        async with serve(
            self._handle, "127.0.0.1", 0, subprotocols=names, process_request=self._admit, compression=None
        ) as server:
            place = f"127.0.0.1:{next(iter(server.sockets)).getsockname()[1]}"
            self.url, self.http = f"ws://{place}/v1/live", f"http://{place}"
            self._started.set()
            await self._stop.wait()

    def _admit(self, _: ServerConnection, request: Request) -> Response | None:
        self.requests.append(request)
        if request.path.endswith("/recording"):
            name = request.path.split("/")[3]
            return _json(200, {"contacts": self.service.sessions[name].notes})
        offered = request.headers.get("Sec-WebSocket-Protocol", "")
        if self.key is not None and f"ridgewave.key.{self.key}" not in offered:
            document = {"type": "/docs#problem-key-required", "title": "A key is required", "status": 401}
            return _json(401, {**document, "detail": "Send a key.", "errors": []})
        return None

    async def _handle(self, connection: ServerConnection) -> None:
        answers: asyncio.Queue[Answer] = asyncio.Queue()
        peer = self.service.connect(answers.put_nowait)
        tasks = [asyncio.create_task(work) for work in (self._write(connection, answers), self._pace(peer))]
        try:
            with contextlib.suppress(ConnectionClosed):
                async for message in connection:
                    peer.receive(message)
        finally:
            peer.lost()
            for task in tasks:
                task.cancel()

    async def _write(self, connection: ServerConnection, answers: asyncio.Queue[Answer]) -> None:
        with contextlib.suppress(ConnectionClosed):
            while True:
                answer = await answers.get()
                if isinstance(answer, Close):
                    await connection.close(answer.code or 1011, answer.reason)
                    return
                await connection.send(answer)

    async def _pace(self, peer: Peer) -> None:
        while True:
            await asyncio.sleep(0.01)
            session = peer.session
            if session is not None and session.pacing == "realtime":
                peer.tick(max(1, round(0.01 * RATE / session.block)))


def _json(status: int, document: object) -> Response:
    body = json.dumps(document).encode()
    headers = Headers({"Content-Type": "application/json", "Content-Length": str(len(body)), "Connection": "close"})
    return Response(status, "", headers, body)


@contextmanager
def cutting(url: str, cuts: Iterable[int | None]) -> Iterator[str]:
    """Yield the address of a proxy to `url` that resets each connection after so many bytes from the server.

    Connections beyond `cuts` are not cut, nor those whose cut is None.
    """
    scheme, _, rest = url.partition("://")
    place, _, path = rest.partition("/")
    host, _, port = place.partition(":")
    listener = socket.create_server(("127.0.0.1", 0))
    threads: list[threading.Thread] = []
    limits = iter(cuts)

    def accept() -> None:
        while True:
            try:
                client, _ = listener.accept()
            except OSError:
                return
            server = socket.create_connection((host, int(port)))
            for sock in (client, server):
                sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            for work, arguments in ((_up, (client, server)), (_down, (server, client, next(limits, None)))):
                thread = threading.Thread(target=work, args=arguments, daemon=True)
                thread.start()
                threads.append(thread)

    acceptor = threading.Thread(target=accept, daemon=True)
    acceptor.start()
    try:
        yield f"{scheme}://127.0.0.1:{listener.getsockname()[1]}/{path}"
    finally:
        listener.shutdown(socket.SHUT_RDWR)
        listener.close()
        acceptor.join(PATIENCE)
        for thread in threads:
            thread.join(PATIENCE)


def _up(client: socket.socket, server: socket.socket) -> None:
    with contextlib.suppress(OSError):
        while data := client.recv(65536):
            server.sendall(data)
    with contextlib.suppress(OSError):
        server.shutdown(socket.SHUT_WR)


def _down(server: socket.socket, client: socket.socket, left: int | None) -> None:
    with contextlib.suppress(OSError):
        while data := server.recv(65536):
            if left is not None and len(data) > left:
                client.sendall(data[:left])
                break
            left = None if left is None else left - len(data)
            client.sendall(data)
    for sock in (server, client):
        with contextlib.suppress(OSError):
            sock.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
            sock.shutdown(socket.SHUT_RD)
        sock.close()


@contextmanager
def silenced(url: str, *, stalled: bool = False) -> Iterator[tuple[str, threading.Event]]:
    """Yield the address of a proxy to `url`, and what makes its first connection pass nothing more, and not end.

    stalled: what comes is not even taken from then on, so that the sender's buffers fill up.
    """
    host, _, port = url.removeprefix("ws://").partition("/")[0].partition(":")
    silence = threading.Event()
    listener = socket.create_server(("127.0.0.1", 0))
    pairs: list[socket.socket] = []
    over = threading.Event()

    def pass_on(source: socket.socket, sink: socket.socket, mute: threading.Event | None) -> None:
        with contextlib.suppress(OSError):  # the other direction has broken it, as a network would
            while data := source.recv(65536):
                if mute is None or not mute.is_set():
                    sink.sendall(data)
                elif stalled:
                    over.wait(PATIENCE)
            sink.shutdown(socket.SHUT_WR)

    def accept() -> None:
        mute: threading.Event | None = silence
        while True:
            try:
                client, _ = listener.accept()
            except OSError:
                return
            server = socket.create_connection((host, int(port)))
            pairs.extend((client, server))
            for source, sink in ((client, server), (server, client)):
                threading.Thread(target=pass_on, args=(source, sink, mute), daemon=True).start()
            mute = None

    thread = threading.Thread(target=accept, daemon=True)
    thread.start()
    try:
        yield f"ws://127.0.0.1:{listener.getsockname()[1]}/v1/live", silence
    finally:
        over.set()
        listener.shutdown(socket.SHUT_RDWR)
        listener.close()
        thread.join(PATIENCE)
        for sock in pairs:
            sock.close()
