"""A `LiveProtocol` for tests, opened without a connection, with a clock that the test sets."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

from clients.live_client.live_protocol import LiveProtocol
from clients.live_client.reconnection import Backoff, Closure
from clients.live_client.stream_request import Reconnect, StreamRequest
from tests.clients.live_client import fake_live
from tests.clients.live_client.fake_live import RATE, Message

BROKEN = Closure(None, "reset")


class Clock:
    """Seconds that a test sets."""

    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:
        return self.now


def protocol_of(clock: Callable[[], float] | None = None, reconnect: Reconnect = True, **request: Any) -> LiveProtocol:
    return LiveProtocol(StreamRequest({}, **request), clock or Clock(), reconnect, Backoff(0.0, 0.0))


def ready(**changes: Any) -> str:
    document = {
        "type": "ready", "session": "s1", "sample_rate": RATE, "channels": 1, "quantities": ["velocity"],
        "full_scale": [2.5], "block": 80, "frame": 0, "plan": {"simulated": []}, "max_silence_ms": 250.0,
        "motion_delay_ms": 8.0, "format": "f32le", "pacing": "pull", "recording": False, "protocol": "ridgewave.v2",
        "over_area": False,
    }  # fmt: skip
    return json.dumps({**document, **changes})


def opened(clock: Callable[[], float] | None = None, reconnect: Reconnect = True, **request: Any) -> LiveProtocol:
    protocol = protocol_of(clock, reconnect, **request)
    protocol.hello()
    protocol.receive(ready())
    assert protocol.over is None
    return protocol


def sent(protocol: LiveProtocol) -> list[Message]:
    messages = []
    while (message := protocol.next_message()) is not None:
        messages.append(message)
    return messages


def told(kind: str, status: int) -> str:
    return fake_live.problem(kind, status, f"{kind} it is")
