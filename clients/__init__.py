"""clients: what people hold: the command line `ridgewave` (`python -m clients` is the same), and the Python client.

    from clients import Client, AsyncClient, Live, AsyncLive

The house's last room: it may import `service` and `synth`, and nothing imports it. Everything heavy is imported inside
the command that needs it, and a name of the Python client is loaded when it is first used, so that `ridgewave --help`
answers at once.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from clients.client_errors import (
        ClientError,
        ConnectionLost,
        Problem,
        ProblemError,
        ProtocolError,
        RefusedError,
        ResumeLost,
        ServiceError,
        StreamEnded,
    )
    from clients.http_client.async_client import AsyncClient
    from clients.http_client.sync_client import Client
    from clients.live_client.async_live import AsyncLive
    from clients.live_client.sync_live import Live
    from synth.encode.sound import Sound

_HOMES = {
    "AsyncClient": "clients.http_client.async_client",
    "AsyncLive": "clients.live_client.async_live",
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

__all__ = [
    "AsyncClient",
    "AsyncLive",
    "Client",
    "ClientError",
    "ConnectionLost",
    "Live",
    "Problem",
    "ProblemError",
    "ProtocolError",
    "RefusedError",
    "ResumeLost",
    "ServiceError",
    "Sound",
    "StreamEnded",
]


def __getattr__(name: str) -> Any:
    """Load a name of the Python client from its home."""
    from importlib import import_module

    if name not in _HOMES:
        raise AttributeError(f"module 'clients' has no attribute {name!r}")
    return getattr(import_module(_HOMES[name]), name)


def __dir__() -> list[str]:
    """Return the public names, those that are not loaded yet included."""
    return sorted({*globals(), *__all__})
