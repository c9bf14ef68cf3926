"""`POST /v1/stop`, `/healthz`, `/readyz`, `/metrics` and `/docs`: the calls for operators."""

from __future__ import annotations

import asyncio
from contextlib import suppress

from fastapi import APIRouter, Request
from starlette.requests import ClientDisconnect
from starlette.responses import HTMLResponse, JSONResponse, PlainTextResponse, Response

from service.http import openapi
from service.http.reference import Reference
from service.http.reference_page import CONTENT_SECURITY_POLICY
from service.http.request_body import read_body
from service.lifespan import service_of
from service.problems import Problem

router = APIRouter(tags=["operations"])


@router.post(
    "/v1/stop",
    operation_id="stopAll",
    summary="Stop everything",
    response_class=JSONResponse,
    responses=openapi.problem_answers("not-json", "too-large"),
)
async def stop(request: Request) -> Response:
    """Every stream and device falls silent within 20 ms at the server's write. Every session ends too, so that a player
    that reconnects by itself gets nothing. No body is required. The answer counts what was stopped in all workers."""
    with suppress(ClientDisconnect):  # a proxy that gave up while this process hung: the stop is wanted all the same
        await read_body(request, optional=True)
    return JSONResponse(await service_of(request).stop())


@router.head("/healthz", include_in_schema=False)
@router.get(
    "/healthz",
    operation_id="getHealth",
    summary="Check that the process answers",
    response_class=JSONResponse,
    responses=openapi.problem_answers(),
)
async def health(request: Request) -> Response:
    """For the health check of a container; requires no key. Lists what works here, and why the rest does not."""
    service = service_of(request)
    workers = 1 + len(service.worker_messages.present())
    starved = service.starved()
    ready = service.warm and not service.closing and not starved
    document = service.health.document(ready=ready, workers=workers, starved=starved)
    return JSONResponse(document, headers={"Cache-Control": "no-store"})


@router.head("/readyz", include_in_schema=False)
@router.get(
    "/readyz",
    operation_id="getReadiness",
    summary="Check that the service is ready",
    response_class=JSONResponse,
    responses=openapi.problem_answers("closing", "warming", "starved"),
)
async def ready(request: Request) -> Response:
    """503 until the kernels are compiled, while short work waits for more than a second, and during shutdown. Requires
    no key."""
    service = service_of(request)
    if service.closing:
        raise Problem("closing", "The service is shutting down.")
    if not service.warm:
        raise Problem("warming", "The kernels are being compiled.", headers={"Retry-After": "1"})
    if waited := service.starved():
        detail = f"Short work has waited for {waited:.1f} s: the service has too much to solve."
        raise Problem("starved", detail, headers={"Retry-After": "1"})
    return JSONResponse({"status": "ready"}, headers={"Cache-Control": "no-store"})


@router.get(
    "/metrics",
    operation_id="getMetrics",
    summary="Get the metrics",
    response_class=PlainTextResponse,
    responses=openapi.problem_answers(),
)
async def metrics(request: Request) -> Response:
    """The metrics of all workers, as text of Prometheus or as OpenMetrics. docs/operations.md lists each metric."""
    text, media_type = await service_of(request).worker_metrics.metrics(request.headers.get("accept", ""))
    return Response(text, headers={"Content-Type": media_type, "Cache-Control": "no-store"})


@router.get(
    "/docs",
    operation_id="getDocs",
    summary="Show this page",
    response_class=HTMLResponse,
    responses=openapi.problem_answers(),
)
async def docs(request: Request) -> Response:
    """A page with all calls, problems and settings."""
    reference = _reference(request)
    page = await asyncio.to_thread(lambda: reference.page)
    return HTMLResponse(page, headers={"Content-Security-Policy": CONTENT_SECURITY_POLICY})


@router.get("/openapi.json", include_in_schema=False)
async def openapi_document(request: Request) -> Response:
    """The OpenAPI document."""
    reference = _reference(request)
    document = await asyncio.to_thread(lambda: reference.document)
    return Response(document, media_type="application/json")


def _reference(request: Request) -> Reference:
    found = service_of(request).reference
    assert found is not None, "the application sets it"
    return found
