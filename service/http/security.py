"""What stands before the routes: Host, Origin and key checks, answers to our own bugs, and the security headers.

Pure ASGI, one layer each, in this order from outside:
    Bouncer   refuses a Host that is not allowed (DNS rebinding: another site's name that resolves to this machine) and
              a write, or a WebSocket, from a web page of another origin; adds headers; turns our bugs into a 500.
    KeyCheck  asks for a Bearer key where RIDGEWAVE_API_KEYS is set; a WebSocket may offer it as a subprotocol,
              `ridgewave.key.` and the key in base64url. Keys are compared in constant time, never echoed or logged.
Between the two stands CORS where RIDGEWAVE_ALLOWED_ORIGINS names someone: a preflight carries no key.
Limits: without a key, any program on this machine may call; these checks keep web pages out, not programs.
"""

from __future__ import annotations

import base64
import hmac
import logging
import uuid

from starlette.requests import ClientDisconnect
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service.http.rate_limits import KEY
from service.operations.logs import request_line
from service.operations.settings import Settings
from service.problems import Problem

log = logging.getLogger("ridgewave.service")

READING = frozenset({"GET", "HEAD", "OPTIONS"})
OPEN_PATHS = frozenset({"/", "/vr", "/docs", "/openapi.json", "/healthz", "/readyz"})  # need no key, tell no secrets
OPEN_FOLDER = "/web/"  # the same for the files of the page: a browser loads them before anyone could give it a key
KEY_PROTOCOL = "ridgewave.key."
HEADERS = (
    (b"x-content-type-options", b"nosniff"),
    (b"cross-origin-resource-policy", b"same-origin"),
    (b"referrer-policy", b"no-referrer"),
)


def header(scope: Scope, name: bytes) -> str | None:
    """Return the header `name` (lower case) of a request, or None; two of a kind count as none that can be trusted."""
    values = [value for key, value in scope["headers"] if key == name]
    if len(values) > 1:
        raise Problem("bad-request", f"The header {name.decode()} stands {len(values)} times.")
    return values[0].decode("latin-1") if values else None


