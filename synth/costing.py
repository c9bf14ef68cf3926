"""What a plan costs on this machine: time to set up, time a frame, memory.

Stage   beside the voice: the plan of a scene with its cost, as `ridgewave explain` shows it.
Model   the scene is prepared and a voice renders blocks of it; the fastest of REPEATS blocks is the time a frame.
Limits  the cost is that of this machine at this moment; with a warm cache the set-up costs next to nothing.
"""

from __future__ import annotations

from dataclasses import replace
from time import perf_counter

from synth.cache import ResponseCache
from synth.plan import Cost, Plan
from synth.preparation import prepare
from synth.scene import Scene
from synth.voice import Voice

TIMED_FRAMES = 1 << 14
REPEATS = 5


def explain(scene: Scene, *, cache: ResponseCache | None = None) -> Plan:
    """Return the plan of `scene`, its response built and its cost measured on this machine."""
    started = perf_counter()
    solved = prepare(scene, cache)
    voice = Voice(solved)
    setup = perf_counter() - started
    voice.render(TIMED_FRAMES)
    fastest = float("inf")
    for _ in range(REPEATS):
        voice.seek(0)
        started = perf_counter()
        voice.render(TIMED_FRAMES)
        fastest = min(fastest, perf_counter() - started)
    per_frame = fastest / TIMED_FRAMES
    cost = Cost(
        setup_seconds=setup,
        ns_per_frame=1e9 * per_frame,
        times_real_time=1.0 / (per_frame * voice.sample_rate),
        memory_bytes=voice.memory_bytes,
    )
    return replace(voice.plan, cost=cost)
