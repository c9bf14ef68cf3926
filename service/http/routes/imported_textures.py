"""`/v1/textures`: the textures that a key has imported: import, export, rename and delete. `textures` lists them."""

from __future__ import annotations

import asyncio
import shutil
import tempfile
from collections.abc import AsyncIterator
from functools import partial
from pathlib import Path
from typing import Annotated, Any, Literal

from fastapi import APIRouter, Query, Request
from pydantic import BaseModel, ConfigDict, Field
from starlette.responses import JSONResponse, Response, StreamingResponse

from service.compute.import_process import NO_ROOM, Uploaded
from service.http import openapi
from service.http.chunked_answer import while_wanted
from service.http.openapi_components import STORED_NAME
from service.http.rate_limits import KEY
from service.http.request_body import PATCH, read_body
from service.http.request_form import FORM, Form, read_form
from service.http.routes.textures import entry_document
from service.lifespan import Service, service_of
from service.operations.settings import Settings
from service.problems import Problem, of, refused
from service.store.store import StoreFull
from service.store.stored_texture import StoredTexture
from service.store.texture_names import ALLOWED_NAME, check_name, name_from_file
from synth.errors import CannotRender, NameTaken, SceneError, shown
from synth.scene.text import object_from_text

router = APIRouter(tags=["textures"])
NO_STORE = {"Cache-Control": "no-store"}
PIECE_BYTES = 1 << 18  # of an export, sent at once: 0.1 ms of copying
TEXT = {"type": "string"}
OPTIONS = {
    "unit": "Unit of the numbers: m, cm, mm, um, nm or inch; or two, of x and of the heights, as in mm, um.",
    "pixel": "Distance between points, as in 5 um, or 5 um, 10 um for x and y.",
    "height": "Height of a displacement map, as in 120 um.",
    "level": "Form to remove: none, tilt or curvature.",
    "missing": "Rule for missing points: refuse, fill or crop.",
    "resample": "Distance to which the points of a profile are interpolated linearly, as in 5 um.",
    "width": "Of a set of maps: width of the sample, as in 2 m.",
    "part": "Of a set of maps: side of the square in its middle that is kept, as in 80 mm.",
    "slope": "Of a set of maps: rms slope along an axis of synthetic waves below its pixel; 0 for none.",
    "hurst": "Of a set of maps: Hurst exponent of these waves, instead of slope.",
    "shortest": "Of a set of maps: the shortest of these waves, as in 60 um.",
}
IMPORT_BODY = {
    "type": "object",
    "required": ["file"],
    "properties": {
        "file": {
            "type": "string",
            "format": "binary",
            "description": "The file of heights, or a ZIP file with a set of maps (docs/import.md).",
        },
        "name": TEXT | {"description": f"Name of the texture: {ALLOWED_NAME}. Default: that of the file."},
        **{name: TEXT | {"description": sentence} for name, sentence in OPTIONS.items()},
    },
}
RENAME_BODY = {
    "type": "object",
    "required": ["name"],
    "additionalProperties": False,
    "properties": {"name": STORED_NAME | {"description": "The new name."}},
}
SURFACE_FILE: openapi.Answers = {
    200: {"description": "The file.", "content": {"application/octet-stream": openapi.BINARY}}
}


class ImportParameters(BaseModel):
    """The query of an import."""

    model_config = ConfigDict(extra="forbid")
    dry_run: bool = Field(default=False, description="Report only, and keep nothing.")


class ExportParameters(BaseModel):
    """The query of an export."""

    model_config = ConfigDict(extra="forbid")
    format: Literal["npy", "x3p"] = Field(default="npy", description="NPY, in m, or X3P (ISO 25178-72).")


@router.post(
    "/v1/textures",
    operation_id="importTexture",
    summary="Import a measured surface",
    status_code=201,
    response_class=JSONResponse,
    responses=openapi.answer_of("ImportedTexture", "The texture, kept.", 201)
    | openapi.answer_of("ImportedTexture", "With ?dry_run=true: the report; nothing was kept.", 200)
    | openapi.problem_answers(
        *("too-large", "not-multipart", "request-refused", "name-taken", "store-full", "too-many-imports"),
        *("cannot-render", "full", "closing"),
    ),
    openapi_extra={"requestBody": {"required": True, "content": {FORM: {"schema": IMPORT_BODY}}}},
)
async def import_texture(request: Request, parameters: Annotated[ImportParameters, Query()]) -> Response:
    """The body is a form with the file. The answer has the report and a picture; see docs/import.md."""
    service = service_of(request)
    with service.uploads.begin(service.limits.caller(request.scope)) as upload:
        async with read_form(request, *_largest(service.settings), upload.hold) as form:
            name = form.fields.pop("name", None) or name_from_file(form.file.filename or "")
            check_name(name)
            found = await while_wanted(_uploaded(service, form, upload.client), request.receive)
    document: dict[str, Any] = {
        "name": name,
        "kept": not parameters.dry_run,
        "address": found.surface.address,
        "report": found.report,
        "picture": f"data:image/png;base64,{found.picture}",
    }
    if parameters.dry_run:
        return JSONResponse(document, headers=NO_STORE)
    own = service.textures
    keep = partial(own.store.keep, own.owner(request.scope.get(KEY)), name)
    kept = await _stored(keep, found.surface, found.report["kind"], found.report, own.quota)
    await asyncio.to_thread(service.prepare_textures)
    document["scene"] = {"texture": kept.texture}
    return JSONResponse(document, 201, NO_STORE | {"Location": _path_of(name, service)})


