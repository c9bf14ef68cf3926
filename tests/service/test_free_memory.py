"""The memory of ended sessions is let go of, and goes back to the system."""

from __future__ import annotations

import asyncio
import platform
import threading
import time
import weakref
from pathlib import Path

import numpy as np
import pytest

from service.compute.threads import BlockThreads
from service.sessions import free_memory
from service.sessions.free_memory import PERIOD, TRIMMED_BYTES, FreeMemory, give_back
from tests.service.harness import PATIENCE

PAGES = 1 << 12


class Voice:
    """Something that a call keeps alive."""

    def block(self) -> int:
        return 1


def test_an_idle_thread_for_blocks_keeps_no_voice_alive() -> None:
    threads, voice = BlockThreads(1, lambda _seconds: None), Voice()
    gone = weakref.ref(voice)
    try:
        assert threads.submit(voice.block).result(PATIENCE) == 1
        del voice
        began = time.monotonic()
        while gone() is not None:
            assert time.monotonic() - began < PATIENCE, "the thread still has it"
            time.sleep(0.001)
    finally:
        threads.shutdown()


def test_memory_goes_back_once_enough_sessions_have_faded_out(monkeypatch: pytest.MonkeyPatch) -> None:
    given: list[str] = []
    done = threading.Event()

    def back() -> None:
        given.append("back")
        done.set()

    monkeypatch.setattr(free_memory, "give_back", back)

    async def scenario() -> None:
        memory = FreeMemory()
        memory.look(100.0)
        memory.ended(TRIMMED_BYTES - 1)
        memory.look(100.0 + PERIOD)
        memory.look(100.0 + 2 * PERIOD)
        assert not given, "too little was freed"
        memory.ended(1)
        memory.look(100.0 + 3 * PERIOD)
        memory.look(100.0 + 4 * PERIOD - 0.01)
        assert not given, "the last one still fades out"
        memory.look(100.0 + 4 * PERIOD)
        assert await asyncio.to_thread(done.wait, PATIENCE)
        memory.look(100.0 + 5 * PERIOD)
        assert given == ["back"]

    asyncio.run(scenario())


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="only glibc has malloc_trim")
def test_what_is_free_between_blocks_in_use_goes_back_to_the_system() -> None:
    kept, freed = [], [np.ones(PAGES) for _ in range(3)]  # 32 KB: below the size that is mapped apart
    for _ in range(2000):
        freed.append(np.ones(PAGES))
        kept.append(np.ones(256))
    freed.clear()
    before = resident()
    give_back()
    assert before - resident() > 20e6


def resident() -> float:
    """Return the resident memory of this process in bytes."""
    return 4096.0 * int(Path("/proc/self/statm").read_text().split()[1])
