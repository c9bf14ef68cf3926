"""The published facts, each with the answer of the model and whether it agrees.

To add a fact, add it to FACTS; `python -m tests.fidelity` prints its row for docs/fidelity.md.

Source  Johansson & LaMotte (1983), Somatosens. Res. 1:21, abstract: an edge is detected from 0.85 um (sd 0.22 um) on.
        Miyaoka, Mano & Ohka (1999), J. Acoust. Soc. Am. 105:2485, abstract: ridges of 6.3 to 25 um are told apart where
        their heights differ by 0.95 to 2.0 um; the abstract has no period. The others: docs/scene.md and its modules.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from tests.fidelity.measures import (
    FINE,
    Section,
    edge_level,
    everyday,
    grating_harmonics,
    heard,
    largest_step,
    lines,
    pacinian_power,
    rank_correlation,
    ridge_line,
    sinusoid,
    strongest_felt,
    weakest_fundamental,
)

Answer = tuple[str, bool]
FINGERS: dict[str, Section] = {"comb": {}, "fingertip": {"kind": "fingertip"}}
RIDGES = {"comb": 0.5e-3, "fingertip": 0.46e-3}  # m


@dataclass(frozen=True)
class Fact:
    """One published fact.

    name: what was found.
    source: author and year.
    answer: the model's answer for a name of FINGERS, in words, and whether it agrees.
    agrees: the fingers that agree, as docs/fidelity.md states.
    """

    name: str
    source: str
    answer: Callable[[str], Answer]
    agrees: tuple[str, ...]


def _fundamental(name: str) -> Answer:
    weakest = weakest_fundamental(FINGERS[name])
    told = f"at worst {weakest:.1f} dB from the strongest" if weakest > -100.0 else "absent at some"
    return told, weakest >= -6.0


def _scales(name: str) -> Answer:
    slow, fast = (heard(FINGERS[name], sinusoid(0.8e-3), speed=speed) for speed in (0.01, 0.16))
    count = len(fast[0])
    same = np.allclose(fast[0], 16.0 * slow[0][:count]) and np.allclose(fast[1], slow[1][:count])
    return "exactly, as the contact is quasi-static", bool(same)


def _smooth(what: str) -> Callable[[str], Answer]:
    def answer(name: str) -> Answer:
        step = largest_step(FINGERS[name], what)
        return f"{step:.1f} dB at most", step < 3.0

    return answer


def _magnitude(name: str) -> Answer:
    found = everyday(FINGERS[name])
    low, middle, high = np.quantile(found, [0.1, 0.5, 0.9])
    return f"median {middle:.2g}, four of five from {low:.2g} to {high:.2g} m/s^2", bool(low >= 0.1 and high <= 5.0)


def _peak(name: str) -> Answer:
    peaks = [
        frequencies[np.argmax(found)] for frequencies, found in (heard(FINGERS[name], sinusoid(float(p))) for p in FINE)
    ]
    return f"{peaks[0]:.0f} to {peaks[-1]:.0f} Hz", bool(np.all(np.diff(peaks) < 0.0))


def _pacinian(name: str) -> Answer:
    power = np.array([pacinian_power(FINGERS[name], sinusoid(float(period))) for period in FINE])
    ranks = rank_correlation(power)
    return f"{power[:3].mean():.0f} to {power[-3:].mean():.0f} dB, rank correlation {ranks:.2f}", ranks >= 0.7


def _ridge_line(name: str) -> Answer:
    above = ridge_line(FINGERS[name], RIDGES[name])
    return f"{above:+.1f} dB over its neighbourhood", above >= 6.0


def _grating(name: str) -> Answer:
    above, slope = grating_harmonics(FINGERS[name])
    told = f"strongest {above:+.0f} dB from the first, power {slope:.1f}" if above < 100.0 else "the first is absent"
    return told, above <= 0.0 and slope < -1.0


def _fine(name: str) -> Answer:
    found = lines(FINGERS[name], sinusoid(0.2e-3))[1]
    return f"{1e6 * found[1]:.2g} um" if found[1] > 1e-12 else "absent", bool(0.01e-6 <= found[1] <= 10e-6)


def _felt(height: float) -> Callable[[str], Answer]:
    def answer(name: str) -> Answer:
        level = strongest_felt(FINGERS[name], sinusoid(0.8e-3, 0.5 * height))[2]
        return f"{level:+.0f} dB over the threshold", level >= 0.0

    return answer


def _edge(height: float, felt: bool) -> Callable[[str], Answer]:
    def answer(name: str) -> Answer:
        level = edge_level(FINGERS[name], height)
        return f"{level:+.0f} dB over the threshold", (level >= 0.0) == felt

    return answer


FACTS = (
    Fact(
        "the line at u / lambda2 is the strongest, or within 6 dB, for periods of 0.1 to 5 mm",
        "Delhaye 2012",
        _fundamental,
        ("fingertip",),
    ),
    Fact("all frequencies scale with the speed, 10 to 160 mm/s", "Greenspon 2019", _scales, ("comb", "fingertip")),
    Fact(
        "rms acceleration is smooth in the amplitude: steps of 5 % change it by less than 3 dB",
        "Cesini 2018",
        _smooth("amplitude"),
        ("comb", "fingertip"),
    ),
    Fact("the same in the speed", "Cesini 2018", _smooth("speed"), ("fingertip",)),
    Fact("the same in the load", "Cesini 2018", _smooth("load"), ("fingertip",)),
    Fact("the same in the period, 0.1 to 5 mm", "Cesini 2018", _smooth("period"), ()),
    Fact("everyday scans: rms acceleration of 0.1 to 5 m/s^2", "general knowledge", _magnitude, ("fingertip",)),
    Fact(
        "the peak frequency falls as the period rises, 0.1 to 0.5 mm",
        "Bensmaia & Hollins 2003",
        _peak,
        ("comb", "fingertip"),
    ),
    Fact(
        "the Pacinian-weighted power rises with the period, 0.1 to 0.5 mm",
        "Bensmaia & Hollins 2003",
        _pacinian,
        ("fingertip",),
    ),
    Fact("a random texture has a line at u / lambda1", "Scheibert 2009", _ridge_line, ("comb",)),
    Fact("harmonics of a grating fall from the first by a power law", "Wiertlewski 2011", _grating, ("fingertip",)),
    Fact("a fine texture of 0.2 mm moves the skin by 0.01 to 10 um", "general knowledge", _fine, ("fingertip",)),
    Fact("a grating of 0.8 mm, 40 um high, is felt", "Miyaoka 1999", _felt(40e-6), ("comb", "fingertip")),
    Fact("the same, 6.3 um high", "Miyaoka 1999", _felt(6.3e-6), ()),
    Fact("an edge of 3 um is felt", "Johansson & LaMotte 1983", _edge(3e-6, True), ()),
    Fact("an edge of 0.3 um is not felt", "Johansson & LaMotte 1983", _edge(0.3e-6, False), ("comb", "fingertip")),
)
"""Every fact of docs/fidelity.md."""
