"""The engine of the service: `synth`, with a cache of contact responses. Implements `service.engine.Engine`.

Each method imports what it needs of `synth`, so that a process loads no more than it uses.
"""

from __future__ import annotations

import json
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from service.engine import CacheCounts, FiniteVoice, HandVoice, Limiter, LiveVoice, TableFile
from service.store.data_folder import tables_folder
from synth.encode.formats import Block
from synth.scene.scene import Scene

if TYPE_CHECKING:
    from synth.response.table import ResponseTable


class SynthEngine:
    """`synth`, with a cache of contact responses. Half of its memory is for surfaces and solvers (`PARTS`)."""

    def __init__(self, cache_bytes: int, textures: Path | None = None) -> None:
        """Make the cache.

        cache_bytes: the bound on the memory of both. Surfaces and solvers may take LEAST_PARTS in any case.
        textures: the data folder. It has the imported textures, for the processes of measurements, and the tables
            that outlive the process. None: there is none.
        """
        self._textures = textures
        from synth.kept_files import KeptFiles
        from synth.response_cache import LEAST_PARTS, PARTS, ResponseCache

        PARTS.resize(max(LEAST_PARTS, cache_bytes // 2))
        files = KeptFiles(tables_folder(textures)) if textures else None
        self._cache = ResponseCache(cache_bytes - cache_bytes // 2, files)

    def cache_counts(self) -> CacheCounts:
        """See `Engine`."""
        return self._cache

    def cached_bytes(self) -> int:
        """See `Engine`."""
        from synth.response_cache import PARTS, bytes_of

        return bytes_of(self._cache, PARTS)

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
        import synth.contact.fingertip_solver
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

    def analyze(self, scene: Scene) -> dict[str, Any]:
        """See `Engine`."""
        from synth.study.skin_outcome import skin_felt

        return skin_felt(scene)

    def analyze_recording(
        self, content: bytes, *, quantity: str | None = None, scale: float | None = None, channel: int | None = None
    ) -> dict[str, Any]:
        """See `Engine`."""
        from synth.study.recordings import recording_in
        from synth.study.sound_outcome import sound_felt

        return sound_felt(recording_in(content, channel=channel, scale=scale), quantity)

    def picture(self, scene: Scene, points: int | None, phases: int | None) -> dict[str, Any]:
        """See `Engine`."""
        from synth.plan.contact_picture import picture

        return picture(scene, points, phases, cache=self._cache)

    def accuracy(
        self, scene: Scene, quantity: str | None, given_up: threading.Event, *, live: bool = False
    ) -> dict[str, Any]:
        """See `Engine`."""
        from service.compute.accuracy_process import measure_apart
        from synth.accuracy.report import require_measurable

        require_measurable(scene)  # refuse at once, without a process
        return measure_apart(scene, quantity, given_up, self._textures, live=live)

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
    """Return the file of `table` and its description."""
    from synth.response.table_error import QUANTITIES
    from synth.response.table_file import table_bytes

    document = {
        "covered_loads": list(table.covered),
        "loads": len(table.loads),
        "levels": len(table.levels.highest),
        "harmonics": table.harmonics,
        "error": {name: table.error.largest_reported(name) for name in QUANTITIES},
    }
    surface = json.loads(table.scene).get("texture", {}).get("surface")
    return TableFile(table.hash, table_bytes(table), document, surface)
