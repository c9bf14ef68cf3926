"""`POST /v1/tables` makes the response table of a scene; `GET /v1/tables/{hash}` returns its file, which never changes.

Model: a table is identified by the hash of its content, and making it again gives the same hash. It belongs to no key,
    unless its scene has an imported surface: it is then found only by an owner who has imported that surface, and no
    shared cache may keep it.
Limits: the table stays as long as the cache of this process has room (RIDGEWAVE_CACHE_BYTES). Other workers lack it.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from functools import partial

from fastapi import APIRouter, Request
from starlette.responses import JSONResponse, Response

from service.engine import Engine, TableFile
from service.http import openapi
from service.http.byte_ranges import ACCEPTED, range_of
from service.http.content_negotiation import is_known
from service.http.rate_limits import KEY
from service.http.request_body import read_body
from service.lifespan import Service, service_of
from service.problems import Problem, refused
from synth.errors import shown
from synth.scene.scene import Scene

router = APIRouter(tags=["tables"])
READS = ("too-large", "not-json", "scene-refused", "cannot-render", "closing")
IMMUTABLE = "max-age=31536000, immutable"
TABLE_FILE: openapi.Answers = {
    200: {
        "description": "The file; docs/table.md describes its format.",
        "content": {"application/octet-stream": openapi.BINARY},
    },
    206: {
        "description": "The bytes that Range names.",
        "content": {"application/octet-stream": openapi.BINARY},
    },
    304: {"description": "If-None-Match names the hash: the client has the file."},
}


@router.post(
    "/v1/tables",
    operation_id="makeTable",
    summary="Make the response table of a scene",
    status_code=201,
    response_class=JSONResponse,
    responses=openapi.answer_of("Table", "The table.", 201) | openapi.problem_answers(*READS),
    openapi_extra=openapi.body(openapi.SCENE),
)
async def make(request: Request) -> Response:
    """The body is a scene. The answer has the hash of the table, the path of its file, and its error."""
    service = service_of(request)
    text = await read_body(request)
    if service.closing:
        raise Problem("closing", "The service is shutting down.")
    read = partial(service.textures.scene, text, request.scope.get(KEY))
    made = await service.solves.run(service.limits.caller(request.scope), _make_table, service.engine, read)
    url = f"{service.settings.root_path}/v1/tables/{made.hash}"
    document = {"hash": made.hash, "url": url, "bytes": len(made.content)} | made.document
    return JSONResponse(document, 201, {"Location": url, "Cache-Control": "no-store"})


@router.head("/v1/tables/{hash}", include_in_schema=False)
@router.get(
    "/v1/tables/{hash}",
    operation_id="getTable",
    summary="Get a response table by its hash",
    response_class=Response,
    responses=TABLE_FILE | openapi.problem_answers("not-found", "range-refused"),
)
async def get(request: Request, hash: str) -> Response:
    """The safetensors file. It never changes, so every cache may keep it; of an imported surface, only yours."""
    service = service_of(request)
    found = service.engine.find_table(hash)
    private = found is not None and found.surface is not None
    if found is None or (private and not await asyncio.to_thread(_has, service, request, found)):
        hint = "POST its scene to /v1/tables: the same scene gives the same hash."
        raise refused("hash", shown(hash), "the hash of a table in the cache", hint, "not-found")
    headers = {"ETag": f'"{found.hash}"', "Cache-Control": f"{'private' if private else 'public'}, {IMMUTABLE}"}
    if is_known(request, found.hash):
        return Response(status_code=304, headers=headers)
    headers |= ACCEPTED
    part = range_of(request, len(found.content), found.hash)
    if part is not None:
        body = found.content[part.first : part.last + 1]
        return Response(body, 206, headers | part.headers, media_type="application/octet-stream")
    headers["Content-Length"] = str(len(found.content))
    body = b"" if request.method == "HEAD" else found.content
    return Response(body, headers=headers, media_type="application/octet-stream")


def _has(service: Service, request: Request, table: TableFile) -> bool:
    """Return whether the caller has imported the surface of `table`."""
    return service.textures.has(request.scope.get(KEY), table.surface or "")


def _make_table(engine: Engine, read: Callable[[], Scene]) -> TableFile:
    return engine.make_table(read())
