"""The numbers of a study that follow from the series of displacement: levels, lines, centroid and what is felt.

Stage   STUDY, used by `steady_outcome` and `simulated_outcome`.
Model   The k-th time derivative has the lines (2 pi n f)^k times those of displacement, f the fundamental.
Limits  At rest only displacement moves, and nothing is felt.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from synth.arrays import Array
from synth.perception.threshold import FAINTEST_DB, threshold_displacement
from synth.response.demand import Complex, curves, points_for
from synth.scene.scene import Scene
from synth.study.variables import QUANTITIES, VARIABLES, shape_of

Numbers = dict[str, Any]
ORDERS = tuple(range(len(QUANTITIES)))


def nothing(lines: int) -> Numbers:
    """Return every variable as NaN."""
    return {one.name: np.full(shape_of(one, lines), math.nan)[()] for one in VARIABLES}


def of_series(series: Complex, scene: Scene, lines: int) -> Numbers:
    """Return what follows from the series of displacement (m) in the band: levels, lines, centroid, what is felt."""
    count, turns = len(series) - 1, abs(scene.scan.speed) / scene.texture.period
    n, points = np.arange(1, count + 1), 2 * points_for(count)
    sizes = 2.0 * np.abs(series[1:])
    amplitudes = sizes * (2.0 * math.pi * turns * n) ** np.array(ORDERS)[:, np.newaxis]
    power = np.sum(amplitudes**2, axis=1)
    rms = np.sqrt(0.5 * power)
    peak = np.array([float(np.max(np.abs(curves(series, order, points)))) * turns**order for order in ORDERS])
    line_amplitude, line_phase = np.zeros(lines), np.full(lines, math.nan)
    seen = min(lines, count)
    line_amplitude[:seen], line_phase[:seen] = sizes[:seen], np.angle(series[1 : seen + 1])
    line_phase[line_amplitude == 0.0] = math.nan
    found: Numbers = {"rms": rms, "peak": peak, "line_amplitude": line_amplitude, "line_phase": line_phase}
    found["crest_factor"] = ratio(peak, rms)
    found["spectral_centroid"] = ratio(turns * (amplitudes**2 @ n), power)
    found["error"] = np.zeros(len(ORDERS))
    if turns > 0.0 and np.any(sizes):
        strongest = np.max(sizes / threshold_displacement(turns * n, scene.accuracy.threshold))
        level = 20.0 * math.log10(float(strongest))
        found["sensation_level"] = level if level >= FAINTEST_DB else math.nan
    return found


def ratio(above: Array, below: Array) -> Array:
    """Return the quotient of each order, NaN where there is none."""
    return np.asarray(np.divide(above, below, out=np.full(len(ORDERS), math.nan), where=below > 0.0))
