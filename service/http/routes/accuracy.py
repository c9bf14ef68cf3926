"""`POST /v1/accuracy`: the error and the cost of every method that can compute a scene."""

from __future__ import annotations

from functools import partial
from typing import Annotated

from fastapi import APIRouter, Query, Request
from pydantic import BaseModel, ConfigDict, Field
from starlette.responses import JSONResponse, Response

from service.http import openapi
from service.http.rate_limits import KEY
from service.http.request_body import read_body
from service.lifespan import service_of
from synth.scene.output_section import QuantityName

router = APIRouter(tags=["render"])
PROBLEMS = ("too-large", "not-json", "scene-refused", "request-refused", "cannot-render", "full", "closing")


class AccuracyParameters(BaseModel):
    """The query of a measurement."""

    model_config = ConfigDict(extra="forbid")
    quantity: QuantityName | None = Field(
        default=None, description="Quantity of one of the scene's channels; without it, of the first."
    )
    live: bool = Field(default=False, description="Measure a live voice, behind a hand, in place of a file.")


@router.post(
    "/v1/accuracy",
    operation_id="measureAccuracy",
    summary="Measure what accuracy costs in time",
    response_class=JSONResponse,
    responses=openapi.answer_of("AccuracyTable", "Error and cost of each method.") | openapi.problem_answers(*PROBLEMS),
    openapi_extra=openapi.body(openapi.SCENE),
)
async def accuracy(request: Request, parameters: Annotated[AccuracyParameters, Query()]) -> Response:
    """Every method with its error and its cost on the service's machine. One measurement at a time, up to a minute."""
    service = service_of(request)
    read = partial(service.textures.scene, await read_body(request), request.scope.get(KEY))
    body = await service.measurements.answer(read, parameters.quantity, request.receive, live=parameters.live)
    return Response(body, media_type="application/json")
