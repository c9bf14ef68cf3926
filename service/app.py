"""The ASGI application: the layers, the routes, and the problem document of every error.

A request passes the layers in this order: RootPath, where the setting is not empty -> Subjects (log)
-> Bouncer (Host, Origin, security headers, internal errors) -> CORS, where origins are allowed -> RateLimit by address
-> KeyCheck -> RateLimit by key -> HeadAsGet -> Compression -> routes
"""

from __future__ import annotations

from pathlib import Path

from fastapi import Depends, FastAPI
from fastapi.exceptions import RequestValidationError
from starlette.exceptions import HTTPException
from starlette.middleware import Middleware
from starlette.middleware.cors import CORSMiddleware
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Match
from starlette.types import Scope

from service import problems
from service.engine import Engine
from service.http import openapi
from service.http.content_negotiation import Compression
from service.http.head_requests import HeadAsGet
from service.http.query_faults import each_once, query_faults
from service.http.rate_limits import Limits, RateLimit
from service.http.reference import Reference
from service.http.root_path import RootPath, redirect_to_page
from service.http.routes import (
    accuracy,
    imported_textures,
    live,
    operations,
    page,
    play,
    render,
    scene,
    sessions,
    stream,
    tables,
    textures,
)
from service.http.security import Bouncer, KeyCheck, Keys
from service.lifespan import Service, lifespan, service_of
from service.operations.logs import Subjects
from service.operations.settings import Settings
from service.problems import Problem
from service.store.data_folder import data_folder
from service.synth_engine import SynthEngine
from synth.errors import RidgewaveError

DESCRIPTION = "What a finger feels when it scans a texture: a scene in, the vibration out, as a file or a live stream."
EXPOSED = ["Ridgewave-Format", "Ridgewave-Full-Scale", "Ridgewave-Quantities", "Ridgewave-Warning", "Server-Timing"]
ROUTES = (render, scene, accuracy, textures, imported_textures, tables, sessions, stream, play, live, operations, page)
KINDS = {400: "bad-request", 404: "not-found", 405: "method-not-allowed", 413: "too-large"}


def create_app(settings: Settings, engine: Engine | None = None, workers_folder: Path | None = None) -> FastAPI:
    """Return the application of one process.

    engine: `synth`, unless a test supplies its own.
    workers_folder: the folder of the sockets between workers; None where this process is the only one.
    """
    own = engine or SynthEngine(settings.cache_bytes, data_folder(settings.data_folder))
    service = Service(settings, own, workers_folder, apart=engine is None)
    app = FastAPI(
        title="ridgewave",
        description=DESCRIPTION,
        version="1",
        lifespan=lifespan,
        servers=[{"url": settings.root_path}] if settings.root_path else None,
        openapi_url=None,
        docs_url=None,
        redoc_url=None,
        redirect_slashes=False,
        dependencies=[Depends(each_once)],
        middleware=_layers(settings, service.limits),
        exception_handlers=dict.fromkeys((Problem, RidgewaveError, RequestValidationError, HTTPException), _answer),
    )
    for module in ROUTES:
        app.include_router(module.router)
    if settings.root_path:
        app.add_route(settings.root_path, redirect_to_page, include_in_schema=False)
    app.state.service = service
    app.openapi = lambda: openapi.document(app)  # type: ignore[method-assign]
    service.reference = Reference(app)
    return app


def _layers(settings: Settings, limits: Limits) -> list[Middleware]:
    layers = [Middleware(RootPath, root_path=settings.root_path)] if settings.root_path else []
    layers += [Middleware(Subjects), Middleware(Bouncer, settings=settings)]
    if settings.allowed_origins:
        cross_origin = Middleware(
            CORSMiddleware,
            allow_origins=list(settings.allowed_origins),
            allow_methods=["GET", "HEAD", "POST", "PATCH", "DELETE"],
            allow_headers=["Authorization", "Content-Type"],
            expose_headers=EXPOSED,
        )
        layers.append(cross_origin)
    keys = Keys(settings)
    by_address, by_key = (
        Middleware(RateLimit, limits=limits, admits=keys.admit, by_key=by_key) for by_key in (False, True)
    )
    inner = [Middleware(HeadAsGet, methods=_methods), Middleware(Compression)]
    return [*layers, by_address, Middleware(KeyCheck, settings=settings, keys=keys), by_key, *inner]


async def _answer(request: Request, error: Exception) -> Response:
    problem = _problem_of(request, error)
    service_of(request).metrics.refused(problem.kind)
    return problem.response(service_of(request).settings.root_path)


def _problem_of(request: Request, error: Exception) -> Problem:
    match error:
        case Problem():
            return error
        case RidgewaveError():
            return problems.of(error)
        case RequestValidationError():  # of query parameters: the framework checks nothing else
            faults = query_faults(request, error.errors())
            return Problem("request-refused", problems.summary(faults), faults)
    assert isinstance(error, HTTPException)  # an unknown path, or a method that the path does not have
    kind = KINDS.get(error.status_code, "bad-request")
    headers = {"Allow": _allowed(request)} if error.status_code == 405 else error.headers or {}
    return Problem(kind, problems.TYPES[kind].when, headers=headers)


def _allowed(request: Request) -> str:
    """Return the methods of the path as text; HEAD is one of them wherever GET is."""
    methods = _methods(request.scope)
    return ", ".join(sorted(methods | {"HEAD"} if "GET" in methods else methods))


def _methods(scope: Scope) -> set[str]:
    """Return the methods of all routes of the path: the router's own Allow has only those of the first route."""
    routes = [*scope["app"].routes, *(route for module in ROUTES for route in module.router.routes)]
    matching = [route for route in routes if route.matches(scope)[0] is not Match.NONE]
    return {method for route in matching for method in getattr(route, "methods", None) or ()}
