"""Renders without effects, in a process that has the modules of effects and in one that has none."""

from __future__ import annotations

import hashlib
from typing import Any

from synth import Motion, explain, open_voice, parse_scene


def digest() -> str:
    """Return the hash of the samples of scenes without effects: constant, back and forth, heavy, and under a hand."""
    found, finger = hashlib.sha256(), {"contact_length": "2 mm"}
    scans: list[tuple[str, dict[str, Any]]] = [
        ("displacement", {}),
        ("acceleration", {"stroke": {}}),
        ("velocity", {"load": 20}),
    ]
    for quantity, scan in scans:
        output = {"sample_rate": 8000, "quantity": quantity}
        scene = parse_scene({"finger": finger, "output": output, "scan": scan})
        voice = open_voice(scene)
        explain(scene)
        found.update(voice.render(3000).tobytes())
        found.update(voice.render(500, Motion.of(500, speed=0.05, load=0.2)).tobytes())
    return found.hexdigest()
