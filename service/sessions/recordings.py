"""The recordings of ended live sessions, within a bound of memory.

Limits: a recording is kept for RIDGEWAVE_SESSION_IDLE after the end of its session. Only the key that opened the
    session can read it.
"""

from __future__ import annotations

import asyncio
import logging
import time
from functools import partial
from typing import NamedTuple

from service.compute.threads import ThreadWork
from service.sessions.session import Session
from service.sessions.voice_stream import VoiceStream

log = logging.getLogger("ridgewave.service")


class Recording(NamedTuple):
    """One recording.

    owner: number of the key that opened the session.
    until: time at which it expires.
    made: its JSON.
    """

    owner: int | None
    until: float
    made: asyncio.Future[bytes]

    @property
    def size(self) -> int:
        """Return the size in bytes, 0 until the JSON is made."""
        return len(self.made.result()) if self.made.done() and not self.made.cancelled() else 0


class Recordings:
    """The recordings of one process. seconds: for which each is kept."""

    def __init__(self, seconds: float) -> None:
        self._seconds = seconds
        self._kept: dict[str, Recording] = {}
        self._tasks: set[asyncio.Task[None]] = set()

    @property
    def used_bytes(self) -> int:
        """Return the size of all recordings."""
        return sum(kept.size for kept in self._kept.values())

    def keep(self, session: Session, stream: VoiceStream) -> None:
        """Keep the recording of the ended `session`."""
        loop = asyncio.get_running_loop()
        made: asyncio.Future[bytes] = loop.create_future()
        self._kept[session.id] = Recording(session.owner, time.monotonic() + self._seconds, made)
        task = loop.create_task(self._make(session.id, stream, made))
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    async def find(self, name: str, owner: int | None) -> bytes | None:
        """Return the JSON of the recording of session `name`, None if `owner` has no such recording."""
        kept = self._kept.get(name)
        return None if kept is None or kept.owner != owner else await asyncio.shield(kept.made)

    def free(self, excess: int) -> int:
        """Remove the oldest recordings until `excess` bytes are free; return how many bytes are missing."""
        for name, size in [(name, kept.size) for name, kept in self._kept.items()]:
            if size and excess > 0:
                del self._kept[name]
                excess -= size
        return excess

    def expire(self, now: float) -> None:
        """Remove expired recordings."""
        for name in [name for name, kept in self._kept.items() if now > kept.until]:
            del self._kept[name]

    async def settle(self, seconds: float) -> None:
        """Return once all recordings are made, or after `seconds`."""
        if self._tasks:
            await asyncio.wait(self._tasks, timeout=seconds)

    async def _make(self, name: str, stream: VoiceStream, made: asyncio.Future[bytes]) -> None:
        async with stream.turn:
            try:
                made.set_result(await recording_of(stream))
            except Exception:
                log.exception("our mistake: the recording of a live session that has ended")
            finally:
                if not made.done():
                    made.cancel()
                    self._kept.pop(name, None)


async def recording_of(stream: VoiceStream) -> bytes:
    """Return the JSON of the recording of `stream`, made in a thread."""
    made: bytes = await ThreadWork(partial(stream.recording), "recording").done
    return made
