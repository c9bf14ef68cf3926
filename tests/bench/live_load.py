"""Moves hands on many live streams at once: connects, strokes, reads everything, and reports how late it arrived.

    python -m tests.bench.live_load http://127.0.0.1:8000 --streams 200 --seconds 60 [--pid SERVER]

Model: one thread, non-blocking sockets, one epoll. A pass reads the received data, sends the updates that are due
    (spread evenly over time and streams), and sleeps a tick. Streams run from their `ready` on. The measured time is
    `--seconds` long and begins `--settle` after the last stream has opened. Prints JSON (`live_report`). The exit code
    is 1 where blocks are missing or a stream broke the protocol. A signal (SIGTERM, SIGINT) ends the measured time, and
    the report is made as usual.
Limits: Linux (epoll, /proc). Lateness and latency include up to a tick and a pass of this process.
"""

from __future__ import annotations

import argparse
import json
import resource
import select
import signal
import socket
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from time import perf_counter
from typing import Any
from urllib.parse import urlsplit

import numpy as np

from tests.bench.live_hand import scene
from tests.bench.live_report import Window, report, spread
from tests.bench.live_stream import Stream
from tests.bench.process_use import family, processor_seconds, resident_bytes

OPENING = 16  # connections that are opened at a time: more would measure the server's queue, not its streams
OPEN_SECONDS = 30.0  # for one stream to be ready: a first scene may have to be compiled and solved
END_SECONDS = 2.0  # for the server to fade and end after `stop`


@dataclass(frozen=True, slots=True)
class Asked:
    """The request for a run; times in seconds."""

    url: str
    streams: int = 1
    seconds: float = 10.0
    settle: float = 1.0
    drain: float = 1.0
    updates_hz: float = 100.0
    block: int = 480
    sample_rate: int = 48000
    scenes: int = 1
    key: str | None = None
    pids: tuple[int, ...] = ()
    tick: float = 0.001
    arrivals: str | None = None


class Load:
    """One run; `run` returns its report."""

    def __init__(self, asked: Asked) -> None:
        self.asked = asked
        self.streams: list[Stream] = []
        self._poll = select.epoll()
        self._by_descriptor: dict[int, Stream] = {}
        self._touched = 0  # updates sent since `_hands_from`, over all streams
        self._hands_from = 0.0
        self._passes: list[float] = []
        self._enough = False

    def enough(self) -> None:
        """End the measured time; for a signal handler."""
        self._enough = True

    def run(self) -> dict[str, Any]:
        """Open, measure and end the streams; return the report."""
        asked = self.asked
        try:
            self._open_all()
            self._go(perf_counter() + asked.settle)
            before, own = self._server_seconds(), time.process_time()
            self._passes.clear()
            begin = perf_counter()
            print("measuring", file=sys.stderr, flush=True)
            self._go(begin + asked.seconds)
            window = Window(begin, perf_counter())
            own = time.process_time() - own
            servers = self._servers(before, window.seconds)
            self._enough = False
            passes = spread(np.array(self._passes))
            self._go(perf_counter() + asked.drain)
            self._end_all()
        finally:
            for stream in self.streams:
                stream.connection.close()
            self._poll.close()
        if asked.arrivals is not None:
            self._keep(asked.arrivals, window)
        mine = {"processor": round(own / window.seconds, 4), "pass_ms": passes}
        return report(self.streams, window, mine, servers)

    def _open_all(self) -> None:
        """Open the streams, `OPENING` at a time, while the opened ones run."""
        give_up = perf_counter() + OPEN_SECONDS
        while len(self.streams) < self.asked.streams:
            opening = sum(one.ready is None and not one.closed for one in self.streams)
            for _ in range(min(OPENING - opening, self.asked.streams - len(self.streams))):
                self._open(len(self.streams))
                give_up = perf_counter() + OPEN_SECONDS
            if not self._pass() and perf_counter() > give_up:
                break
        self._until(lambda: all(one.ready is not None or one.closed for one in self.streams), OPEN_SECONDS)
        self._hands_from, self._touched = perf_counter(), 0

    def _open(self, index: int) -> None:
        asked, address = self.asked, urlsplit(self.asked.url)
        connection = socket.create_connection((address.hostname, address.port or 80), OPEN_SECONDS)
        connection.setblocking(False)
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        hello = {
            "scene": scene(index % asked.scenes, asked.sample_rate),
            "format": "f32le",
            "block": asked.block,
            "pacing": "realtime",
        }
        stream = Stream(index, connection, hello, address.netloc, asked.key)
        self.streams.append(stream)
        self._by_descriptor[connection.fileno()] = stream
        self._poll.register(connection.fileno(), select.EPOLLIN)
        stream.flush()

    def _go(self, until: float) -> None:
        while perf_counter() < until and not self._enough:
            self._pass(hands=True)

    def _until(self, happened: Any, seconds: float) -> None:
        give_up = perf_counter() + seconds
        while not happened() and perf_counter() < give_up:
            self._pass()

    def _pass(self, hands: bool = False) -> bool:
        """Read the received data, send what is due, sleep a tick; return whether anything was received."""
        began = perf_counter()
        events = self._poll.poll(0)
        for descriptor, _ in events:
            stream = self._by_descriptor[descriptor]
            stream.act(perf_counter())
            if stream.closed:
                self._poll.unregister(descriptor)
            elif stream.waiting:
                stream.flush()
        if hands and self.asked.updates_hz > 0:
            self._touch_due()
        self._passes.append(perf_counter() - began)
        time.sleep(self.asked.tick)
        return bool(events)

    def _touch_due(self) -> None:
        rate = self.asked.updates_hz
        due = int((perf_counter() - self._hands_from) * rate * len(self.streams))
        for number in range(self._touched, due):
            self.streams[number % len(self.streams)].touch(rate)
        self._touched = max(self._touched, due)

    def _end_all(self) -> None:
        for stream in self.streams:
            if not stream.closed:
                stream.stop()
        self._until(lambda: all(one.closed for one in self.streams), END_SECONDS)
        for stream in self.streams:
            if not stream.closed:
                stream.mistakes.append("did not end after `stop`")

    def _server_seconds(self) -> dict[int, float]:
        pids = [member for pid in self.asked.pids for member in family(pid)]
        return {pid: processor_seconds(pid) for pid in pids}

    def _servers(self, before: dict[int, float], seconds: float) -> dict[str, Any]:
        """Return the processor time share and the memory of each server process, and the sum of the shares."""
        after = self._server_seconds()
        shares = {str(pid): round((took - before.get(pid, 0.0)) / seconds, 4) for pid, took in after.items()}
        memory = {str(pid): resident_bytes(pid) for pid in after}
        return {"processor": round(sum(shares.values()), 4), "each": shares, "resident_bytes": memory}

    def _keep(self, path: str, window: Window) -> None:
        """Write the arrival time of each block of each stream, for the analysis of other windows of the same run."""
        kept = {f"stream{index}": np.array(one.arrivals) for index, one in enumerate(self.streams)}
        np.savez(path, window=np.array([window.begin, window.end]), **kept)  # type: ignore[arg-type]


