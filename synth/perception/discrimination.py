"""Whether two vibrations are told apart, from just-noticeable differences.

Model   Two sensations are told apart if only one is felt, if one has a spatial pattern that is felt and the other has
        none, if their intensities differ by more than the just-noticeable difference (JND) of amplitude, or the
        frequencies of their strongest lines by more than that of frequency. Below both JND they are not told apart.
        Between the smallest and the largest JND of the source it is open. The strongest line of an analysis
        (`study.skin_outcome`, `study.sound_outcome`) is that of the channel with the larger power.
Source  JND at the fingertip, 2 to 200 Hz: Israr, Tan & Reed (2006), amplitude 2.2 to 2.5 dB, frequency 18 to 25 %.
Limits  JND of sinusoids, used for all vibrations and above 200 Hz. Two spatial patterns that are both felt are not
        compared: no source for their JND was found.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import Any

from synth.errors import Fault, InvalidRequest
from synth.perception.receptors import VIBRATION

AMPLITUDE = 2.2, 2.5  # dB
FREQUENCY = 0.18, 0.25  # of the lower frequency
VERDICTS = "not told apart", "open", "told apart"


@dataclass(frozen=True, slots=True)
class Sensation:
    """What decides whether a scene or a recording is told from another.

    intensity: thresholds. frequency: of the strongest line, Hz; 0 where nothing vibrates.
    vibration, pattern: whether one is felt.
    """

    intensity: float
    frequency: float
    vibration: bool
    pattern: bool


@dataclass(frozen=True, slots=True)
class Discrimination:
    """How two sensations differ.

    verdict: of VERDICTS. level_db: of the second over the first; None where one of them does not vibrate.
    frequency: of the second over the first, less 1; None where one of them does not vibrate.
    """

    verdict: str
    level_db: float | None
    frequency: float | None


def told_apart(first: Sensation, second: Sensation) -> Discrimination:
    """Return whether two sensations are told apart, and by how much they differ."""
    level = frequency = None
    if first.intensity > 0.0 and second.intensity > 0.0:
        level = 20.0 * math.log10(second.intensity / first.intensity)
    if first.frequency > 0.0 and second.frequency > 0.0:
        frequency = second.frequency / first.frequency - 1.0
    if first.vibration != second.vibration or first.pattern != second.pattern:
        return Discrimination(VERDICTS[2], level, frequency)
    if not first.vibration or level is None or frequency is None:
        return Discrimination(VERDICTS[0], level, frequency)
    ratio = max(first.frequency, second.frequency) / min(first.frequency, second.frequency) - 1.0
    steps = (abs(level), AMPLITUDE), (ratio, FREQUENCY)
    verdict = max((apart >= low) + (apart > high) for apart, (low, high) in steps)
    return Discrimination(VERDICTS[verdict], level, frequency)


def beside(first: dict[str, Any], second: dict[str, Any]) -> dict[str, Any]:
    """Return `verdict`, and by how much `second` differs from `first`: `level_db` and `frequency`, a part of it.

    Raises InvalidRequest for a scene beside a recording: the skin under ridges, and a contactor on the skin.
    """
    if ("spatial_variation" in first) != ("spatial_variation" in second):
        hint = "Analyze the scene's own render, too, and set it beside the recording."
        raise InvalidRequest([Fault("/beside", "a scene and a recording", "two scenes, or two recordings", hint)])
    return asdict(told_apart(_sensation(first), _sensation(second)))


def _sensation(felt: dict[str, Any]) -> Sensation:
    names = [one.name for one in VIBRATION]
    leading = max((one for one in felt["receptors"] if one["receptor"] in names), key=lambda one: one["power"])
    words = felt["felt_by"]
    return Sensation(felt["intensity"], leading["frequency"], "vibration" in words, "pattern" in words)
