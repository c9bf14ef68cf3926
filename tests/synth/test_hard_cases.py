"""Hard cases: contacts, scans and hands at the ends of what a scene allows, one row a case, with what must come out.

Contacts are compared with the oracle; scans and hands with bounds that hold for any contact. z follows the highest of
the heights under it at most and the lowest at least, so over a period it moves by 2 a2 at most; dz/dt is a mean of
dh/dt over what touches, so it stays within 2 pi a2 u / lambda2.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from synth.motion import Motion
from synth.scene_scan import LIFT_LOAD
from synth.voice import open_voice
from tests.synth.engine_cases import QUANTITIES, Real, physical, scene_of

ROUNDED = 1.0 + 1e-6  # a bound, after the rounding to float32
TINY = float(np.finfo(np.float32).tiny)
ALL = {"channels": [{"quantity": name, "full_scale": 1.0} for name in QUANTITIES]}


SCANS: dict[str, dict[str, Any]] = {
    "no load": {"scan": {"load": 0.0}},
    "a nanonewton": {"scan": {"load": 1e-9}},
    "a feather": {"scan": {"load": 1e-3}},
    "a kilonewton": {"scan": {"load": 1e3}},
    "no texture": {"texture": {"amplitude": 0.0}},
    "no ridges": {"finger": {"ridge_amplitude": 0.0}},
    "neither": {"finger": {"ridge_amplitude": 0.0}, "texture": {"amplitude": 0.0}},
    "standing still": {"scan": {"speed": 0.0}},
    "a nanometre a second": {"scan": {"speed": 1e-9}},
    "10 m/s": {"scan": {"speed": 10.0}},
    "10 m/s at 8 kHz": {"scan": {"speed": 10.0}, "rate": 8000},
    "backwards": {"scan": {"speed": -0.08}},
    "1 kHz": {"rate": 1000},
    "192 kHz": {"rate": 192000},
    "locked": {"texture": {"period": 0.5e-3}},
    "opposite and as high": {"texture": {"period": 0.5e-3, "amplitude": 40e-6, "phase": math.pi}},
    "cancelled by whole periods": {"texture": {"period": 1e-3}, "scan": {"load": 30.0}},
    "10,000 periods": {"texture": {"period": 1e-6, "amplitude": 1e-7}, "scan": {"speed": 1e-3}},
    "a metre": {"texture": {"period": 1.0, "amplitude": 1e-3}},
}
NOTHING = {"no load", "no texture", "neither", "10 m/s at 8 kHz", "cancelled by whole periods"}


def fit(block: Real) -> bool:
    """Return whether every sample is finite and none would be denormal."""
    size = np.abs(block)
    return bool(np.isfinite(block).all() and not ((size > 0) & (size < TINY)).any())


@pytest.mark.parametrize("name", SCANS)
def test_a_hard_scan_stays_within_what_its_amplitude_allows(name: str) -> None:
    sections = dict(SCANS[name])
    rate = sections.pop("rate", 48000)
    scene = scene_of(output={**ALL, "sample_rate": rate}, **sections)
    block = physical(open_voice(scene), 4096)
    height, turns = scene.texture.amplitude, abs(scene.scan.speed) / scene.texture.period
    assert fit(block)
    assert np.max(np.abs(block[:, 0])) <= 2.0 * height * ROUNDED
    # the limit to the band rings, by 9 % of a step (Wilbraham, 1848), at a corner of z
    assert np.max(np.abs(block[:, 1])) <= 2.0 * math.pi * turns * height * 1.1 * ROUNDED
    if scene.scan.speed == 0.0:
        assert not block[:, 1:].any()
        assert np.all(block[:, 0] == block[0, 0])
    if name in NOTHING:
        assert np.max(np.abs(block[:, 0])) <= 1e-12 * (scene.finger.ridge_amplitude + height)


@pytest.mark.parametrize("name", NOTHING)
def test_what_does_not_move_says_why_and_stays_silent_at_an_automatic_scale(name: str) -> None:
    sections = dict(SCANS[name])
    rate = sections.pop("rate", 48000)
    voice = open_voice(scene_of(output={"sample_rate": rate}, **sections))
    assert voice.warnings
    assert not voice.render(1000).any()
    assert voice.plan.left_out[0].name == "contact response"


FRAMES, RATE = 2400, 8000
TIME = np.arange(FRAMES) / RATE
RANDOM = np.random.default_rng(77)
HANDS: dict[str, dict[str, Any]] = {
    "a load that drops to nothing and returns": {
        "speed": 0.04,
        "load": np.where((TIME > 0.1) & (TIME < 0.2), 0.0, 0.3),
    },
    "a load that fades to nothing and returns": {"speed": 0.04, "load": 0.3 * np.cos(20 * TIME) ** 2},
    "a load that steps at every frame": {"speed": 0.04, "load": np.where(np.arange(FRAMES) % 2, 0.25, 0.35)},
    "noisy force at 1 kHz": {
        "speed": 0.04,
        "load": np.interp(TIME, np.arange(400) / 1000, 0.3 + 0.02 * RANDOM.standard_normal(400)),
    },
    "loads from a nanonewton to a kilonewton": {"speed": 0.04, "load": 10.0 ** np.interp(TIME, [0, 0.3], [-9, 3])},
    "a reversal in mid-block": {"speed": np.where(TIME < 0.1537, 0.04, -0.04), "load": 0.3},
    "speed steps": {"speed": np.where((np.arange(FRAMES) // 100) % 2, 0.3, 0.02), "load": 0.3},
    "a hand that jumps": {"position": RANDOM.uniform(-1e3, 1e3, FRAMES), "load": 0.3},
    "a hand that trembles": {"position": 1e-6 * np.cumsum(RANDOM.standard_normal(FRAMES)), "load": 0.3},
    "the smallest numbers": {"speed": 5e-324, "load": 5e-324},
    "far too fast": {"speed": 1e30, "load": 0.3},
    "far too heavy": {"speed": 0.04, "load": 1e30},
}
BAND = {**ALL, "sample_rate": RATE, "bandwidth": 600.0}


def rendered(motion: Callable[[slice], Motion], sizes: list[int]) -> Real:
    voice = open_voice(scene_of(output=BAND, accuracy={"tolerance": 1e-2}))
    ends = [0, *itertools.accumulate(sizes)]
    parts = [voice.render(b - a, motion(slice(a, b))) for a, b in itertools.pairwise(ends)]
    return np.concatenate(parts).astype(float)


@pytest.mark.parametrize("name", HANDS)
def test_a_hard_hand_stays_within_bounds_and_its_blocks_do_not_matter(name: str) -> None:
    fields = HANDS[name]

    def motion(part: slice) -> Motion:
        at = {key: value[part] if isinstance(value, np.ndarray) else value for key, value in fields.items()}
        return Motion.of(part.stop - part.start, **at)

    whole = rendered(motion, [FRAMES])
    assert fit(whole)
    assert np.max(np.abs(whole[:, 0])) <= 2.0 * 20e-6 * ROUNDED
    pieces = rendered(motion, [1, 1, 7, 480, 511, 1000, 400])
    assert np.array_equal(whole, pieces)
    loads = np.broadcast_to(fields["load"], FRAMES)
    assert not whole[loads == 0.0, 0].any()


def test_a_block_of_a_million_frames_is_a_thousand_blocks() -> None:
    scene = scene_of(scan={"speed": 0.0613}, output={"quantity": "acceleration"})
    whole = open_voice(scene).render(1_000_000)
    voice = open_voice(scene)
    for begin in range(0, 1_000_000, 1000):
        assert np.array_equal(voice.render(1000), whole[begin : begin + 1000])


def ends() -> list[Any]:
    """Return every pair of ends of two fields of finger, texture and scan, as test parameters."""
    fields: dict[tuple[str, str], tuple[float, float]] = {
        ("finger", "ridge_period"): (1e-5, 1e-2),
        ("finger", "ridge_amplitude"): (0.0, 1e-3),
        ("finger", "contact_length"): (1e-5, 0.1),
        ("texture", "period"): (1e-6, 1.0),
        ("texture", "amplitude"): (0.0, 1e-3),
        ("scan", "speed"): (-10.0, 10.0),
        ("scan", "load"): (0.0, 1e3),
        ("scan", "lift_load"): (LIFT_LOAD.low, LIFT_LOAD.high),
        ("output", "sample_rate"): (1000, 192000),
    }
    return [
        pytest.param(((one, low), (other, high)), id=f"{one[1]}={low:g} {other[1]}={high:g}")
        for one, other in itertools.combinations(fields, 2)
        for low, high in itertools.product(fields[one], fields[other])
    ]


@pytest.mark.parametrize("pair", ends())
def test_two_fields_at_their_ends(pair: tuple[tuple[tuple[str, str], float], ...]) -> None:
    sections: dict[str, dict[str, Any]] = {"output": {**ALL, "bandwidth": 2000.0}}
    for (section, name), value in pair:
        sections.setdefault(section, {})[name] = value
    scene = scene_of(**sections, accuracy={"tolerance": 1e-2})
    block = physical(open_voice(scene), 256)
    assert fit(block)
    assert np.max(np.abs(block[:, 0])) <= 2.0 * scene.texture.amplitude * ROUNDED
