"""Whether one analysis is told from another, in the words of `skin_outcome` and `sound_outcome`.

Stage   STUDY.
Model   `perception.discrimination`, over the intensity of vibration, the strongest line of the channel with the larger
        power, and whether a spatial pattern is felt.
"""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from synth.errors import Fault, InvalidRequest
from synth.perception.discrimination import Sensation, told_apart
from synth.perception.receptors import VIBRATION


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
