"""The log on standard error: one line per event, plain or JSON, with the request and the session of the event.

Model: the outermost layer notes the request (method and path as sent, percent-encoded, so that no client can forge
    lines) and the session in its path. A filter adds both to every record that is made meanwhile. uvicorn's loggers
    and Python's warnings go the same way. At "debug" this module writes a line per request, because the server's own
    lines would hold the query.
Limits: the text of an exception is logged and never sent. Keys are never logged: no line holds a query, where a client
    may have put a key by mistake, and no library logs headers (`WithoutHeaders`). Ids of sessions are logged, and
    whoever knows an id may use the session: keep the log private.
"""

from __future__ import annotations

import logging
import logging.config
from contextvars import ContextVar
from dataclasses import dataclass

from starlette.types import ASGIApp, Message, Receive, Scope, Send

PLAIN = "%(asctime)s %(levelname)s %(name)s: %(message)s"
SESSIONS = ("v1", "sessions")
STATUS_OF = {"websocket.accept": 101, "websocket.close": 403}  # status of the answer to a WebSocket upgrade

access = logging.getLogger("ridgewave.access")
CUT = "ASGI callable returned without completing response."
"""uvicorn's error about an answer that was cut on purpose, by a stop or a shutdown."""


@dataclass(slots=True)
class Subject:
    """The request and session of events; all tasks of a request share one."""

    request: str
    session: str | None


_subject: ContextVar[Subject | None] = ContextVar("subject", default=None)


class SubjectFilter(logging.Filter):
    """Adds the request and the session to each record that has none of its own, and drops CUT."""

    def filter(self, record: logging.LogRecord) -> bool:
        """Return True for all but CUT."""
        if record.msg == CUT:
            return False
        subject = _subject.get()
        if subject is not None:
            if not hasattr(record, "request"):
                record.request = subject.request
            if subject.session is not None and not hasattr(record, "session"):
                record.session = subject.session
        return True


class Subjects:
    """The outermost layer: notes the request and the session."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass the request on. Its tasks inherit the subject."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        token = _subject.set(Subject(request_line(scope), _session_in(scope["path"])))
        try:
            await self._app(scope, receive, _noting(scope, send) if access.isEnabledFor(logging.DEBUG) else send)
        finally:
            _subject.reset(token)


class WithoutHeaders(logging.LoggerAdapter[logging.Logger]):
    """A logger of warnings and errors only, for a library that logs headers, keys included, at "debug"."""

    def isEnabledFor(self, level: int) -> bool:
        """Return whether records of `level` are logged."""
        return level >= logging.WARNING and super().isEnabledFor(level)


def _noting(scope: Scope, send: Send) -> Send:
    """Return a `send` that logs the status of the answer. Used at "debug" only: it costs a call per message."""
    answered = False

    async def noting(message: Message) -> None:
        """Send `message`, and log the status that it gives the request."""
        nonlocal answered
        status = message.get("status", STATUS_OF.get(message["type"]))
        if not answered and status is not None:
            answered = True
            host, port = scope.get("client") or ("-", 0)
            access.debug("%s:%d %s %d", host, port, request_line(scope), status)
        await send(message)

    return noting


def about_session(session: str) -> None:
    """Name `session` in all further records of this request, which is a live connection."""
    subject = _subject.get()
    if subject is None:
        _subject.set(Subject("", session))
    else:
        subject.session = session


def request_line(scope: Scope) -> str:
    """Return the method (or "WEBSOCKET") and the path as sent, without its query: `GET /v1/textures`."""
    raw: bytes | None = scope.get("raw_path")
    path: str = scope["path"] if raw is None else raw.partition(b"?")[0].decode("latin-1")
    return f"{scope.get('method', 'WEBSOCKET')} {path.encode('unicode_escape').decode('ascii')}"


def set_up_log(level: str, log_format: str = "text") -> None:
    """Log to standard error. log_format: "text" or "json", one line per event."""
    ours = {"level": level.upper(), "handlers": ["stderr"], "propagate": False}
    least = logging.getLevelNamesMapping()[level.upper()]
    servers = ours | {"level": max(logging.INFO, least)}
    json = {
        "()": "pythonjsonlogger.json.JsonFormatter",
        "fmt": ["levelname", "name", "message", "process"],
        "rename_fields": {"levelname": "level", "name": "logger"},
        "reserved_attrs": _reserved(),
        "timestamp": True,
    }
    logging.captureWarnings(True)
    logging.config.dictConfig(
        {
            "version": 1,
            "disable_existing_loggers": False,
            "filters": {"subject": {"()": SubjectFilter}},
            "formatters": {"text": {"format": PLAIN}, "json": json if log_format == "json" else {"format": PLAIN}},
            "handlers": {"stderr": {"class": "logging.StreamHandler", "formatter": log_format, "filters": ["subject"]}},
            "loggers": {
                "ridgewave": ours,
                **dict.fromkeys(("uvicorn", "uvicorn.error"), servers),
                "uvicorn.access": {"handlers": [], "propagate": False},  # in a worker this replaces `access_log`
            },
            "root": {"level": "WARNING", "handlers": ["stderr"]},
        }
    )


def _reserved() -> list[str]:
    """Return the fields of a record that JSON lines leave out."""
    from pythonjsonlogger.core import RESERVED_ATTRS

    return [*RESERVED_ATTRS, "color_message"]


def _session_in(path: str) -> str | None:
    parts = path.split("/")[1:]
    return parts[2] if len(parts) > 2 and tuple(parts[:2]) == SESSIONS and parts[2] else None
