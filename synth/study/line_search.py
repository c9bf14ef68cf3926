"""Lines at multiples of one frequency in a measured signal: found, or not claimed, at a stated rate of false alarms.

Stage   STUDY, used by `comparison`.
Model   Welch's spectrum: segments of SEGMENT s, Hann windows, half overlapped. The noise at a frequency is the median
        of the spectrum around it, over the median of its distribution (chi-squared). The power of a line is the sum
        over its bins, less the noise; a line may drift by DRIFT of its frequency. The fundamental is searched within a
        range, at steps of half a bin of the highest multiple: the one with the largest sum of the logarithms of the
        powers over the noise. A line is found where its power would occur by chance in less than ALARMS of all
        recordings, over all lines and all fundamentals that were tried.
        What is beside the mains does not count for a claim.
        Noise whose level varies has fewer degrees of freedom, by the part of the recording that has its power.
Source  Welch (1967), IEEE Trans. Audio Electroacoust. 15; equivalent degrees of freedom of overlapped Hann segments:
        Percival & Walden (1993), Spectral Analysis for Physical Applications.
Limits  Noise that is level around a line. Mains hum is left out: lines within LOBE bins of multiples of 50 and 60 Hz.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from synth.arrays import Array
from synth.study.recording_doubts import BLOCK, MAINS

SEGMENT, LEAST_SEGMENTS = 1.0, 4  # s; a shorter recording has shorter segments
OVERLAPPED = 36.0 / 19.0  # degrees of freedom of each Hann segment that half overlaps the next, for many segments
ALARMS = 0.01  # part of recordings of noise in which a line is claimed
DRIFT = 0.015  # of the frequency: how far a line may be spread to each side, by a speed that drifts by 1 %
AROUND = 64  # bins on each side over which the noise is judged
LOBE = 2  # bins on each side of a line that does not drift
SEARCHED = 12  # multiples by which the fundamental is found
WIDE, APART = 0.2, 0.4  # how far around a line its spread is looked for: of its frequency, and of the fundamental
SPREAD = 0.1  # least part of the power of a line that is told where it is around it: the line is 0.4 dB too low
CENTRED, OF_CENTRE = 4, 3  # times that the centre of lines that are spread is sought, and how many of them
LEAST_APART = 0.1  # of the power of a line that is not beside the mains; below, a line beside 600 Hz may be hum alone


@dataclass(frozen=True, slots=True)
class Spectrum:
    """A Welch spectrum.

    hertz, density: one-sided, unit^2/Hz.
    freedom: equivalent degrees of freedom.
    steady: part of the recording that has its power; 1 where its level does not vary.
    noise: level at each frequency without lines.
    """

    hertz: Array
    density: Array
    freedom: float
    noise: Array
    steady: float = 1.0

    @property
    def bin(self) -> float:
        """Distance of frequencies, Hz."""
        return float(self.hertz[1])

    def interval(self, part: float = 0.95) -> tuple[float, float]:
        """Return the factors on the density between which the true one is with a probability of `part`."""
        from scipy.stats import chi2

        low, high = chi2.ppf([0.5 * (1.0 - part), 0.5 * (1.0 + part)], self.freedom)
        return self.freedom / float(high), self.freedom / float(low)


@dataclass(frozen=True, slots=True)
class Line:
    """One multiple of the fundamental.

    number: n. frequency: Hz.
    amplitude: of the sinusoid, in units of the signal; 0 where nothing is above the noise.
    low, high: 95 % interval of the amplitude.
    found: whether it is claimed.
    mains: whether it is left out, beside hum.
    """

    number: int
    frequency: float
    amplitude: float
    low: float
    high: float
    found: bool
    mains: bool


def spectrum_of(values: Array, rate: float) -> Spectrum:
    """Return the Welch spectrum of `values` at `rate` (Hz)."""
    from scipy.ndimage import median_filter
    from scipy.signal import welch
    from scipy.stats import chi2

    length = segment_of(len(values), rate)
    hertz, density = welch(values, rate, "hann", length, length // 2, detrend="linear")
    segments = max(1, (len(values) - length // 2) // (length - length // 2))
    steady = _steady(values, max(1, round(BLOCK * rate)))
    freedom = max(OVERLAPPED * segments * steady, 2.0) if segments > 1 else 2.0
    median = median_filter(density, 2 * AROUND + 1, mode="nearest")
    noise = median / (chi2.median(freedom) / freedom)
    return Spectrum(np.asarray(hertz), np.asarray(density), freedom, np.asarray(np.maximum(noise, 1e-300)), steady)


def segment_of(samples: int, rate: float) -> int:
    """Return the samples of a segment."""
    return max(16, min(round(SEGMENT * rate), 2 * samples // (LEAST_SEGMENTS + 1)))


def _steady(values: Array, block: int) -> float:
    """Return the part of a recording that has its power: (sum of p)^2 / (n sum of p^2) over blocks of power p."""
    whole = values[: len(values) // block * block].reshape(-1, block)
    power = np.mean(whole**2, axis=1)
    square = float(np.sum(power**2))
    return min(1.0, float(np.sum(power)) ** 2 / (len(power) * square)) if square > 0.0 else 1.0


def fundamental_of(spectrum: Spectrum, low: float, high: float, count: int) -> tuple[float, int]:
    """Return the fundamental (Hz) between two frequencies whose multiples stand out most, and how many were tried.

    count: multiples that may be there.
    """
    used = max(1, min(count, SEARCHED, int(0.95 * spectrum.hertz[-1] / high)))
    steps = max(2, math.ceil((high - low) * used / (0.5 * spectrum.bin)))
    tried = np.linspace(low, high, steps + 1)
    ratio = np.maximum(spectrum.density / spectrum.noise, 1.0)
    ratio[beside_mains(spectrum.hertz, LOBE * spectrum.bin)] = 1.0
    wide = np.log(np.maximum.reduce([np.roll(ratio, shift) for shift in (-1, 0, 1)]))
    n = np.arange(1, used + 1)
    scores = np.sum(np.interp(np.outer(tried, n), spectrum.hertz, wide), axis=1)
    best = float(tried[int(np.argmax(scores))])
    return _nearer(spectrum, best, used), steps + 1


def _nearer(spectrum: Spectrum, fundamental: float, used: int) -> float:
    """Return the fundamental from the centres of its lines, weighted by power and by the square of their number."""
    above, below = 0.0, 0.0
    for n in range(1, used + 1):
        near = _bins(spectrum, n * fundamental, 0.5 * DRIFT)
        over = np.maximum(spectrum.density[near] - 2.0 * spectrum.noise[near], 0.0) / spectrum.noise[near]
        if near.size == 0 or not over.any() or beside_mains(np.array([n * fundamental]), LOBE * spectrum.bin)[0]:
            continue
        centre, weight = float(np.average(spectrum.hertz[near], weights=over)), n * n * float(np.sum(over))
        above, below = above + weight * centre / n, below + weight
    return above / below if below > 0.0 else fundamental


def lines_at(spectrum: Spectrum, fundamental: float, count: int, tried: int) -> list[Line]:
    """Return the lines at 1 to `count` times `fundamental` (Hz); tried: fundamentals among which it was chosen."""
    from scipy.stats import chi2

    found, chance = [], ALARMS / (count * tried)
    for n in range(1, count + 1):
        frequency = n * fundamental
        near = _bins(spectrum, frequency, DRIFT)
        mains = bool(beside_mains(np.array([frequency]), LOBE * spectrum.bin)[0])
        noise = float(np.sum(spectrum.noise[near]))
        power = float(np.sum(spectrum.density[near]))
        apart = np.compress(beside_mains(spectrum.hertz[near], LOBE * spectrum.bin) == 0.0, near)
        power_apart, noise_apart = (float(np.sum(of[apart])) for of in (spectrum.density, spectrum.noise))
        freedom = _freedom(spectrum, apart)
        most = float(chi2.isf(chance, freedom)) / freedom
        freedom = _freedom(spectrum, near)
        own = max(power - noise, 0.0) * spectrum.bin  # mean square
        beside = math.sqrt(noise / max(power, 1e-300) / freedom)
        spread = noise * spectrum.bin * math.sqrt(2.0 / freedom) + 2.0 * own * beside
        low, high = (math.sqrt(2.0 * max(own + sign * 1.96 * spread, 0.0)) for sign in (-1.0, 1.0))
        claimed = power_apart > max(most * noise_apart, LEAST_APART * power) and not mains
        found.append(Line(n, frequency, math.sqrt(2.0 * own), low, high, claimed, mains))
    return found


def spread_of(spectrum: Spectrum, lines: list[Line]) -> tuple[Line, float] | None:
    """Return the line that is spread most beyond its bins, and how far it is too low (dB); None where none is.

    A speed that varies by more than DRIFT, or a level that does, moves power from a line to the frequencies around it.
    """
    from scipy.stats import chi2

    worst, sizes = None, [0.0, *(line.amplitude for line in lines), 0.0]
    for line in lines:
        if not line.found or line.amplitude < max(sizes[line.number - 1], sizes[line.number + 1]):
            continue  # what is around it may be its neighbour's
        reach = min(WIDE * line.frequency, APART * lines[0].frequency)
        around = np.setdiff1d(_within(spectrum, line.frequency, reach), _bins(spectrum, line.frequency, DRIFT))
        around = np.compress(beside_mains(spectrum.hertz[around], LOBE * spectrum.bin) == 0.0, around)
        if around.size == 0:
            continue
        power, noise = (float(np.sum(of[around])) for of in (spectrum.density, spectrum.noise))
        freedom = _freedom(spectrum, around)
        part = (power - noise) * spectrum.bin / (0.5 * line.amplitude**2)
        certain = power > noise * float(chi2.isf(ALARMS / len(lines), freedom)) / freedom
        lower = 10.0 * math.log10(1.0 + max(part, 0.0))
        if certain and part > SPREAD and (worst is None or lower > worst[1]):
            worst = (line, lower)
    return worst


def mean_fundamental(spectrum: Spectrum, fundamental: float, lines: list[Line]) -> float:
    """Return the mean of a fundamental (Hz) that varies: the centre of the power around its first lines."""
    for _turn in range(CENTRED):
        above, below = 0.0, 0.0
        for n in (line.number for line in lines[:OF_CENTRE] if not line.mains):
            near = _within(spectrum, n * fundamental, min(WIDE * n, APART) * fundamental)
            near = np.compress(beside_mains(spectrum.hertz[near], LOBE * spectrum.bin) == 0.0, near)
            over = np.maximum(spectrum.density[near] - 2.0 * spectrum.noise[near], 0.0)
            above, below = above + float(spectrum.hertz[near] @ over) / n, below + float(np.sum(over))
        fundamental = above / below if below > 0.0 else fundamental
    return fundamental


def _freedom(spectrum: Spectrum, bins: Array) -> float:
    """Return the degrees of freedom of the sum over `bins`."""
    return max(2.0, spectrum.freedom * max(1.0, bins.size / 1.5 * spectrum.steady))


def _bins(spectrum: Spectrum, frequency: float, drift: float) -> Array:
    """Return the indices of the bins of a line."""
    return _within(spectrum, frequency, LOBE * spectrum.bin + min(drift * frequency, 0.3 * frequency))


def _within(spectrum: Spectrum, frequency: float, reach: float) -> Array:
    """Return the indices of the bins within `reach` (Hz) of a frequency."""
    return np.asarray(np.flatnonzero(np.abs(spectrum.hertz - frequency) <= reach + 1e-9))


def beside_mains(hertz: Array, near: float) -> Array:
    """Return whether each frequency is within `near` (Hz) of a multiple of the mains."""
    apart = [np.abs(hertz - base * np.maximum(np.round(hertz / base), 1.0)) for base in MAINS]
    return np.asarray(np.minimum(*apart) <= near)
