"""`GET /v1/sessions/{id}/stream`: the sound of a session in real time, endless or of a given duration."""

from __future__ import annotations

import asyncio
from contextlib import suppress
from typing import Annotated

from fastapi import APIRouter, Query, Request
from pydantic import BaseModel, ConfigDict, Field
from starlette.responses import Response, StreamingResponse

from service.compute.render_steps import check_duration
from service.http import openapi
from service.http.byte_ranges import ACCEPTED, part_of, range_of, range_of_endless
from service.http.chunked_answer import PumpedResponse
from service.http.content_negotiation import choose_format
from service.http.paced_stream import Reader, stream_length
from service.http.rate_limits import KEY
from service.http.sound_headers import describe, metadata_of
from service.lifespan import service_of
from service.operations.metrics import Metrics
from service.problems import Problem
from service.sessions.admission import stream_admitted
from service.sessions.session import Session
from synth.encode.formats import SoundFormat, media_type, stream_header

router = APIRouter(tags=["sessions"])
LEAVING_SECONDS = 0.25  # until a busy service notices that the earlier reader has disconnected


class StreamParameters(BaseModel):
    """The query of a stream."""

    model_config = ConfigDict(extra="forbid")
    format: SoundFormat | None = Field(
        default=None, description="Sound format; wins over Accept. FLAC does not stream."
    )
    duration: float | None = Field(
        default=None,
        ge=0.001,
        allow_inf_nan=False,
        description="Seconds; without it, the stream is endless.",
        json_schema_extra={"x-unit": "s"},
    )


@router.head("/v1/sessions/{session_id}/stream", include_in_schema=False, response_class=Response)
@router.get(
    "/v1/sessions/{session_id}/stream",
    operation_id="streamSession",
    summary="Listen to a session",
    response_class=Response,
    responses=openapi.audio(
        "not-found",
        "not-acceptable",
        "busy",
        "request-refused",
        "too-many-streams",
        "cannot-render",
        "full",
        "one-worker",
        "range-refused",
        flac=False,
        part=True,
    ),
)
async def stream(request: Request, session_id: str, parameters: Annotated[StreamParameters, Query()]) -> Response:
    """One reader at a time. The sound begins at frame 0 of the scene, fades in, and is sent a little ahead of time."""
    service = service_of(request)
    session = service.sessions.find(session_id, request.scope.get(KEY))
    if parameters.duration is not None:
        check_duration(parameters.duration, service.settings.max_duration, "?duration", "request-refused")
    accept = request.headers.get("accept")
    sound_format = choose_format(parameters.format, accept, session.sample_rate, session.channels, endless=True)
    kind = media_type(sound_format, session.sample_rate, session.channels)
    frames = None if parameters.duration is None else max(1, round(parameters.duration * session.sample_rate))
    metadata = metadata_of(session, session.scene_text)
    header = stream_header(sound_format, session.sample_rate, session.channels, metadata, frames)
    headers = describe(session, sound_format)
    if frames is None:
        part = range_of_endless(request, len(header))
    else:
        length = stream_length(sound_format, len(header), session.channels, frames)
        headers |= ACCEPTED | {"Content-Length": str(length)}
        part = range_of(request, length)
    if part is not None:
        headers |= part.headers
        if part.last < len(header):  # needs no reader, so it can be answered beside one
            return Response(header[part.first : part.last + 1], 206, headers, media_type=kind)
    if request.method == "HEAD":
        return StreamingResponse((), headers=headers, media_type=kind)
    ticket = service.limits.admit(request.scope)
    try:
        await stream_admitted(service.metrics.load, service.settings.full_at)
        reader = await _claim(session, service.metrics)
    except BaseException:
        ticket.release()
        raise
    service.metrics.stream_opened("http")

    def released() -> None:
        """Give back what the stream holds: its place as the reader, and its part of the limits."""
        _release(session, reader)
        ticket.release()
        service.metrics.stream_closed("http")

    chunks = reader.chunks(sound_format, header, frames, service.settings, service.blocks)
    status = 200
    if part is not None:
        chunks, status = part_of(chunks, part), 206
    return PumpedResponse(chunks, headers, kind, status=status, released=released, ended=reader.ended)


async def _claim(session: Session, metrics: Metrics) -> Reader:
    """Return a new reader of the session; raises Problem (409) if another one stays for LEAVING_SECONDS."""
    if session.reader is not None:
        with suppress(TimeoutError):
            await asyncio.wait_for(session.reader.left.wait(), LEAVING_SECONDS)
    if session.reader is not None:
        raise Problem("busy", "The session already has a reader. Close its stream first, or open another session.")
    reader = session.reader = Reader(metrics)
    try:
        reader.stream = await session.open_stream()
    except BaseException:
        _release(session, reader)
        raise
    return reader


def _release(session: Session, reader: Reader) -> None:
    if session.reader is reader:
        session.reader = None
        session.touch()
    reader.left.set()
