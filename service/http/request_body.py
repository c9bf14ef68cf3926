"""Request bodies of JSON, or of the media types that a route names, checked for their media type and their size.

The Content-Type is checked before a byte of the body is read, so a form that another page posts has no effect. The size
is checked while the body is read, whether its length was announced or not. `synth.scene.scene` parses the JSON.
"""

from __future__ import annotations

from starlette.requests import Request

from service.lifespan import service_of
from service.problems import Problem

JSON = frozenset({"application/json"})
PATCH = JSON | {"application/merge-patch+json"}


def media_type_of(request: Request) -> str:
    """Return the media type of a body, without parameters; "" where none is named."""
    return str(request.headers.get("content-type", "")).partition(";")[0].strip().lower()


async def read_body(request: Request, media_types: frozenset[str] = JSON, *, optional: bool = False) -> bytes:
    """Return the body of a request.

    media_types: those that the route reads.
    optional: a request without Content-Type and without a body returns b"".
    Raises Problem: 415 for another media type, 413 for a body larger than RIDGEWAVE_MAX_BODY.
    """
    given = request.headers.get("content-type")
    if given is None and optional and _has_no_body(request):
        return b""
    if media_type_of(request) not in media_types:
        names = names_of(media_types)
        raise Problem("not-json", f"Send Content-Type: {names}.", headers={"Accept-Post": names})
    check_not_packed(request, "not-json", names_of(media_types))
    limit = service_of(request).settings.max_body
    larger = too_large(limit, "RIDGEWAVE_MAX_BODY")
    length = request.headers.get("content-length", "")
    if length.isdigit() and int(length) > limit:
        raise larger
    parts, total = [], 0
    async for part in request.stream():
        total += len(part)
        if total > limit:
            raise larger
        parts.append(part)
    return b"".join(parts)


def names_of(media_types: frozenset[str]) -> str:
    """Return media types as the end of a sentence."""
    return " or ".join(sorted(media_types))


def check_not_packed(request: Request, kind: str, media_type: str) -> None:
    """Raise Problem `kind` (415) for a body with a Content-Encoding, such as gzip: it would be read as damaged."""
    coding = request.headers.get("content-encoding", "").strip().lower()
    if coding not in ("", "identity"):
        detail = f"Send {media_type} without Content-Encoding: packed bodies, such as gzip, are not read."
        raise Problem(kind, detail, headers={"Accept-Encoding": "identity"})


def too_large(limit: int, setting: str) -> Problem:
    """Return the problem of a body with more than `limit` bytes, which the setting `setting` gives."""
    detail = f"The body may have at most {limit} bytes ({setting})."
    return Problem("too-large", detail, headers={"Connection": "close"})


def _has_no_body(request: Request) -> bool:
    return request.headers.get("content-length", "0") == "0" and "transfer-encoding" not in request.headers
