"""The log: a line an event on standard error, plain or JSON, that says which request and which session it belongs to.

Model: the outermost layer notes the request (method and path as it was sent, percent-encoded, so that no client writes
    lines of its own) and the session that its path names; a filter writes both into every record made meanwhile.
    uvicorn's loggers and Python's warnings go the same way. At "debug" each request has a line of this module's: the
    server's own would hold the query.
Limits: an exception's text stands in the log and never in an answer. Keys stand in neither: no line holds a query,
    where a mistaken client may have put one, and no library logs headers (`WithoutHeaders`). The id of a session is the
    right to use it, and stands in the log: keep the log to yourself.
"""

from __future__ import annotations

import logging
import logging.config
from contextvars import ContextVar
from dataclasses import dataclass

from starlette.types import ASGIApp, Message, Receive, Scope, Send

PLAIN = "%(asctime)s %(levelname)s %(name)s: %(message)s"
SESSIONS = ("v1", "sessions")
STATUS_OF = {"websocket.accept": 101, "websocket.close": 403}  # of an answer to a WebSocket's upgrade, by its message

access = logging.getLogger("ridgewave.access")
CUT = "ASGI callable returned without completing response."
"""What uvicorn says, as an error, of an answer that is cut on purpose, as by a stop or a shutdown."""


@dataclass(slots=True)
class Subject:
    """What the events of a request are about; one object for all tasks that the request starts."""

    request: str
    session: str | None


_subject: ContextVar[Subject | None] = ContextVar("subject", default=None)


class SubjectFilter(logging.Filter):
    """Writes the request and the session into each record that does not name its own; lets all pass but CUT."""

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
    """The outermost layer: notes what the events of a request are about."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Hand the request on; what it starts (tasks, its answer) belongs to it too."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        token = _subject.set(Subject(request_line(scope), _session_in(scope["path"])))
        try:
            await self._app(scope, receive, _noting(scope, send) if access.isEnabledFor(logging.DEBUG) else send)
        finally:
            _subject.reset(token)


class WithoutHeaders(logging.LoggerAdapter[logging.Logger]):
    """The logger for a library that would log headers, keys included, at "debug": it has warnings and errors only."""

    def isEnabledFor(self, level: int) -> bool:
        """Return whether `level` is heard."""
        return level >= logging.WARNING and super().isEnabledFor(level)


def _noting(scope: Scope, send: Send) -> Send:
    """Return `send`, which logs the answer when it begins: at "debug" only, since it costs each message a call."""
    answered = False

    async def noting(message: Message) -> None:
        nonlocal answered
        status = message.get("status", STATUS_OF.get(message["type"]))
        if not answered and status is not None:
            answered = True
            host, port = scope.get("client") or ("-", 0)
            access.debug("%s:%d %s %d", host, port, request_line(scope), status)
        await send(message)

    return noting


def about_session(session: str) -> None:
    """Have the records of this request, in all its tasks, name `session` from here on: a live connection."""
    subject = _subject.get()
    if subject is None:
        _subject.set(Subject("", session))
    else:
        subject.session = session


def request_line(scope: Scope) -> str:
    """Return `GET /v1/textures`: the method ("WEBSOCKET" for one) and the path as it was sent, without its query."""
    raw: bytes | None = scope.get("raw_path")
    path: str = scope["path"] if raw is None else raw.partition(b"?")[0].decode("latin-1")
    return f"{scope.get('method', 'WEBSOCKET')} {path.encode('unicode_escape').decode('ascii')}"


def set_up_log(level: str, log_format: str = "text") -> None:
    """Log to standard error; log_format: "text", a plain line an event, or "json", an object a line."""
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
            "loggers": {"ridgewave": ours} | dict.fromkeys(("uvicorn", "uvicorn.error"), servers),
            "root": {"level": "WARNING", "handlers": ["stderr"]},
        }
    )


def _reserved() -> list[str]:
    """Return the fields of a record that stay out: all but those that are asked for, and uvicorn's coloured twin."""
    from pythonjsonlogger.core import RESERVED_ATTRS

    return [*RESERVED_ATTRS, "color_message"]


def _session_in(path: str) -> str | None:
    parts = path.split("/")[1:]
    return parts[2] if len(parts) > 2 and tuple(parts[:2]) == SESSIONS and parts[2] else None
