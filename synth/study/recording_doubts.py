"""What is doubtful of a recording before anything is compared: a sensor that clips, pauses, and hum.

Stage   STUDY, used by `comparison` and `sound_outcome`.
Model   A sensor that clips stops at one value: RUN samples or more in a row are the largest or the smallest, and the
        wave comes there with a slope. A round top of a slow wave has equal samples too, from the steps of a converter.
        The sample before them is then at most two steps away, less than SUDDEN of the range from 8 bits on; and the
        wave needs a length of sqrt(5) times theirs to fall by ROUND more steps, where a slope needs ROUND samples.
        A pause is quieter than the rest by QUIET.
        A component at the frequency of the mains may be hum.
"""

from __future__ import annotations

import math

import numpy as np

from synth.arrays import Array

CLIPPED, RUN = 1e-3, 3  # part of samples at an end of the range; equal ones in a row
SUDDEN = 0.02  # of the range: a step to the end that no round top has
ROUND, LONG = 4.0, 4  # times the last step, which a slope falls within 1 / LONG of the equal samples
BLOCK = 0.1  # s, over which the level is taken
LOUD = 0.9  # quantile of the power over blocks that is the level of a scan: a knock at its beginning is above it
QUIET = 0.1  # power of a pause over that of the rest, -10 dB
MAINS, NEAR_MAINS = (50.0, 60.0), 0.6  # Hz; as near as a component of a recording of 1 s is told
PAUSED = 0.1  # least part of a recording in pauses that is told: levels are 0.5 dB lower with it


def clipping_of(values: Array) -> list[str]:
    """Return a sentence for each end of the range at which a sensor clips."""
    ends = (float(np.max(values)), float(np.min(values)))
    told = []
    for end in ends if ends[0] > ends[1] else ():
        at = values == end
        if np.mean(at) > CLIPPED and _has_corner(np.abs(values - end), ends[0] - ends[1]):
            part = 100.0 * float(np.mean(at))
            told.append(f"The sensor clips at {end:.4g}, {part:.2g} % of the samples: levels are too small.")
    return told


def _has_corner(away: Array, extent: float) -> bool:
    """Return whether a wave reaches its end with a slope. away: from it, of all samples; extent: peak-to-peak."""
    edges = np.flatnonzero(np.diff(np.concatenate([[1], (away > 0.0).astype(np.int8), [1]])))
    for start, after in edges.reshape(-1, 2).tolist():
        last, ahead = start - 1, start - 1 - (after - start) // LONG
        if after - start < RUN or last < 0:
            continue
        if away[last] > SUDDEN * extent or (
            after - start >= 4 * LONG and np.max(away[max(ahead, 0) : start]) > ROUND * away[last]
        ):
            return True
    return False


def pause_of(values: Array, rate: float, slowest: float = 0.0, segment: int = 0) -> str:
    """Return a sentence on the pauses of a recording, which lower its levels, or "" where it has none.

    slowest: time (s) that blocks last at least, such as two periods of the texture.
    segment: samples of a Hann window of Welch's method, half overlapped, in which the ends count less; 0: none.
    """
    block = max(1, round(max(BLOCK, slowest) * rate))
    whole = values[: len(values) // block * block].reshape(-1, block)
    power = np.var(whole, axis=1)
    part = float(np.mean(power < QUIET * np.quantile(power, LOUD)))
    if part < PAUSED:
        return ""
    counts = _counting(len(values), segment)[: len(power) * block].reshape(-1, block).sum(axis=1)
    there = power >= QUIET * np.quantile(power, LOUD)
    lower = -10.0 * math.log10(float(np.sum(counts[there]) / np.sum(counts)))
    return (
        f"The level varies: {round(100.0 * part)} % of the recording is quieter than the rest by 10 dB or more, so its "
        f"levels are some {lower:.1f} dB lower. Cut it to the scan."
    )


def _counting(samples: int, segment: int) -> Array:
    """Return how much each sample counts in Welch's method, with segments of a Hann window."""
    if not segment:
        return np.ones(samples)
    counts, window = np.zeros(samples), np.hanning(segment + 1)[:-1] ** 2
    for first in range(0, samples - segment + 1, segment - segment // 2):
        counts[first : first + segment] += window
    return counts


def hum_of(frequency: float) -> str:
    """Return a sentence on a recording whose strongest component is at the frequency of the mains, or ""."""
    if min(abs(frequency - base) for base in MAINS) > NEAR_MAINS:
        return ""
    return (
        f"The strongest component is at {frequency:.4g} Hz, as hum of the mains is. Record with the finger off the "
        "surface, to see whether it stays."
    )
