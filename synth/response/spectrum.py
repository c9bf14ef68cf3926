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
from synth.contact.forces import Response
from synth.kept_files import json_form

if TYPE_CHECKING:
    from synth.contact.area_forces import ForceOverArea

    Source = Response | ForceOverArea

Complex = np.ndarray[Any, np.dtype[np.complex128]]

STILL_PHASES = 1024  # least number that decides whether a finger is still
FEWEST_PHASES = 8  # doubled at least once; with fewer there is no second change to estimate the error from
MOST_PHASES = 1 << 21  # 4 s of work on the default scene; where it is too few, the error is larger than the tolerance
MOST_WORK = 1 << 29  # phases times cells of the response: 1 to 10 s; where it is too little, the error is larger
FLOOR = 1e-12  # round-off of the solver, relative to the scale of a response (of z: a1 + a2; design, section 4)
# Weights in the bound of `_errors`: of the last change, of the change before it, and of folding in each. With 1, 0.2, 2
# and 0.5 one bound in 2000 is exceeded; with the changes only, one in 60. From MANY harmonics on, with SEEN_WELL phases
# or more each, chance cancellation is rare: of 2787 such bounds the largest error was 0.92 of the bound.
SURE, SURE_OF_MANY = (1.0, 0.3, 3.0, 1.0), (0.55, 0.11, 0.55, 0.16)
MANY, SEEN_WELL = 128, 4  # harmonics, and phases of each
MISSING = 3.0  # safety factor on the harmonics above those that the phases resolve
UNSEEN = 0.25  # change of a harmonic by an event between M phases, times M^4, relative to the scale: see `_unseen`
FOLDED_SHARE = 8  # folding is measured in at least the lowest 1/8 of the harmonics that the grid resolves
PROBES = 16  # phases between all grids, at which a converged series is checked
DISCRETE_SHARE = 0.3  # share of the tolerance for the discretisation, where there is one
MOST_DISCRETE = 0.8  # share that it has where it cannot be finer, or only at a high cost; the phases keep the rest
FINER_WORK = 8  # times the work of the last refinement: room for three more refinements
JUDGED_PHASES = 384  # least number of phases at which a discretisation is tested; 3 per harmonic where that is more
SETTLED = 0.7  # of the error may remain after a doubling: a third is usual; if more remains, the grid hides a harmonic
FIRST_ORDER = 0.5  # of the error remains when a discretisation is halved, for segments of a profile with corners
UNSETTLED = 0.8  # largest assumed ratio of the next change to the last one: the error is then 4 times the last change
DOUBT = 1.15  # times the error that the changes predict, where they fall faster: up to 1.1 was seen (denim, corduroy)
SLOWER = math.sqrt(2.0)  # factor between the speeds at which the error of a slower scan is judged
GOLDEN = 0.5 * (math.sqrt(5.0) - 1.0)


@dataclass(frozen=True, slots=True)
class Demand:
    """The requirements on a series.

    highest: highest harmonic in the band at the scan's own speed, at least 1.
    orders: time derivatives (0 displacement, 1 velocity, 2 acceleration).
    tolerance: largest error of each, relative to its own peak-to-peak at the own speed.
    still: if the peak of all harmonics of z is below this (m), the finger counts as still and the series is not
        refined.
    slower: highest harmonic that counts where the scan is slower; 0: `highest`.
    """

    highest: int
    orders: tuple[int, ...]
    tolerance: float
    still: float = 0.0
    slower: int = 0

    @property
    def total(self) -> int:
        """Number of harmonics that count at any speed."""
        return max(self.highest, self.slower)

    @property
    def bands(self) -> list[tuple[int, float]]:
        """The number of harmonics in the band, and the speed over the own, at the own speed and at slower ones.

        A k-th time derivative falls with the k-th power of the speed.
        """
        counts = [self.highest]
        while counts[-1] < self.total:
            counts.append(min(math.ceil(SLOWER * counts[-1]), self.total))
        return [(count, self.highest / count) for count in counts]

    def largest(self, series: Complex, order: int) -> float:
        """Return the largest value of derivative `order` of `series` at any speed, at the scale of the own speed."""
        return max(
            speed**order * float(np.max(np.abs(curves(series[: count + 1], order, points_for(count)))))
            for count, speed in self.bands
        )

    def is_still(self, height: Array) -> bool:
        """Return whether z at equal steps of a period (m), enough of them to judge, moves by less than `still`."""
        enough = len(height) >= max(STILL_PHASES, 4 * self.total)
        return self.still > 0.0 and enough and self.of_still(harmonics_of(height, self.total))

    def of_still(self, harmonics: Complex) -> bool:
        """Return whether the harmonics of the demand, of z (m), have a peak below `still`."""
        moved = curves(harmonics[: self.total + 1], 0, points_for(self.total))
        return float(np.max(np.abs(moved))) < self.still


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


