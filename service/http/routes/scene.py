"""`GET /v1/scene/schema.json`, `POST /v1/picture` and `GET /v1/threshold`: what a program needs to show a scene."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from fastapi import APIRouter, Query, Request
from pydantic import BaseModel, ConfigDict, Field
from starlette.responses import JSONResponse, Response

from service.compute.area_picture import MOST_AREA
from service.compute.render_steps import Order
from service.http import openapi
from service.http.request_body import read_body
from service.lifespan import service_of
from service.problems import refused
from synth.perception.threshold import threshold_displacement
from synth.scene.scene import scene_schema

router = APIRouter(tags=["scene"])
READS = ("too-large", "not-json", "scene-refused", "request-refused", "cannot-render", "full", "closing")
BODY = {
    "type": "object",
    "additionalProperties": False,
    "properties": {
        "scene": openapi.SCENE,
        "points": {"type": "integer", "minimum": 16, "maximum": 8192, "description": "Heights of each surface."},
        "phases": {"type": "integer", "minimum": 0, "maximum": 1024, "description": "Phases at which z is solved."},
        "area": {"type": "integer", "minimum": 0, "maximum": MOST_AREA, "description": "Heights a side over an area."},
    },
}


Frequency = Annotated[float, Field(ge=0.1, le=1e5, allow_inf_nan=False, json_schema_extra={"x-unit": "Hz"})]


class ThresholdParameters(BaseModel):
    """The query of a threshold."""

    model_config = ConfigDict(extra="forbid")
    name: Literal["fingertip", "probe", "pen"] = Field(default="fingertip", description="Name of the curve.")
    low: Frequency = Field(default=1.0, description="Lowest frequency, Hz.")
    high: Frequency = Field(default=1000.0, description="Highest frequency, Hz.")
    points: int = Field(default=200, ge=2, le=10_000, description="Number of frequencies.")


@router.get(
    "/v1/scene/schema.json",
    operation_id="getSceneSchema",
    summary="Show the schema of a scene",
    response_class=openapi.SchemaResponse,
    responses=openapi.problem_answers(),
)
async def schema() -> Response:
    """JSON Schema (2020-12): the description, default and range of each field, and its SI unit as `x-unit`."""
    return openapi.SchemaResponse(scene_schema())


@router.post(
    "/v1/picture",
    operation_id="drawPicture",
    summary="Draw the surfaces of a scene and where they touch",
    response_class=JSONResponse,
    responses=openapi.answer_of("Picture", "Surfaces, z, and patches in contact.") | openapi.problem_answers(*READS),
    openapi_extra=openapi.body(BODY),
)
async def picture(request: Request) -> Response:
    """Both surfaces, the height z of the finger over a texture period, and where they touch at each phase."""
    service = service_of(request)
    text = await read_body(request)
    return await service.renders.answer(Order("picture"), text, request)


@router.get(
    "/v1/threshold",
    operation_id="getThreshold",
    summary="Show the smallest vibration that is felt",
    response_class=JSONResponse,
    responses=openapi.answer_of("Threshold", "The curve.") | openapi.problem_answers("request-refused"),
)
def threshold(parameters: Annotated[ThresholdParameters, Query()]) -> Response:  # not async: it runs in a thread
    """The peak displacement of a sinusoid that is just felt, at frequencies evenly spaced on a logarithmic scale."""
    if not parameters.low < parameters.high:
        raise refused("?low", str(parameters.low), f"below ?high, {parameters.high:g} Hz", "Write a lower frequency.")
    frequencies = np.geomspace(parameters.low, parameters.high, parameters.points)
    felt = threshold_displacement(frequencies, parameters.name)
    document = {"name": parameters.name, "frequencies": frequencies.tolist(), "displacement": felt.tolist()}
    return JSONResponse(document)
