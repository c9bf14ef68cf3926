"""What a voice renders of a steady scene: the numbers of a study where effects are simulated, and lines of the force.

Stage   STUDY.
Model   A voice renders whole periods. Lines are the least squares fit of sines and cosines at multiples of the
        fundamental; levels are those of the samples. The force is that of the effect `tangential` of the scene, or of
        its defaults, along the scan.
Limits  What is no multiple of the fundamental is in the levels, not in the lines. A finger at rest is not fitted.
        Friction without sticking.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from synth.arrays import Array
from synth.plan.request import harmonics_in_band
from synth.response.demand import Complex
from synth.scene.merge import merge_patch
from synth.scene.scene import Scene, parse_scene, scene_document
from synth.study.series_outcome import of_series
from synth.study.variables import QUANTITIES
from synth.voice.voice import open_voice

LEAST, LONGEST = 0.1, 20.0  # s, of whole periods; a longer period is rendered in part
MOST_FITTED = 512  # lines that are fitted
FORCE = "tangential_force"


def simulated(scene: Scene, lines: int) -> dict[str, Any]:
    """Return what a render of `scene` shows; the other variables stay unknown."""
    turns, rate, seconds = abs(scene.scan.speed) / scene.texture.period, scene.output.sample_rate, whole_periods(scene)
    output = {"channels": [{"quantity": one} for one in QUANTITIES], "duration": seconds, "fade": 0.0}
    voice = open_voice(parse_scene(merge_patch(scene_document(scene), {"output": output})))
    values = voice.render(max(2, round(seconds * rate))).astype(np.float64) * voice.full_scale
    values[:, 0] -= np.mean(values[:, 0])
    count = min(harmonics_in_band(scene, MOST_FITTED), len(values) // 4) if turns > 0.0 else 0
    series = (
        fitted(values[:, 0], scene.scan.speed / scene.texture.period / rate, count) if count else np.zeros(2, complex)
    )
    found = of_series(series, scene, lines)
    found["rms"], found["peak"] = np.sqrt(np.mean(values**2, axis=0)), np.max(np.abs(values), axis=0)
    with np.errstate(invalid="ignore"):
        found["crest_factor"] = found["peak"] / found["rms"]
    told = voice.plan.estimated_error
    found["error"] = np.array([told.get(one, math.nan) for one in QUANTITIES])
    return found


def whole_periods(scene: Scene) -> float:
    """Return the duration of whole periods, at least LEAST and at most LONGEST, s."""
    turns = abs(scene.scan.speed) / scene.texture.period
    period = 1.0 / turns if turns > 0.0 else LEAST
    return min(period * max(1.0, math.ceil(LEAST / period)), LONGEST)


def fitted(values: Array, cycles: float, count: int) -> Complex:
    """Return the series [count + 1] that fits `values` best.

    cycles: of the fundamental, per sample.
    """
    waves = np.outer(2.0 * math.pi * cycles * np.arange(len(values)), np.arange(1, count + 1))
    found = np.linalg.lstsq(np.hstack([np.cos(waves), np.sin(waves)]), values, rcond=None)[0]
    return np.concatenate([np.zeros(1), 0.5 * (found[:count] - 1j * found[count:])])


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
