"""The public Python interface of ridgewave: the vibration that a finger feels when it scans a texture.

    import ridgewave as rw
    sound = rw.render("grating-1mm-31um", scan={"speed": "120 mm/s"})  # a Sound: values in SI units, save(), plot()
    same = rw.load(sound.save("coarse.wav"))  # a file has its scale and its scene
    plan = rw.explain({"texture": {"period": "0.8 mm"}})  # what is simulated, why, at what cost and error
    many = rw.sweep({}, {"texture.period": ["0.4 mm", "0.8 mm"]})  # many scenes, as a labelled dataset
    voice = rw.open_voice("scene.json")  # the same sound, block by block
    names = rw.textures()  # sandpapers, cloths, wood, metal, gratings of laboratories, and what you imported
    client = rw.Client("http://127.0.0.1:8000")  # the service, over HTTP; `rw.Live` over a WebSocket

Only these names are stable; those in `synth`, `service` and `clients` may move. The import is fast, because each name
is loaded when it is first used.
"""

from __future__ import annotations as _annotations

from importlib import import_module as _import_module
from typing import TYPE_CHECKING as _TYPE_CHECKING

if _TYPE_CHECKING:
    from clients.client_errors import ClientError as ClientError
    from clients.client_errors import ConnectionLost as ConnectionLost
    from clients.client_errors import Problem as Problem
    from clients.client_errors import ProblemError as ProblemError
    from clients.client_errors import ProtocolError as ProtocolError
    from clients.client_errors import RefusedError as RefusedError
    from clients.client_errors import ResumeLost as ResumeLost
    from clients.client_errors import ServiceError as ServiceError
    from clients.client_errors import StreamEnded as StreamEnded
    from clients.http_client.async_client import AsyncClient as AsyncClient
    from clients.http_client.sync_client import Client as Client
    from clients.live_client.async_live import AsyncLive as AsyncLive
    from clients.live_client.reconnection import Backoff as Backoff
    from clients.live_client.sync_live import Live as Live
    from ridgewave.imports import import_texture as import_texture
    from ridgewave.scenes import explain as explain
    from ridgewave.scenes import load as load
    from ridgewave.scenes import measure_accuracy as measure_accuracy
    from ridgewave.scenes import open_voice as open_voice
    from ridgewave.scenes import parse_scene as parse_scene
    from ridgewave.scenes import render as render
    from ridgewave.scenes import textures as textures
    from ridgewave.studies import analyze as analyze
    from ridgewave.studies import compare as compare
    from ridgewave.studies import sweep as sweep
    from ridgewave.studies import told_apart as told_apart
    from service.store.stored_texture import StoredTexture as StoredTexture
    from synth.accuracy.report import AccuracyReport as AccuracyReport
    from synth.encode.sound import Sound as Sound
    from synth.encode.sound import common_full_scale as common_full_scale
    from synth.errors import CannotRender as CannotRender
    from synth.errors import InvalidRequest as InvalidRequest
    from synth.errors import NameTaken as NameTaken
    from synth.errors import RenderWarning as RenderWarning
    from synth.errors import RidgewaveError as RidgewaveError
    from synth.errors import SceneError as SceneError
    from synth.motion.motion import Motion as Motion
    from synth.plan.plan import Plan as Plan
    from synth.scene.catalogue import CatalogueEntry as CatalogueEntry
    from synth.scene.scene import Scene as Scene
    from synth.voice.voice import Voice as Voice

_MODULES = {
    "AccuracyReport": "synth.accuracy.report",
    "AsyncClient": "clients.http_client.async_client",
    "AsyncLive": "clients.live_client.async_live",
    "Backoff": "clients.live_client.reconnection",
    "CannotRender": "synth.errors",
    "CatalogueEntry": "synth.scene.catalogue",
    "Client": "clients.http_client.sync_client",
    "ClientError": "clients.client_errors",
    "ConnectionLost": "clients.client_errors",
    "InvalidRequest": "synth.errors",
    "Live": "clients.live_client.sync_live",
    "Motion": "synth.motion.motion",
    "NameTaken": "synth.errors",
    "Plan": "synth.plan.plan",
    "Problem": "clients.client_errors",
    "ProblemError": "clients.client_errors",
    "ProtocolError": "clients.client_errors",
    "RefusedError": "clients.client_errors",
    "RenderWarning": "synth.errors",
    "ResumeLost": "clients.client_errors",
    "RidgewaveError": "synth.errors",
    "Scene": "synth.scene.scene",
    "SceneError": "synth.errors",
    "ServiceError": "clients.client_errors",
    "Sound": "synth.encode.sound",
    "StoredTexture": "service.store.stored_texture",
    "StreamEnded": "clients.client_errors",
    "Voice": "synth.voice.voice",
    "analyze": "ridgewave.studies",
    "common_full_scale": "synth.encode.sound",
    "compare": "ridgewave.studies",
    "explain": "ridgewave.scenes",
    "import_texture": "ridgewave.imports",
    "load": "ridgewave.scenes",
    "measure_accuracy": "ridgewave.scenes",
    "open_voice": "ridgewave.scenes",
    "parse_scene": "ridgewave.scenes",
    "render": "ridgewave.scenes",
    "sweep": "ridgewave.studies",
    "told_apart": "ridgewave.studies",
    "textures": "ridgewave.scenes",
}

__all__ = [*_MODULES]


def __getattr__(name: str) -> object:
    """Load a public name from its module."""
    if name not in _MODULES:
        raise AttributeError(f"module 'ridgewave' has no attribute {name!r}")
    return getattr(_import_module(_MODULES[name]), name)


def __dir__() -> list[str]:
    """Return the public names, including those that are not loaded yet."""
    return sorted(__all__)
