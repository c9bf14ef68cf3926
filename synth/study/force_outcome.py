"""Lines of the tangential force of a steady scene, as a voice renders it.

Stage   STUDY, used by `comparison`.
Model   The effect `tangential` of the scene, or its defaults, over whole periods; the lines are those of
        `simulated_outcome`.
Limits  The component along the scan. Friction without sticking.
"""

from __future__ import annotations

import numpy as np

from synth.arrays import Array
from synth.scene.merge import merge_patch
from synth.scene.scene import Scene, parse_scene, scene_document
from synth.study.simulated_outcome import fitted, whole_periods
from synth.voice.voice import open_voice

FORCE = "tangential_force"


def force_lines(scene: Scene, count: int) -> Array:
    """Return the amplitudes of `count` lines of the tangential force, N. Raises SceneError as a render does."""
    seconds, rate = whole_periods(scene), scene.output.sample_rate
    change = {"effects": {"tangential": {}}, "output": {"duration": seconds, "fade": 0.0}}
    voice = open_voice(parse_scene(merge_patch(scene_document(scene), change)))
    values = voice.render(max(2, round(seconds * rate))).astype(np.float64) * voice.full_scale
    force = values[:, voice.quantities.index(FORCE)]
    cycles = scene.scan.speed / scene.texture.period / rate
    highest = min(count, int(0.45 / abs(cycles)), len(values) // 4)
    lines = np.zeros(count)
    lines[:highest] = 2.0 * np.abs(fitted(force - np.mean(force), cycles, highest)[1:])
    return lines
