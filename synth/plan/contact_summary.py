"""What a researcher asks of a plan first: stiffness, how much touches, how strong and how far above the threshold.

Stage   2 (PLAN), for people: `explain` adds it to the response of a plan.
Model   k of eqs 4-5 (or as given) and the groups of eqs 6-7 at the scan's load; the length that touches, mean over
        PHASES of a period, over `finger.contact_length`; the rms of each quantity about its mean; 20 log10 of the
        strongest line of the motion over the detection threshold at its frequency (`perception.threshold`).
Source  Fagiani & Barbieri (2016), eqs 4-7.
Limits  all at the scan's own speed and load. rms and level are those of the contact response: None where a simulation
        takes its place, or nothing sounds.
"""

from __future__ import annotations

import math
from dataclasses import asdict
from typing import Any

import numpy as np

from synth.contact.groups import Groups
from synth.perception.threshold import threshold_displacement
from synth.plan.preparation import Preparation

PHASES = 256  # the mean touching length to some thousandths of itself


def contact_summary(solved: Preparation) -> dict[str, Any]:
    """Return stiffness (N/m), contact_fraction, rms (a quantity, SI), sensation_level_db and groups; None: unknown."""
    told: dict[str, Any] = dict.fromkeys(("stiffness", "contact_fraction", "rms", "sensation_level_db", "groups"))
    contact, load = solved.contact, solved.scene.scan.load
    if contact is None or load <= 0.0:
        return told
    turns = np.arange(PHASES) / PHASES
    _depth, touching = contact.measure(turns, contact.approach(turns, load)[0], load)
    length = float(np.mean(touching)) * contact.geometry_at(load).contact_length
    told["stiffness"] = contact.stiffness_at(load)
    told["contact_fraction"] = length / solved.scene.finger.contact_length
    groups = Groups.of_contact(contact.geometry, contact.stiffness, load)
    told["groups"] = None if groups is None else asdict(groups)
    if solved.spectrum is not None and not solved.simulated and solved.turns:
        series = {channel.quantity: solved.steady.series(channel.order)[1:] for channel in solved.channels}
        told["rms"] = {name: math.sqrt(2.0 * float(np.sum(np.abs(one) ** 2))) for name, one in series.items()}
        lines = 2.0 * np.abs(solved.steady.series(0)[1:])
        felt = threshold_displacement(abs(solved.turns) * np.arange(1, len(lines) + 1), solved.scene.accuracy.threshold)
        strongest = float(np.max(lines / felt, initial=0.0))
        told["sensation_level_db"] = 20.0 * math.log10(strongest) if strongest > 0.0 else None
    return told
