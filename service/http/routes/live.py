"""`WS /v1/live`, the schemas of its messages, and the recordings of its sessions."""

from __future__ import annotations

from fastapi import APIRouter, Request
from starlette.responses import JSONResponse, Response
from starlette.routing import WebSocketRoute
from starlette.types import Receive, Scope, Send

from service.http import openapi
from service.http.rate_limits import KEY
from service.lifespan import Service, service_of
from service.live.connection import Connection
from service.live.messages import V1, V2, VERSIONS, newest_version
from service.live.transport import WIRE
from service.problems import Problem

router = APIRouter(tags=["live"])


class LiveEndpoint:
    """The ASGI application of `WS /v1/live`; a class, because Starlette wraps a function."""

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one WebSocket; raises Problem where its upgrade is refused."""
        service: Service = scope["app"].state.service
        service.live.admit()
        version = newest_version(scope["subprotocols"])
        if version is None:
            names = " or ".join(known.name for known in VERSIONS)
            raise Problem("protocol", f"Offer the subprotocol {names} in Sec-WebSocket-Protocol.")
        ticket = service.limits.admit(scope)
        try:
            assert (await receive())["type"] == "websocket.connect"
            await send({"type": "websocket.accept", "subprotocol": version.name, "headers": []})
            client, wire = service.limits.caller(scope), scope.get("extensions", {}).get(WIRE)
            await Connection(scope, receive, send, service.live, version, client=client, wire=wire).run()
        finally:
            ticket.release()


router.routes.append(WebSocketRoute("/v1/live", LiveEndpoint(), name="live"))


@router.get(
    "/v1/live/schema.json",
    operation_id="getLiveSchema",
    summary="Show the schema of the live protocol, version 1",
    response_class=openapi.SchemaResponse,
    responses=openapi.problem_answers(),
)
async def live_schema() -> Response:
    """JSON Schema (2020-12) of every text message of `ridgewave.v1` on `/v1/live`. The service checks against it."""
    return openapi.SchemaResponse(V1.schema())


@router.get(
    "/v1/live/schema.v2.json",
    operation_id="getLiveSchemaV2",
    summary="Show the schema of the live protocol, version 2",
    response_class=openapi.SchemaResponse,
    responses=openapi.problem_answers(),
)
async def live_schema_v2() -> Response:
    """JSON Schema (2020-12) of every text message of `ridgewave.v2` on `/v1/live`. The service checks against it."""
    return openapi.SchemaResponse(V2.schema())


@router.get(
    "/v1/sessions/{session_id}/recording",
    operation_id="getRecording",
    summary="Fetch the recording of a live session",
    response_class=JSONResponse,
    responses=openapi.problem_answers("not-found"),
)
async def recording(request: Request, session_id: str) -> Response:
    """The recording of a live session whose `hello` had `record`, during it and for RIDGEWAVE_SESSION_IDLE after it."""
    body = await service_of(request).sessions.recording(session_id, request.scope.get(KEY))
    return Response(body, media_type="application/json", headers={"Cache-Control": "no-store"})
