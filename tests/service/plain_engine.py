"""An engine whose sound is known exactly: a sine whose pitch is that of the scene, in place of the contact model.

The protocol's own promises (pacing, fades, sizes, ends) are tested with it; what is heard is tested with `synth`.
Processes start with it, so what only few tests need is imported where it is needed.
"""

from __future__ import annotations

import threading
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from service.engine import FiniteVoice, TableFile
from service.synth_engine import file_of_table
from synth.encode.formats import Block
from synth.errors import CannotRender
from synth.held_memory import Held
from synth.scene.scene import Scene, scene_document

if TYPE_CHECKING:
    from tests.service.plain_hand import PlainHand

LEVEL = 0.8
FULL_SCALE = 12.5
RAMP_SECONDS = 0.01
TABLE = Path(__file__).parent.parent / "conformance" / "table.safetensors"


def pitch(scene: Scene) -> float:
    """Return the frequency of the texture under the finger, in hertz."""
    return abs(scene.scan.speed) / scene.texture.period


def sine(scene: Scene, first: int, frames: int) -> Block:
    """Return `frames` from frame `first` on, float32 [frames, channels], every channel the same."""
    turns = pitch(scene) / scene.output.sample_rate * np.arange(first, first + frames)
    wave = (LEVEL * np.sin(2 * np.pi * turns)).astype(np.float32)
    return np.repeat(wave[:, np.newaxis], len(scene.output.channel_list), axis=1)


class PlainVoice:
    """A finite voice."""

    warnings: tuple[str, ...] = ()

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self.sample_rate = scene.output.sample_rate
        self.channels = len(scene.output.channel_list)
        self.full_scale = tuple(channel.full_scale or FULL_SCALE for channel in scene.output.channel_list)
        self.quantities = tuple(channel.quantity for channel in scene.output.channel_list)
        self.frame = 0

    def render(self, frames: int) -> Block:
        block = sine(self.scene, self.frame, frames)
        self.frame += frames
        return block


class PlainLive(PlainVoice):
    """A live voice: ramps in; a change is a cross-fade over one ramp."""

    reduction_db = 0.0

    def __init__(self, scene: Scene) -> None:
        super().__init__(scene)
        self._ramp = round(RAMP_SECONDS * self.sample_rate)
        self._from: Scene | None = None
        self._since = 0

    def held(self, change: Scene | None = None) -> Held:
        return Held()

    def prepare(self, scene: Scene) -> Scene:
        return scene

    def apply(self, change: Scene) -> None:
        self._from, self.scene, self._since = self.scene, change, self.frame

    def render(self, frames: int) -> Block:
        start = self.frame
        weight = np.clip((np.arange(start, start + frames) - self._since) / self._ramp, 0, 1)[:, np.newaxis]
        before = 0.0 if self._from is None else sine(self._from, start, frames)
        block = weight * super().render(frames) + (1 - weight) * before
        return np.asarray(block, dtype=np.float32)


@dataclass(frozen=True)
class NoCache:
    """What a cache that is not there has done."""

    hits: int = 0
    misses: int = 0


class NoLimiter:
    """The plain sine never needs limiting."""

    def limited(self, blocks: Iterable[Block]) -> Iterator[Block]:
        return iter(blocks)

    def take_reduction(self) -> float:
        return 0.0


@dataclass
class PlainEngine:
    """Counts what it opens; can be told to fail, to wait before a voice is ready, or to measure for ever (slow)."""

    refuse: str | None = None
    mistake: bool = False
    slow: bool = False
    gate: threading.Event | None = None
    planned: float | None = None
    opened: list[str] = field(default_factory=list)
    hands: list[PlainHand] = field(default_factory=list)
    tables: dict[str, TableFile] = field(default_factory=dict)
    live_delay = 0.0

    def cache_counts(self) -> NoCache:
        return NoCache()

    def cached_bytes(self) -> int:
        return 0

    def open_voice(self, scene: Scene) -> PlainVoice:
        self._about_to("voice")
        return PlainVoice(scene)

    def blocks(self, voice: FiniteVoice, frames: int) -> Iterator[Block]:
        assert isinstance(voice, PlainVoice)
        while voice.frame < round(voice.scene.output.duration * voice.sample_rate):
            yield voice.render(min(frames, round(voice.scene.output.duration * voice.sample_rate) - voice.frame))

    def planned_seconds(self, voice: FiniteVoice) -> float | None:
        return self.planned

    def open_live(self, scene: Scene) -> PlainLive:
        self._about_to("live")
        return PlainLive(scene)

    def open_hand(self, scene: Scene, *, record: bool = False) -> PlainHand:
        from tests.service.plain_hand import PlainHand

        self._about_to("hand")
        hand = PlainHand(scene, record=record)
        self.hands.append(hand)
        return hand

    def load_reading(self) -> None:
        pass

    def load_following(self) -> None:
        pass

    def explain(self, scene: Scene) -> dict[str, Any]:
        self._about_to("explain")
        nothing: dict[str, Any] = {"response": {}, "estimated_error": {}, "cost": None, "warnings": []}
        return {"scene": scene_document(scene), "simulated": [], "left_out": []} | nothing

    def analyze(self, scene: Scene) -> dict[str, Any]:
        self._about_to("analyze")
        return {
            "whole_finger_level": None,
            "receptors": [],
            "pacinian_power": 0.0,
            "intensity": 0.0,
            "felt_by": "nothing",
        }

    def analyze_recording(
        self, content: bytes, *, quantity: str | None = None, scale: float | None = None, channel: int | None = None
    ) -> dict[str, Any]:
        return self.analyze(Scene())

    def picture(self, scene: Scene, points: int | None, phases: int | None) -> dict[str, Any]:
        self._about_to("picture")
        return {
            "texture": {"period": scene.texture.period, "heights": [0.0] * (points or 16)},
            "finger": {"begin": 0.0, "length": scene.finger.contact_length, "heights": [0.0] * (points or 16)},
            "response": {"load": scene.scan.load, "foundation": None, "heights": [0.0] * (phases or 0)},
            "touching": [[]] * (phases or 0),
            "left_out": [],
        }

    def accuracy(
        self, scene: Scene, quantity: str | None, given_up: threading.Event, *, live: bool = False
    ) -> dict[str, Any]:
        self._about_to("accuracy")
        if self.slow:
            assert given_up.wait(30.0), "nobody gave it up"
            self.opened.append("given up")
            raise CannotRender("The measurement was given up.")
        from tests.accuracy_case import report

        return report(scene, quantity or scene.output.channel_list[0].quantity).document()

    def make_table(self, scene: Scene) -> TableFile:
        self._about_to("table")
        from synth.response.table_file import read_table

        made = file_of_table(read_table(TABLE))
        return self.tables.setdefault(made.hash, made)

    def find_table(self, name: str) -> TableFile | None:
        return self.tables.get(name)

    def limiter(self, channels: int, sample_rate: int) -> NoLimiter:
        return NoLimiter()

    def _about_to(self, what: str) -> None:
        self.opened.append(what)
        if self.gate is not None:
            assert self.gate.wait(30.0), "the test never opened the gate"
        if self.refuse is not None:
            raise CannotRender(self.refuse)
        if self.mistake:
            raise RuntimeError("a secret that no peer may learn")
