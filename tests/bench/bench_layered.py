"""The layered table of a height map: making it, its memory, reading z, and its error against the exact solver.

Model: the usual fingertip on a random self-affine map of 2,000 x 2,000 heights, 25 um apart, whose edges join: Hurst
    exponent 0.8, Rq 10 um, waves of 0.1 to 3 mm. The error in the band is that of a straight scan over a period at
    100 mm/s: the largest difference up to 1 kHz, relative to the peak-to-peak. A coarser lattice has fewer bytes.
Limits: making is measured in processor time on one core, and in time with two threads. Reads follow a scan; reads at
    random places wait for the memory.
"""

from __future__ import annotations

import math
from time import process_time
from typing import Any

import numpy as np

from synth.arrays import Array
from synth.contact.area_contact import CombOnArea
from synth.contact.fingertip import FingertipContact
from synth.contact.geometry import Geometry
from synth.contact.load_balance import Contact
from synth.contact.scene_contact import contact_of
from synth.response.layered_cost import LayeredBounds, grid_of, layered_cost
from synth.response.layered_making import make_layered_table
from synth.response.layered_table import LayeredTable
from synth.response.table_error import QUANTITIES
from synth.scene.scene import parse_scene
from synth.surfaces.measured_area import MeasuredArea
from synth.surfaces.surface_data import SurfaceData
from tests.bench.timing import Figure, figure, one_core, repeated, seconds

SPACING, SPEED, BAND = 25e-6, 0.1, 1000.0
READS = 8000  # reads of a voice per second
LIMITS = {"seconds": 3.0, "megabytes": 64.0, "nanoseconds": 100.0}
USUAL = 0.02, 2.0  # N
SCANS = ((0.05, (1, 0)), (0.3, (1, 1)), (1.0, (0, 1)))  # load (N), periods along and across


def figures(quick: bool) -> list[Figure]:
    """Return the lines of a layered table; quick: a smaller map and few repeats."""
    count = 160 if quick else 2000
    contact = fingertip_on(self_affine(count))
    cost = layered_cost(contact)
    places = math.prod(cost.plan.places)
    how = f"{count} x {count} heights, {cost.plan.places[0]} x {cost.plan.places[1]} places, {cost.rows} loads to 5 N"
    with one_core():
        began = process_time()
        table = make_layered_table(contact, cost=cost)
        took = process_time() - began
    both = [seconds(lambda: make_layered_table(contact, cost=cost, workers=2)) for _ in range(1 if quick else 3)]
    lines = [
        figure("layered table, made on one core", [took], "s", None, f"{how}, predicted {cost.seconds:.2f} s"),
        figure("layered table, a place", [took], "us", None, how, scale=1e6 / places),
        figure("layered table, two threads", both, "s", LIMITS["seconds"], how),
        figure("layered table, size", [table.memory_bytes / 1e6], "MB", LIMITS["megabytes"], how),
    ]
    lines += reading(table, 3 if quick else 51)
    exact = {scan: scanned(contact, *scan) for scan in SCANS}
    lines += errors(table, "usual", exact)
    if not quick:
        for nbytes, rows in ((32 << 20, 24), (13 << 20, 24), (64 << 20, 16)):
            bounds = LayeredBounds(nbytes=nbytes, rows=(rows,))
            made = make_layered_table(contact, bounds, workers=2)
            lines += errors(made, f"{rows} loads, {1e6 * made_spacing(made, count):.0f} um", exact)
    return lines


def self_affine(count: int) -> Any:
    """Return the map [count, count], m."""
    waves = np.hypot(np.fft.fftfreq(count, SPACING)[:, np.newaxis], np.fft.rfftfreq(count, SPACING))
    sizes = np.where((waves > 1.0 / 3.001e-3) & (waves < 1.0 / 0.1e-3), np.maximum(waves, 1.0) ** -1.8, 0.0)
    noise = np.random.default_rng(1).normal(size=(count, count))
    heights = np.fft.irfft2(np.fft.rfft2(noise) * sizes, (count, count))
    return (heights * (10e-6 / heights.std())).astype(np.float32)


