"""A table of the elastic energy of one contact, over the height of the finger and the phase of the texture.

Stage   contact -> TABLE OF THE ENERGY -> steps
Model   I(z, theta) = mean over L of max(h - z, 0), l = -dI/dz, E = integral of I from z to infinity; the energy is
        k E. With d = z - b(theta), b a smooth curve near z, I is in each cell of d the cubic that shares I and l with
        the exact contact at both ends, and E its integral, E = 0 above the top; below the lowest height I goes on as
        a line. Between equal steps of phase every coefficient is its periodic cubic spline, so that at any phase I is
        -dE/dz of what is read, and two derivatives over the phase are continuous.
Source  Fagiani & Barbieri (2016), eq. 1; cubic splines from samples: Unser, Aldroubi & Eden (1993), IEEE Trans.
        Signal Process. 41. The rest is derived here.
Limits  `error` bounds, from places off the grid, against the exact contact, the largest error dI / l of the z that
        balances a load, relative to the peak-to-peak of z, or to how far z lies outside the loads asked for where that
        is more. Where crests come into contact I is only once differentiable: there the error falls as the square of
        the rows. The default contact at its one load takes 0.25 s and 1.3 MB for 1e-3 (it is 5e-4 then); from 1 mN to
        1 N it takes 1.5 s and 16 MB.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from synth.arrays import Array
from synth.contact.load_balance import Contact
from synth.effects.simulation.potential_reading import BOUNDS, ORIGINS, STRIDE, Layout, pool_of, read_heights
from synth.response.phases import turns_to_phase

MOST_BYTES = 64 << 20  # of one table; beyond it `error` says what is left
MOST_WORK = 1 << 28  # places measured for a table times cells of the contact's grid: a second or two
ROW_BYTES = 5 * 8  # of a cell at one phase: four coefficients of I, and E
FEWEST_ROWS = 64  # phases to begin with
BASE_PHASES = 512  # at which the curve b and the range of heights are found
BASE_HARMONICS = 16  # of b, faded out: more would bring the kinks of z to heights that have none
FEWEST_CELLS = 8  # of d to begin with: a power of two
CELL_PHASES = 256  # at which the cubics of a cell are judged
FINEST = 12  # times that the range of d is halved at most; each more doubles the index of cells
CELL_SHARE = 0.25  # of the tolerance: what the cubics of a cell may be wrong by; the rest is for the phases
STALLED = 0.7  # of the error before: where more phases leave more than this, the cells are cut finer instead
PROBES, LAYERS = 512, 8  # phases off the grid, and heights at each, at which the error is measured
MARGIN = 1.5  # times the largest error found there: between probes it was up to 1.4 times as large
SMALLEST_MOTION = 1e-5  # of a1 + a2: where z moves less, errors are relative to this
GOLDEN = 0.5 * (math.sqrt(5.0) - 1.0)


class _Probes(NamedTuple):
    """Places off the grid: phases (turns) and heights (m), exact I, smallest l counted, and the error allowed (m)."""

    phases: Array
    heights: Array
    depth: Array
    touching: Array
    allowed: Array


@dataclass(frozen=True, slots=True)
class PotentialTable:
    """The energy of one contact, ready to be read.

    pool, layout: what compiled loops read (`potential_reading`). error: see Limits. motion: peak-to-peak of z (m) to
    which it is relative. load: N, at which the shape of the contact was taken.
    """

    pool: Array
    layout: Layout
    error: float
    motion: float
    load: float

    @property
    def nbytes(self) -> int:
        """Bytes that the table holds."""
        return int(self.pool.nbytes)

    @property
    def rows(self) -> int:
        """Phases of a period at which the contact was measured."""
        return int(self.layout[STRIDE]) - 3

    @property
    def edges(self) -> Array:
        """Ends of the cells of d (m), ascending."""
        return self.pool[self.layout[BOUNDS] + 1 : self.layout[ORIGINS] - 1]

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
    ) -> PotentialTable:
        """Return the table of `contact` in its shape at `load` (N) that keeps `tolerance`, or the best in its bounds.

        lightest, heaviest: loads (N) between whose heights the tolerance is kept; beyond, up to the loss of contact,
        it is relative to how far z lies outside. below, above: m, how far from those heights z may go and still be
        read from cells. The loss of contact is always within, and so is a peak-to-peak of z below.
        """
        plan = _Range.of(contact, load, min(lightest, load), max(heaviest, load), below, above, tolerance)
        probes, share, rows, before, work = plan.probes(PROBES, LAYERS), CELL_SHARE, FEWEST_ROWS, math.inf, 0
        edges = plan.cells(share)
        best, least = plan.table(edges, rows), math.inf
        while True:
            table = plan.table(edges, rows) if work else best
            error = plan.error(table, probes)
            if error < least:
                best, least = table, error
            work += rows * len(edges)
            most = min(MOST_BYTES // (ROW_BYTES * len(edges)), (MOST_WORK // contact.cells - work) // len(edges))
            if error <= tolerance or 2 * rows > most:
                return cls(*best, least, plan.motion, load)
            if error > STALLED * before:
                share *= CELL_SHARE
                edges = plan.cells(share)
            else:
                wanted = rows * max(2.0, math.sqrt(error / tolerance))  # the error falls as the square of the rows
                rows = 1 << int(math.log2(min(wanted, most)))
            before = error


@dataclass(frozen=True, slots=True)
class _Range:
    """What a table is to span: the curve b as harmonics, the range of d (m), and what errors are relative to.

    known: what `cells` has measured, by the place in d.
    """

    contact: Contact
    load: float
    indentations: tuple[float, float]
    harmonics: np.ndarray[Any, np.dtype[np.complex128]]
    bottom: float
    top: float
    below: float
    motion: float
    tolerance: float
    known: dict[int, tuple[Array, Array]]

    @classmethod
    def of(
        cls,
        contact: Contact,
        load: float,
        lightest: float,
        heaviest: float,
        below: float,
        above: float,
        tolerance: float,
    ) -> _Range:
        """Return the range of the heights between the loads and what is below and above; see `PotentialTable.of`."""
        solver, phases = contact.solver(load), np.arange(BASE_PHASES) / BASE_PHASES
        pressed = [_indentation(contact, w, load) for w in (load, lightest, heaviest)]
        middle, light, heavy = (solver.solve(phases, indentation).height for indentation in pressed)
        scale = contact.geometry_at(load).height_scale
        harmonics = np.fft.rfft(middle)[:BASE_HARMONICS] / BASE_PHASES
        harmonics *= np.cos(0.5 * np.pi * np.arange(BASE_HARMONICS) / BASE_HARMONICS) ** 2
        base = _curve(harmonics, phases)
        highest = solver.solve(phases, 0.0).height
        motion = max(*(float(np.ptp(heights)) for heights in (middle, light, heavy)), SMALLEST_MOTION * scale)
        below += motion
        top, bottom = float(np.max(highest - base)), float(np.min(heavy - base)) - below
        # all touches below the lowest h but for what a parabola takes off: there the line below the bottom is exact
        if contact.dome == 0.0:
            bottom = max(bottom, contact.geometry_at(load).extent[0] - float(np.max(base)))
        bottom = min(bottom, top - motion)
        top = max(top, min(top + above, float(np.max(light - base)) + above)) + 0.01 * (top - bottom)
        return cls(contact, load, (pressed[1], pressed[2]), harmonics, bottom, top, below, motion, tolerance, {})

    def probes(self, phases: int, layers: int) -> _Probes:
        """Return `layers` heights at each of `phases` phases off every grid, from the highest point downwards."""
        turns = np.sort(np.arange(1, phases + 1) * GOLDEN % 1.0)
        solver = self.contact.solver(self.load)
        light, heavy = (solver.solve(turns, indentation) for indentation in self.indentations)
        highest = solver.solve(turns, 0.0).height
        part = (np.arange(layers * phases) * GOLDEN % 1.0).reshape(layers, phases)
        part = (np.arange(layers)[:, None] + part) / layers
        least = highest - light.height
        depths = least * ((highest - heavy.height + self.below) / least) ** part
        heights = (highest - depths).ravel()
        spread = np.tile(turns, layers)
        depth, touching = self.contact.measure(spread, heights, self.load)
        outside = np.maximum(heights - np.tile(light.height, layers), np.tile(heavy.height, layers) - heights)
        allowed = self.tolerance * np.maximum(self.motion, outside)
        return _Probes(spread, heights, depth, np.maximum(touching, np.tile(light.touching, layers)), allowed)

    def error(self, table: tuple[Array, Layout], probes: _Probes) -> float:
        """Return the largest error of `table` at `probes`, relative to the motion; see Limits of the module."""
        read = read_heights(*table, turns_to_phase(probes.phases), probes.heights)[0]
        return MARGIN * self.tolerance * float(np.max(np.abs(read - probes.depth) / probes.touching / probes.allowed))

    def cells(self, share: float) -> Array:
        """Return the ends of cells of d (m): halved until their cubics keep `share` of the tolerance."""
        turns = np.sort(np.arange(1, CELL_PHASES + 1) * GOLDEN % 1.0)
        base, solver = _curve(self.harmonics, turns), self.contact.solver(self.load)
        light, heavy = (solver.solve(turns, indentation) for indentation in self.indentations)
        unit = (self.top - self.bottom) / (1 << FINEST)

        def measured(place: int) -> tuple[Array, Array]:
            if place not in self.known:
                self.known[place] = self.contact.measure(turns, base + (self.bottom + unit * place), self.load)
            return self.known[place]

        most = min(MOST_BYTES // (4 * ROW_BYTES * FEWEST_ROWS), MOST_WORK // (4 * CELL_PHASES * self.contact.cells))
        whole = (1 << FINEST) // FEWEST_CELLS
        waiting = [(first, first + whole) for first in range(0, 1 << FINEST, whole)]
        ends = [1 << FINEST]
        while waiting:
            low, high = waiting.pop(0)
            middle = (low + high) // 2
            (first, rise), (last, fall), (depth, touching) = measured(low), measured(high), measured(middle)
            wrong = np.abs(0.5 * (first + last) + 0.125 * unit * (high - low) * (fall - rise) - depth)
            heights = base + (self.bottom + unit * middle)
            outside = np.maximum(heights - light.height, heavy.height - heights)
            allowed = share * self.tolerance * np.maximum(self.motion, outside)
            finer = high - low > 1 and len(waiting) + len(ends) < most
            if finer and np.any(wrong > allowed * np.maximum(touching, light.touching)):
                waiting += [(low, middle), (middle, high)]
            else:
                ends.append(low)
        return self.bottom + unit * np.sort(np.array(ends))

    def table(self, edges: Array, rows: int) -> tuple[Array, Layout]:
        """Return the table of `rows` phases, exact at the ends of its cells."""
        turns = np.arange(rows) / rows
        base = _curve(self.harmonics, turns)
        heights = (base[:, None] + edges).ravel()
        measured = self.contact.measure(np.repeat(turns, len(edges)), heights, self.load)
        depth, touching = (part.reshape(rows, len(edges)).T.copy() for part in measured)
        depth[-1], touching[-1] = 0.0, 0.0  # the top lies above all but what stands between the phases of its search
        highest = self.contact.solver(self.load).solve(turns, 0.0).height
        return laid_out(edges, splines(np.stack([base, highest])), splines(depth), splines(touching))


def laid_out(edges: Array, curves: Array, depth: Array, touching: Array) -> tuple[Array, Layout]:
    """Return the pool and layout of a table of I and l at `edges`: spline coefficients `depth` and `touching`."""
    cells, width = len(edges) - 1, np.diff(edges)[:, None]
    pieces = np.zeros((cells + 2, depth.shape[1], 4))
    rise, start, end = np.diff(depth, axis=0), -width * touching[:-1], -width * touching[1:]
    inner = pieces[1:-1]
    inner[..., 0], inner[..., 1] = depth[:-1], start
    inner[..., 2], inner[..., 3] = 3.0 * rise - 2.0 * start - end, start + end - 2.0 * rise
    pieces[0, :, :2] = pieces[1, :, :2]
    energies = np.zeros((cells + 2, depth.shape[1]))
    whole = width * (inner @ (1.0 / np.arange(1.0, 5.0)))
    energies[1:-1] = np.cumsum(whole[::-1], axis=0)[::-1]
    energies[0] = energies[1]
    bounds = np.concatenate([[-np.inf], edges, [np.inf]])
    return pool_of(pieces, energies, curves, bounds)


def splines(values: Array) -> Array:
    """Return the coefficients of the periodic cubic splines through rows of `values`, with three more at the ends.

    A value is (c[j - 1] + 4 c[j] + c[j + 1]) / 6, and c[j - 1] stands at place j.
    """
    count = values.shape[-1]
    gain = (2.0 + np.cos(2.0 * np.pi * np.arange(count // 2 + 1) / count)) / 3.0
    found = np.fft.irfft(np.fft.rfft(values, axis=-1) / gain, count, axis=-1)
    return np.ascontiguousarray(np.concatenate([found[..., -1:], found, found[..., :2]], axis=-1))


def _curve(harmonics: np.ndarray[Any, np.dtype[np.complex128]], turns: Array) -> Array:
    """Return the series at each of `turns`."""
    waves = np.exp(2j * np.pi * np.outer(turns, np.arange(1, len(harmonics))))
    return np.asarray(harmonics[0].real + 2.0 * (waves @ harmonics[1:]).real)


def _indentation(contact: Contact, load: float, shape: float) -> float:
    """Return w / k (m) at `load` (N) of the contact that keeps its shape at `shape` (N)."""
    return contact.indentation(load) if contact.of_one_shape else load / contact.stiffness_at(shape)
