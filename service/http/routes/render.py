"""`POST /v1/render`: the sound of a scene; `POST /v1/explain`: its plan; `POST /v1/analyze`: what is felt of it, or of
a recording.
"""

from __future__ import annotations

from typing import Annotated, Literal

from fastapi import APIRouter, Query, Request
from pydantic import BaseModel, ConfigDict, Field
from starlette.responses import JSONResponse, Response

from service.compute.render_steps import Order
from service.http import openapi
from service.http.request_body import JSON, media_type_of, read_body
from service.lifespan import service_of
from service.problems import refused
from synth.encode.containers import CONTAINERS
from synth.encode.formats import SoundFormat
from synth.errors import shown

router = APIRouter(tags=["render"])
FILE = "application/octet-stream"
SOUNDS = frozenset((FILE, *CONTAINERS["wav"].media_types, *CONTAINERS["flac"].media_types))
READS = ("too-large", "not-json", "scene-refused", "request-refused", "cannot-render", "full", "closing")


class RenderParameters(BaseModel):
    """The query of a render."""

    model_config = ConfigDict(extra="forbid")
    format: SoundFormat | None = Field(default=None, description="Sound format; wins over Accept.")


@router.post(
    "/v1/render",
    operation_id="render",
    summary="Render a scene to audio",
    response_class=Response,
    responses=openapi.audio(*READS, "not-acceptable", "too-costly", "too-many-renders", flac=True),
    openapi_extra=openapi.body(openapi.SCENE),
)
async def render(request: Request, parameters: Annotated[RenderParameters, Query()]) -> Response:
    """The body is a scene; `{}` is the default. Content-Length is exact. Long sounds are sent during the render."""
    service = service_of(request)
    text = await read_body(request)
    longest = service.settings.max_duration
    order = Order("render", parameters.format, request.headers.get("accept"), longest)
    return await service.renders.answer(order, text, request)


@router.post(
    "/v1/explain",
    operation_id="explain",
    summary="Explain what a render would simulate",
    response_class=JSONResponse,
    responses=openapi.answer_of("Plan", "The plan.") | openapi.problem_answers(*READS),
    openapi_extra=openapi.body(openapi.SCENE),
)
async def explain(request: Request) -> Response:
    """What is simulated and why, what is left out and what that changes, the estimated error, and the cost."""
    service = service_of(request)
    text = await read_body(request)
    return await service.renders.answer(Order("explain"), text, request)


class AnalysisParameters(BaseModel):
    """The query of an analysis: of a recorded vibration only."""

    model_config = ConfigDict(extra="forbid")
    quantity: Literal["displacement", "velocity", "acceleration"] | None = Field(
        default=None, description="What the samples are, where the file does not say it."
    )
    scale: Annotated[float, Field(ge=1e-12, le=1e12)] | None = Field(
        default=None, description="SI value of a sample of 1, where the file does not say it."
    )
    channel: Annotated[int, Field(ge=0, le=1023)] | None = Field(default=None, description="The channel, from 0.")


@router.post(
    "/v1/analyze",
    operation_id="analyze",
    summary="Tell what is felt of a scene or a recording",
    response_class=JSONResponse,
    responses=openapi.answer_of("Analysis", "What is felt.") | openapi.problem_answers(*READS),
    openapi_extra=openapi.body(openapi.SCENE, [FILE]),
)
async def analyze(request: Request, parameters: Annotated[AnalysisParameters, Query()]) -> Response:
    """What the whole finger and each class of receptors feel: of a steady scan on a texture along a line, or of a WAV
    or FLAC file. A file may also be named audio/wav or audio/flac.
    """
    service = service_of(request)
    body = await read_body(request, JSON | SOUNDS)
    told = parameters.model_dump(exclude_none=True)
    if media_type_of(request) in SOUNDS:
        return await service.renders.answer(Order("analyze", recording=told), body, request)
    for name in told:
        raise refused(f"?{name}", shown(told[name]), "nothing with a scene", "Leave it out, or send a sound file.")
    return await service.renders.answer(Order("analyze"), body, request)