def fingertip_on(heights: Any) -> Contact:
    """Return the usual fingertip on a map whose edges join."""
    scene = parse_scene({"finger": {"kind": "fingertip"}})
    contact, area = contact_of(scene), MeasuredArea(SurfaceData(heights, (SPACING, SPACING)), "join")
    assert isinstance(contact, FingertipContact | CombOnArea)
    return contact.on(Geometry.of_surfaces(scene.finger, area))


def made_spacing(table: LayeredTable, count: int) -> float:
    """Return the distance between neighbouring places along the scan (m)."""
    return count * SPACING / table.places[0]


def reading(table: LayeredTable, repeats: int) -> list[Figure]:
    """Return the lines of reading z along a scan with a changing load, and at random."""
    t = np.arange(READS)
    motion = 2.5e-4 * t, 1.1e-4 * t, 0.3 + 0.1 * np.sin(1e-2 * t)
    random = np.random.default_rng(2)
    anywhere = random.uniform(size=READS), random.uniform(size=READS), random.uniform(*USUAL, READS)
    how = f"{READS} reads, {repeats} passes"
    return [
        figure(name, repeated(lambda path=path: table.heights(*path), repeats), "ns", limit, how, scale=1e9 / READS)  # type: ignore[misc]
        for name, path, limit in (
            ("layered table, a read along a scan", motion, LIMITS["nanoseconds"]),
            ("layered table, a read anywhere", anywhere, None),
        )
    ]


def path_of(turns: tuple[int, int], count: int) -> tuple[Array, Array]:
    """Return `count` places of a straight scan over whole periods, in periods."""
    steps = np.asarray(np.arange(count) / count)
    return steps * turns[0], 0.37 + steps * turns[1]


def scanned(contact: Contact, load: float, turns: tuple[int, int]) -> Array:
    """Return z (m) of the exact solver along a scan, eight places per period of the band."""
    area = contact.geometry.profile
    assert isinstance(area, MeasuredArea)
    length = math.hypot(turns[0] * area.period, turns[1] * area.across)
    along, across = path_of(turns, math.ceil(8.0 * length * BAND / SPEED))
    return grid_of(contact).solve_places(along % 1.0, across % 1.0, contact.indentation(load)).height


def errors(table: LayeredTable, name: str, exact: dict[tuple[float, tuple[int, int]], Array]) -> list[Figure]:
    """Return the largest reported error over the motion, and that of each quantity in the band."""
    usual = (table.loads[:-1] >= USUAL[0]) & (table.loads[1:] <= USUAL[1])
    reported = np.max(table.errors[usual] / table.swings[1:][usual])
    found: dict[str, list[float]] = {one: [] for one in QUANTITIES}
    for (load, turns), z in exact.items():
        read = table.heights(*path_of(turns, len(z)), np.full(len(z), load))
        series, other = np.fft.rfft(z), np.fft.rfft(read)
        n = np.arange(len(series))
        heard = (n > 0) & (n <= len(z) / 8)
        for order, one in enumerate(QUANTITIES):
            factor = heard * (1j * n) ** order
            wanted, got = (np.fft.irfft(factor * each, len(z)) for each in (series, other))
            found[one].append(float(np.max(np.abs(got - wanted)) / np.ptp(wanted)))
    how = f"of the peak-to-peak, {len(exact)} scans at {1e3 * SPEED:g} mm/s up to {BAND:g} Hz; largest "
    lines = [figure(f"layered, {name}, reported", [reported], "%", None, "of the motion, 0.02 to 2 N", scale=100.0)]
    for one, values in found.items():
        lines.append(
            figure(f"layered, {name}, {one}", values, "%", None, how + f"{100 * max(values):.2g} %", scale=100.0)
        )
    return lines
