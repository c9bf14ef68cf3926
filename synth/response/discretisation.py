"""The discretisation of a contact for frames and simulations, which read z between the places and loads of a grid.

Stage   RESPONSE. A series is refined further when it is solved (`spectrum`).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from synth.contact.load_balance import Contact
from synth.response.spectrum import GOLDEN, Demand, changes, harmonics_of, points_for, remaining

FRAME_PHASES = 2048  # most phases at which that of frames is tested; 4 per harmonic where that is fewer
JUDGED_WORK = 1 << 26  # phases times cells: a fraction of a second


def fine_enough(contact: Contact, loads: tuple[float, ...], usual: float, demand: Demand) -> Contact:
    """Return `contact` on a discretisation that keeps its share of `demand` at each of `loads` (N).

    The result is the finest that JUDGED_WORK allows, or `contact` itself where its solver has no discretisation.

    usual: load (N) whose peak-to-peak is used where it is larger, because no relative error could be met at a load
    at which the motion nearly cancels.
    """
    finer = contact.refined()
    phases = min(points_for(demand.total), FRAME_PHASES)
    theta = (np.arange(phases) + GOLDEN) / phases
    most = phases // 4
    seen = replace(demand, highest=min(demand.highest, most), slower=min(demand.slower, most))
    earlier: list[tuple[float, ...] | None] = [None] * len(loads)
    while finer is not None:
        good = True
        moved = harmonics_of(finer.approach(theta, usual)[0], seen.total)
        for number, load in enumerate(loads):
            before, after = (harmonics_of(one.approach(theta, load)[0], seen.total) for one in (contact, finer))
            changed, allowed = changes(before, after, seen, finer.scale_at(load), moved)
            left, earlier[number] = remaining(changed, earlier[number], finer.settles), changed
            good = good and all(one <= most for one, most in zip(left, allowed, strict=True))
        contact = finer
        spent = len(loads) * phases * contact.work_at(max(loads)) > JUDGED_WORK
        finer = None if good or spent else contact.refined()
    return contact
