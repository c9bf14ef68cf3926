"""The spectrum of a map at its pixel, and the self-affine spectrum that continues it.

Stage   SURFACES.
Model   The power of the wave (qx, qy) of a map is |H|^2, where H is its amplitude in the Fourier series of the map. The
        pixel's wave number is Nyquist's, qN = pi / pixel. Below the pixel, the power of a wave is

            level (q / qN)^-(2 + 2 hurst),   q = |(qx, qy)|,

        for the waves that the map cannot hold: |qx| or |qy| above pi / pixel along that axis. `level` is the power of
        the map at qN: a straight line through the logarithms of its mean power in BANDS bands from qN / 2 to qN, at qN.
        A band that an enlarged or smoothed map has nearly empty counts as the steepest self-affine law (hurst 1)
        through the fullest of the bands from qN / 8 on.
        The rms slope is that along one axis, the mean of both: of a surface that is bilinear between its points.
Source  Persson et al. 2005 (J. Phys.: Condens. Matter 17, R1): the power of a self-affine surface falls as
        q^-(2 + 2 H). The fit is this project's.
Limits  A map of few waves, such as a grating, has no such law: its bands count as they are.
        The spectrum below the pixel is the same in every direction, and at every place.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from synth.surfaces.profile import Array

BANDS = 8  # for the fit of the level; a band of a map of 64 x 64 has 100 waves and more
EDGES = np.linspace(0.125, 1.0, 15)  # of bands, in wave numbers of the pixel; the last BANDS are those of the fit
STEEPEST = 4.0  # exponent of the power of a self-affine surface of Hurst exponent 1
FULL, EMPTY = (
    math.log(10.0**0.4),
    math.log(10.0),
)  # 4 and 10 dB below the law; what mirroring adds is 9 dB below at 64^2
LEAST = 1e-60  # m^2: no power
MOST_UNEVEN = 10.0  # mean square of the power in a band by its square mean: 2 to 3 for random waves
BINS = 4096  # of log q, for sums over waves: within one, q differs by 0.1 %
HALVINGS = 60  # of the range of the Hurst exponent
ROWS = 256  # of waves that are summed together: 4 MB


@dataclass(frozen=True, slots=True)
class Waves:
    """The waves of a periodic grid of points, as `rfft2` orders them.

    counts: points along x and y.
    steps: distances between points along x and y, m.
    """

    counts: tuple[int, int]
    steps: tuple[float, float]

    @property
    def x(self) -> Array:
        """Wave numbers along x, 1/m [columns // 2 + 1]."""
        return np.asarray(2.0 * math.pi * np.fft.rfftfreq(self.counts[0], self.steps[0]))

    @property
    def y(self) -> Array:
        """Wave numbers along y, 1/m [rows]."""
        return np.asarray(2.0 * math.pi * np.fft.fftfreq(self.counts[1], self.steps[1]))

    @property
    def pixel(self) -> float:
        """Wave number of the larger pixel (Nyquist's), 1/m."""
        return math.pi / max(self.steps)

    @property
    def twice(self) -> Array:
        """How many waves of the grid each column of `rfft2` stands for: 2, and 1 for the first and for Nyquist's."""
        found = np.full(self.counts[0] // 2 + 1, 2.0)
        found[0] = 1.0
        if self.counts[0] % 2 == 0:
            found[-1] = 1.0
        return found


@dataclass(frozen=True, slots=True)
class Bands:
    """The power of a map in bands of wave numbers; those without a wave are left out.

    at: mean log of q / qN. counts: number of waves. edges: upper q / qN.
    power: log of the mean power, m^2, as it counts for the fit: LEAST for none.
    emptiness: 0 for a band that is full, 1 for one that is empty and counts as the law.
    """

    at: Array
    counts: Array
    power: Array
    emptiness: Array
    edges: Array

    @classmethod
    def of(cls, heights: Array, steps: tuple[float, float]) -> Bands:
        """Return the bands; heights: of one period, m [rows, columns]. steps: between its columns, then rows, m."""
        waves = Waves((heights.shape[1], heights.shape[0]), steps)
        power = np.abs(np.fft.rfft2(heights) / heights.size) ** 2
        edges, sums = waves.pixel * EDGES, np.zeros((4, len(EDGES) - 1))
        for first in range(0, len(power), ROWS):
            q = np.hypot(waves.x, waves.y[first : first + ROWS, np.newaxis])
            band = np.searchsorted(edges, q, "right") - 1
            held = (band >= 0) & (band < len(edges) - 1)
            twice, some, own = (
                np.broadcast_to(waves.twice, q.shape)[held],
                band[held],
                power[first : first + ROWS][held],
            )
            for row, values in enumerate((np.ones(len(own)), np.log(q[held] / waves.pixel), own, own**2)):
                sums[row] += np.bincount(some, twice * values, sums.shape[1])
        known = sums[0] > 0.0
        counts, places, total, squares = sums[:, known]
        at, own = places / counts, np.log(np.maximum(total / counts, LEAST))
        even = (counts * squares <= MOST_UNEVEN * total**2) & (own > math.log(LEAST))
        law = np.max((own + STEEPEST * at)[even], initial=-np.inf) - STEEPEST * at
        emptiness = np.clip((law - own - FULL) / (EMPTY - FULL), 0.0, 1.0)
        return cls(at, counts, own + emptiness * (np.maximum(law, own) - own), emptiness, EDGES[1:][known])


def level_at_pixel(heights: Array, steps: tuple[float, float]) -> float:
    """Return the power (m^2) of a wave of the map at its pixel's wave number; 0 for a map without waves there.

    The arguments are those of `Bands.of`.
    """
    bands = Bands.of(heights, steps)
    known = (bands.edges > 0.5) & (bands.power > math.log(LEAST))
    if not np.any(known):
        return 0.0
    x, y = bands.at[known], bands.power[known]
    if len(x) < 3:
        return float(np.exp(np.mean(y)))
    return float(np.exp(np.polyfit(x, y, 1, w=np.sqrt(bands.counts[known]))[1]))


def finest_wave(heights: Array, steps: tuple[float, float]) -> float:
    """Return the length (m) of the waves from which on the map is empty; two pixels for a map that is nowhere empty.

    The arguments are those of `Bands.of`.
    """
    bands = Bands.of(heights, steps)
    return float(2.0 * max(steps) / np.max(bands.edges[bands.emptiness < 1.0], initial=EDGES[0]))


def below_pixel(
    fine: Waves, pixel: Waves, shortest: float, row: int
) -> np.ndarray[tuple[int, int], np.dtype[np.bool_]]:
    """Return which waves of ROWS rows of `fine` the map cannot hold, and are not shorter than `shortest` (m).

    pixel: the waves of the map. row: the first of the rows.
    """
    y = np.abs(fine.y[row : row + ROWS, np.newaxis])
    beyond = (fine.x > (1.0 + 1e-9) * math.pi / pixel.steps[0]) | (y > (1.0 + 1e-9) * math.pi / pixel.steps[1])
    q = np.hypot(fine.x, y)
    whole = (fine.x < (1.0 - 1e-9) * math.pi / fine.steps[0]) & (y < (1.0 - 1e-9) * math.pi / fine.steps[1])
    return np.asarray(beyond & whole & (q <= (1.0 + 1e-9) * 2.0 * math.pi / shortest))


@dataclass(frozen=True, slots=True)
class SlopeSums:
    """Sums over the waves below the pixel, from which the rms slope follows for every Hurst exponent.

    at: q / qN of each bin. squares: 1/m^2, sum of the squared slopes of its waves, of amplitude 1.
    """

    at: Array
    squares: Array

    @classmethod
    def of(cls, fine: Waves, pixel: Waves, shortest: float) -> SlopeSums:
        """Return the sums of the waves of `below_pixel`."""
        highest = max(2.0 * math.pi / shortest / pixel.pixel, 1.0 + 1e-6)
        edges = np.geomspace(1.0 - 1e-6, highest * (1.0 + 1e-6), BINS + 1)
        squares = np.zeros(BINS)
        of_x, along_x = _bilinear(fine.x, fine.steps[0])
        for row in range(0, fine.counts[1], ROWS):
            held = below_pixel(fine, pixel, shortest, row)
            y = fine.y[row : row + ROWS, np.newaxis]
            of_y, along_y = _bilinear(y, fine.steps[1])
            slope = 0.5 * fine.twice * (of_x * along_y + of_y * along_x)
            bins = np.searchsorted(edges, np.hypot(fine.x, y)[held] / pixel.pixel) - 1
            squares += np.bincount(np.clip(bins, 0, BINS - 1), slope[held], BINS)
        return cls(np.sqrt(edges[1:] * edges[:-1]), squares)

    def slope(self, level: float, hurst: float) -> float:
        """Return the rms slope along one axis; level: m^2."""
        return math.sqrt(level * float(np.sum(self.squares * self.at ** (-2.0 - 2.0 * hurst))))


def _bilinear(q: Array, step: float) -> tuple[Array, Array]:
    """Return the mean square slope of a wave between points, and its mean square height relative to that at points."""
    turn = q * step
    return np.asarray((2.0 * np.sin(0.5 * turn) / step) ** 2), np.asarray((2.0 + np.cos(turn)) / 3.0)


def slope_down_to(level: float, hurst: float, pixel: Waves, shortest: float) -> float:
    """Return the rms slope along one axis of all waves from the pixel's down to `shortest` (m), as an integral."""
    per_wave = math.prod(2.0 * math.pi / (count * step) for count, step in zip(pixel.counts, pixel.steps, strict=True))
    ratio, grows = 2.0 * math.pi / shortest / pixel.pixel, 2.0 - 2.0 * hurst
    octaves = math.log(ratio) if grows < 1e-9 else math.expm1(grows * math.log(ratio)) / grows
    return math.sqrt(math.pi * level / per_wave * pixel.pixel**4 * octaves)


def hurst_of(slope: float, of_hurst: Callable[[float], float]) -> float:
    """Return the Hurst exponent, 0 to 1, whose slope is nearest to `slope`; of_hurst: returns the slope, falling."""
    low, high = 0.0, 1.0
    if slope >= of_hurst(low):
        return low
    if slope <= of_hurst(high):
        return high
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if of_hurst(middle) > slope else (low, middle)
    return 0.5 * (low + high)
