"""The command line `ridgewave` (also `python -m clients`), the Python client of the service, and the web page.

    from clients import Client, AsyncClient, Live, AsyncLive

A name of the Python client is loaded when it is first used, and each command imports what it needs, so that
`ridgewave --help` answers at once.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
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
    from synth.encode.sound import Sound as Sound

_MODULES = {
    "AsyncClient": "clients.http_client.async_client",
    "AsyncLive": "clients.live_client.async_live",
    "Backoff": "clients.live_client.reconnection",
    "Client": "clients.http_client.sync_client",
    "ClientError": "clients.client_errors",
    "ConnectionLost": "clients.client_errors",
    "Live": "clients.live_client.sync_live",
    "Problem": "clients.client_errors",
    "ProblemError": "clients.client_errors",
    "ProtocolError": "clients.client_errors",
    "RefusedError": "clients.client_errors",
    "ResumeLost": "clients.client_errors",
    "ServiceError": "clients.client_errors",
    "Sound": "synth.encode.sound",
    "StreamEnded": "clients.client_errors",
}

__all__ = [*_MODULES]


def __getattr__(name: str) -> Any:
    """Load a name of the Python client from its module."""
    from importlib import import_module

    if name not in _MODULES:
        raise AttributeError(f"module 'clients' has no attribute {name!r}")
    return getattr(import_module(_MODULES[name]), name)


def __dir__() -> list[str]:
    """Return the public names, also those that are not loaded yet."""
    return sorted({*globals(), *__all__})
