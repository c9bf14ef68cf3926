"""What the service needs of the engine: the interfaces of the engine, of its voices and of their parts.

`synth_engine` implements them over `synth`. Tests of the protocol put a plain, exactly known waveform in place of the
physics. The methods are called from threads: opening a voice solves a contact response, which takes milliseconds to
seconds.
"""

from __future__ import annotations

import threading
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

from synth.encode.formats import Block
from synth.motion.motion import Update
from synth.scene.scene import Scene

if TYPE_CHECKING:
    from synth.held_memory import Held


class Sounding(Protocol):
    """The format of a voice or a session."""

    @property
    def sample_rate(self) -> int:
        """Return the frames per second."""

    @property
    def channels(self) -> int:
        """Return the samples per frame."""

    @property
    def full_scale(self) -> tuple[float, ...]:
        """Return the SI value of a sample of 1.0, for each channel."""

    @property
    def quantities(self) -> tuple[str, ...]:
        """Return the quantity of each channel."""


class Voice(Sounding, Protocol):
    """A running plan, rendered block after block from frame 0."""

    def render(self, frames: int) -> Block:
        """Return the next `frames` as float32 [frames, channels]."""


class FiniteVoice(Voice, Protocol):
    """A voice for a finite render. Its samples may exceed full scale."""

    @property
    def frame(self) -> int:
        """Return the first frame of the next block."""

    @property
    def warnings(self) -> tuple[str, ...]:
        """Return warnings for the listener, one sentence each."""


class LiveVoice(Voice, Protocol):
    """A voice that fades in, cross-fades at changes, and is limited to full scale."""

    @property
    def reduction_db(self) -> float:
        """Return the limiter's largest gain reduction in the last block, in dB."""

    def held(self, change: Any = None) -> Held:
        """Return the memory that the voice keeps alive, or that a `change` keeps. Takes up to some milliseconds."""

    def prepare(self, scene: Scene) -> Any:
        """Return the solved change to `scene`. Slow."""

    def apply(self, change: Any) -> None:
        """Cross-fade to what `prepare` returned, from the next block on. Instant."""


class HandVoice(LiveVoice, Protocol):
    """A live voice that follows a hand. `render` usually takes microseconds; the rest, except `prepare`, is instant."""

    @property
    def scene(self) -> Scene:
        """Return the scene, or the one that the sound cross-fades to."""

    @property
    def frame(self) -> int:
        """Return the first frame of the next block."""

    @property
    def finished(self) -> bool:
        """Return whether the voice was released and has faded out."""

    @property
    def motion_delay(self) -> float:
        """Return the delay of the sound behind the updates, in seconds."""

    @property
    def lowest_load(self) -> float:
        """Return the smallest permitted load, in newtons: 0 without adhesion."""

    @property
    def before_limiter(self) -> Block | None:
        """Return the last block before the limiter; None where the limiter did not act."""

    @property
    def over_area(self) -> bool:
        """Return whether updates can lead the finger over an area and turn it."""

    @property
    def plan_document(self) -> dict[str, Any]:
        """Return the JSON document of `/v1/explain` for the latest scene, without scene and cost."""

    def touch(self, update: Update) -> None:
        """Apply `update` from the first frame of the next block."""

    def lift(self) -> None:
        """Ramp the load to zero from the next block on, until the next `touch`."""

    def release(self) -> None:
        """Fade out within 10 ms from the next block on; then the voice is `finished`. Further calls do nothing."""

    def cut(self, block: Block, frames: int) -> Block:
        """Return the first `frames` of the last block, faded to zero, as the end of the sound."""

    @property
    def recorded_bytes(self) -> int:
        """Return the memory of the recording, in bytes; 0 without `record`."""

    def end_recording(self) -> None:
        """End the recording here, if there is one. It is marked as incomplete."""

    def recording(self) -> dict[str, Any]:
        """Return the recording, from which `synth` renders the same samples. Needs `record`; from any thread."""


class Limiter(Protocol):
    """The limiter, for finite renders in integer formats."""

    def limited(self, blocks: Iterable[Block]) -> Iterator[Block]:
        """Yield the whole sound, limited to full scale, in non-empty blocks."""

    def take_reduction(self) -> float:
        """Return the largest gain reduction since the last call, in dB."""


@dataclass(frozen=True)
class TableFile:
    """The file of a response table.

    document: the JSON document of `POST /v1/tables` without hash, url and bytes.
    surface: address of the imported surface in its scene, None if it has none.
    """

    hash: str
    content: bytes
    document: dict[str, Any]
    surface: str | None = None


class CacheCounts(Protocol):
    """Counts of a cache of solved scenes."""

    @property
    def hits(self) -> int:
        """Return the number of lookups that found their entry."""

    @property
    def misses(self) -> int:
        """Return the number of lookups that did not."""


class Engine(Protocol):
    """Scenes in, voices out."""

    def cache_counts(self) -> CacheCounts:
        """Return the counts of the cache."""

    def cached_bytes(self) -> int:
        """Return the memory of all that is cached: responses, tables, and the surfaces and solvers of scenes."""

    def open_voice(self, scene: Scene) -> FiniteVoice:
        """Return a voice at frame 0 for a finite render."""

    def blocks(self, voice: FiniteVoice, frames: int) -> Iterator[Block]:
        """Yield the whole sound of the voice's scene with its fades, `frames` at a time."""

    def planned_seconds(self, voice: FiniteVoice) -> float | None:
        """Return the processor seconds of the whole sound if the plan predicts them, else None."""

    def open_live(self, scene: Scene) -> LiveVoice:
        """Return a live voice at frame 0, which fades in."""

    def open_hand(self, scene: Scene, *, record: bool = False) -> HandVoice:
        """Return a live voice at frame 0 that follows a hand. record: it records the hand's motion."""

    def load_reading(self) -> None:
        """Load the kernels of fingertips, table reading and the limiter; a first start compiles them."""

    def load_following(self) -> None:
        """Load the kernels that follow a hand; a first start compiles them."""

    @property
    def live_delay(self) -> float:
        """Return the delay of a live voice behind its changes, in seconds."""

    def explain(self, scene: Scene) -> dict[str, Any]:
        """Return the plan as the JSON document of `/v1/explain`."""

    def analyze(self, scene: Scene) -> dict[str, Any]:
        """Return what is felt of a steady scene as the JSON document of `/v1/analyze`."""

    def analyze_recording(
        self, content: bytes, *, quantity: str | None = None, scale: float | None = None, channel: int | None = None
    ) -> dict[str, Any]:
        """Return what is felt of a vibration in the bytes of a WAV or FLAC file, as the document of `/v1/analyze`."""

    def picture(self, scene: Scene, points: int | None, phases: int | None) -> dict[str, Any]:
        """Return the JSON document of `/v1/picture`. None stands for the default number of points or phases."""

    def accuracy(
        self, scene: Scene, quantity: str | None, given_up: threading.Event, *, live: bool = False
    ) -> dict[str, Any]:
        """Return the JSON document of `/v1/accuracy`. Takes up to a minute.

        quantity: that of one of the scene's channels; None for the first channel.
        live: measure a live voice, behind a hand.
        given_up: when set, the call soon raises CannotRender.
        """

    def make_table(self, scene: Scene) -> TableFile:
        """Return the table of `scene`, and cache it for `find_table`."""

    def find_table(self, name: str) -> TableFile | None:
        """Return the table with the hash `name`, None if it is not cached. Instant."""

    def limiter(self, channels: int, sample_rate: int) -> Limiter:
        """Return a new limiter."""
