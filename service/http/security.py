"""The checks of Host, Origin and key, the security headers, and the answer to an internal error.

Two ASGI layers, the outer one first:
    Bouncer   refuses a Host that is not allowed (DNS rebinding: a foreign name that resolves to this machine), and a
              write or a WebSocket from a web page of another origin. Adds headers. Answers internal errors by a 500,
              and requests that a shutdown cancels by a 503.
    KeyCheck  requires a Bearer key if the settings have keys. A WebSocket may offer its key as a subprotocol,
              `ridgewave.key.` and the key in base64url. Keys are compared in constant time, and never echoed or logged.
CORS stands between the two, because a preflight request carries no key.
Limits: without keys, any program on this machine may call the service: the checks keep web pages out, not programs.
"""

from __future__ import annotations

import asyncio
import base64
import hmac
import logging
import uuid

from starlette.requests import ClientDisconnect
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service.http.rate_limits import KEY
from service.operations.logs import request_line
from service.operations.owners import owners, owners_of_keys
from service.operations.settings import Settings
from service.problems import Problem

log = logging.getLogger("ridgewave.service")

READING = frozenset({"GET", "HEAD", "OPTIONS"})
OPEN_PATHS = frozenset(
    {"/", "/vr", "/docs", "/openapi.json", "/healthz", "/readyz"}
)  # require no key: they contain no secrets
OPEN_FOLDER = "/web/"  # likewise: a browser loads the files of the page before the user can enter a key
KEY_PROTOCOL = "ridgewave.key."
HEADERS = (
    (b"x-content-type-options", b"nosniff"),
    (b"cross-origin-resource-policy", b"same-origin"),
    (b"referrer-policy", b"no-referrer"),
    (b"cache-control", b"no-store"),
)


def header(scope: Scope, name: bytes) -> str | None:
    """Return the header `name` (lower case), or None; raises Problem if it is present more than once."""
    values = [value for key, value in scope["headers"] if key == name]
    if len(values) > 1:
        raise Problem("bad-request", f"The header {name.decode()} is present {len(values)} times.")
    return values[0].decode("latin-1") if values else None


