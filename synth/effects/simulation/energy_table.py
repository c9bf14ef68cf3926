"""A table of the elastic energy of one contact, over the height of the finger and the phase of the texture.

Stage   contact -> TABLE OF THE ENERGY -> steps
Model   I(z, theta) is the mean over L of max(h - z, 0), l = -dI/dz the part of L that touches, and E the integral of I
        from z to infinity. The elastic energy is k E.
        d = z - b(theta), where b is a smooth curve near z. The table has I, l and E at equal steps of d and of phase.
        Between two steps of d, I is the cubic through both values with both slopes, and E is its integral. Above the
        last step I is 0; below the first it continues as a straight line.
        Over the phase, I, l and E are periodic cubic splines. The values read therefore satisfy I = -dE/dz at every
        phase, and have two continuous derivatives over the phase.
        The mean of I between two heights is integrated piece by piece over the cubics, not as a difference of E.
        Until the table keeps its tolerance, the steps of the phase or of d are halved: those for which a table of every
        second node has the larger error. Existing nodes are kept.
Source  Fagiani & Barbieri (2016), eq. 1; cubic splines from samples: Unser, Aldroubi & Eden (1993), IEEE Trans.
        Signal Process. 41. The rest is derived here.
Limits  `error` bounds the largest error dI / l of the z that balances a load. It is measured at places off the grid,
        against the exact contact. It is relative to the peak-to-peak of z or, if that is larger, to the distance of z
        from the heights of the given loads.
        Where crests come into contact I is only once differentiable. The error there falls as the square of the steps
        of the phase.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from synth.arrays import Array
from synth.contact.load_balance import Contact
from synth.effects.simulation.energy_reading import read_places
from synth.response.phases import turns_to_phase

Complex = np.ndarray[Any, np.dtype[np.complex128]]

MOST_NODES = 1 << 21  # per table, 50 MB; where more would be needed, `error` reports the remaining error
MOST_LIVE = 1 << 18  # the same for a live voice: half a second
MOST_WORK = 1 << 28  # nodes times cells of the contact's grid: a second or two
LEAST_NODES = 1 << 16  # always permitted for a file, whatever the work: 1024 rows of the finest sandpaper, 15 s
FEWEST_ROWS = 64  # phases of the first attempt: an error of 1e-3 to 1e-2
ROWS_A_HARMONIC = 16  # phases per harmonic of z: with 4, fine grain under a fingertip erred by its own peak-to-peak
MOST_FIRST_ROWS = 4096  # phases of the first attempt, for more harmonics
CELLS_OF_MOTION = 6.0  # steps of d per peak-to-peak of z, in the first attempt; of a round finger I is smooth in d
FEWEST_CELLS, MOST_CELLS = 6, 9  # log2 of the number of steps of d, in the first attempt
BASE_PHASES = 512  # phases at which the curve b and the range of heights are found
BASE_HARMONICS = 16  # harmonics of b, faded out; more would add the kinks of z to heights that have none
PROBES, LAYERS = 512, 8  # phases off the grid, and heights per phase, at which the error is measured
MARGIN = 1.5  # times the largest error at the probes; between them it was up to 1.4 times as large
SMALLEST_MOTION = 1e-5  # of a1 + a2: if z moves less, errors are relative to this
GOLDEN = 0.5 * (math.sqrt(5.0) - 1.0)


class _Probes(NamedTuple):
    """Places off the grid at which the error is measured.

    phases: turns.
    heights: m.
    depth: exact I (m).
    touching: exact l, or l at the lightest load if that is larger.
    allowed: permitted error (m).
    """

    phases: Array
    heights: Array
    depth: Array
    touching: Array
    allowed: Array


@dataclass(frozen=True, slots=True)
class EnergyTable:
    """The energy of one contact, ready to be read.

    nodes: float64 [steps of d + 1, phases + 3, 3], spline coefficients over the phase; see `energy_reading`.
    curves: float64 [2, phases + 3], spline coefficients of b and of the highest point of h (m).
    grid: float64 [4], see `energy_reading`.
    error: see Limits.
    motion: peak-to-peak of z (m), to which `error` is relative.
    """

    nodes: Array
    curves: Array
    grid: Array
    error: float
    motion: float

    @property
    def nbytes(self) -> int:
        """Size in bytes."""
        return int(self.nodes.nbytes + self.curves.nbytes)

    def read(self, turns: Array, heights: Array) -> Array:
        """Return [4, places] at `turns` and `heights` (m): I (m), l, dE/dtheta at fixed z (m^2 per turn), E (m^2)."""
        return np.asarray(read_places(self.nodes, self.curves, self.grid, turns_to_phase(turns), heights))

    def coarser(self) -> EnergyTable:
        """Return the table of every second node along both axes. Its `error` is still that of this table."""
        nodes = _values(self.nodes)[::2, ::2] * [1.0, 2.0, 0.5]
        nodes[..., 2] = integrated(nodes[..., 0], nodes[..., 1])
        curves = _values(self.curves)[:, ::2]
        bottom, width, cells, bits = self.grid.tolist()
        return replace(
            self,
            nodes=splines(nodes),
            curves=splines(curves),
            grid=np.array([bottom, 2.0 * width, cells / 2.0, bits - 1.0]),
        )

    @classmethod
    def of(
        cls,
        contact: Contact,
        load: float,
        lightest: float,
        heaviest: float,
        below: float = 0.0,
        above: float = 0.0,
        tolerance: float = 1e-3,
        *,
        harmonics: int = 0,
        live: bool = False,
    ) -> EnergyTable:
        """Return the table that keeps `tolerance`, or the best table within the bounds on nodes and work.

        contact, load: the table is that of the contact in its shape at `load` (N).
        lightest, heaviest: loads (N) between whose heights the tolerance is kept. Outside, up to the loss of contact,
            the tolerance is relative to the distance of z from those heights.
        below, above: distances (m) from those heights that the cells also cover. The cells always cover the loss of
            contact, and a peak-to-peak of z below the heights.
        harmonics: number of harmonics of z that the table has to hold, as far as the bounds permit.
        live: whether a live voice waits for the table, which then has at most MOST_LIVE nodes.
        """
        span = _Range.of(contact, load, min(lightest, load), max(heaviest, load), below, above)
        probes = span.probes(tolerance)
        most = MOST_WORK // contact.grid.cells
        most = min(MOST_LIVE, most) if live else min(MOST_NODES, max(LEAST_NODES, most))
        wanted = math.ceil(math.log2(CELLS_OF_MOTION * (span.top - span.bottom) / span.motion))
        wanted = wanted if contact.of_one_line else FEWEST_CELLS
        cells = 1 << min(max(wanted, FEWEST_CELLS), MOST_CELLS)
        rows = FEWEST_ROWS
        while rows < min(ROWS_A_HARMONIC * harmonics, MOST_FIRST_ROWS) and 4 * rows * (cells + 1) <= most:
            rows *= 2
        nodes = span.measured(np.arange(rows) / rows, np.arange(cells + 1) / cells)
        tables = [span.table(nodes, probes, tolerance)]
        while tables[-1].error > tolerance and 2 * nodes[0, :, 1:].size <= most:
            fewer_rows, fewer_cells = (span.table(part, probes, tolerance) for part in (nodes[:, ::2], nodes[..., ::2]))
            nodes = span.finer(nodes, 1 if fewer_rows.error > fewer_cells.error else 2)
            tables.append(span.table(nodes, probes, tolerance))
        return min(tables, key=lambda table: table.error)


@dataclass(frozen=True, slots=True)
class _Range:
    """The range that a table spans.

    indentations: at the lightest and the heaviest load (m).
    harmonics: of the curve b.
    bottom, top: lowest and highest d (m).
    below: see `EnergyTable.of` (m), with a peak-to-peak of z added.
    motion: peak-to-peak of z (m), to which errors are relative.
    """

    contact: Contact
    load: float
    indentations: tuple[float, float]
    harmonics: Complex
    bottom: float
    top: float
    below: float
    motion: float

    @classmethod
    def of(cls, contact: Contact, load: float, lightest: float, heaviest: float, below: float, above: float) -> _Range:
        """Return the range between the heights of the loads, extended by `below` and `above`; see `EnergyTable.of`."""
        solver, phases = contact.solver(load), np.arange(BASE_PHASES) / BASE_PHASES
        pressed = [contact.indentation(w) for w in (load, lightest, heaviest)]
        middle, light, heavy = (solver.solve(phases, indentation).height for indentation in pressed)
        scale = contact.geometry_at(load).height_scale
        harmonics = np.fft.rfft(middle)[:BASE_HARMONICS] / BASE_PHASES
        harmonics *= np.cos(0.5 * np.pi * np.arange(BASE_HARMONICS) / BASE_HARMONICS) ** 2
        base = np.fft.irfft(harmonics, BASE_PHASES) * BASE_PHASES
        highest = solver.solve(phases, 0.0).height
        motion = max(*(float(np.ptp(heights)) for heights in (middle, light, heavy)), SMALLEST_MOTION * scale)
        below += motion
        top, bottom = float(np.max(highest - base)), float(np.min(heavy - base)) - below
        # below the lowest h all of a flat finger touches, so the straight line below the bottom is exact there
        if contact.of_one_line and contact.dome == 0.0:
            bottom = max(bottom, contact.geometry_at(load).extent[0] - float(np.max(base)) - 0.01 * (top - bottom))
        bottom = min(bottom, top - motion)
        top = max(top, min(top + above, float(np.max(light - base)) + above)) + 0.01 * (top - bottom)
        return cls(contact, load, (pressed[1], pressed[2]), harmonics, bottom, top, below, motion)

    def probes(self, tolerance: float) -> _Probes:
        """Return the probes: LAYERS heights, from the highest point down, at each of PROBES phases off every grid."""
        turns = np.sort(np.arange(1, PROBES + 1) * GOLDEN % 1.0)
        solver = self.contact.solver(self.load)
        light, heavy = (solver.solve(turns, indentation) for indentation in self.indentations)
        highest = solver.solve(turns, 0.0).height
        part = (np.arange(LAYERS * PROBES) * GOLDEN % 1.0).reshape(LAYERS, PROBES)
        part = (np.arange(LAYERS)[:, None] + part) / LAYERS
        least = highest - light.height
        depths = least * ((highest - heavy.height + self.below) / least) ** part
        heights = (highest - depths).ravel()
        spread = np.tile(turns, LAYERS)
        depth, touching = (part.T.ravel() for part in self.contact.measure(turns, (highest - depths).T, self.load))
        outside = np.maximum(heights - np.tile(light.height, LAYERS), np.tile(heavy.height, LAYERS) - heights)
        allowed = tolerance * np.maximum(self.motion, outside)
        return _Probes(spread, heights, depth, np.maximum(touching, np.tile(light.touching, LAYERS)), allowed)

    def measured(self, turns: Array, places: Array) -> Array:
        """Return the exact I and l, float64 [2, phases, places].

        turns: phases.
        places: parts of the way from the lowest to the highest d.
        """
        ways = np.arange(len(self.harmonics))
        base = 2.0 * np.real(np.exp(2j * np.pi * np.outer(turns, ways)) @ self.harmonics) - self.harmonics[0].real
        heights = base[:, None] + (self.bottom + (self.top - self.bottom) * places)
        nodes = np.stack(self.contact.measure(turns, heights, self.load))
        nodes[..., places == 1.0] = 0.0  # the top is above all heights, except any between the phases of its search
        return nodes

    def finer(self, nodes: Array, axis: int) -> Array:
        """Return twice as many `nodes` along `axis` (1: phases, 2: steps of d). Only the new ones are measured."""
        rows, cells = nodes.shape[1], nodes.shape[2] - 1
        turns, places = np.arange(rows) / rows, np.arange(cells + 1) / cells
        if axis == 1:
            both = np.stack([nodes, self.measured(turns + 0.5 / rows, places)], axis=2)
            return both.reshape(2, 2 * rows, cells + 1)
        between = self.measured(turns, places[:-1] + 0.5 / cells)
        return np.insert(nodes, np.arange(1, cells + 1), between, axis=2)

    def table(self, measured: Array, probes: _Probes, tolerance: float) -> EnergyTable:
        """Return the table of the nodes `measured`, exact there, with its error at `probes`."""
        depth, touching = np.moveaxis(measured, 2, 1)
        rows, cells = depth.shape[1], len(depth) - 1
        turns, width = np.arange(rows) / rows, (self.top - self.bottom) / cells
        base = np.fft.irfft(self.harmonics, rows) * rows
        energy = integrated(depth, width * touching)
        highest = self.contact.solver(self.load).solve(turns, 0.0).height
        nodes = splines(np.stack([depth, width * touching, energy], axis=-1))
        grid = np.array([self.bottom, width, cells, math.log2(rows)])
        table = EnergyTable(nodes, splines(np.stack([base, highest])), grid, 0.0, self.motion)
        wrong = np.abs(table.read(probes.phases, probes.heights)[0] - probes.depth) / probes.touching
        return replace(table, error=MARGIN * tolerance * float(np.max(wrong / probes.allowed)))


def integrated(depth: Array, touching: Array) -> Array:
    """Return E of the nodes, in steps of d, from I and from l times a step: the integral of the cubics over d."""
    energy = np.zeros_like(depth)
    pieces = 0.5 * (depth[:-1] + depth[1:]) + np.diff(touching, axis=0) / 12.0
    energy[:-1] = np.cumsum(pieces[::-1], axis=0)[::-1]
    return energy


def splines(values: Array) -> Array:
    """Return the coefficients of periodic cubic splines through `values` along the second axis, which grows by three.

    A value is (c[j - 1] + 4 c[j] + c[j + 1]) / 6, and c[j - 1] is stored at index j.
    """
    count = values.shape[1]
    gain = (2.0 + np.cos(2.0 * np.pi * np.arange(count // 2 + 1) / count)) / 3.0
    lines = np.fft.rfft(np.moveaxis(values, 1, -1)) / gain
    found = np.moveaxis(np.fft.irfft(lines, count), -1, 1)
    return np.ascontiguousarray(np.concatenate([found[:, -1:], found, found[:, :2]], axis=1))


def _values(coefficients: Array) -> Array:
    """Return the values from their spline coefficients along the second axis: the inverse of `splines`."""
    return np.asarray((coefficients[:, :-3] + 4.0 * coefficients[:, 1:-2] + coefficients[:, 2:-1]) / 6.0)
