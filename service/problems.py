"""Problem documents (RFC 9457): the shape of every error answer of the service.

    {"type", "title", "status", "detail", "errors": [{"pointer", "value", "allowed", "hint"}]}

`errors` is always present, even when empty. A 500 adds `instance`, the id under which the log has the details.
`TYPES` lists every problem. docs/problems.md and the page /docs describe each of them; `type` links to that page.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from starlette.responses import Response

from synth.errors import CannotRender, Fault, InvalidRequest, RidgewaveError, SceneError

MEDIA_TYPE = "application/problem+json"


@dataclass(frozen=True, slots=True)
class ProblemType:
    """One kind of problem.

    name: the part of `type` behind "#problem-".
    status: of the HTTP answer.
    title: the same for every problem of the kind.
    when: a sentence on when it happens.
    """

    name: str
    status: int
    title: str
    when: str

    @property
    def uri(self) -> str:
        """The `type` of the document: a link to the paragraph of the page /docs that describes the problem."""
        return f"/docs#problem-{self.name}"


_ROWS = (
    ("bad-request", 400, "Malformed request", "The request's framing or headers are invalid."),
    (
        "protocol",
        400,
        "Unsupported protocol",
        "The WebSocket offers neither the subprotocol ridgewave.v2 nor ridgewave.v1.",
    ),
    ("key-required", 401, "A key is required", "Keys are set, and the request has none of them as its Bearer token."),
    ("host-refused", 403, "Host not allowed", "The Host header is not in RIDGEWAVE_ALLOWED_HOSTS."),
    ("origin-refused", 403, "Origin not allowed", "A write came from a web page of another origin."),
    (
        "not-found",
        404,
        "Not found",
        "No such route, session, play, texture or table; an expired or stopped session is gone.",
    ),
    ("method-not-allowed", 405, "Method not allowed", "The route exists, but not with this method; see Allow."),
    ("not-acceptable", 406, "No acceptable sound format", "Accept names no format in which this sound can be sent."),
    (
        "slow-reader",
        408,
        "Read too slowly",
        "A live stream is read slower than it plays; past RIDGEWAVE_SLOW_READER it ends.",
    ),
    ("busy", 409, "Already in use", "The session already has a reader or a play, or the device plays another session."),
    ("fixed", 409, "Fixed for the session", "Rate, channels, quantity and full scale do not change in a session."),
    ("name-taken", 409, "Name taken", "A recording or a texture of that name exists; neither is ever overwritten."),
    (
        "too-large",
        413,
        "Body too large",
        "The body is larger than RIDGEWAVE_MAX_BODY, or RIDGEWAVE_MAX_IMPORT for an import.",
    ),
    ("too-costly", 413, "Too costly", "This render alone would take more processor time than one client may use."),
    (
        "store-full",
        413,
        "No room for the texture",
        "The key keeps as much as RIDGEWAVE_TEXTURES_PER_KEY or _TEXTURE_BYTES_PER_KEY allows; delete a texture.",
    ),
    ("not-json", 415, "Not JSON", "Bodies are application/json; a form is read for an import only."),
    ("not-multipart", 415, "Not a form", "An import is a multipart/form-data body with the file."),
    ("range-refused", 416, "No such bytes", "Range begins behind the end, or among the samples of an endless stream."),
    (
        "scene-refused",
        422,
        "The scene is refused",
        "The scene has a fault, or no contact of it can be solved; see `errors`.",
    ),
    (
        "request-refused",
        422,
        "The request is refused",
        "A parameter, or a body that is not a scene, is invalid; see `errors`.",
    ),
    (
        "message-refused",
        422,
        "The message is refused",
        "A live message is invalid, or not allowed now; see `errors`.",
    ),
    (
        "too-fast",
        429,
        "Too many messages",
        "Live messages wait because more than RIDGEWAVE_MAX_UPDATES come per second, or too many changes wait at once.",
    ),
    ("rate-limited", 429, "Too many requests", "More requests than RIDGEWAVE_REQUESTS_PER_SECOND; see Retry-After."),
    (
        "too-many-streams",
        429,
        "Too many streams",
        "The key or the address has as many streams as RIDGEWAVE_STREAMS_PER_KEY or _PER_ADDRESS allows.",
    ),
    (
        "too-many-renders",
        429,
        "Too many renders",
        "Together with the client's other renders it would take more than RIDGEWAVE_RENDER_SECONDS_PER_CLIENT.",
    ),
    (
        "too-many-imports",
        429,
        "Too many imports",
        "The client has RIDGEWAVE_IMPORTS_PER_CLIENT imports under way, or they hold _IMPORT_BYTES_PER_CLIENT.",
    ),
    ("internal", 500, "Internal error", "A bug of ridgewave. The log has the details under the id in `instance`."),
    ("cannot-render", 503, "Not possible here", "The request is valid, but this machine cannot carry it out."),
    ("full", 503, "Full", "The limit on sessions, renders, imports or measurements is reached; see Retry-After."),
    ("one-worker", 503, "Sessions need one worker", "Sessions live in one process: start the service with one worker."),
    ("starved", 503, "Too busy", "Short work has waited for more than a second; `/readyz` reports it."),
    ("warming", 503, "Not ready yet", "The service has just started and is still compiling its kernels."),
    ("closing", 503, "Shutting down", "The service is shutting down."),
)
TYPES: Mapping[str, ProblemType] = {row[0]: ProblemType(*row) for row in _ROWS}


@dataclass(eq=False)
class Problem(Exception):
    """Raised anywhere in the service to answer with a problem document."""

    kind: str
    detail: str
    faults: tuple[Fault, ...] = ()
    headers: Mapping[str, str] = field(default_factory=dict)
    instance: str | None = None

    def document(self, root_path: str = "") -> dict[str, Any]:
        """Return the JSON document. root_path: the setting, for its link."""
        kind = TYPES[self.kind]
        document: dict[str, Any] = {
            "type": root_path + kind.uri,
            "title": kind.title,
            "status": kind.status,
            "detail": self.detail,
            "errors": [
                {"pointer": fault.pointer, "value": fault.value, "allowed": fault.allowed, "hint": fault.hint}
                for fault in self.faults
            ],
        }
        return document if self.instance is None else document | {"instance": self.instance}

    def response(self, root_path: str) -> Response:
        """Return the HTTP answer. root_path: the setting, for its link."""
        headers = {"Cache-Control": "no-store", **self.headers}
        body = json.dumps(self.document(root_path), ensure_ascii=True, allow_nan=False).encode("ascii")
        return Response(body, TYPES[self.kind].status, headers, media_type=MEDIA_TYPE)


def of(error: RidgewaveError) -> Problem:
    """Return the problem document of an error that `synth` raised."""
    if isinstance(error, InvalidRequest):
        kind = "scene-refused" if isinstance(error, SceneError) else "request-refused"
        return Problem(kind, summary(error.faults), error.faults)
    assert isinstance(error, CannotRender)
    return Problem("cannot-render", error.reason)


def refused(pointer: str, value: str, allowed: str, hint: str, kind: str = "request-refused") -> Problem:
    """Return a problem with one fault; the `pointer` of a query parameter is "?name"."""
    fault = Fault(pointer, value, allowed, hint)
    return Problem(kind, fault.sentence(), (fault,))


def summary(faults: Sequence[Fault]) -> str:
    """Return the first fault as a sentence, and the number of the others."""
    if not faults:
        return "The request is refused."
    return faults[0].sentence() + (f" ({len(faults) - 1} more)" if len(faults) > 1 else "")
