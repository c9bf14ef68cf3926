"""`GET /v1/scene/schema.json`, `POST /v1/picture` and `GET /v1/threshold`: what a page needs to show a scene."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated, Any, Literal

import numpy as np
from fastapi import APIRouter, Query, Request
from pydantic import BaseModel, ConfigDict, Field
from starlette.responses import JSONResponse, Response

from service import openapi
from service.body import read_body
from service.problems import Problem, of, refused
from service.running import service_of
from synth.errors import AskedWrong, Fault, SceneError, shown
from synth.scene import Scene, object_from_text, parse_scene, scene_schema
from synth.threshold import threshold_displacement

router = APIRouter(tags=["scene"])
READS = ("too-large", "not-json", "scene-refused", "request-refused", "cannot-render", "full")
FIELDS = ("scene", "points", "phases")
BODY = {
    "type": "object",
    "additionalProperties": False,
    "properties": {
        "scene": openapi.SCENE,
        "points": {"type": "integer", "minimum": 16, "maximum": 8192, "description": "Heights of each surface."},
        "phases": {"type": "integer", "minimum": 0, "maximum": 1024, "description": "Phases at which z is solved."},
    },
}


class ThresholdParameters(BaseModel):
    """The query of a threshold."""

    model_config = ConfigDict(extra="forbid")
    name: Literal["fingertip", "probe", "pen"] = Field(default="fingertip", description="Which threshold.")
    low: float = Field(default=1.0, ge=0.1, le=1e5, allow_inf_nan=False, description="Lowest frequency, Hz.")
    high: float = Field(default=1000.0, ge=0.1, le=1e5, allow_inf_nan=False, description="Highest frequency, Hz.")
    points: int = Field(default=200, ge=2, le=10_000, description="How many frequencies.")


@router.get(
    "/v1/scene/schema.json",
    summary="Show the schema of a scene",
    response_class=openapi.SchemaResponse,
    responses=openapi.problem_answers(),
)
async def schema() -> Response:
    """JSON Schema (2020-12): for each field its sentence, default, range, and its SI unit as `x-unit`."""
    return openapi.SchemaResponse(scene_schema())


@router.post(
    "/v1/picture",
    summary="Draw the surfaces of a scene and where they touch",
    response_class=JSONResponse,
    responses=openapi.answer_of("Picture", "The surfaces, z, and the patches.") | openapi.problem_answers(*READS),
    openapi_extra=openapi.body(BODY),
)
async def picture(request: Request) -> Response:
    """Both surfaces, the height z of the finger over a texture period, and where they touch at each phase."""
    service = service_of(request)
    text = await read_body(request, service.settings.max_body)

    def made() -> bytes:
        document = service.engine.picture(*read_picture(text))
        return JSONResponse(document).body  # type: ignore[return-value]

    return Response(await service.renders.run(made), media_type="application/json")


@router.get(
    "/v1/threshold",
    summary="Show the smallest vibration that is felt",
    response_class=JSONResponse,
    responses=openapi.answer_of("Threshold", "The curve.") | openapi.problem_answers("request-refused"),
)
async def threshold(parameters: Annotated[ThresholdParameters, Query()]) -> Response:
    """The peak displacement of a sinusoid that is just felt, at frequencies evenly spaced on a logarithmic scale."""
    if not parameters.low < parameters.high:
        raise refused("?low", str(parameters.low), f"below ?high, {parameters.high:g} Hz", "Write a lower one.")
    frequencies = np.geomspace(parameters.low, parameters.high, parameters.points)
    felt = threshold_displacement(frequencies, parameters.name)
    document = {"name": parameters.name, "frequencies": frequencies.tolist(), "displacement": felt.tolist()}
    return JSONResponse(document)


def read_picture(text: bytes) -> tuple[Scene, int | None, int | None]:
    """Return scene, points and phases that the body of a picture asks for, None where it does not say.

    Raises Problem where the body makes no sense, SceneError with pointers into the body where its scene does not.
    """
    try:
        document = object_from_text(text)
    except SceneError as error:
        problem = of(error)
        raise Problem("request-refused", problem.detail, problem.faults) from error
    unknown = [name for name in document if name not in FIELDS]
    if unknown:
        raise refused("", shown(unknown[0]), f"the fields {', '.join(FIELDS)}", "Leave it out.")
    return _scene(document.get("scene", {})), _whole(document, "points"), _whole(document, "phases")


def _scene(document: Any) -> Scene:
    if not isinstance(document, dict):
        raise refused("/scene", shown(document), "a scene, an object", "Write {} for the default.", "scene-refused")
    try:
        return parse_scene(document)
    except SceneError as error:
        raise SceneError([replace(fault, pointer="/scene" + fault.pointer) for fault in error.faults]) from error


def _whole(document: dict[str, object], name: str) -> int | None:
    value = document.get(name)
    whole = int(value) if isinstance(value, float) and value.is_integer() else value  # JSON Schema: 32.0 is an integer
    if whole is not None and (isinstance(whole, bool) or not isinstance(whole, int)):
        raise AskedWrong([Fault(f"/{name}", shown(value), "a whole number", f"Leave {name} out for the default.")])
    return whole
