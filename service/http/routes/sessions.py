"""`/v1/sessions`: open, show, change and end a session."""

from __future__ import annotations

from collections.abc import Mapping

from fastapi import APIRouter, Request
from starlette.responses import JSONResponse, Response

from service.http import openapi
from service.http.rate_limits import KEY
from service.http.request_body import PATCH, read_body
from service.lifespan import Service, service_of
from service.sessions.session import Session

router = APIRouter(tags=["sessions"])
SESSION = openapi.answer_of("Session", "The session.")
SESSION_OPENED = openapi.answer_of("Session", "The session.", 201)
READS = ("too-large", "not-json", "scene-refused", "cannot-render")


@router.post(
    "/v1/sessions",
    operation_id="openSession",
    summary="Open a session",
    status_code=201,
    response_class=JSONResponse,
    responses=SESSION_OPENED | openapi.problem_answers(*READS, "full", "one-worker", "closing"),
    openapi_extra=openapi.body(openapi.SCENE),
)
async def create(request: Request) -> Response:
    """The body is a scene. The answer has the id, the full scale, which stays fixed, and the path of the stream."""
    service = service_of(request)
    text = await read_body(request)
    client = service.limits.caller(request.scope)
    session = await service.sessions.create(text, client, request.scope.get(KEY))
    location = {"Location": f"{service.settings.root_path}/v1/sessions/{session.id}"}
    return _answer(session, service, 201, location)


@router.get(
    "/v1/sessions/{session_id}",
    operation_id="getSession",
    summary="Show a session",
    response_class=JSONResponse,
    responses=SESSION | openapi.problem_answers("not-found", "one-worker"),
)
async def show(request: Request, session_id: str) -> Response:
    """The complete scene, whether the session streams or plays, and when it expires."""
    service = service_of(request)
    session = service.sessions.find(session_id, request.scope.get(KEY))
    return _answer(session, service)


@router.patch(
    "/v1/sessions/{session_id}",
    operation_id="changeSession",
    summary="Change the scene of a session",
    response_class=JSONResponse,
    responses=SESSION | openapi.problem_answers(*READS, "not-found", "fixed", "full", "one-worker"),
    openapi_extra=openapi.body(openapi.SCENE),
)
async def change(request: Request, session_id: str) -> Response:
    """The body is a partial scene (RFC 7396). Streams and plays cross-fade to it within `heard_within` seconds."""
    service = service_of(request)
    text = await read_body(request, PATCH)
    session = service.sessions.find(session_id, request.scope.get(KEY))
    await session.change(text)
    session.touch()
    return _answer(session, service)


@router.delete(
    "/v1/sessions/{session_id}",
    operation_id="deleteSession",
    summary="End a session",
    status_code=204,
    response_class=Response,
    responses=openapi.problem_answers("not-found", "one-worker"),
)
async def delete(request: Request, session_id: str) -> Response:
    """Its stream and its play fade out and end; a recording is completed."""
    service_of(request).sessions.delete(session_id, request.scope.get(KEY))
    return Response(status_code=204)


def _answer(
    session: Session, service: Service, status: int = 200, headers: Mapping[str, str] | None = None
) -> Response:
    headers = {"Cache-Control": "no-store", **(headers or {})}
    return Response(session.document(service.settings), status, headers, media_type="application/json")
