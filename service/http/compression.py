"""Answers of text are packed by gzip on their way, for who takes it; sound never is.

Model: Starlette's own layer packs. This one asks it only where Accept-Encoding allows gzip: there, "gzip;q=0" counts.
Limits: what a route has packed itself goes out as it is.
"""

from __future__ import annotations

from starlette.datastructures import Headers
from starlette.middleware.gzip import DEFAULT_EXCLUDED_CONTENT_TYPES, GZipMiddleware
from starlette.types import ASGIApp, Receive, Scope, Send

NEVER_PACKED = (*DEFAULT_EXCLUDED_CONTENT_TYPES, "application/octet-stream")  # sound, which is sent block by block
SHORTEST = 1000  # bytes of an answer: less fits into a packet or two
LEVEL = 5  # of gzip: a picture of 70 kB takes 1 ms and becomes 20 kB; higher levels gain a percent
NONE = ("q=0", "q=0.0", "q=0.00", "q=0.000")


class Packing:
    """The layer."""

    def __init__(self, app: ASGIApp) -> None:
        self._plain = app
        self._packed = GZipMiddleware(app, SHORTEST, LEVEL, exclude_content_types=NEVER_PACKED)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve a request, packed or not."""
        packs = scope["type"] == "http" and takes_gzip(Headers(scope=scope))
        await (self._packed if packs else self._plain)(scope, receive, send)


def takes_gzip(headers: Headers) -> bool:
    """Return whether Accept-Encoding allows gzip (RFC 9110, 12.5.3)."""
    for entry in ",".join(headers.getlist("accept-encoding")).split(","):
        coding, _, parameter = entry.partition(";")
        if coding.strip().lower() in ("gzip", "*"):
            return parameter.replace(" ", "").lower() not in NONE
    return False
