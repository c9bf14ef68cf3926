"""A core of the live protocol as its tests want it: opened by hand, with a clock that a test sets."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

from clients.live_client.live_protocol import LiveCore, Reconnect, Wish
from clients.live_client.reconnection import Backoff, Closure
from tests.clients.live_client import fake_live
from tests.clients.live_client.fake_live import RATE, Message

BROKEN = Closure(None, "reset")


class Clock:
    """Seconds that a test sets."""

    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:
        return self.now


def core_of(clock: Callable[[], float] | None = None, reconnect: Reconnect = True, **wish: Any) -> LiveCore:
    return LiveCore(Wish({}, **wish), clock or Clock(), reconnect, Backoff(0.0, 0.0))


def ready(**changes: Any) -> str:
    document = {
        "type": "ready", "session": "s1", "sample_rate": RATE, "channels": 1, "quantities": ["velocity"],
        "full_scale": [2.5], "block": 80, "frame": 0, "plan": {"simulated": []}, "max_silence_ms": 250.0,
        "motion_delay_ms": 8.0, "format": "f32le", "pacing": "pull", "recording": False, "protocol": "ridgewave.v1",
    }  # fmt: skip
    return json.dumps({**document, **changes})


def opened(clock: Callable[[], float] | None = None, reconnect: Reconnect = True, **wish: Any) -> LiveCore:
    core = core_of(clock, reconnect, **wish)
    core.hello()
    core.receive(ready())
    assert core.over is None
    return core


def sent(core: LiveCore) -> list[Message]:
    messages = []
    while (message := core.next_message()) is not None:
        messages.append(message)
    return messages


def told(kind: str, status: int) -> str:
    return fake_live.problem(kind, status, f"{kind} it is")
