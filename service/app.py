"""The ASGI application: layers outside, routes inside, one shape of error everywhere.

Bouncer (Host, Origin, headers, our bugs) -> CORS, if anyone is allowed -> KeyCheck -> routes
"""

from __future__ import annotations

from fastapi import FastAPI
from fastapi.exceptions import RequestValidationError
from starlette.exceptions import HTTPException
from starlette.middleware import Middleware
from starlette.middleware.cors import CORSMiddleware
from starlette.requests import Request
from starlette.responses import Response

from service import openapi, problems
from service.engine import Engine, SynthEngine
from service.problems import Problem
from service.routes import accuracy, operations, play, render, sessions, stream, textures
from service.running import Service, lifespan
from service.security import Bouncer, KeyCheck
from service.settings import Settings
from synth.errors import Fault, RidgewaveError, shown

DESCRIPTION = "What a finger feels when it scans a texture: a scene in, the vibration out, as a file or a live stream."
EXPOSED = ["Ridgewave-Format", "Ridgewave-Full-Scale", "Ridgewave-Quantities", "Ridgewave-Warning", "Server-Timing"]
LONGEST_NAME = 100  # characters of a parameter's name that a refusal repeats: a peer's text is not sent back whole
STATUSES = {400: "bad-request", 404: "not-found", 405: "method-not-allowed", 413: "too-large"}


def create_app(settings: Settings, engine: Engine | None = None) -> FastAPI:
    """Return the application of one process; `engine` is `synth` unless a test brings its own."""
    app = FastAPI(
        title="ridgewave",
        description=DESCRIPTION,
        version="1",
        lifespan=lifespan,
        docs_url=None,
        redoc_url=None,
        redirect_slashes=False,
        middleware=_layers(settings),
        exception_handlers={
            Problem: _answer_problem,
            RidgewaveError: _answer_refusal,
            RequestValidationError: _answer_parameters,
            HTTPException: _answer_status,
        },
    )
    for routes in (render, accuracy, textures, sessions, stream, play, operations):
        app.include_router(routes.router)
    app.state.service = Service(settings, engine or SynthEngine(settings.cache_bytes))
    app.openapi = lambda: openapi.document(app)  # type: ignore[method-assign]
    return app


def _layers(settings: Settings) -> list[Middleware]:
    layers = [Middleware(Bouncer, settings=settings)]
    if settings.allowed_origins:
        cross_origin = Middleware(
            CORSMiddleware,
            allow_origins=list(settings.allowed_origins),
            allow_methods=["GET", "HEAD", "POST", "PATCH", "DELETE"],
            allow_headers=["Authorization", "Content-Type"],
            expose_headers=EXPOSED,
        )
        layers.append(cross_origin)
    return [*layers, Middleware(KeyCheck, settings=settings)]


async def _answer_problem(_request: Request, error: Exception) -> Response:
    assert isinstance(error, Problem)
    return error.response()


async def _answer_refusal(_request: Request, error: Exception) -> Response:
    assert isinstance(error, RidgewaveError)
    return problems.of(error).response()


async def _answer_parameters(_request: Request, error: Exception) -> Response:
    """Answer for query parameters, the only thing that the framework checks by itself."""
    assert isinstance(error, RequestValidationError)
    faults = tuple(_parameter_fault(entry) for entry in error.errors())
    return Problem("request-refused", faults[0].sentence(), faults).response()


async def _answer_status(_request: Request, error: Exception) -> Response:
    """Answer for what the router refuses: no such path, not this method."""
    assert isinstance(error, HTTPException)
    kind = STATUSES.get(error.status_code, "bad-request")
    return Problem(kind, problems.TYPES[kind].when, headers=error.headers or {}).response()


def _parameter_fault(entry: dict[str, object]) -> Fault:
    place = entry["loc"]
    assert isinstance(place, tuple)
    name = str(place[-1])
    name = name if len(name) <= LONGEST_NAME else name[: LONGEST_NAME - 3] + "..."
    if entry["type"] == "extra_forbidden":
        return Fault(f"?{name}", "a parameter that does not exist", "the parameters of this call", "See /docs.")
    return Fault(f"?{name}", shown(entry.get("input")), str(entry["msg"]), "See /docs.")
