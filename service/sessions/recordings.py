"""The recordings of live sessions that have ended, kept for a while within a bound of memory.

Limits: a recording is kept for RIDGEWAVE_SESSION_IDLE after its session's end. It belongs to the key that opened the
    session: to another key it is not there.
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
    """One recording: whose it is, until when it is kept, and its JSON once it is made."""

    owner: int | None
    until: float
    made: asyncio.Future[bytes]

    @property
    def size(self) -> int:
        """Return its bytes; 0 until it is made."""
        return len(self.made.result()) if self.made.done() and not self.made.cancelled() else 0


class Recordings:
    """The recordings of one process. seconds: for how long one is kept."""

    def __init__(self, seconds: float) -> None:
        self._seconds = seconds
        self._kept: dict[str, Recording] = {}
        self._tasks: set[asyncio.Task[None]] = set()

    @property
    def used_bytes(self) -> int:
        """Return the memory that they take."""
        return sum(kept.size for kept in self._kept.values())

    def keep(self, session: Session, stream: VoiceStream) -> None:
        """Keep the recording of `session`, which has ended."""
        loop = asyncio.get_running_loop()
        made: asyncio.Future[bytes] = loop.create_future()
        self._kept[session.id] = Recording(session.owner, time.monotonic() + self._seconds, made)
        task = loop.create_task(self._make(session.id, stream, made))
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    async def find(self, name: str, owner: int | None) -> bytes | None:
        """Return the JSON of a session's recording, None where there is none of that owner."""
        kept = self._kept.get(name)
        return None if kept is None or kept.owner != owner else await asyncio.shield(kept.made)

    def free(self, excess: int) -> int:
        """Forget the oldest recordings until `excess` bytes are free; return how many are still too many."""
        for name, size in [(name, kept.size) for name, kept in self._kept.items()]:
            if size and excess > 0:
                del self._kept[name]
                excess -= size
        return excess

    def expire(self, now: float) -> None:
        """Forget those whose time is over."""
        for name in [name for name, kept in self._kept.items() if now > kept.until]:
            del self._kept[name]

    async def settle(self, seconds: float) -> None:
        """Return once all are made, or after so long."""
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
    """Return the JSON of the recording that `stream` keeps."""
    made: bytes = await ThreadWork(partial(stream.recording), "recording").done
    return made
