"""`GET /v1/textures` and `/v1/textures/{name}`: the catalogue."""

from __future__ import annotations

from typing import Any

from fastapi import APIRouter
from starlette.responses import JSONResponse, Response

from service.http import openapi
from service.problems import Problem
from synth.errors import SceneError
from synth.scene.catalogue import CatalogueEntry, catalogue, lookup

router = APIRouter(tags=["textures"])


def entry_document(entry: CatalogueEntry) -> dict[str, Any]:
    """Return an entry as JSON; its `scene` is a partial scene that can be rendered or merged."""
    return {"name": entry.name, "title": entry.title, "source": entry.source, "scene": entry.document}


@router.get(
    "/v1/textures",
    operation_id="listTextures",
    summary="List the named textures",
    response_class=JSONResponse,
    responses=openapi.problem_answers(),
)
async def textures() -> Response:
    """Each with its title, the source of its values, and the partial scene that it stands for."""
    return JSONResponse({"textures": [entry_document(entry) for entry in catalogue()]})


@router.get(
    "/v1/textures/{name}",
    operation_id="getTexture",
    summary="Show one named texture",
    response_class=JSONResponse,
    responses=openapi.problem_answers("not-found"),
)
async def texture(name: str) -> Response:
    """One entry of the catalogue."""
    try:
        entry = lookup(name)
    except SceneError as error:
        raise Problem("not-found", error.faults[0].sentence(), error.faults) from error
    return JSONResponse(entry_document(entry))