def parser() -> argparse.ArgumentParser:
    """Return the command's arguments."""
    made = argparse.ArgumentParser(
        prog="python -m tests.bench.live_load",
        description="Move hands on many live streams of a running service, and report the lateness of blocks as JSON.",
    )
    usual = Asked("")
    made.add_argument("url", help="where the service listens, as http://127.0.0.1:8000")
    made.add_argument("--streams", type=int, default=usual.streams, help="connections (default %(default)s)")
    made.add_argument("--seconds", type=float, default=usual.seconds, help="time measured (default %(default)s)")
    made.add_argument("--settle", type=float, default=usual.settle, help="seconds before it (default %(default)s)")
    made.add_argument("--drain", type=float, default=usual.drain,
                      help="seconds after it until a block counts as missing (default %(default)s)")  # fmt: skip
    made.add_argument("--updates", type=float, default=usual.updates_hz, dest="updates_hz", metavar="HZ",
                      help="contact updates per second of each stream, 0 for none (default %(default)s)")  # fmt: skip
    made.add_argument("--block", type=int, default=usual.block, help="frames of a block (default %(default)s)")
    made.add_argument("--rate", type=int, default=usual.sample_rate, dest="sample_rate", metavar="HZ",
                      help="of the samples (default %(default)s)")  # fmt: skip
    made.add_argument("--scenes", type=int, default=usual.scenes, help="different scenes (default %(default)s)")
    made.add_argument("--key", help="one of the service's keys")
    made.add_argument("--pid", type=int, action="append", default=[], dest="pids",
                      help="a server process, whose processor time is reported with that of its children")  # fmt: skip
    made.add_argument("--tick", type=float, default=usual.tick, help="seconds slept per pass (default %(default)s)")
    made.add_argument("--arrivals", metavar="FILE.npz", help="write the arrival time of every block to this file")
    return made


def main(words: Sequence[str] | None = None) -> int:
    """Run with the arguments `words`; return 0, or 1 where blocks are missing or a stream broke the protocol."""
    arguments = vars(parser().parse_args(words))
    asked = Asked(**arguments | {"pids": tuple(arguments["pids"])})
    limit = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (limit[1], limit[1]))
    load = Load(asked)
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, lambda *_: load.enough())
    found = load.run()
    print(json.dumps(found, indent=1))
    return 1 if found["missing"] or found["mistaken_streams"] else 0


if __name__ == "__main__":
    sys.exit(main())
