"""The table of statistics of the areas in docs/catalogue.md: `python -m docs.figures.area_statistics`.

Model   Each surface is sampled at PLACES by PLACES places of a period. Rq is the standard deviation of these heights.
        Rms slopes, correlation lengths and periods follow from their Fourier transform. A correlation length is the
        distance at which the autocorrelation along a direction falls to 1 / e. A period is that of the wave of lowest
        order which all waves of the surface are multiples of.
        The expected values use the numbers of the entry alone. A self-affine surface with waves from 1 / q1 to 1 / q2
        has power q^-(1 + 2 H) dq in all directions together, so the mean of (dh/dx)^2 is Rq^2 (2 pi)^2 <q^2> / 2, and
        the autocorrelation is <J0(2 pi q r)>.
The page has the table between BEGIN and END. A test makes it again and compares.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from docs.figures.catalogue import PAGE
from synth.scene.catalogue import CatalogueEntry, catalogue
from synth.scene.scene import parse_scene
from synth.surfaces import profile_of
from synth.surfaces.height_field import HeightField

Array = np.ndarray[Any, np.dtype[np.float64]]

BEGIN = "<!-- made by: python -m docs.figures.area_statistics -->\n"
END = "<!-- end of what it makes -->\n"
HEAD = (
    "| name | Rq | rms slope, along and across | correlation length, along and across | period, along and across |\n"
    "| --- | --- | --- | --- | --- |\n"
)
PLACES = 1024  # per period, along and across; six per shortest wave of the catalogue
WAVES, ANGLES, DISTANCES = 120, 60, 600  # of the sums for expected values; their error is below 1e-3


@dataclass(frozen=True, slots=True)
class Statistics:
    """What heights over a period have; pairs are along and across.

    rq: m.
    height: from the lowest to the highest place, m.
    slopes: rms.
    correlation, periods: m.
    """

    rq: float
    height: float
    slopes: tuple[float, float]
    correlation: tuple[float, float]
    periods: tuple[float, float]


KINDS = "rough_area", "dots", "weave"  # of the catalogue, which vary across the scan


def areas() -> list[CatalogueEntry]:
    """Return the entries that vary across the scan."""
    return [entry for entry in catalogue() if entry.document["texture"]["kind"] in KINDS]


def measured(field: HeightField) -> Statistics:
    """Return the statistics of a surface from its heights."""
    sizes = field.period, field.across
    x, y = (np.asarray(np.arange(PLACES) * (size / PLACES), np.float64) for size in sizes)
    heights = field.area(x, y)
    heights -= heights.mean()
    power = np.abs(np.fft.fft2(heights)).astype(np.float64) ** 2 / PLACES**4
    orders = np.abs(np.fft.fftfreq(PLACES, 1.0 / PLACES))
    totals = power.sum(axis=0), power.sum(axis=1)  # by the order along, and across
    slopes = [
        math.sqrt(np.sum(one * (2.0 * math.pi * orders / size) ** 2)) for one, size in zip(totals, sizes, strict=True)
    ]
    lengths = [falls_to(np.fft.fft(one).real, size / PLACES) for one, size in zip(totals, sizes, strict=True)]
    periods = [size / common_order(one) for one, size in zip(totals, sizes, strict=True)]
    return Statistics(
        float(heights.std()), float(np.ptp(heights)), (slopes[0], slopes[1]), (lengths[0], lengths[1]),
        (periods[0], periods[1]),
    )  # fmt: skip


def falls_to(correlation: Array, step: float, level: float = 1.0 / math.e) -> float:
    """Return the distance (m) at which a correlation at multiples of `step` (m) falls to `level`; inf if nowhere."""
    relative = correlation / correlation[0]
    if not np.any(relative < level):
        return math.inf
    below = int(np.argmax(relative < level))
    before, after = relative[below - 1], relative[below]
    return step * (below - float((level - after) / (before - after)))


def common_order(power: Array) -> int:
    """Return the largest common divisor of the orders that have power."""
    return int(np.gcd.reduce(np.flatnonzero(power[: PLACES // 2] > 1e-12 * power.max())))


def expected_slope(rq: float, hurst: float, longest: float, shortest: float) -> float:
    """Return the rms slope along any direction of a self-affine surface; lengths in m."""
    q, share = _waves(hurst, longest, shortest)
    return rq * 2.0 * math.pi * math.sqrt(0.5 * float(np.sum(share * q**2)))


def expected_correlation(hurst: float, longest: float, shortest: float) -> float:
    """Return the correlation length (m) of a self-affine surface; lengths in m."""
    q, share = _waves(hurst, longest, shortest)
    distance = np.arange(DISTANCES) * (0.3 * longest / DISTANCES)
    angle = (np.arange(ANGLES) + 0.5) * (math.pi / ANGLES)
    turns = 2.0 * math.pi * np.outer(distance, q)
    j0 = sum(np.cos(turns * math.sin(one)) for one in angle) / ANGLES
    return falls_to(np.asarray(j0 @ share), float(distance[1]))


def _waves(hurst: float, longest: float, shortest: float) -> tuple[Array, Array]:
    """Return wave numbers (1/m) at equal steps of their logarithm, and the share of the power at each."""
    edges = np.geomspace(1.0 / longest, 1.0 / shortest, WAVES + 1)
    q = np.sqrt(edges[1:] * edges[:-1])
    share = q ** (-2.0 * hurst)
    return np.asarray(q), np.asarray(share / share.sum())


def table() -> str:
    """Return the table: each value as found, and in brackets as expected from the numbers of the entry."""
    return HEAD + "".join(map(row, areas()))


def row(entry: CatalogueEntry) -> str:
    """Return the line of an entry."""
    texture = parse_scene(entry.document).texture.values()
    field = profile_of(parse_scene(entry.document))
    assert isinstance(field, HeightField)
    found = measured(field)
    rq, slope, length = micrometres(found.rq), pair(found.slopes, 1.0), pair(found.correlation, 1e6, " um")
    if field.kind == "rough_area":
        band = texture["hurst"], texture["longest"], texture["shortest"]
        rq += f" ({micrometres(texture['rms_height'])})"
        slope += f" ({shown(expected_slope(texture['rms_height'], *band))})"
        length += f" ({micrometres(expected_correlation(*band))})"
    periods = f"{pair(found.periods, 1e3, ' mm')} ({pair((field.period, field.across), 1e3, ' mm')})"
    return f"| `{entry.name}` | {rq} | {slope} | {length} | {periods} |\n"


def shown(value: float) -> str:
    """Return a number with three digits."""
    return f"{float(f'{value:.3g}'):g}"


def micrometres(length: float) -> str:
    """Return a length (m) as text."""
    return f"{shown(1e6 * length)} um"


def pair(values: tuple[float, float], factor: float, unit: str = "") -> str:
    """Return two values as text."""
    return ", ".join(shown(factor * value) + unit if math.isfinite(value) else "none" for value in values)


def main() -> None:
    """Write the table into the page."""
    page = PAGE.read_text("utf-8")
    before, _, rest = page.partition(BEGIN)
    PAGE.write_text(before + BEGIN + table() + END + rest.partition(END)[2], "utf-8")


if __name__ == "__main__":
    main()
