"""The discretisation of a contact: segments, columns or cells that are halved until their error has its share.

Stage   RESPONSE. `spectrum` refines that of a series. Frames and simulations, which read z between the places and loads
        of a grid, use `fine_enough`.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from synth.contact.load_balance import Contact
from synth.response.demand import GOLDEN, Complex, Demand, curves, harmonics_of, points_for
from synth.response.series_error import error_floor

if TYPE_CHECKING:
    from synth.contact.area_forces import ForceOverArea
    from synth.contact.forces import Response

    Source = Response | ForceOverArea

MOST_WORK = 1 << 29  # phases times cells of the response: 1 to 10 s; where it is too little, the error is larger
DISCRETE_SHARE = 0.3  # share of the tolerance for the discretisation, where there is one
MOST_DISCRETE = 0.8  # share that it has where it cannot be finer, or only at a high cost; the phases keep the rest
FINER_WORK = 8  # times the work of the last refinement: room for three more refinements
JUDGED_PHASES = 384  # least number of phases at which a discretisation is tested; 3 per harmonic where that is more
FIRST_ORDER = 0.5  # of the error remains when a discretisation is halved, for segments of a profile with corners
UNSETTLED = 0.8  # largest assumed ratio of the next change to the last one: the error is then 4 times the last change
DOUBT = 1.15  # times the error that the changes predict, where they fall faster: up to 1.1 was seen (denim, corduroy)
AFTER_FIRST, EARLIER = 0.5, 0.25  # of the change before the last one: of the first change, and of a later one
"""Parts that the error may still be. Of 186 random fingertips, at three halvings each, two exceeded it, by 1.2."""
ROOM = (
    0.6  # of the change before the last one, told where it is within the share: of 250 random fingertips one needed it
)
FRAME_PHASES = 2048  # most phases at which that of frames is tested; 4 per harmonic where that is fewer
JUDGED_WORK = 1 << 26  # phases times cells: a fraction of a second


def finest_needed(coarse: Source, finer: Source, load: float, demand: Demand) -> tuple[Source, tuple[float, ...]]:
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
    settles, part = max(finer.settles, finer.begins), EARLIER
    while True:
        height = finer.approach(phases, load, height)[0]
        before, series = series, harmonics_of(height, demand.total)
        changed, allowed = changes(before, series, demand, finer.scale_at(load), share=share)
        left = remaining(changed, earlier, settles, part)
        part = AFTER_FIRST if earlier is None else EARLIER
        good = all(one <= most for one, most in zip(left, allowed, strict=True))
        settles = settles if earlier is None else finer.settles
        finest = finer.work_at(load) * count * FINER_WORK > MOST_WORK
        following = None if good or finest or demand.is_still(height) else finer.refined()
        if following is None:
            return finer, left if earlier is None or share == DISCRETE_SHARE else _cautious(left, earlier, allowed)
        finer, earlier = following, changed


def _cautious(left: tuple[float, ...], earlier: tuple[float, ...], allowed: tuple[float, ...]) -> tuple[float, ...]:
    """Return errors that are told larger where the tolerance leaves room: a change may be small by chance.

    earlier: the change before the last one. Where the discretisation cannot be finer, all of ROOM is told.
    """
    good = all(one <= most for one, most in zip(left, allowed, strict=True))
    return tuple(
        max(one, min(ROOM * before, most) if good else ROOM * before)
        for one, before, most in zip(left, earlier, allowed, strict=True)
    )


def remaining(
    changed: tuple[float, ...], earlier: tuple[float, ...] | None, settles: float, part: float = EARLIER
) -> tuple[float, ...]:
    """Return what error remains after the last halving of a discretisation.

    changed, earlier: by the last halving and by the one before it; None: there was none.
    settles: least part of the error that a halving leaves. At 1/2 the last change is the bound, because the error of
        every continuous profile at least halves. Below 1/2 the errors are assumed to keep falling as the changes did,
        with DOUBT, but not below the last change, and not below a part of the one before it: where few places touch,
        the changes fall by chance, and the error stays.
    part: of the change before the last one.
    """
    if settles >= FIRST_ORDER or earlier is None:
        return changed
    falls = (
        min(max(settles, one / before if before > 0.0 else settles), UNSETTLED)
        for one, before in zip(changed, earlier, strict=True)
    )
    predicted = (DOUBT * one * fall / (1.0 - fall) for one, fall in zip(changed, falls, strict=True))
    return tuple(max(one, part * two, three) for one, two, three in zip(changed, earlier, predicted, strict=True))


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


def fine_enough(
    contact: Contact, loads: tuple[float, ...], usual: float, demand: Demand
) -> tuple[Contact, tuple[float, ...]]:
    """Return `contact` on a discretisation that keeps its share of `demand` at each of `loads` (N), and its error.

    The result is the finest that JUDGED_WORK allows, or `contact` itself where its solver has no discretisation. The
    error of each order is that at the load `usual`.

    usual: load (N) whose peak-to-peak is used where it is larger, because no relative error could be met at a load
    at which the motion nearly cancels.
    """
    finer = contact.refined()
    phases = min(points_for(demand.total), FRAME_PHASES)
    theta = (np.arange(phases) + GOLDEN) / phases
    most = phases // 4
    seen = replace(demand, highest=min(demand.highest, most), slower=min(demand.slower, most))
    earlier: list[tuple[float, ...] | None] = [None] * len(loads)
    left_over = (0.0,) * len(demand.orders)
    while finer is not None:
        good = True
        moved = harmonics_of(finer.approach(theta, usual)[0], seen.total)
        for number, load in enumerate(loads):
            before, after = (harmonics_of(one.approach(theta, load)[0], seen.total) for one in (contact, finer))
            changed, allowed = changes(before, after, seen, finer.scale_at(load), moved)
            left, earlier[number] = remaining(changed, earlier[number], finer.settles), changed
            good = good and all(one <= most for one, most in zip(left, allowed, strict=True))
            left_over = left if load == usual else left_over
        contact = finer
        spent = len(loads) * phases * contact.work_at(max(loads)) > JUDGED_WORK
        finer = None if good or spent else contact.refined()
    return contact, left_over
