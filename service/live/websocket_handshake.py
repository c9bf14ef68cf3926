"""The handshake of a WebSocket: reads the upgrade request, and answers it with an upgrade or a refusal.

Model: the library websockets checks the request. What it finds becomes the scope of an ASGI application, or a problem.
Source: RFC 6455, 4.2; the ASGI specification, 2.4, "WebSocket" and "WebSocket Denial Response".
"""

from __future__ import annotations

import asyncio
import email.utils
from http import HTTPStatus
from typing import Any
from urllib.parse import unquote

from starlette.types import Message
from uvicorn import Config
from websockets.datastructures import Headers
from websockets.exceptions import InvalidMethod
from websockets.http11 import Request, Response
from websockets.server import ServerProtocol

from service.problems import Problem

UNREADABLE = "The head of the request has an invalid header, announces a body, or is too large for a WebSocket."


class Handshake:
    """The handshake of one connection. answer: to a request that has been read."""

    def __init__(self, conn: ServerProtocol) -> None:
        self._conn = conn
        self.answer: Response | None = None

    def read(self, request: bytes) -> Request | Problem:
        """Return the request for an upgrade, or what is wrong with it."""
        self._conn.receive_data(request)
        asked = next(iter(self._conn.events_received()), None)
        if isinstance(asked, Request):
            self.answer = self._conn.accept(asked)
            if self.answer.status_code == HTTPStatus.SWITCHING_PROTOCOLS:
                return asked
        return _invalid(self._conn.handshake_exc)

    def accept(self, message: Message) -> None:
        """Answer with an upgrade, as `websocket.accept` asks. The parser then has the answer to send."""
        answer = self.answer
        assert answer is not None
        for name, value in message.get("headers", ()):
            answer.headers[name.decode("latin-1")] = value.decode("latin-1")
        if message.get("subprotocol"):
            answer.headers["Sec-WebSocket-Protocol"] = message["subprotocol"]
        self._conn.send_response(answer)


def refusal_bytes(refusal: Message) -> bytes:
    """Return the answer without an upgrade. refusal: its status, headers and body, as in the messages of ASGI."""
    headers = Headers([(name.decode("latin-1"), value.decode("latin-1")) for name, value in refusal["headers"]])
    for name, value in (("Date", email.utils.formatdate(usegmt=True)), ("Connection", "close")):
        headers.setdefault(name, value)
    headers.setdefault("Content-Length", str(len(refusal["body"])))
    return Response(refusal["status"], HTTPStatus(refusal["status"]).phrase, headers, refusal["body"]).serialize()


def scope_of(asked: Request, transport: asyncio.Transport, config: Config) -> dict[str, Any]:
    """Return the scope of a handshake, without `state` and `extensions`."""
    raw_path, _, query = asked.path.partition("?")
    root, peer, own = config.root_path, *map(transport.get_extra_info, ("peername", "sockname"))
    offered = [name.strip() for line in asked.headers.get_all("Sec-WebSocket-Protocol") for name in line.split(",")]
    return {
        "type": "websocket",
        "asgi": {"version": config.asgi_version, "spec_version": "2.4"},
        "http_version": "1.1",
        "scheme": "wss" if transport.get_extra_info("sslcontext") else "ws",
        "server": tuple(own[:2]) if isinstance(own, tuple) else None,
        "client": tuple(peer[:2]) if isinstance(peer, tuple) else None,
        "root_path": root,
        "path": root + unquote(raw_path),
        "raw_path": (root + raw_path).encode("ascii"),
        "query_string": query.encode("ascii"),
        "headers": [
            (name.lower().encode("ascii"), value.encode("latin-1", "surrogateescape"))
            for name, value in asked.headers.raw_items()
        ],
        "subprotocols": offered,
    }


def _invalid(error: Exception | None) -> Problem:
    """Return the problem of an invalid handshake. It may name a header, but not its value, which may be a key."""
    if isinstance(error, InvalidMethod):
        return Problem("method-not-allowed", "A WebSocket is opened by GET.", headers={"Allow": "GET"})
    name = getattr(error, "name", None)
    return Problem("bad-request", f"{name} is invalid for a WebSocket (RFC 6455, 4.2.1)." if name else UNREADABLE)
