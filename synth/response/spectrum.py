"""The Fourier series of z, or of another response, over one period of the texture, with an error bound.

Model   z(theta) = sum over n of Z_n exp(2 pi i n theta). The k-th time derivative at a speed u has the coefficients
        (2 pi i n u / lambda2)^k Z_n. The series is computed from M exact solutions at equal steps of phase. M doubles,
        reusing earlier solutions, until the change of every required quantity is within the tolerance.
Source  Fagiani & Barbieri (2016), eqs 1, 4, 5. Kinks of order 3/2 make Z_n fall as n^-2.5, so each doubling of M
        lowers the error by a factor of about 5.6. An event that all phases miss has a bound of its own.
Limits  `errors` bounds the error by the changes of the last two doublings. Of 32,871 bounds over 700 scenes, up to 1500
        harmonics and three derivatives, two were exceeded, by a tenth. The median error is 1/20 of the bound for few
        harmonics and about 1/6 for many. Of 10,800 bounds just below full contact one was exceeded, by a quarter.
        Where a solver has a discretisation, the change when its segments are halved is added.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from synth.arrays import Array
from synth.kept_files import json_form
from synth.response.demand import GOLDEN, Complex, Demand, harmonics_of
from synth.response.discretisation import DISCRETE_SHARE, MOST_DISCRETE, MOST_WORK, finest_needed
from synth.response.series_error import FLOOR, series_errors

if TYPE_CHECKING:
    from synth.response.discretisation import Source


FEWEST_PHASES = 8  # doubled at least once; with fewer there is no second change to estimate the error from
MOST_PHASES = 1 << 21  # 4 s of work on the default scene; where it is too few, the error is larger than the tolerance
PROBES = 16  # phases between all grids, at which a converged series is checked
BESIDE_DISCRETE = 0.25  # of the error that a discretisation leaves in each order: the phases need not err by less
SETTLED = 0.7  # of the error may remain after a doubling: a third is usual; if more remains, the grid hides a harmonic


@dataclass(frozen=True, slots=True)
class Spectrum:
    """The series of z at one load, in metres (of a force: in N).

    harmonics: complex128 [highest + 1], one-sided: z = Z_0 + 2 Re sum over n > 0 of Z_n e^{2 pi i n theta}.
    errors: error bound of each order of the demand, relative to its peak-to-peak.
    phases: number of solutions.
    closed: True where z is one sinusoid in closed form.
    solver: name of the solver.
    discrete: the part of each of `errors` by the discretisation of the solver; empty where it has none.
    """

    harmonics: Complex
    errors: tuple[float, ...]
    phases: int
    closed: bool
    solver: str
    discrete: tuple[float, ...] = ()

    @property
    def highest(self) -> int:
        """Number of the highest harmonic."""
        return len(self.harmonics) - 1

    def document(self) -> dict[str, Any]:
        """Return the spectrum as a JSON document; `of` reads it back, bit for bit."""
        return asdict(self) | {"harmonics": self.harmonics.view(float).tolist()}

    @classmethod
    def of(cls, document: dict[str, Any]) -> Spectrum:
        """Return the spectrum of a `document`."""
        harmonics = np.array(document["harmonics"], dtype=float).view(np.complex128)
        tuples = {name: tuple(document[name]) for name in ("errors", "discrete")}
        return cls(**{**document, "harmonics": harmonics, **tuples})


SPECTRUM_FORM = json_form(Spectrum.document, Spectrum.of)


def solve_spectrum(response: Source, load: float, demand: Demand, keep: int = 0) -> Spectrum:
    """Return the series of `response` at `load` (N) that meets `demand`, or the best within the limits on work.

    keep: largest number of harmonics returned: those of the demand, and more where there are phases for them, which
        have no error bound.
    """
    keep = max(keep, demand.total)
    closed = response.closed(load)
    if closed is not None:
        harmonics = np.zeros(demand.total + 1, dtype=np.complex128)
        harmonics[:2] = closed.mean, closed.first
        return Spectrum(harmonics, (1e-15,) * len(demand.orders), 0, True, "closed form")
    finer = response.refined()
    if finer is not None:
        return _refined(response, finer, load, demand, keep)
    larger = response.doubled() if response.refines else None
    if larger is not None:  # it is the finest: the change from larger ones shows its error
        return _refined(larger, response, load, demand, keep)
    return _grown(response, load, demand, keep, min(MOST_PHASES, max(256, MOST_WORK // response.work_at(load))))


def _refined(coarse: Source, finer: Source, load: float, demand: Demand, keep: int) -> Spectrum:
    """Return the series of a response whose solver has a discretisation, whose error is added to its own."""
    chosen, left = finest_needed(coarse, finer, load, demand)
    spent = min(max(max(left), DISCRETE_SHARE * demand.tolerance), MOST_DISCRETE * demand.tolerance)
    rest = replace(demand, tolerance=max(demand.tolerance - spent, BESIDE_DISCRETE * min(left)))
    found = _grown(chosen, load, rest, keep, min(MOST_PHASES, max(256, MOST_WORK // chosen.work_at(load))))
    errors = tuple(one + rest for one, rest in zip(found.errors, left, strict=True))
    return replace(found, errors=errors, discrete=left)


def _grown(response: Source, load: float, demand: Demand, keep: int, most: int) -> Spectrum:
    phases, scale = FEWEST_PHASES, response.scale_at(load)
    height = response.approach(np.arange(phases) / phases, load)[0]
    while True:
        between = (np.arange(phases) + 0.5) / phases
        more = response.approach(between, load, _midway(height))[0]
        unseen = _largest_gap(height, more)
        height = np.stack([height, more], axis=1).ravel()
        phases *= 2
        errors, good = series_errors(height, demand, scale)
        settled = (good and _probed(response, load, height, unseen, scale)) or demand.is_still(height)
        if settled or 2 * phases > most:
            kept = max(demand.total, min(keep, phases // 2))
            return Spectrum(harmonics_of(height, kept), errors, phases, False, response.solver(load).name)


def _midway(height: Array) -> Array:
    """Return the cubic through the four nearest of equally spaced values, halfway between each and the next."""
    after = np.roll(height, -1)
    return (9.0 * (height + after) - np.roll(height, 1) - np.roll(height, -2)) / 16.0


def _largest_gap(height: Array, between: Array) -> float:
    """Return the largest error (m) of the full series through `height` at the points halfway, where z is `between`."""
    count = len(height)
    shift = np.exp(1j * math.pi * np.arange(count // 2 + 1) / count)
    return float(np.max(np.abs(np.fft.irfft(np.fft.rfft(height) * shift, count) - between)))


def _probed(response: Source, load: float, height: Array, unseen: float, scale: float) -> bool:
    """Return whether the series through `height` agrees with exact solutions at phases between all grids.

    unseen: largest error of the series through every second of `height`. The error here must be at most SETTLED times
        it.
    scale: of the response.
    """
    places = np.sort(np.arange(1, PROBES + 1) * GOLDEN % 1.0)
    exact, _slope = response.approach(places, load)
    series = np.fft.rfft(height) / len(height)
    series[1:-1] *= 2.0
    n = np.arange(len(series))
    read = [float(np.dot(series, np.exp(2j * math.pi * place * n)).real) for place in places]
    gap = float(np.max(np.abs(read - exact)))
    return gap <= SETTLED * unseen + FLOOR * scale
