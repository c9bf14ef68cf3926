"""A client that pulls a minute of sound block by block, over loopback: how long it takes, and its messages a second.

Model: one service of one worker, and `reference_client`, whose socket has no setting. It sends the credit of a block in
    its contact, or in a message `more` in the same write. The last lines send the two in writes of their own, with and
    without TCP_NODELAY, for some seconds of sound.
Limits: the client and the service share the machine's cores.
"""

from __future__ import annotations

import socket
import tempfile
from pathlib import Path
from time import perf_counter

from tests.bench.timing import Figure
from tests.service.harness import Child, roomy_environment
from tests.service.live.reference_client import ReferenceClient, Way

SECONDS = 60.0  # of sound
LONGEST = 61.0  # s that they may take
APART_SECONDS = 3.0  # of sound, where the two messages are two writes
BLOCKS = (48, 480)
WAYS: tuple[Way, ...] = ("one message", "two messages")


def figures(quick: bool) -> list[Figure]:
    """Return the lines of each way and block."""
    seconds, apart = (0.5, 0.1) if quick else (SECONDS, APART_SECONDS)
    with tempfile.TemporaryDirectory() as folder:
        child = Child("service", Path(folder), **roomy_environment())
        try:
            lines = []
            for way in WAYS:
                for block in BLOCKS:
                    lines += measured(child.url(), way, block, seconds)
            for no_delay in (False, True):
                lines += measured(child.url(), "two writes", BLOCKS[-1], apart, no_delay=no_delay)
            return lines
        finally:
            child.terminate()


def measured(url: str, way: Way, block: int, seconds: float, *, no_delay: bool | None = None) -> list[Figure]:
    """Return the seconds that `seconds` of sound take, and the messages a second. no_delay: None leaves the socket."""
    client, longest = ReferenceClient(url, block), 0.0
    with client.socket:
        if no_delay is not None:
            client.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, no_delay)
        began = perf_counter()
        while client.frames < seconds * client.rate:
            before = perf_counter()
            client.pull(way)
            longest = max(longest, perf_counter() - before)
        took = perf_counter() - began
    sent = client.seq * (1 if way == "one message" else 2) / took
    name = f"lock step, {way}" + (", TCP_NODELAY" if no_delay else "") + f", {block}"
    how = f"{seconds:g} s of sound in blocks of {block}; the longest block {1e3 * longest:.0f} ms"
    limit = None if way == "two writes" else LONGEST * seconds / SECONDS
    return [Figure(name, took, took, "s", limit, how), Figure(f"{name}, sent", sent, sent, "1/s", None, how)]
