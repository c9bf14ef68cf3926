"""What `/healthz` says: the process answers, and what of it works and what does not.

Model: what takes time to find out (whether PortAudio is there) is looked for once, in a thread, after the start; an
    answer only tells what is known. Nothing optional makes the service unhealthy: a machine without PortAudio renders
    and streams all the same, and says so.
Limits: PortAudio is looked for, not loaded, since it sees only the devices that are there when it is loaded; whether
    it finds a device is for `GET /v1/devices`.
"""

from __future__ import annotations

import asyncio
import importlib.util
from typing import Any

from service import VERSION
from service.operations.settings import Settings
from service.sinks.device_list import missing_portaudio

NOT_YET = "not looked for yet: ask again in a second"
NO_WEBSOCKETS = "live connections need the Python package websockets: pip install websockets."
NO_SESSIONS = "sessions of plain HTTP live in one process: start the service with RIDGEWAVE_WORKERS=1."


class Health:
    """What is known of the state of one process."""

    def __init__(self, settings: Settings) -> None:
        self._audio_device = _capability(None, NOT_YET)
        self._live = _capability(importlib.util.find_spec("websockets") is not None, NO_WEBSOCKETS)
        self._sessions = _capability(settings.workers == 1, NO_SESSIONS)

    async def look(self) -> None:
        """Find out what takes time, once."""
        reason = await asyncio.to_thread(missing_portaudio)
        self._audio_device = _capability(reason is None, reason or "")

    def document(self, *, ready: bool, workers: int, starved: float) -> dict[str, Any]:
        """Return the answer; workers: how many are there. starved: for how long (s) short work has waited, or 0."""
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
