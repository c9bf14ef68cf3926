"""Request bodies: JSON by their media type, and no larger than the limit.

A body is refused by its Content-Type before a byte of it is read, so that a form post of another page does nothing, and
by its size while it is read, chunked or not. What the JSON says is read by `synth.scene.scene`, which is strict.
"""

from __future__ import annotations

from starlette.requests import Request

from service.problems import Problem

JSON = frozenset({"application/json"})
PATCH = JSON | {"application/merge-patch+json"}


async def read_body(
    request: Request, limit: int, media_types: frozenset[str] = JSON, *, optional: bool = False
) -> bytes:
    """Return the body of a JSON request; optional: nothing at all, without a Content-Type, is b"".

    Raises Problem: 415 for another media type, 413 beyond `limit` bytes.
    """
    given = request.headers.get("content-type")
    if given is None and optional and _has_no_body(request):
        return b""
    if (given or "").partition(";")[0].strip().lower() not in media_types:
        names = " or ".join(sorted(media_types))
        raise Problem("not-json", f"Send Content-Type: {names}.", headers={"Accept-Post": names})
    length = request.headers.get("content-length", "")
    if length.isdigit() and int(length) > limit:
        raise _too_large(limit)
    parts, total = [], 0
    async for part in request.stream():
        total += len(part)
        if total > limit:
            raise _too_large(limit)
        parts.append(part)
    return b"".join(parts)


def _has_no_body(request: Request) -> bool:
    return request.headers.get("content-length", "0") == "0" and "transfer-encoding" not in request.headers


def _too_large(limit: int) -> Problem:
    detail = f"The body may have {limit} bytes (RIDGEWAVE_MAX_BODY)."
    return Problem("too-large", detail, headers={"Connection": "close"})
