"""The wave in the skin: motion at a distance from the contact, as a gain over frequency and as a causal filter.

Stage   3 (VOICE), used only by the effect `propagation`.
Model   s = 2 pi i f. W is the wave, B the part of the finger that moves as one body, D the delay:
            gain = W + B (1 - W),    W = (r / R)^-far P(s) exp(-s D),    D = (r - R) / c,    far = near + RISE
            P = (s^2 + s w K^(1/2) / Q + w^2) / (s^2 + s w K^(-1/2) / Q + w^2),    K = (r / R)^RISE,    w = 2 pi BEST
            B = v^2 / (s^2 + 2^(1/2) s v + v^2),    v = 2 pi body;    B = 0 where body is 0
        So |W| = (r / R)^-near at BEST and (r / R)^-far away from it. Below `body` the motion is that of the contact.
        Apart from D, W and B have no zeros in the right half-plane: no causal filter with these amplitudes is faster.
        Within R nothing changes: gain = 1.
        Filter: TAPS taps approximate the delay, which need not be a whole number of frames, by least squares in the
        band. P and B are bilinear transforms that keep BEST and `body`.
Source  Power of the distance, lowest near 200 to 250 Hz, and c: Manfredi et al. (2012), doi
        10.1371/journal.pone.0031203. The skin under the contact moves as one, so the delay counts from R: Saal
        et al. (2017), doi 10.1073/pnas.1704856114, in its code. P, B: second-order forms, unverified defaults.
Limits  Speed and direction do not depend on frequency; no reflections. The error of the filter is `SkinFilter.error`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from synth.arrays import Array
from synth.kernels import signed_kernel
from synth.response.demand import Complex

BEST = 225.0  # Hz, middle of the 200 to 250 Hz at which vibration decays least (Manfredi et al., 2012)
RISE = 0.2  # of the exponent away from BEST: 1.3 against 1.1, the two exponents of Manfredi et al. (2012), figure 3
Q = 1.0  # of the resonance at BEST, 1.5 octaves wide; unverified default: larger makes it narrower
TAPS = 24  # of the delay; with 16 the error of the default at full band is 5e-3, not 2e-3
WIDER = 2.0  # of the band for which taps are made: moving scans and hands fade out up to twice the band
WIDEST = 0.45  # of the rate: taps for more would ring
STOP = 1e-8  # weight of the power of the taps, which keeps them small where there is no motion
PROBED = 512  # frequencies of a band at which the filter is compared with the gain
QUIET = 1e-12  # of full scale: below it the end of a sound becomes exact zero


@dataclass(frozen=True, slots=True)
class SkinWave:
    """The way from a contact to a place on the skin.

    ratio: distance over the radius of the contact, r / R; up to 1 the place is in the contact.
    delay: D, s.
    near: exponent of the distance at BEST.
    body: frequency (Hz) below which the place moves with the contact; 0: nowhere.
    """

    ratio: float
    delay: float
    near: float
    body: float

    @classmethod
    def of(cls, distance: float, radius: float, speed: float, near: float, body: float) -> SkinWave:
        """Return the way to `distance` (m) from the middle of a contact of `radius` (m), at a wave speed (m/s)."""
        return cls(distance / radius, max(distance - radius, 0.0) / speed, near, body)

    @property
    def inside(self) -> bool:
        """True if the place is in the contact."""
        return self.ratio <= 1.0

    @property
    def least(self) -> float:
        """The amplitude of the wave away from BEST."""
        return float(self.ratio ** -(self.near + RISE))

    @property
    def resonance(self) -> tuple[float, float]:
        """The damping of numerator and denominator of P, relative to w."""
        root = self.ratio ** (0.5 * RISE)
        return root / Q, 1.0 / (root * Q)

    def gain(self, frequency: Array) -> Complex:
        """Return the complex gain at each frequency (Hz; negative ones are conjugate)."""
        if self.inside:
            return np.ones(np.shape(frequency), np.complex128)
        s = 1j * np.asarray(frequency) / BEST
        above, below = self.resonance
        wave = self.least * (s * s + above * s + 1.0) / (s * s + below * s + 1.0)
        wave = wave * np.exp(-2j * math.pi * self.delay * np.asarray(frequency))
        if self.body == 0.0:
            return np.asarray(wave)
        s = 1j * np.asarray(frequency) / self.body
        return np.asarray(wave + (1.0 - wave) / (s * s + math.sqrt(2.0) * s + 1.0))


@dataclass(frozen=True, slots=True)
class SkinFilter:
    """The causal filter of a way.

    first: delay of the first tap, frames.
    taps: float64 [TAPS], each a frame later than the one before.
    wave: b0, b1, b2, a1, a2 of the amplitude of the wave.
    body: the same of B; zeros if there is none.
    error: largest difference of its gain from that of the way, within the band.
    largest: largest gain within the band.
    """

    first: int
    taps: Array
    wave: Array
    body: Array
    error: float
    largest: float

    @classmethod
    def of(cls, way: SkinWave, rate: int, band: float) -> SkinFilter:
        """Return the filter at `rate` (Hz) for motion below `band` (Hz)."""
        late = way.delay * rate
        first = max(0, math.ceil(late) - TAPS // 2)
        taps = _delay_taps(late - first, min(WIDER * band / rate, WIDEST))
        above, below = way.resonance
        wave = way.least * _section((1.0, above, 1.0), below, BEST / rate)
        body = _section((0.0, 0.0, 1.0), math.sqrt(2.0), way.body / rate) if way.body else np.zeros(5)
        wave[3:] /= way.least
        made = cls(first, taps, wave, body, 0.0, 0.0)
        frequency = np.linspace(0.0, band, PROBED)
        wanted = way.gain(frequency)
        error = float(np.max(np.abs(made.gain(frequency / rate) - wanted)))
        return cls(first, taps, wave, body, error, float(np.max(np.abs(wanted))))

    def gain(self, frequency: Array) -> Complex:
        """Return the complex gain at frequencies relative to the rate."""
        z = np.exp(-2j * math.pi * frequency)
        wave = np.polynomial.polynomial.polyval(z, self.taps) * z**self.first * _response(self.wave, z)
        return np.asarray(wave + _response(self.body, z) * (1.0 - wave))

    @property
    def memory(self) -> int:
        """Number of past frames that it reads."""
        return self.first + TAPS - 1

    def start(self, value: float) -> tuple[Array, Array]:
        """Return past frames and state of a filter that has read `value` for ever."""
        late = value * float(np.sum(self.taps))
        wave, state = _settled(self.wave, late)
        _body, more = _settled(self.body, value - wave)
        return np.full(self.memory, value), np.array([*state, *more])

    def run(self, past: Array, state: Array, values: Array) -> Array:
        """Return the filtered `values` [frames], and update `past` and `state`."""
        both = np.concatenate([past, values])
        out = np.empty(len(values))
        filter_frames(both, self.first, self.taps, self.wave, self.body, state, QUIET, out)
        past[:] = both[len(values) :]
        return out


def _delay_taps(late: float, band: float) -> Array:
    """Return the taps closest to a delay of `late` frames at frequencies up to `band` (of the rate)."""
    apart, to = np.arange(TAPS)[:, np.newaxis] - np.arange(TAPS), np.arange(TAPS) - late
    power = 2.0 * band * np.sinc(2.0 * band * apart) + STOP * np.eye(TAPS)
    return np.linalg.solve(power, 2.0 * band * np.sinc(2.0 * band * to))


def _section(above: tuple[float, float, float], damping: float, place: float) -> Array:
    """Return b0, b1, b2, a1, a2 of above(s) / (s^2 + damping s + 1), where s = i is at `place` (of the rate).

    above: factors of s^2, s and 1.
    """
    t = math.tan(math.pi * place)
    rows = [(two + one * t + zero * t * t, 2.0 * (zero * t * t - two), two - one * t + zero * t * t)
            for two, one, zero in (above, (1.0, damping, 1.0))]  # fmt: skip
    numerator, denominator = np.array(rows) / rows[1][0]
    return np.array([*numerator, *denominator[1:]])


def _response(section: Array, z: Complex) -> Complex:
    """Return the gain of a section; z is one frame of delay."""
    b0, b1, b2, a1, a2 = section
    return np.asarray((b0 + z * (b1 + z * b2)) / (1.0 + z * (a1 + z * a2)))


def _settled(section: Array, value: float) -> tuple[float, tuple[float, float]]:
    """Return the output and the state of a section that has read `value` for ever."""
    b0, b1, b2, a1, a2 = section.tolist()
    out = value * (b0 + b1 + b2) / (1.0 + a1 + a2)
    return out, (out - b0 * value, b2 * value - a2 * out)


@signed_kernel("void(f8[::1], i8, f8[::1], f8[::1], f8[::1], f8[::1], f8, f8[::1])")
def filter_frames(values, first, taps, wave, body, state, quiet, out):
    """Write the filtered frames: the last len(out) of `values`, before which are those that the taps read.

    state: float64 [4], two of each section (transposed direct form 2).
    quiet: smaller states become zero when nothing comes in.
    """
    count = len(taps)
    begin = first + count - 1
    for i in range(len(out)):
        late = 0.0
        for k in range(count):
            late += taps[k] * values[i + count - 1 - k]
        if late == 0.0 and abs(state[0]) < quiet and abs(state[1]) < quiet:
            state[0] = state[1] = 0.0
        moved = wave[0] * late + state[0]
        state[0] = wave[1] * late - wave[3] * moved + state[1]
        state[1] = wave[2] * late - wave[4] * moved
        rest = values[i + begin] - moved
        if rest == 0.0 and abs(state[2]) < quiet and abs(state[3]) < quiet:
            state[2] = state[3] = 0.0
        whole = body[0] * rest + state[2]
        state[2] = body[1] * rest - body[3] * whole + state[3]
        state[3] = body[2] * rest - body[4] * whole
        out[i] = moved + whole
