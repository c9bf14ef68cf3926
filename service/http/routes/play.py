"""`/v1/sessions/{id}/play` and `/v1/devices`: sound on the machine that the service runs on."""

from __future__ import annotations

import asyncio

from fastapi import APIRouter, Request
from starlette.responses import JSONResponse, Response
from starlette.types import Scope

from service.http import openapi
from service.http.rate_limits import KEY
from service.http.request_body import read_body
from service.http.sound_headers import metadata_of
from service.lifespan import Service, service_of
from service.problems import Problem, of, refused
from service.sessions.session import Session
from service.sinks import DeviceBusy, list_devices
from service.sinks.player import Player
from synth.errors import CannotRender, NameTaken, SceneError, shown
from synth.scene.text import object_from_text

router = APIRouter(tags=["play"])

END_SECONDS = 5.0  # for a play to end; a device that takes longer has stalled, and its play reports it
BODY = {
    "type": "object",
    "additionalProperties": False,
    "properties": {"device": {"type": ["string", "integer", "null"], "description": "Name, index, or file:NAME.wav"}},
}


@router.post(
    "/v1/sessions/{session_id}/play",
    operation_id="playSession",
    summary="Play a session on the server's machine",
    status_code=202,
    response_class=JSONResponse,
    responses=openapi.answer_of("Play", "The play has begun.", 202)
    | openapi.problem_answers(
        "not-found",
        "busy",
        "too-large",
        "not-json",
        "request-refused",
        "too-many-streams",
        "cannot-render",
        "full",
        "one-worker",
    ),
    openapi_extra=openapi.body(BODY),
)
async def play(request: Request, session_id: str) -> Response:
    """`{"device": null}` is the default device; "file:NAME.wav" or "file:NAME.flac" records into a file."""
    service = service_of(request)
    text = await read_body(request)
    session = service.sessions.find(session_id, request.scope.get(KEY))
    player = await _start(service, request.scope, session, await asyncio.to_thread(_device, text))
    location = f"{service.settings.root_path}/v1/sessions/{session.id}"
    return JSONResponse(player.document(), 202, {"Location": location})


@router.delete(
    "/v1/sessions/{session_id}/play",
    operation_id="endPlay",
    summary="End a play",
    response_class=JSONResponse,
    responses=openapi.answer_of("Play", "The play, ended.") | openapi.problem_answers("not-found", "one-worker"),
)
async def end(request: Request, session_id: str) -> Response:
    """The play fades out. The answer is sent when the device has played all of the sound, or the file holds it."""
    session = service_of(request).sessions.find(session_id, request.scope.get(KEY))
    player = session.player
    if player is None:
        raise Problem("not-found", "This session has no play.")
    player.end()
    await asyncio.to_thread(player.wait, END_SECONDS)
    if session.player is player:
        session.player = None
    session.touch()
    return JSONResponse(player.document())


@router.get(
    "/v1/devices",
    operation_id="listDevices",
    summary="List the audio devices of the server's machine",
    response_class=JSONResponse,
    responses=openapi.problem_answers(),
)
async def devices(request: Request) -> Response:
    """Without PortAudio the list is empty, and `note` says what to install. The file sink is always available."""
    try:
        found, note = await asyncio.to_thread(list_devices), None
    except CannotRender as error:
        found, note = [], error.reason
    return JSONResponse({"devices": found, "file_sink": "file:NAME.wav or file:NAME.flac", "note": note})


async def _start(service: Service, scope: Scope, session: Session, device: str | int | None) -> Player:
    """Start and return the play of a session; raises Problem (409) if it has one."""
    if session.player is not None and session.player.playing:
        raise Problem("busy", "The session already plays. DELETE its play first.")
    ticket = service.limits.admit(scope)
    try:
        player = Player(device, service.settings, service.metrics, service.claims, over=ticket.release)
        return await _begin(session, player)
    except BaseException:
        ticket.release()
        raise


async def _begin(session: Session, player: Player) -> Player:
    """Start `player` as the play of a session; on failure the session keeps its earlier one."""
    earlier, session.player = session.player, player
    try:
        player.stream = await session.open_stream()
        await asyncio.to_thread(player.start, metadata_of(session, session.scene_text))
    except BaseException as error:
        session.player = earlier
        if isinstance(error, NameTaken):
            detail = "A recording of that name exists, or is being made. Choose another name."
            raise Problem("name-taken", detail) from error
        if isinstance(error, DeviceBusy):
            raise Problem("busy", error.reason) from error
        raise
    if session.ended:
        player.end(at_once=True)
    return player


def _device(text: bytes) -> str | int | None:
    """Return the device that a body names."""
    try:
        document = object_from_text(text)
    except SceneError as error:
        problem = of(error)
        raise Problem("request-refused", problem.detail, problem.faults) from error
    unknown = [name for name in document if name != "device"]
    if unknown:
        raise refused("", shown(unknown[0]), "the field device", 'Write {"device": "file:take.wav"}.')
    device = document.get("device")
    if isinstance(device, bool) or not (device is None or isinstance(device, str | int)):
        raise refused("/device", shown(device), "a name, an index, or file:NAME", 'Write {"device": null}.')
    return device
