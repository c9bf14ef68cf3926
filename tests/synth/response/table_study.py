"""Errors of tables over random scenes, at random loads and places: the study behind docs/table.md.

    python -m tests.synth.response.table_study SCENES [full]

The reference is the exact solver at 16 phases per harmonic, cut at the level's highest harmonic. With `full`, the
tables cover the whole band of 48 kHz. Errors are relative to the peak-to-peak at that load or at 0.3 N, whichever is
larger, as in a table's own errors.
"""

from __future__ import annotations

import sys
import time
from dataclasses import dataclass

import numpy as np

from synth.contact.scene_contact import contact_of
from synth.plan.scene_table import bounds_for
from synth.response.table import ResponseTable
from synth.response.table_error import QUANTITIES, USUAL_LOAD
from synth.response.table_making import BOUNDS, TableBounds, make_table
from synth.scene.scene import Scene, parse_scene
from tests.synth.engine_cases import Real, random_document, spread

LOADS = 12  # per scene
PHASES_A_HARMONIC = 16  # of the reference
WIDE = 3  # periods of a spline's coefficients whose images count
FINER = 3  # number of times that the segments of a profile are halved for its reference
USUAL_SECONDS = 0.3  # to make a table of two cosines; the report counts the tables that take longer
WITHIN = 32  # harmonics up to which the limits on velocity and acceleration apply


@dataclass(frozen=True)
class Found:
    """The results of one scene.

    loads: [loads].
    errors, told: measured and reported errors [quantity, level, loads].
    harmonics: of each level.
    """

    loads: Real
    errors: Real
    told: Real
    harmonics: tuple[int, ...]
    seconds: float
    nbytes: int
    rows: int


def random_scene(seed: int) -> Scene:
    return parse_scene(random_document(np.random.default_rng(seed), 48000))


def table_of(scene: Scene, bounds: TableBounds = BOUNDS) -> ResponseTable:
    return make_table(
        contact_of(scene), period=scene.texture.period, band=1e3, lift_load=scene.scan.lift_load, bounds=bounds
    )


def cubic_weights(s: float) -> tuple[float, ...]:
    """Return the weights of value and slope (times the width) of the lower row, then of the upper, at 0 <= s <= 1."""
    rest = 1.0 - s
    return (1.0 + 2.0 * s) * rest * rest, s * rest * rest, s * s * (3.0 - 2.0 * s), -s * s * rest


def read_series(table: ResponseTable, level: int, load: float) -> npt_complex:
    """Return the harmonics of a level's spline at `load` (N), with its images."""
    loads = table.loads.astype(float)
    held = min(load, loads[-1])
    row = min(int(np.searchsorted(loads, held, side="right")) - 1, len(loads) - 2)
    width = loads[row + 1] - loads[row]
    a, b, c, d = cubic_weights((held - loads[row]) / width)
    low, high = table.swings[level][row].astype(float), table.swings[level][row + 1].astype(float)
    coefficients = a * low[0] + b * width * low[1] + c * high[0] + d * width * high[1]
    places = len(coefficients)
    k = np.arange(WIDE * places)
    return np.asarray((np.fft.fft(coefficients) / places)[k % places] * np.sinc(k / places) ** 6)


npt_complex = np.ndarray[tuple[int, ...], np.dtype[np.complex128]]


def curve(series: npt_complex, order: int, points: int) -> Real:
    """Return a derivative over turns of a one-sided series, without its mean, at `points` places."""
    n = np.arange(len(series))
    spectrum = np.zeros(points // 2 + 1, dtype=np.complex128)
    spectrum[1 : len(series)] = series[1:] * (2j * np.pi * n[1:]) ** order
    return np.asarray(np.fft.irfft(spectrum, points) * points)


def measured(seed: int, loads: int = LOADS, bounds: TableBounds = BOUNDS) -> Found:
    """Return the errors of the table of one random scene at random loads."""
    return measured_scene(random_scene(seed), seed, loads, bounds)


def measured_scene(scene: Scene, seed: int, loads: int = LOADS, bounds: TableBounds = BOUNDS) -> Found:
    """Return the errors of the table of `scene` at random loads; for a profile, against segments an eighth as long."""
    phases = PHASES_A_HARMONIC * bounds.harmonics
    random = np.random.default_rng(10_000 + seed)
    began = time.perf_counter()
    table = table_of(scene, bounds)
    took = time.perf_counter() - began
    contact = contact_of(scene)
    for _ in range(FINER):
        contact = contact.refined() or contact
    offset = random.random() / phases
    turns = np.arange(phases) / phases + offset
    chosen = np.array([spread(random, 0.02, 5.0) for _ in range(loads)])
    levels = table.levels.highest
    errors, told = np.zeros((3, len(levels), loads)), np.zeros((3, len(levels), loads))

    def exact(load: float) -> npt_complex:
        found = np.fft.rfft(contact.approach(turns, load)[0]) / phases
        return np.asarray(found * np.exp(-2j * np.pi * np.arange(len(found)) * offset))

    usual = exact(USUAL_LOAD)
    for i, load in enumerate(chosen):
        truth = exact(float(load))
        for j, n in enumerate(levels):
            read = read_series(table, j, float(load))
            points = 2 << (len(read) - 1).bit_length()
            for order, quantity in enumerate(QUANTITIES):
                own, other = (curve(one[: n + 1], order, points) for one in (truth, usual))
                extent = max(float(np.ptp(own)), float(np.ptp(other)))
                floor = 1e-12 * contact.geometry.height_scale * (2 * np.pi * n) ** order
                error = float(np.max(np.abs(curve(read, order, points) - own)))
                errors[order, j, i] = error / max(extent, floor)
                told[order, j, i] = table.error.at(float(load), quantity, n)
    return Found(chosen, errors, told, levels, took, table.memory_bytes, len(table.loads))


def report(found: list[Found]) -> str:
    """Return the figures of a study as text."""
    levels = found[0].harmonics
    errors = np.concatenate([one.errors for one in found], axis=2)
    told = np.concatenate([one.told for one in found], axis=2)
    seconds = np.array([one.seconds for one in found])
    lines = [
        f"{len(found)} scenes, {errors.shape[2]} loads; tables of {np.median([one.rows for one in found]):.0f} rows, "
        f"at most {max(one.nbytes for one in found) / 1e6:.2f} MB, made in {np.median(seconds):.2f} s "
        f"(largest {seconds.max():.2f}, {np.sum(seconds > USUAL_SECONDS)} above {USUAL_SECONDS} s)"
    ]
    for order, quantity in enumerate(QUANTITIES):
        for j, n in enumerate(levels):
            e, t = errors[order, j], told[order, j]
            passed = float(np.mean(e > t + 1e-5))
            lines.append(
                f"{quantity:13} {n:3d} harmonics: median {np.median(e):.1e}, 99 % {np.quantile(e, 0.99):.1e}, "
                f"largest {e.max():.1e}; told {np.median(t):.1e} to {t.max():.1e}, passed by {100 * passed:.1f} %, "
                f"at most {np.max(e / (t + 1e-5)):.2f} times"
            )
    return "\n".join(lines)


if __name__ == "__main__":
    chosen = bounds_for(parse_scene({"output": {"bandwidth": "full"}})) if "full" in sys.argv else BOUNDS
    print(report([measured(seed, bounds=chosen) for seed in range(int(sys.argv[1]))]))
