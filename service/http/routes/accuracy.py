"""`POST /v1/accuracy`: what accuracy costs in time, for a scene, on the service's machine."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Query, Request
from pydantic import BaseModel, ConfigDict, Field
from starlette.responses import JSONResponse, Response

from service.http import openapi
from service.http.request_body import read_body
from service.lifespan import service_of
from synth.scene.output_section import QuantityName

router = APIRouter(tags=["render"])
PROBLEMS = ("too-large", "not-json", "scene-refused", "request-refused", "cannot-render", "full", "closing")


class AccuracyParameters(BaseModel):
    """The query of a measurement."""

    model_config = ConfigDict(extra="forbid")
    quantity: QuantityName | None = Field(
        default=None, description="A quantity of the scene's channels; without it, that of the first."
    )


@router.post(
    "/v1/accuracy",
    operation_id="measureAccuracy",
    summary="Measure what accuracy costs in time",
    response_class=JSONResponse,
    responses=openapi.answer_of("AccuracyTable", "Error against cost.") | openapi.problem_answers(*PROBLEMS),
    openapi_extra=openapi.body(openapi.SCENE),
)
async def accuracy(request: Request, parameters: Annotated[AccuracyParameters, Query()]) -> Response:
    """Every method there is: its error, and its cost on the service's machine. Takes up to a minute, one at a time."""
    service = service_of(request)
    text = await read_body(request, service.settings.max_body)
    return JSONResponse(await service.measurements.answer(text, parameters.quantity, request.receive))
