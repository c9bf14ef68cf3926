"""The log: a line an event on standard error, plain or JSON, that says which request and which session it belongs to.

Model: the outermost layer notes the request (method and path as it was sent, percent-encoded, so that no client writes
    lines of its own) and the session that its path names; a filter writes both into every record made meanwhile.
    uvicorn's loggers and Python's warnings go the same way.
Limits: an exception's text stands in the log and never in an answer. Keys stand in neither: uvicorn's own lines never
    go below "info", since the WebSocket library writes whole headers, keys included, at "debug". The id of a session
    is the right to use it, and stands in the log: keep the log to yourself.
"""

from __future__ import annotations

import logging
import logging.config
from contextvars import ContextVar
from dataclasses import dataclass

from starlette.types import ASGIApp, Receive, Scope, Send

PLAIN = "%(asctime)s %(levelname)s %(name)s: %(message)s"
SESSIONS = ("v1", "sessions")
WEBSOCKETS = "uvicorn.websockets"  # where uvicorn's lines for each connection go; `service.live` has better ones


@dataclass(slots=True)
class Subject:
    """What the events of a request are about; one object for all tasks that the request starts."""

    request: str
    session: str | None


_subject: ContextVar[Subject | None] = ContextVar("subject", default=None)


class SubjectFilter(logging.Filter):
    """Writes the request and the session into each record that does not name its own; lets all pass."""

    def filter(self, record: logging.LogRecord) -> bool:
        """Return True."""
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
            await self._app(scope, receive, send)
        finally:
            _subject.reset(token)


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
    quiet = {"level": logging.INFO if level == "debug" else max(logging.WARNING, least)}
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
            "loggers": {"ridgewave": ours}
            | dict.fromkeys(("uvicorn", "uvicorn.error", "uvicorn.access"), servers)
            | {WEBSOCKETS: quiet},
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