class Bouncer:
    """The outer layer; see the module."""

    def __init__(self, app: ASGIApp, settings: Settings) -> None:
        self._app = app
        self._hosts = frozenset(host.lower() for host in (*settings.allowed_hosts, _bound_name(settings.host)))
        self._origins = frozenset(settings.allowed_origins)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Check a request or WebSocket and pass it on."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        if scope["type"] == "websocket":
            await self._websocket(scope, receive, send)
            return
        started = False

        async def send_with_headers(message: Message) -> None:
            """Send `message`; the first of an answer gets those of HEADERS that it lacks."""
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
            return  # no answer can be sent
        except asyncio.CancelledError:  # the server's timeout after a signal is over
            if started or not scope["app"].state.service.closing:
                raise
            await refuse(Problem("closing", "The service is shutting down."), scope, receive, send_with_headers)
        except Problem as problem:
            await refuse(problem, scope, receive, send_with_headers)
        except Exception:
            internal = our_bug(scope)
            if started:
                return  # the server closes the connection before the answer is complete
            await refuse(internal, scope, receive, send_with_headers)

    async def _websocket(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Check a WebSocket and pass it on. Its many messages go to the server directly."""
        try:
            self._check(scope)
            await self._app(scope, receive, send)
        except Problem as problem:
            await refuse(problem, scope, receive, send)

    def _check(self, scope: Scope) -> None:
        host = header(scope, b"host") or ""
        if "*" not in self._hosts and _without_port(host) not in self._hosts:
            raise Problem("host-refused", "This Host is not allowed. See RIDGEWAVE_ALLOWED_HOSTS.")
        if scope["type"] == "http" and scope["method"] in READING:
            return
        origin = header(scope, b"origin")
        if origin is None:
            foreign = header(scope, b"sec-fetch-site") in ("cross-site", "same-site")
        else:
            foreign = origin.lower() not in self._origins and not _same_origin(origin, host)
        if foreign:
            raise Problem("origin-refused", "Pages of another origin may not do this. See RIDGEWAVE_ALLOWED_ORIGINS.")


class Keys:
    """The keys of the settings, and their owners."""

    def __init__(self, settings: Settings) -> None:
        known, numbers = owners_of_keys(settings), owners(settings)
        self._keys = tuple(key.encode("ascii") for key in known)
        self._numbers = tuple(numbers.index(owner) for owner in known.values())
        self.required = settings.requires_key

    def owner(self, scope: Scope) -> int | None:
        """Return the number of the owner of the key in `scope`; None if it has no right key.

        Raises Problem if there are several Authorization headers.
        """
        scheme, _, token = (header(scope, b"authorization") or "").partition(" ")
        given = token.strip().encode("latin-1") if scheme.lower() == "bearer" else _offered_key(scope)
        matches = [hmac.compare_digest(given, key) for key in self._keys]  # compares all keys, for constant time
        return self._numbers[matches.index(True)] if any(matches) else None

    def admit(self, scope: Scope) -> bool:
        """Return whether `scope` has a right key, or none is required."""
        try:
            return not self.required or self.owner(scope) is not None
        except Problem:  # `KeyCheck` will refuse it
            return False


class KeyCheck:
    """Passes requests that carry one of the keys, and requests of open paths and files of the page."""

    def __init__(self, app: ASGIApp, settings: Settings, keys: Keys) -> None:
        self._app = app
        self._keys = keys
        self._open = OPEN_PATHS | {settings.root_path or "/"}  # with RIDGEWAVE_ROOT_PATH, the redirect to its page

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Check a request and pass it on."""
        if scope["type"] in ("http", "websocket") and not self._may_pass(scope):
            challenge = {"WWW-Authenticate": 'Bearer realm="ridgewave"'}
            problem = Problem("key-required", "Send Authorization: Bearer KEY with one of the keys.", headers=challenge)
            await refuse(problem, scope, receive, send)
            return
        await self._app(scope, receive, send)

    def _may_pass(self, scope: Scope) -> bool:
        if not self._keys.required or scope["path"] in self._open or scope["path"].startswith(OPEN_FOLDER):
            return True
        owner = self._keys.owner(scope)
        if owner is None:
            return False
        scope[KEY] = owner
        return True


def _offered_key(scope: Scope) -> bytes:
    """Return the key that a WebSocket offers as a subprotocol, or b"": a web page cannot set Authorization on it."""
    offered = [name[len(KEY_PROTOCOL) :] for name in scope.get("subprotocols", ()) if name.startswith(KEY_PROTOCOL)]
    if len(offered) != 1:
        return b""
    text = offered[0].rstrip("=")
    try:
        return base64.b64decode(text + "=" * (-len(text) % 4), b"-_", validate=True)
    except ValueError:
        return b""


def our_bug(scope: Scope) -> Problem:
    """Log the current exception under a new id; return a problem that contains only the id."""
    instance = f"urn:uuid:{uuid.uuid4()}"
    log.exception("our mistake %s: %s", instance, request_line(scope), extra={"instance": instance})
    return Problem("internal", "A bug of the service, not a fault of the request.", instance=instance)


async def refuse(problem: Problem, scope: Scope, receive: Receive, send: Send) -> None:
    """Answer with `problem`, and count it. A WebSocket gets the document too, if the server can send it."""
    service = scope["app"].state.service
    service.metrics.refused(problem.kind)
    if scope["type"] == "websocket" and "websocket.http.response" not in scope.get("extensions", {}):
        await send({"type": "websocket.close", "code": 1008, "reason": problem.kind})
    else:
        await problem.response(service.settings.root_path)(scope, receive, send)


def _bound_name(host: str) -> str:
    """Return the Host name of the address that the service listens on; "localhost" for all addresses."""
    if host in ("0.0.0.0", "::"):
        return "localhost"
    return f"[{host}]" if ":" in host else host


def _without_port(host: str) -> str:
    """Return the name in a Host header, in lower case; an IPv6 address keeps its brackets."""
    host = host.strip().lower()
    if host.startswith("["):
        name, bracket, rest = host.partition("]")
        return name + bracket if not rest or (rest[0] == ":" and rest[1:].isdigit()) else ""
    name, colon, port = host.partition(":")
    return name.removesuffix(".") if not colon or port.isdigit() else ""


def _same_origin(origin: str, host: str) -> bool:
    """Return whether `origin` is this service, by either scheme: a proxy may add TLS."""
    scheme, _, place = origin.strip().lower().partition("://")
    return scheme in ("http", "https") and bool(place) and place == host.strip().lower()
