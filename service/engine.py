"""What the service needs of the engine: one small interface, and its implementation over `synth`.

The interface is there so that tests of the protocol can put a plain, exactly known waveform in place of the physics.
Everything here is called from threads: building a voice solves a contact response and takes milliseconds to seconds.
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
    from synth.response.table import ResponseTable


class Sounding(Protocol):
    """What a voice and a session say about their sound."""

    @property
    def sample_rate(self) -> int:
        """Return frames a second."""

    @property
    def channels(self) -> int:
        """Return samples a frame."""

    @property
    def full_scale(self) -> tuple[float, ...]:
        """Return the SI value of a sample of 1.0, one a channel."""

    @property
    def quantities(self) -> tuple[str, ...]:
        """Return the quantity of each channel."""


class Voice(Sounding, Protocol):
    """A running plan: renders block after block from frame 0 on."""

    def render(self, frames: int) -> Block:
        """Return the next `frames` as float32 [frames, channels]."""


class FiniteVoice(Voice, Protocol):
    """A voice for a finite render: not limited to full scale."""

    @property
    def frame(self) -> int:
        """Return the frame that the next block begins at."""

    @property
    def warnings(self) -> tuple[str, ...]:
        """Return what the listener should know, a sentence each."""


class LiveVoice(Voice, Protocol):
    """A voice that ramps in and across changes, and passes the safety limiter last."""

    @property
    def reduction_db(self) -> float:
        """Return the largest gain reduction of the limiter in the last block, in dB."""

    def prepare(self, scene: Scene) -> Any:
        """Return the change to `scene`, solved; slow."""

    def apply(self, change: Any) -> None:
        """Cross-fade to what `prepare` returned, from the next block on; instant."""


class HandVoice(LiveVoice, Protocol):
    """A live voice that a hand leads; `render` takes microseconds usually, what is not `prepare` is instant."""

    @property
    def frame(self) -> int:
        """Return the frame that the next block begins at."""

    @property
    def finished(self) -> bool:
        """Return whether it was released and has faded out."""

    @property
    def motion_delay(self) -> float:
        """Return by how many seconds the sound is behind the updates."""

    @property
    def lowest_load(self) -> float:
        """Return the smallest load of an update, in newtons: 0 but for adhesion."""

    @property
    def plan_document(self) -> dict[str, Any]:
        """Return the JSON document of `/v1/explain` of the scene that sounds or is coming, without scene and cost."""

    def touch(self, update: Update) -> None:
        """Take `update` over from the next block's first frame on."""

    def lift(self) -> None:
        """Let the load ramp to zero from the next block on; the next `touch` picks it up again."""

    def release(self) -> None:
        """Fade out (10 ms) from the next block on; then `finished`. Again is the same as once."""

    def cut(self, block: Block, frames: int) -> Block:
        """Return the first `frames` of the block that was rendered last, fading to zero: the sound ends with them."""

    @property
    def recorded_bytes(self) -> int:
        """Return the memory that its recording takes; 0 where it was not opened with `record`."""

    def end_recording(self) -> None:
        """Have its recording end here, if there is one: it holds the beginning, and says so."""

    def recording(self) -> dict[str, Any]:
        """Return what `synth` renders the same samples from; of a voice opened with `record`, from any thread."""


class Limiter(Protocol):
    """The safety limiter, for integer output of finite renders."""

    def limited(self, blocks: Iterable[Block]) -> Iterator[Block]:
        """Yield the whole sound limited to full scale, in blocks of any lengths but 0."""

    def take_reduction(self) -> float:
        """Return the largest gain reduction, in dB, since this was last asked."""


@dataclass(frozen=True)
class TableFile:
    """The file of a response table. told: the JSON document of `POST /v1/tables`, but for hash, url and bytes."""

    hash: str
    content: bytes
    told: dict[str, Any]

    @property
    def memory_bytes(self) -> int:
        """Bytes that it holds, for a cache."""
        return len(self.content)


class CacheCounts(Protocol):
    """What a cache of solved scenes has done so far."""

    @property
    def hits(self) -> int:
        """Return how often it had what was wanted."""

    @property
    def misses(self) -> int:
        """Return how often it had not."""

    @property
    def used_bytes(self) -> int:
        """Return the bytes that it holds."""


