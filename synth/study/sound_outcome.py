"""What is felt of a recorded or rendered vibration, in the words of `skin_outcome`.

Stage   STUDY.
Model   `perception.contactor`. The level of the whole finger is that of the strongest band of either channel.
Limits  A vibration has no spatial pattern, so there is no SA1. Its scale must be known.
"""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import numpy as np

from synth.arrays import Array
from synth.errors import Fault, InvalidRequest, shown
from synth.perception.contactor import contactor_felt
from synth.perception.skin import intensity
from synth.study.recording_doubts import clipping_of, hum_of, pause_of
from synth.study.recordings import Recording, quantity_of
from synth.study.variables import QUANTITIES

SHORTEST = 0.1  # s: a cycle at the lowest frequency
RATES = 100.0, 1e7  # Hz


def sound_felt(recording: Recording, quantity: str | None = None) -> dict[str, Any]:
    """Return what is felt of a vibration with a known scale.

    quantity: displacement, velocity or acceleration; None: that of the recording.
    Raises InvalidRequest for a recording whose scale or quantity is unknown, and for one that is too short.
    """
    said = quantity_of(recording, quantity)
    _check(recording.values, recording.rate, said, scaled=recording.scaled)
    pause = pause_of(recording.values, recording.rate)
    felt = contactor_felt(recording.values, recording.rate, QUANTITIES.index(said))
    levels = [one.level for one in felt if one.level is not None]
    strongest = max((one for one in felt if one.level is not None), key=lambda one: one.level or 0.0, default=None)
    hum = hum_of(strongest.frequency) if strongest and not recording.quantity else ""
    return {
        "whole_finger_level": max(levels, default=None),
        "receptors": [asdict(one) for one in felt],
        "pacinian_power": felt[-1].power,
        "intensity": intensity(felt),
        "felt_by": "vibration" if max(levels, default=-1.0) > 0.0 else "nothing",
        "warnings": [*recording.warnings, *clipping_of(recording.values), *filter(None, (pause, hum))],
    }


def _check(values: Array, rate: float, quantity: str, *, scaled: bool) -> None:
    faults = []
    if quantity not in QUANTITIES:
        hint = "Write the quantity of the recording; a force has no threshold here."
        faults.append(
            Fault("/quantity", shown(quantity) if quantity else "none", f"one of {', '.join(QUANTITIES)}", hint)
        )
    if not scaled:
        hint = "Write the SI value of a sample of 1, such as 9.81 for 1 g."
        faults.append(Fault("/scale", "none", "a recording whose scale is known", hint))
    if not RATES[0] <= rate <= RATES[1]:
        allowed = f"{RATES[0]:g} to {RATES[1]:,.0f} Hz"
        faults.append(Fault("/rate", shown(rate), allowed, "Write the sample rate of the recording."))
    elif values.ndim != 1 or len(values) < SHORTEST * rate or not np.all(np.isfinite(values)):
        told = f"an array of shape {values.shape}"
        allowed = f"one channel of at least {SHORTEST:g} s, all finite"
        faults.append(Fault("/recording", told, allowed, "Choose a channel, or record longer."))
    if faults:
        raise InvalidRequest(faults)
