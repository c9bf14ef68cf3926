"""`GET /v1/textures`, `/v1/textures/{name}` and its `/picture`: the catalogue, and what the caller has imported.

Model: the catalogue is part of the release, so a picture is made once per process. A browser may keep it for a day;
    then it revalidates it by its ETag, which is a hash of the file. The picture of an imported texture is made for each
    request, because its name may later refer to another surface.
"""

from __future__ import annotations

import asyncio
import hashlib
from functools import cache
from typing import Any

from fastapi import APIRouter, Request
from starlette.responses import JSONResponse, Response

from service.http import openapi
from service.http.content_negotiation import is_known
from service.http.rate_limits import KEY
from service.lifespan import service_of
from service.problems import Problem
from service.store.stored_texture import StoredTexture
from synth.errors import SceneError
from synth.scene.catalogue import CatalogueEntry, catalogue, lookup
from synth.scene.text import json_text

router = APIRouter(tags=["textures"])
A_DAY = "public, max-age=86400"
PICTURE: openapi.Answers = {
    200: {"description": "5 mm x 5 mm from above, lit from the left.", "content": {"image/png": openapi.BINARY}},
    304: {"description": "If-None-Match names the picture: the client has it."},
}


def entry_document(entry: CatalogueEntry | StoredTexture, request: Request) -> dict[str, Any]:
    """Return an entry as JSON; its `scene` is a partial scene that can be rendered or merged."""
    root_path = service_of(request).settings.root_path
    stored = isinstance(entry, StoredTexture)
    return entry.description() | {"picture": f"{root_path}/v1/textures/{entry.name}/picture", "stored": stored}


@router.get(
    "/v1/textures",
    operation_id="listTextures",
    summary="List the named textures",
    response_class=JSONResponse,
    responses=openapi.answer_of("Textures", "The catalogue, a group after the other, then what was imported.")
    | openapi.problem_answers("cannot-render"),
)
async def textures(request: Request) -> Response:
    """Each has its title, its group and its scenes. The entry of a single texture also has its numbers."""
    return Response(await asyncio.to_thread(_listed, request), media_type="application/json")


def _listed(request: Request) -> bytes:
    own = service_of(request).textures
    stored = own.store.textures(own.owner(request.scope.get(KEY)))
    entries: list[CatalogueEntry | StoredTexture] = [*catalogue(), *stored]
    found = [entry_document(entry, request) for entry in entries]
    for document in found:
        del document["numbers"]  # half of the text; a page shows those of one entry
    return json_text({"textures": found})


@router.get(
    "/v1/textures/{name}",
    operation_id="getTexture",
    summary="Show one named texture",
    response_class=JSONResponse,
    responses=openapi.answer_of("NamedTexture", "The entry.") | openapi.problem_answers("not-found", "cannot-render"),
)
async def texture(request: Request, name: str) -> Response:
    """One entry of the list."""
    return JSONResponse(entry_document(await _entry(request, name), request))


@router.head("/v1/textures/{name}/picture", include_in_schema=False)
@router.get(
    "/v1/textures/{name}/picture",
    operation_id="getTexturePicture",
    summary="Show a picture of one named texture",
    response_class=Response,
    responses=PICTURE | openapi.problem_answers("not-found", "scene-refused", "cannot-render"),
)
async def texture_picture(request: Request, name: str) -> Response:
    """A PNG of 240 x 240 pixels: 5 mm x 5 mm of the surface, lit from the left. Slopes are not to scale."""
    entry = await _entry(request, name)
    if isinstance(entry, StoredTexture):
        picture, tag = await asyncio.to_thread(_drawn, {"texture": entry.texture})
    else:
        picture, tag = await asyncio.to_thread(_picture_of, name)
    headers = {"Cache-Control": "private, no-cache" if isinstance(entry, StoredTexture) else A_DAY, "ETag": f'"{tag}"'}
    if is_known(request, tag):
        return Response(status_code=304, headers=headers)
    headers["Content-Length"] = str(len(picture))
    return Response(b"" if request.method == "HEAD" else picture, headers=headers, media_type="image/png")


async def _entry(request: Request, name: str) -> CatalogueEntry | StoredTexture:
    own = service_of(request).textures
    try:
        return await asyncio.to_thread(own.store.entry, own.owner(request.scope.get(KEY)), name)
    except SceneError as error:
        raise Problem("not-found", error.faults[0].sentence(), error.faults) from error


@cache
def _picture_of(name: str) -> tuple[bytes, str]:
    """Return the PNG file of an entry of the catalogue and its tag."""
    return _drawn(lookup(name).document)


def _drawn(document: dict[str, Any]) -> tuple[bytes, str]:
    """Return the PNG file of the texture of a scene and its tag."""
    from synth.encode.png import png_of
    from synth.scene.scene import parse_scene
    from synth.surfaces import profile_of
    from synth.surfaces.lit_picture import lit_picture

    picture = png_of(lit_picture(profile_of(parse_scene(document))))
    return picture, hashlib.sha256(picture).hexdigest()[:32]