class Engine(Protocol):
    """Scenes in, voices out."""

    def cache_counts(self) -> CacheCounts:
        """Return what the cache has done so far."""

    def open_voice(self, scene: Scene) -> FiniteVoice:
        """Return a voice at frame 0 for a finite render."""

    def blocks(self, voice: FiniteVoice, frames: int) -> Iterator[Block]:
        """Yield the whole duration of the voice's scene, `frames` at a time, with the fades that it asks for."""

    def planned_seconds(self, voice: FiniteVoice) -> float | None:
        """Return the processor time (s) of the voice's whole sound where its plan predicts it, else None."""

    def open_live(self, scene: Scene) -> LiveVoice:
        """Return a live voice at frame 0, silent and about to ramp in."""

    def open_hand(self, scene: Scene, *, record: bool = False) -> HandVoice:
        """Return a live voice at frame 0 that takes updates of a hand; record: it can give a recording."""

    def load_reading(self) -> None:
        """Load what reads tables and limits, which compiles it at a first start."""

    def load_following(self) -> None:
        """Load what follows a hand, which compiles it at a first start."""

    @property
    def live_delay(self) -> float:
        """Return by how many seconds a live voice sounds behind its changes."""

    def explain(self, scene: Scene) -> dict[str, Any]:
        """Return the plan as the JSON document of `/v1/explain`."""

    def picture(self, scene: Scene, points: int | None, phases: int | None) -> dict[str, Any]:
        """Return the JSON document of `/v1/picture`; None: as many points and phases as it likes."""

    def accuracy(self, scene: Scene, quantity: str | None, given_up: threading.Event) -> dict[str, Any]:
        """Return the JSON document of `/v1/accuracy`; takes up to a minute.

        quantity: of one of the scene's channels, None for the first. given_up: set where nobody waits any more; then it
        raises CannotRender soon.
        """

    def make_table(self, scene: Scene) -> TableFile:
        """Return the table of `scene`, and keep it for `find_table`."""

    def find_table(self, name: str) -> TableFile | None:
        """Return the table whose hash is `name`, None where it is not kept; instant."""

    def limiter(self, channels: int, sample_rate: int) -> Limiter:
        """Return a limiter in its first state."""


class SynthEngine:
    """The engine: `synth`, with one cache of contact responses for all of a process."""

    def __init__(self, cache_bytes: int) -> None:
        """cache_bytes: the bound of memory, see `ResponseCache`."""
        from synth.response.response_cache import ResponseCache

        self._cache = ResponseCache(cache_bytes)

    def cache_counts(self) -> CacheCounts:
        """See `Engine`."""
        return self._cache

    def open_voice(self, scene: Scene) -> FiniteVoice:
        """See `Engine`."""
        from synth import open_voice

        return open_voice(scene, cache=self._cache)

    def blocks(self, voice: FiniteVoice, frames: int) -> Iterator[Block]:
        """See `Engine`."""
        from synth.voice.voice import Voice, blocks

        assert isinstance(voice, Voice), "a voice of this engine"
        return blocks(voice, frames)

    def planned_seconds(self, voice: FiniteVoice) -> float | None:
        """See `Engine`."""
        from synth.voice.voice import Voice

        assert isinstance(voice, Voice), "a voice of this engine"
        frames, effects = voice.solved.frames, voice.solved.effects
        if frames is not None and voice.frames_together:
            return frames.work * voice.scene.output.duration
        if effects is not None and effects.simulation is not None:
            return effects.simulation.work * voice.scene.output.duration
        return None

    def open_live(self, scene: Scene) -> LiveVoice:
        """See `Engine`."""
        from synth.voice.live_voice import LiveVoice

        return LiveVoice(scene, cache=self._cache)

    def open_hand(self, scene: Scene, *, record: bool = False) -> HandVoice:
        """See `Engine`."""
        from synth.voice.hand_voice import HandVoice

        return HandVoice(scene, cache=self._cache, record=record)

    def load_reading(self) -> None:
        """See `Engine`."""
        import synth.voice.limiter
        import synth.voice.table_reading  # noqa: F401

    def load_following(self) -> None:
        """See `Engine`."""
        import synth.motion.update_smoothing  # noqa: F401

    @property
    def live_delay(self) -> float:
        """See `Engine`."""
        from synth.voice.limiter import LOOK_AHEAD

        return LOOK_AHEAD

    def explain(self, scene: Scene) -> dict[str, Any]:
        """See `Engine`."""
        from synth import explain

        return explain(scene, cache=self._cache).document()

    def picture(self, scene: Scene, points: int | None, phases: int | None) -> dict[str, Any]:
        """See `Engine`."""
        from synth.plan.contact_picture import picture

        return picture(scene, points, phases, cache=self._cache)

    def accuracy(self, scene: Scene, quantity: str | None, given_up: threading.Event) -> dict[str, Any]:
        """See `Engine`."""
        from service.compute.accuracy_process import measure_apart
        from synth.accuracy.report import require_measurable

        require_measurable(scene)  # what is refused is refused at once, not by a process of the lowest priority
        return measure_apart(scene, quantity, given_up)

    def make_table(self, scene: Scene) -> TableFile:
        """See `Engine`."""
        from synth.plan.scene_table import table_of_scene

        table = table_of_scene(scene, cache=self._cache)
        return self._cache.get(("table file", table.hash), lambda: file_of_table(table))

    def find_table(self, name: str) -> TableFile | None:
        """See `Engine`."""
        found = self._cache.find(("table file", name))
        assert found is None or isinstance(found, TableFile)
        return found

    def limiter(self, channels: int, sample_rate: int) -> Limiter:
        """See `Engine`."""
        from synth.voice.limiter import Limiter, look_ahead

        return Limiter(channels, sample_rate, look_ahead(sample_rate))


def file_of_table(table: ResponseTable) -> TableFile:
    """Return the file of `table`, and what the service tells of it."""
    from synth.response.table_error import QUANTITIES
    from synth.response.table_file import table_bytes

    told = {
        "covered_loads": list(table.covered),
        "loads": len(table.loads),
        "levels": len(table.levels.highest),
        "harmonics": table.harmonics,
        "error": {name: table.error.largest_told(name) for name in QUANTITIES},
    }
    return TableFile(table.hash, table_bytes(table), told)
