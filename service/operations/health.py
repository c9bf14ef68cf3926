"""The answer of `/healthz`: which parts of the service work on this machine.

Model: whether PortAudio is installed is checked once, in a thread, after the start; an answer never waits for it. No
    optional part makes the service unhealthy: a machine without PortAudio renders and streams.
Limits: PortAudio is looked for but not loaded, because it sees only the devices present when it is loaded. `GET
    /v1/devices` lists devices.
"""

from __future__ import annotations

import asyncio
import importlib.util
from typing import Any

from service import VERSION
from service.operations.settings import Settings
from service.sinks.device_list import missing_portaudio

NOT_YET = "not checked yet: try again in a second."
NO_WEBSOCKETS = "live connections need the Python package websockets: pip install websockets."
NO_SESSIONS = "sessions of plain HTTP need a single process: start the service with RIDGEWAVE_WORKERS=1."


class Health:
    """The known state of one process."""

    def __init__(self, settings: Settings) -> None:
        self._audio_device = _capability(None, NOT_YET)
        self._live = _capability(importlib.util.find_spec("websockets") is not None, NO_WEBSOCKETS)
        self._sessions = _capability(settings.workers == 1, NO_SESSIONS)

    async def look(self) -> None:
        """Check for PortAudio."""
        reason = await asyncio.to_thread(missing_portaudio)
        self._audio_device = _capability(reason is None, reason or "")

    def document(self, *, ready: bool, workers: int, starved: float) -> dict[str, Any]:
        """Return the answer. starved: seconds that short work has waited to begin."""
        return {
            "status": "ok",
            "version": VERSION,
            "ready": ready,
            "workers": workers,
            "starved_seconds": starved,
            "audio_device": self._audio_device,
            "live": self._live,
            "sessions": self._sessions,
        }


def _capability(available: bool | None, reason: str) -> dict[str, Any]:
    return {"available": available, "reason": None if available else reason}
