"""`POST /v1/stop`, `/healthz`, `/readyz`, `/metrics` and `/docs`: what those who look after the service call."""

from __future__ import annotations

from fastapi import APIRouter, Request
from starlette.responses import HTMLResponse, JSONResponse, PlainTextResponse, Response

from service.http import openapi
from service.http.reference_page import CONTENT_SECURITY_POLICY, reference_page
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
    """Every stream and device falls silent within 20 ms at the server's write, and every session ends, so that a player
    that connects again by itself gets nothing. Needs no body. The answer counts what was stopped, in all workers."""
    service = service_of(request)
    await read_body(request, service.settings.max_body, optional=True)
    return JSONResponse(await service.stop())


@router.head("/healthz", include_in_schema=False)
@router.get(
    "/healthz",
    operation_id="getHealth",
    summary="Say that the process answers",
    response_class=JSONResponse,
    responses=openapi.problem_answers(),
)
async def health(request: Request) -> Response:
    """For a container's health check; needs no key. It also says what works here and what does not, and why."""
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
    summary="Say whether requests are welcome",
    response_class=JSONResponse,
    responses=openapi.problem_answers("closing", "warming", "starved"),
)
async def ready(request: Request) -> Response:
    """503 until the kernels are compiled, while short work waits for more than a second, and once the service shuts
    down; needs no key."""
    service = service_of(request)
    if service.closing:
        raise Problem("closing", "The service is shutting down.")
    if not service.warm:
        raise Problem("warming", "The kernels are being compiled.", headers={"Retry-After": "1"})
    if waited := service.starved():
        detail = f"Short work has waited for {waited:.1f} s: the service has more to solve than it can."
        raise Problem("starved", detail, headers={"Retry-After": "1"})
    return JSONResponse({"status": "ready"}, headers={"Cache-Control": "no-store"})


@router.get(
    "/metrics",
    operation_id="getMetrics",
    summary="Measure the service",
    response_class=PlainTextResponse,
    responses=openapi.problem_answers(),
)
async def metrics(request: Request) -> Response:
    """For Prometheus, in its text or as OpenMetrics; of all workers. docs/operations.md has each metric."""
    text, media_type = await service_of(request).worker_metrics.metrics(request.headers.get("accept", ""))
    return Response(text, headers={"Content-Type": media_type, "Cache-Control": "no-store"})


@router.get(
    "/docs",
    operation_id="getDocs",
    summary="Read this",
    response_class=HTMLResponse,
    responses=openapi.problem_answers(),
)
async def docs(request: Request) -> Response:
    """Calls, problems and settings as a page."""
    page = reference_page(request.app.openapi())
    return HTMLResponse(page, headers={"Content-Security-Policy": CONTENT_SECURITY_POLICY})
