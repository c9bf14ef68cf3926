"""What is known of the friction of a finger on glass, and what `stick_slip` answers on "wet_glass".

Every answer is the force of friction over the load, of a finger that is dragged at a constant speed and load. The
loads and speeds are those of people who scan a surface; those of the experiments are not known.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache

import numpy as np

from synth.effects.stick_slip import StickSlipSettings
from synth.motion.stick_slip_onset import Dragged, dragged

DERLER = "Derler & Rotaru"
LOADS = 0.25, 0.5, 1.0  # N
SLOW, FAST = (0.005, 0.01), (0.05, 0.09, 0.16)  # m/s: below the onset of the default finger, and above
RATE = 8000.0
Answer = tuple[str, bool]


@dataclass(frozen=True)
class FrictionFact:
    """A published fact. agrees: whether the model does; answer: what it says, and whether that agrees."""

    name: str
    source: str
    agrees: bool
    answer: Callable[[], Answer]


@cache
def found(speeds: tuple[float, ...]) -> list[tuple[float, Dragged]]:
    """Return the load, and what the finger does, for each of LOADS and `speeds`."""
    p = StickSlipSettings(surface="wet_glass").parameters
    return [(load, dragged(p, load, speed, RATE)) for load in LOADS for speed in speeds]


def coefficient(speeds: tuple[float, ...]) -> float:
    """Return the mean coefficient of friction."""
    return float(np.mean([one.force[0] / load for load, one in found(speeds)]))


def swings(speeds: tuple[float, ...]) -> list[float]:
    """Return half of the peak-to-peak of the force over its mean."""
    return [0.5 * one.force[1] / one.force[0] for _load, one in found(speeds)]


def _occurs() -> Answer:
    slips = [one.frequency for _load, one in found(SLOW)]
    return f"at {min(slips):.0f} to {max(slips):.0f} Hz", min(slips) > 0.0


def _in_stick_slip() -> Answer:
    mean = coefficient(SLOW)
    return f"{mean:.2f}", 0.32 <= mean <= 0.74


def _in_sliding() -> Answer:
    mean = coefficient(FAST)
    return f"{mean:.2f}", 0.43 <= mean <= 1.13


def _lower() -> Answer:
    ratio = coefficient(SLOW) / coefficient(FAST) - 1.0
    return f"{100.0 * ratio:+.0f} %", ratio < -0.15


def _jumps() -> Answer:
    least = min(swings(SLOW))
    return f"+-{100.0 * least:.0f} % at least", least > 0.25


def _steady() -> Answer:
    most = max(swings(FAST))
    return f"+-{100.0 * most:.0f} % at most", most < 0.1


def _falls() -> Answer:
    slow, fast = coefficient(SLOW), coefficient(FAST)
    return f"{slow:.2f} at 5 to 10 mm/s, {fast:.2f} at 50 to 160 mm/s", fast < slow


def _rises() -> Answer:
    rise = StickSlipSettings(surface="wet_glass").moisture_rise
    return f"{rise:g} times, unless `moisture_rise` is set", rise > 2.0


FRICTION_FACTS = (
    FrictionFact("a slow finger sticks and slips on wet glass", DERLER, True, _occurs),
    FrictionFact("mean coefficient in stick-slip: 0.53 +- 0.21", DERLER, True, _in_stick_slip),
    FrictionFact("mean coefficient in steady sliding: 0.78 +- 0.35", DERLER, False, _in_sliding),
    FrictionFact("the mean in stick-slip is some 30 % below that of steady sliding", DERLER, False, _lower),
    FrictionFact("in stick-slip the force jumps by more than +-25 % of its mean", DERLER, True, _jumps),
    FrictionFact("in steady sliding it varies by less than +-10 %", DERLER, True, _steady),
    FrictionFact("friction falls with speed", DERLER, True, _falls),
    FrictionFact(
        "friction on glass rises severalfold within tens of seconds", "Adams 2013; Dzidek 2017", False, _rises
    ),
)


def table() -> Iterator[str]:
    """Yield one row per fact."""
    yield "| fact | source | `stick_slip` on wet glass |"
    yield "| --- | --- | --- |"
    for fact in FRICTION_FACTS:
        told, agrees = fact.answer()
        yield f"| {fact.name} | {fact.source} | {told}: **{'pass' if agrees else 'fail'}** |"
