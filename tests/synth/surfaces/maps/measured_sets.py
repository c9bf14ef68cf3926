"""Prints what sets of maps of known surfaces become: `python -m tests.synth.surfaces.maps.measured_sets`.

The first table has the errors of the eleven sets of `map_sets`, the second those of ten maps that are continued below
their pixel. A minute.
"""

from __future__ import annotations

import math
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from synth.surfaces.measured_area import MeasuredArea
from synth.surfaces.surface_data import SurfaceData
from tests.synth.surfaces.maps import map_sets
from tests.synth.surfaces.maps.map_sets import PIXEL
from tests.synth.surfaces.maps.test_continued import (
    FINER,
    SEEDS,
    area_of,
    at_pixel,
    imported,
    on_points,
    powers,
    synthetic_only,
)
from tests.synth.surfaces.maps.test_map_sets import imported as imported_set
from tests.synth.surfaces.maps.test_map_sets import rms


def print_sets() -> None:
    """Print the errors of heights and slopes, relative to the rms of the surface, and the residual of the fit."""
    print("| set | heights | rms slope | residual |\n| --- | --- | --- | --- |")
    for number, (name, case) in enumerate(map_sets.CASES.items()):
        heights = map_sets.surface(number)
        options = {} if case.green else {"height": 2.0 * float(np.max(np.abs(heights))) / 0.95}
        with TemporaryDirectory() as folder:
            found = imported_set(map_sets.made(case, heights, Path(folder)), **options)
        error = 100.0 * rms(found.heights - heights) / rms(heights)
        one, own = (rms(map_sets.slopes(of, PIXEL)[0]) for of in (found.heights, heights))
        residual = found.report["residual"]
        shown = "" if residual is None else f"{100.0 * residual:.2g} %"
        print(f"| {name} | {error:.2g} % | {100.0 * (one / own - 1.0):+.1g} % | {shown} |")


def print_continued() -> None:
    """Print the step of the spectrum at the wave number of the pixel, and the error of the rms slope."""
    print("\n| seed | Hurst exponent | step at the pixel | rms slope |\n| --- | --- | --- | --- |")
    for seed in SEEDS:
        hurst = 0.3 + 0.07 * seed
        with TemporaryDirectory() as folder:
            found = imported(seed, Path(folder), hurst=hurst)
        power, x, y = powers(found.heights, PIXEL)
        own, area = at_pixel(power, np.hypot(x, y), 0.5, 1.0), area_of(found, synthetic_seed=seed)
        power, x, y = powers(on_points(area), PIXEL / FINER)
        outside = np.maximum(np.abs(x), np.abs(y)) > 1.0 + 1e-6
        step = at_pixel(power[outside], np.hypot(x, y)[outside], 1.0, 3.0) - own
        alone = MeasuredArea(SurfaceData(synthetic_only(area).astype(np.float32), area.data.spacing), "join")
        turned = MeasuredArea(SurfaceData(alone.data.heights.T.copy(), area.data.spacing), "join")
        slope = math.sqrt(0.5 * (alone.rms[1] ** 2 + turned.rms[1] ** 2)) / found.report["synthetic"]["rms_slope"]
        print(f"| {seed} | {hurst:.2f} | {step:+.2f} dB | {100.0 * (slope - 1.0):+.1g} % |")


if __name__ == "__main__":
    print_sets()
    print_continued()
