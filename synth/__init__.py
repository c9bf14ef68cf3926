"""The engine of ridgewave: it computes the vibration that a finger feels from a scene. It uses no network or device.

    import synth
    sound = synth.render({"texture": {"period": "0.8 mm"}})  # a Sound: values in SI units, save(), plot()
    voice = synth.open_voice("grating-1mm-31um")  # renders block by block
    plan = synth.explain("scene.json")  # what is simulated, why, at what cost and error

The import is fast, because each name is loaded when it is first used.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from synth.accuracy.costing import explain as explain
    from synth.accuracy.report import measure_accuracy as measure_accuracy
    from synth.encode.sound import Sound as Sound
    from synth.encode.sound import render as render
    from synth.motion.motion import Motion as Motion
    from synth.plan.plan import Plan as Plan
    from synth.response_cache import ResponseCache as ResponseCache
    from synth.scene.scene import Scene as Scene
    from synth.scene.scene import parse_scene as parse_scene
    from synth.voice.live_voice import LiveVoice as LiveVoice
    from synth.voice.voice import Voice as Voice
    from synth.voice.voice import open_voice as open_voice

_HOMES = {
    "LiveVoice": "synth.voice.live_voice",
    "Motion": "synth.motion.motion",
    "Plan": "synth.plan.plan",
    "ResponseCache": "synth.response_cache",
    "Scene": "synth.scene.scene",
    "Sound": "synth.encode.sound",
    "Voice": "synth.voice.voice",
    "explain": "synth.accuracy.costing",
    "measure_accuracy": "synth.accuracy.report",
    "open_voice": "synth.voice.voice",
    "parse_scene": "synth.scene.scene",
    "render": "synth.encode.sound",
}

__all__ = [*_HOMES]


def __getattr__(name: str) -> Any:
    """Load a public name from its module."""
    if name not in _HOMES:
        raise AttributeError(f"module 'synth' has no attribute {name!r}")
    return getattr(import_module(_HOMES[name]), name)


def __dir__() -> list[str]:
    """Return the public names, including those that are not loaded yet."""
    return sorted({*globals(), *__all__})
