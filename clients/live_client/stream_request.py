"""What a program asks of a live stream, checked before anything is sent."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

from clients.pcm_buffer import whole_frames
from clients.scene_and_key import json_text
from synth.errors import Fault, InvalidRequest, shown

Reconnect = Literal["new"] | bool


@dataclass(frozen=True, slots=True)
class StreamRequest:
    """The request of a `hello` message, and `ahead`: the frames of credit kept beyond those that are read."""

    scene: Mapping[str, Any]
    sample_format: str = "f32le"
    pacing: str = "pull"
    block: int | None = None
    record: bool = False
    ahead: int = 0

    def __post_init__(self) -> None:
        require_one_of("format", self.sample_format, ("f32le", "s16le"))
        require_one_of("pacing", self.pacing, ("pull", "realtime"))
        object.__setattr__(self, "ahead", whole_frames("ahead", self.ahead))  # an int, which JSON can hold
        if self.block is not None:
            object.__setattr__(self, "block", whole_frames("block", self.block))
        json_text(self.scene)


def require_one_of(name: str, value: object, allowed: tuple[str | bool, ...]) -> None:
    """Raise InvalidRequest if the argument `name` has a value that is not allowed."""
    if value not in allowed:
        raise InvalidRequest([Fault("/" + name, shown(value), " or ".join(map(str, allowed)), f"Write {allowed[0]}.")])