class Bouncer:
    """The outermost layer; see the module."""

    def __init__(self, app: ASGIApp, settings: Settings) -> None:
        self._app = app
        self._hosts = frozenset(host.lower() for host in (*settings.allowed_hosts, _bound_name(settings.host)))
        self._origins = frozenset(origin.lower() for origin in settings.allowed_origins)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Check one request or WebSocket, then hand it on."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        if scope["type"] == "websocket":
            await self._websocket(scope, receive, send)
            return
        started = False

        async def send_with_headers(message: Message) -> None:
            nonlocal started
            if message["type"] == "http.response.start":
                started = True
                given = message.get("headers", ())
                names = {name for name, _ in given}
                message["headers"] = [*given, *(entry for entry in HEADERS if entry[0] not in names)]
            await send(message)

        try:
            self._check(scope)
            await self._app(scope, receive, send_with_headers)
        except ClientDisconnect:
            return  # nobody is left to answer
        except Problem as problem:
            await refuse(problem, scope, receive, send_with_headers)
        except Exception:
            mistake = our_bug(scope)
            if started:
                return  # the server cuts the answer short, which is all a peer should learn
            await refuse(mistake, scope, receive, send_with_headers)

    async def _websocket(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Check one WebSocket, then hand it on with nothing between it and the server: it sends many messages."""
        try:
            self._check(scope)
            await self._app(scope, receive, send)
        except Problem as problem:
            await refuse(problem, scope, receive, send)

    def _check(self, scope: Scope) -> None:
        host = header(scope, b"host") or ""
        if "*" not in self._hosts and _without_port(host) not in self._hosts:
            raise Problem("host-refused", "This service does not answer to that Host. See RIDGEWAVE_ALLOWED_HOSTS.")
        if scope["type"] == "http" and scope["method"] in READING:
            return
        origin = header(scope, b"origin")
        if origin is None:
            foreign = header(scope, b"sec-fetch-site") in ("cross-site", "same-site")
        else:
            foreign = origin.lower() not in self._origins and not _same_origin(origin, host)
        if foreign:
            raise Problem("origin-refused", "Pages of another origin may not do this. See RIDGEWAVE_ALLOWED_ORIGINS.")


class KeyCheck:
    """Lets a request pass that carries one of the keys, or asks for an open path or a file of the page."""

    def __init__(self, app: ASGIApp, settings: Settings) -> None:
        self._app = app
        self._keys = tuple(key.encode("ascii") for key in settings.api_keys)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Check one request, then hand it on."""
        if scope["type"] in ("http", "websocket") and not self._may_pass(scope):
            challenge = {"WWW-Authenticate": 'Bearer realm="ridgewave"'}
            problem = Problem("key-required", "Send Authorization: Bearer KEY with one of the keys.", headers=challenge)
            await refuse(problem, scope, receive, send)
            return
        await self._app(scope, receive, send)

    def _may_pass(self, scope: Scope) -> bool:
        if not self._keys or scope["path"] in OPEN_PATHS or scope["path"].startswith(OPEN_FOLDER):
            return True
        scheme, _, token = (header(scope, b"authorization") or "").partition(" ")
        given = token.strip().encode("latin-1") if scheme.lower() == "bearer" else _offered_key(scope)
        matches = [hmac.compare_digest(given, key) for key in self._keys]  # every key, whatever the first says
        if not any(matches):
            return False
        scope[KEY] = matches.index(True)  # for the limits: the key's number, never the key
        return True


def _offered_key(scope: Scope) -> bytes:
    """Return the key that a WebSocket offers as a subprotocol, since a web page cannot set its headers; else b""."""
    offered = [name[len(KEY_PROTOCOL) :] for name in scope.get("subprotocols", ()) if name.startswith(KEY_PROTOCOL)]
    if len(offered) != 1:
        return b""
    text = offered[0].rstrip("=")
    try:
        return base64.b64decode(text + "=" * (-len(text) % 4), b"-_", validate=True)
    except ValueError:
        return b""


def our_bug(scope: Scope) -> Problem:
    """Log the exception being handled under a new id, and return the problem that names the id and nothing else."""
    instance = f"urn:uuid:{uuid.uuid4()}"
    log.exception("our mistake %s: %s", instance, request_line(scope), extra={"instance": instance})
    return Problem("internal", "A mistake of the service's own, not of the request.", instance=instance)


async def refuse(problem: Problem, scope: Scope, receive: Receive, send: Send) -> None:
    """Answer with `problem`, and count it.

    A WebSocket is refused before it opens, with the same document where the server can.
    """
    scope["app"].state.service.metrics.refused(problem.kind)
    if scope["type"] == "websocket" and "websocket.http.response" not in scope.get("extensions", {}):
        await send({"type": "websocket.close", "code": 1008, "reason": problem.kind})
    else:
        await problem.response()(scope, receive, send)


def _bound_name(host: str) -> str:
    """Return the Host name of the address that the service listens on; the wildcards are nobody's name."""
    if host in ("0.0.0.0", "::"):
        return "localhost"
    return f"[{host}]" if ":" in host else host


def _without_port(host: str) -> str:
    """Return the name in a Host header, lower case, with its brackets if it is an IPv6 address."""
    host = host.strip().lower()
    if host.startswith("["):
        name, bracket, rest = host.partition("]")
        return name + bracket if not rest or (rest[0] == ":" and rest[1:].isdigit()) else ""
    name, colon, port = host.partition(":")
    return name.removesuffix(".") if not colon or port.isdigit() else ""


def _same_origin(origin: str, host: str) -> bool:
    """Return whether `origin` is the page of this very service; behind a TLS proxy the scheme may be either."""
    scheme, _, place = origin.strip().lower().partition("://")
    return scheme in ("http", "https") and bool(place) and place == host.strip().lower()