def _largest(settings: Settings) -> tuple[int, str]:
    """Return the bytes of the largest body of an import, and the setting that gives them."""
    if settings.import_bytes_per_client < settings.max_import:
        return settings.import_bytes_per_client, "RIDGEWAVE_IMPORT_BYTES_PER_CLIENT"
    return settings.max_import, "RIDGEWAVE_MAX_IMPORT"


async def _uploaded(service: Service, form: Form, client: str) -> Uploaded:
    """Return the surface of `form`, read in a process of its own. Raises CannotRender where its files have no room.

    The file is copied when its turn comes. Until then only the form holds it, and then only the copy.
    """
    try:
        async with service.imports.turn(client):
            folder = tempfile.TemporaryDirectory(prefix="ridgewave-")
            try:
                upload = Path(folder.name) / "upload"
                with upload.open("wb") as copy:
                    await asyncio.to_thread(shutil.copyfileobj, form.file.file, copy, 1 << 20)
                await form.file.close()
                return await service.imports.read(upload, form.file.filename or "", form.fields, upload.parent)
            finally:
                await asyncio.to_thread(folder.cleanup)  # deleting 128 MB takes 0.1 s
    except OSError as error:
        raise CannotRender(NO_ROOM) from error


async def _stored(change: Any, *arguments: Any) -> Any:
    """Return what a change of the store returns, with its own errors as problems."""
    try:
        return await asyncio.to_thread(change, *arguments)
    except NameTaken as error:
        raise Problem("name-taken", error.reason) from error
    except StoreFull as error:
        raise Problem("store-full", error.reason) from error


@router.patch(
    "/v1/textures/{name}",
    operation_id="renameTexture",
    summary="Rename an imported texture",
    response_class=JSONResponse,
    responses=openapi.problem_answers(
        "not-found", "too-large", "not-json", "request-refused", "name-taken", "cannot-render"
    ),
    openapi_extra=openapi.body(RENAME_BODY),
)
async def rename(request: Request, name: str) -> Response:
    """The body is `{"name": "new-name"}`. Scenes hold the surface's address, so they do not change."""
    own = service_of(request).textures
    new = await asyncio.to_thread(_new_name, await read_body(request, PATCH))
    renamed: StoredTexture | None = await _stored(own.store.rename, own.owner(request.scope.get(KEY)), name, new)
    if renamed is None:
        raise _no_texture(name)
    location = {"Location": _path_of(new, service_of(request))}
    return JSONResponse(entry_document(renamed, request), headers=NO_STORE | location)


def _new_name(text: bytes) -> str:
    try:
        document = object_from_text(text)
    except SceneError as error:
        problem = of(error)
        raise Problem("request-refused", problem.detail, problem.faults) from error
    name = document.get("name")
    if set(document) != {"name"} or not isinstance(name, str):
        raise refused("", shown(document), 'an object with the field "name"', 'Write {"name": "new-name"}.')
    return name


@router.delete(
    "/v1/textures/{name}",
    operation_id="deleteTexture",
    summary="Delete an imported texture",
    status_code=204,
    response_class=Response,
    responses=openapi.problem_answers("not-found", "cannot-render"),
)
async def delete(request: Request, name: str) -> Response:
    """The surface is deleted with its last name. A session that plays it continues."""
    own = service_of(request).textures
    if not await asyncio.to_thread(own.store.delete, own.owner(request.scope.get(KEY)), name):
        raise _no_texture(name)
    return Response(status_code=204)


@router.get(
    "/v1/textures/{name}/surface",
    operation_id="exportTexture",
    summary="Export the heights of an imported texture",
    response_class=Response,
    responses=SURFACE_FILE | openapi.problem_answers("not-found", "request-refused", "cannot-render"),
)
async def surface(request: Request, name: str, parameters: Annotated[ExportParameters, Query()]) -> Response:
    """The heights as they were kept, float32 in m: `?format=npy` or `x3p`."""
    own = service_of(request).textures
    found = await asyncio.to_thread(own.store.find, own.owner(request.scope.get(KEY)), name)
    if found is None:
        raise _no_texture(name)
    content = await asyncio.to_thread(_exported, service_of(request), found, parameters.format)
    attachment = {"Content-Disposition": f'attachment; filename="{name}.{parameters.format}"'}
    headers = NO_STORE | attachment | {"Content-Length": str(len(content))}
    return StreamingResponse(_pieces(content), headers=headers, media_type="application/octet-stream")


async def _pieces(content: bytes) -> AsyncIterator[bytes]:
    """Yield `content` in pieces: the server copies each, and copying 64 MB at once takes 0.1 s of the event loop."""
    for begin in range(0, len(content), PIECE_BYTES):
        yield content[begin : begin + PIECE_BYTES]


def _exported(service: Service, texture: StoredTexture, file_format: str) -> bytes:
    from synth.surfaces.measurement.exporting import exported

    return exported(service.textures.store.surface(texture.address), file_format)


def _path_of(name: str, service: Service) -> str:
    return f"{service.settings.root_path}/v1/textures/{name}"


def _no_texture(name: str) -> Problem:
    return refused("name", shown(name), "the name of a texture that you imported", "See /v1/textures.", "not-found")
