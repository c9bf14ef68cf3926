"""The real service with the page of the web client, and with pages of the tests below `/test/`.

Model: a layer around the application answers `/test/...` from the folder `pages`, with the policy of the page; all else
    is the service's. `Breaker` is a port that stays, before a service that comes and goes.
"""

from __future__ import annotations

import contextlib
import mimetypes
import socket
import struct
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from starlette.responses import PlainTextResponse, Response
from starlette.types import ASGIApp, Receive, Scope, Send

from service.engine import Engine
from service.http.routes.page import POLICIES
from tests.service.harness import ROOT, Running, serving

PATIENCE = 20.0
WEB = ROOT / "clients" / "web"
OWN, PAGES = "/test/", Path(__file__).parent / "pages"
RST = struct.pack("ii", 1, 0)  # SO_LINGER: a close that resets


def with_pages(app: ASGIApp) -> ASGIApp:
    """Return `app` with the tests' own pages around it."""

    async def layer(scope: Scope, receive: Receive, send: Send) -> None:
        path = scope.get("path", "")
        if scope["type"] != "http" or not path.startswith(OWN):
            await app(scope, receive, send)
        else:
            await _file(path.removeprefix(OWN))(scope, receive, send)

    return layer


def _file(name: str) -> Response:
    path = (PAGES / name).resolve()
    if not (path.is_relative_to(PAGES) and path.is_file()):
        return PlainTextResponse("no such file", 404)
    kind = mimetypes.guess_type(path.name)[0] or "application/octet-stream"
    return Response(path.read_bytes(), media_type=kind, headers=POLICIES)


@contextmanager
def serving_pages(engine: Engine | None = None, **changes: Any) -> Iterator[Running]:
    """Yield the service with the page and those of the tests; `engine`: `synth` unless a test has its own."""
    with serving(engine, outside=with_pages, web=str(WEB), **changes) as running:
        yield running


class Breaker:
    """A port of its own that passes everything on to the service at `target`, None for nobody, and breaks when told."""

    def __init__(self, target: str | None) -> None:
        self.target = target
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.url = f"http://127.0.0.1:{self._listener.getsockname()[1]}"
        self._pairs: list[tuple[socket.socket, socket.socket]] = []
        self._threads = [threading.Thread(target=self._accept, daemon=True)]
        self._threads[0].start()

    def __enter__(self) -> Breaker:
        return self

    def __exit__(self, *_: object) -> None:
        self._listener.shutdown(socket.SHUT_RDWR)
        self._listener.close()
        self.reset()
        for thread in list(self._threads):
            thread.join(PATIENCE)

    def reset(self) -> None:
        """Reset every connection that there is, at both ends."""
        pairs, self._pairs = self._pairs, []
        for pair in pairs:
            for sock in pair:
                _reset(sock)

    def _accept(self) -> None:
        while True:
            try:
                client, _ = self._listener.accept()
            except OSError:
                return
            target = self.target
            try:
                place = urlsplit(target or "")
                server = socket.create_connection((place.hostname or "", place.port or 0))
            except OSError:
                _reset(client)
                continue
            self._pairs.append((client, server))
            for source, sink in ((client, server), (server, client)):
                sink.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                thread = threading.Thread(target=_pass_on, args=(source, sink), daemon=True)
                thread.start()
                self._threads.append(thread)


def _pass_on(source: socket.socket, sink: socket.socket) -> None:
    with contextlib.suppress(OSError):
        while data := source.recv(65536):
            sink.sendall(data)
    with contextlib.suppress(OSError):
        sink.shutdown(socket.SHUT_WR)


def _reset(sock: socket.socket) -> None:
    with contextlib.suppress(OSError):
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, RST)
        sock.shutdown(socket.SHUT_RD)  # wakes whoever reads; the linger resets at the close
    sock.close()
