"""ridgewave's engine: a scene in, the vibration that the finger feels out. Numbers only: no network, no device.

    from synth import Scene, render, explain, open_voice, parse_scene, Motion

Names are loaded when they are first used, so that importing the package costs nothing.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from synth.accuracy import measure_accuracy
    from synth.cache import ResponseCache
    from synth.costing import explain
    from synth.live import LiveVoice
    from synth.motion import Motion
    from synth.plan import Plan
    from synth.scene import Scene, parse_scene
    from synth.voice import Voice, open_voice, render

_HOMES = {
    "LiveVoice": "synth.live",
    "Motion": "synth.motion",
    "Plan": "synth.plan",
    "ResponseCache": "synth.cache",
    "Scene": "synth.scene",
    "Voice": "synth.voice",
    "explain": "synth.costing",
    "measure_accuracy": "synth.accuracy",
    "open_voice": "synth.voice",
    "parse_scene": "synth.scene",
    "render": "synth.voice",
}

__all__ = [
    "LiveVoice",
    "Motion",
    "Plan",
    "ResponseCache",
    "Scene",
    "Voice",
    "explain",
    "measure_accuracy",
    "open_voice",
    "parse_scene",
    "render",
]


def __getattr__(name: str) -> Any:
    """Load a public name from its home."""
    if name not in _HOMES:
        raise AttributeError(f"module 'synth' has no attribute {name!r}")
    return getattr(import_module(_HOMES[name]), name)
