"""Whether a client has an answer already, by its ETag (RFC 9110, 13.1.2): then 304 is enough."""

from __future__ import annotations

from starlette.requests import Request


def is_known(request: Request, tag: str) -> bool:
    """Return whether If-None-Match names `tag`, in a weak comparison."""
    tags = ",".join(request.headers.getlist("if-none-match")).split(",")
    return any(one.strip().removeprefix("W/") in ("*", f'"{tag}"') for one in tags)