def curves(harmonics: Complex, order: int, points: int) -> Array:
    """Return the `order`-th derivative over theta (in turns), without the mean, at `points` equal steps of a period."""
    count = len(harmonics)
    series = np.zeros(points // 2 + 1, dtype=np.complex128)
    n = np.arange(1, count)
    series[1:count] = harmonics[1:] * (2j * math.pi * n) ** order
    return np.fft.irfft(series, points) * points


def points_for(highest: int) -> int:
    """Return the number of points that resolve `highest` harmonics: a power of two, at least 4 per harmonic."""
    return max(64, 1 << (4 * highest).bit_length())


def solve_spectrum(response: Source, load: float, demand: Demand, keep: int = 0) -> Spectrum:
    """Return the series of `response` at `load` (N) that meets `demand`, or the best within the limits on work.

    keep: number of harmonics returned, at least those of the demand. Harmonics above the demand have no error bound.
    """
    keep = max(keep, demand.total)
    closed = response.closed(load)
    if closed is not None:
        harmonics = np.zeros(keep + 1, dtype=np.complex128)
        harmonics[:2] = closed.mean, closed.first
        return Spectrum(harmonics, (1e-15,) * len(demand.orders), 0, True, "closed form")
    coarse, finer = response, response.refined()
    if finer is None and response.refines:  # it is the finest: larger ones show its error
        coarse, finer = response.doubled(), response
    if coarse is not None and finer is not None:
        return _refined(coarse, finer, load, demand, keep)
    return _grown(response, load, demand, keep, min(MOST_PHASES, max(256, MOST_WORK // response.work_at(load))))


def _refined(coarse: Source, finer: Source, load: float, demand: Demand, keep: int) -> Spectrum:
    """Return the series of a response whose solver has a discretisation, whose error is added to its own."""
    chosen, left = _discretised(coarse, finer, load, demand)
    spent = min(max(max(left), DISCRETE_SHARE * demand.tolerance), MOST_DISCRETE * demand.tolerance)
    rest = replace(demand, tolerance=demand.tolerance - spent)
    found = _grown(chosen, load, rest, keep, min(MOST_PHASES, max(256, MOST_WORK // chosen.work_at(load))))
    errors = tuple(one + rest for one, rest in zip(found.errors, left, strict=True))
    return replace(found, errors=errors, discrete=left)


def _discretised(coarse: Source, finer: Source, load: float, demand: Demand) -> tuple[Source, tuple[float, ...]]:
    """Return the response on a discretisation that keeps its share of the tolerance, and the error that it leaves.

    The discretisation is halved until the error that `remaining` returns is within its share of the tolerance. That is
    MOST_DISCRETE for columns and cells, whose halving takes four times the work and more. The discretisation is judged
    at phases that are no multiples of a segment, a column or a node.
    """
    count = max(JUDGED_PHASES, 3 * points_for(demand.total) // 4)
    phases = (np.arange(count) + GOLDEN) / count
    height = coarse.approach(phases, load)[0]
    series, earlier = harmonics_of(height, demand.total), None
    share = DISCRETE_SHARE if coarse.settles >= FIRST_ORDER else MOST_DISCRETE
    settles = max(finer.settles, finer.begins)
    while True:
        height = finer.approach(phases, load, height)[0]
        before, series = series, harmonics_of(height, demand.total)
        changed, allowed = changes(before, series, demand, finer.scale_at(load), share=share)
        left = remaining(changed, earlier, settles)
        good = all(one <= most for one, most in zip(left, allowed, strict=True))
        settles = settles if earlier is None else finer.settles
        finest = finer.work_at(load) * count * FINER_WORK > MOST_WORK
        following = None if good or finest or demand.is_still(height) else finer.refined()
        if following is None:
            return finer, left
        finer, earlier = following, changed


def remaining(changed: tuple[float, ...], earlier: tuple[float, ...] | None, settles: float) -> tuple[float, ...]:
    """Return what error remains after the last halving of a discretisation.

    changed, earlier: by the last halving and by the one before it; None: there was none.
    settles: least part of the error that a halving leaves. At 1/2 the last change is the bound, because the error of
        every continuous profile at least halves. Below 1/2 the errors are assumed to keep falling as the changes did,
        with DOUBT.
    """
    if settles >= FIRST_ORDER or earlier is None:
        return changed
    parts = (
        min(max(settles, one / before if before > 0.0 else settles), UNSETTLED)
        for one, before in zip(changed, earlier, strict=True)
    )
    return tuple(DOUBT * one * part / (1.0 - part) for one, part in zip(changed, parts, strict=True))


def changes(
    before: Complex,
    after: Complex,
    demand: Demand,
    scale: float,
    usual: Complex | None = None,
    share: float = DISCRETE_SHARE,
) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return the largest change of each order, and the share of the tolerance, both relative to the peak-to-peak.

    usual: a series whose peak-to-peak is used instead where it is larger.
    share: of the tolerance.
    """
    points, kept = points_for(demand.highest), demand.highest + 1
    found, allowed = [], []
    for order in demand.orders:
        change = demand.largest(after - before, order)
        extent = float(np.ptp(curves(after[:kept], order, points)))
        if usual is not None:
            extent = max(extent, float(np.ptp(curves(usual[:kept], order, points))))
        found.append(change / extent if extent > 0.0 else 0.0)
        floor = error_floor(scale, demand.highest, order)
        allowed.append(share * demand.tolerance + (floor / extent if extent > 0.0 else 0.0))
    return tuple(found), tuple(allowed)


def _grown(response: Source, load: float, demand: Demand, keep: int, most: int) -> Spectrum:
    phases, scale = FEWEST_PHASES, response.scale_at(load)
    height = response.approach(np.arange(phases) / phases, load)[0]
    while True:
        between = (np.arange(phases) + 0.5) / phases
        more = response.approach(between, load, _midway(height))[0]
        unseen = _largest_gap(height, more)
        height = np.stack([height, more], axis=1).ravel()
        phases *= 2
        errors, good = _errors(height, demand, scale)
        settled = (good and _probed(response, load, height, unseen, scale)) or demand.is_still(height)
        if settled or 2 * phases > most:
            return Spectrum(harmonics_of(height, keep), errors, phases, False, response.solver(load).name)


def harmonics_of(samples: Array, highest: int) -> Complex:
    """Return harmonics 0 to `highest` of one period of samples; those above the Nyquist harmonic are zero.

    The Nyquist harmonic is halved, since it is the sum of its two sides. It is kept, so that a strong harmonic there is
    not missed.
    """
    found = np.fft.rfft(samples) / len(samples)
    found[-1] *= 0.5
    series = np.zeros(highest + 1, dtype=np.complex128)
    kept = min(highest + 1, len(found))
    series[:kept] = found[:kept]
    return series


def _missing(height: Array, highest: int, order: int) -> float:
    """Return an estimate of the part of derivative `order` in harmonics above those that the phases resolve.

    They are assumed to fall as those of a kink, from the largest of the last known harmonics, with random phases.
    """
    seen = len(height) // 2
    if highest < seen:
        return 0.0
    last = float(np.max(np.abs(harmonics_of(height, seen - 1)[3 * seen // 4 :])))
    n = np.arange(seen, highest + 1)
    sizes = last * (n / seen) ** -2.5 * (2.0 * math.pi * n) ** order
    return 2.0 * math.sqrt(float(np.sum(sizes**2)))


def _unseen(height: Array, highest: int, order: int, scale: float) -> float:
    """Return the most that an event between two phases adds to derivative `order` of harmonics 1 to `highest`.

    Just below full contact two valleys part for a short time while they pass each other. If this time is a part 1/M of
    a period, the gap between them is about M^-2 deep and M^-1 wide, z moves by M^-3 of the scale, and each harmonic up
    to M changes by M^-4.
    """
    n = 2.0 * math.pi * np.arange(1, min(highest, len(height)) + 1)
    return 2.0 * UNSEEN * scale * float(np.sum(n**order)) / float(len(height)) ** 4


def _midway(height: Array) -> Array:
    """Return the cubic through the four nearest of equally spaced values, halfway between each and the next."""
    after = np.roll(height, -1)
    return (9.0 * (height + after) - np.roll(height, 1) - np.roll(height, -2)) / 16.0


def error_floor(scale: float, highest: int, order: int) -> float:
    """Return the round-off error in a derivative over theta: FLOOR of `scale` (for z: a1 + a2) in the response."""
    return FLOOR * scale * (2.0 * math.pi * highest) ** order


def _errors(height: Array, demand: Demand, scale: float) -> tuple[tuple[float, ...], bool]:
    """Return the error bound of each order relative to its peak-to-peak, and whether all are within the tolerance.

    The error is the folding of harmonics around the number of phases and its multiples. The last two doublings removed
    the folding of harmonics around half and a quarter of that number. The bound uses the largest change of the curve.
    A few harmonics may change little by chance. The bound therefore also uses the change that harmonics of random phase
    would cause if they folded as strongly as their neighbours.
    """
    series = tuple(harmonics_of(height[::step], demand.total) for step in (1, 2, 4))
    now, points = series[0][: demand.highest + 1], points_for(demand.highest)
    errors, good = [], True
    for order in demand.orders:
        error = max(
            speed**order * _error(height, tuple(one[: count + 1] for one in series), order, scale)
            for count, speed in demand.bands
        )
        extent = float(np.ptp(curves(now, order, points)))
        good = good and error <= demand.tolerance * extent + error_floor(scale, demand.highest, order)
        errors.append(error / extent if extent > 0.0 else 0.0)
    return tuple(errors), good


def _error(height: Array, series: tuple[Complex, ...], order: int, scale: float) -> float:
    """Return the error bound of derivative `order` over theta; series: of all phases, every second and every fourth."""
    now, before, earlier = series
    highest = len(now) - 1
    points, n = points_for(highest), 2.0 * math.pi * np.arange(1, highest + 1)
    many = highest >= MANY and len(height) > SEEN_WELL * highest
    last = float(np.max(np.abs(curves(now - before, order, points))))
    previous = float(np.max(np.abs(curves(before - earlier, order, points))))
    together = 2.0 * math.sqrt(float(np.sum(n ** (2 * order))))
    folded = _folded(height, highest), _folded(height[::2], highest)
    parts = (last, previous, together * folded[0], together * folded[1])
    error = max(weight * part for weight, part in zip(SURE_OF_MANY if many else SURE, parts, strict=True))
    error = max(error, MISSING * _missing(height, highest, order))
    return error + _unseen(height, highest, order, scale)


def _folded(height: Array, highest: int) -> float:
    """Return the rms change (m) of a harmonic in the last doubling, which removed the part that had folded into it."""
    half = len(height) // 2
    most = min(max(min(highest, half // 2), half // FOLDED_SHARE, 4), half // 2 - 1)
    took = harmonics_of(height, most)[1:] - harmonics_of(height[::2], most)[1:]
    return float(np.sqrt(np.mean(np.abs(took) ** 2)))


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
