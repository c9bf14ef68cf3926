"""The numbers that a study records of a steady scene whose effects are simulated step by step.

Stage   STUDY.
Model   A voice renders whole periods. Lines are the least squares fit of sines and cosines at multiples of the
        fundamental; levels are those of the samples.
Limits  What is no multiple of the fundamental is in the levels, not in the lines. A finger at rest is not fitted.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from synth.plan.request import harmonics_in_band
from synth.scene.merge import merge_patch
from synth.scene.scene import Scene, parse_scene, scene_document
from synth.study.series_outcome import of_series
from synth.study.variables import QUANTITIES
from synth.voice.voice import open_voice

LEAST, LONGEST = 0.1, 20.0  # s, of whole periods; a longer period is rendered in part
MOST_FITTED = 512  # lines that are fitted


def simulated(scene: Scene, lines: int) -> dict[str, Any]:
    """Return what a render of `scene` shows; the other variables stay unknown."""
    turns, rate = abs(scene.scan.speed) / scene.texture.period, scene.output.sample_rate
    period = 1.0 / turns if turns > 0.0 else LEAST
    seconds = min(period * max(1.0, math.ceil(LEAST / period)), LONGEST)
    output = {"channels": [{"quantity": one} for one in QUANTITIES], "duration": seconds, "fade": 0.0}
    voice = open_voice(parse_scene(merge_patch(scene_document(scene), {"output": output})))
    values = voice.render(max(2, round(seconds * rate))).astype(np.float64) * voice.full_scale
    values[:, 0] -= np.mean(values[:, 0])
    count = min(harmonics_in_band(scene, MOST_FITTED), len(values) // 4) if turns > 0.0 else 0
    series = np.zeros(count + 1, complex)
    if count:
        angles = 2.0 * math.pi * scene.scan.speed / scene.texture.period / rate * np.arange(len(values))
        waves = np.outer(angles, np.arange(1, count + 1))
        fitted = np.linalg.lstsq(np.hstack([np.cos(waves), np.sin(waves)]), values[:, 0], rcond=None)[0]
        series[1:] = 0.5 * (fitted[:count] - 1j * fitted[count:])
    found = of_series(series if count else np.zeros(2, complex), scene, lines)
    found["rms"], found["peak"] = np.sqrt(np.mean(values**2, axis=0)), np.max(np.abs(values), axis=0)
    with np.errstate(invalid="ignore"):
        found["crest_factor"] = found["peak"] / found["rms"]
    told = voice.plan.estimated_error
    found["error"] = np.array([told.get(one, math.nan) for one in QUANTITIES])
    return found
