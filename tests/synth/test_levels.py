"""Which harmonics sound at an instantaneous frequency: none above 0.49 of the rate, none below 0.35 lost, no step."""

from __future__ import annotations

import math

import numpy as np
import pytest

from synth.response.speed_levels import Levels, levels_heard, levels_up_to
from tests.synth.engine_cases import Real

SIZES = [*range(1, 60), 99, 137, 191, 500, 1000, 3070, 4096]


def weights(levels: Levels, highest: int, turns: float) -> Real:
    """Return the gain of harmonics 1 to `highest` at `turns` a frame, as the levels say, written out."""
    gains = np.zeros(highest)
    for index, (top, start, stop) in enumerate(zip(levels.highest, levels.fade_from, levels.fade_to, strict=True)):
        begins = levels.fade_to[index - 1] if index else 0.0
        if not begins <= turns < stop:
            continue
        s = min(max((turns - start) / (stop - start), 0.0), 1.0)
        part = s * s * (3 - 2 * s)
        gains[:top] += 1.0 - part
        if index + 1 < len(levels.highest):
            gains[: levels.highest[index + 1]] += part
    return gains


@pytest.mark.parametrize("highest", SIZES)
def test_levels_fall_from_the_fullest_to_the_fundamental(highest: int) -> None:
    levels = levels_up_to(highest)
    assert levels.highest[0] == highest
    assert levels.highest[-1] == 1
    assert all(a > b for a, b in zip(levels.highest, levels.highest[1:], strict=False))


@pytest.mark.parametrize("highest", SIZES)
def test_fades_rise_and_do_not_overlap(highest: int) -> None:
    levels = levels_up_to(highest)
    assert np.all(levels.fade_from < levels.fade_to)
    assert np.all(levels.fade_to[:-1] <= levels.fade_from[1:] * (1 + 1e-12))


@pytest.mark.parametrize("highest", [1, 2, 3, 7, 19, 53, 191])
def test_no_harmonic_sounds_too_high_and_none_is_lost_below(highest: int) -> None:
    levels = levels_up_to(highest)
    n = np.arange(1, highest + 1)
    for turns in np.exp(np.linspace(math.log(0.2 / highest), math.log(0.6), 700)):
        gains = weights(levels, highest, float(turns))
        assert np.all(gains[n * turns >= 0.49] == 0.0)
        assert np.all(np.abs(gains[n * turns <= 0.35] - 1.0) <= 1e-12)
        assert np.all((gains >= 0.0) & (gains <= 1.0 + 1e-12))


@pytest.mark.parametrize("highest", [1, 3, 19, 191])
def test_gains_do_not_step(highest: int) -> None:
    levels = levels_up_to(highest)
    largest = []
    for points in (10_000, 40_000):
        turns = np.exp(np.linspace(math.log(0.3 / highest), math.log(0.52), points))
        gains = np.array([weights(levels, highest, float(one)) for one in turns])
        largest.append(float(np.max(np.abs(np.diff(gains, axis=0)))))
    assert largest[0] < 0.1
    assert largest[1] < 0.3 * largest[0]  # a step would stay as large however close the points


@pytest.mark.parametrize("highest", [1, 2, 3, 19, 64, 380])
def test_the_levels_heard_are_those_that_sound_however_the_turns_are_rounded(highest: int) -> None:
    levels = levels_up_to(highest)
    limits = [*levels.fade_from, *levels.fade_to]
    inside = [math.sqrt(a * b) for a, b in zip([1e-9, *levels.fade_to], levels.fade_to, strict=False)]
    for limit in [*limits, *inside, 0.0, 0.6]:
        for off in (-3e-16, 0.0, 3e-16):
            turns = limit * (1.0 + off)
            begins = np.array([0.0, *levels.fade_to[:-1]])
            sounding = [n for n in range(len(begins)) if begins[n] <= turns < levels.fade_to[n]]
            fading = [n + 1 for n in sounding if turns > levels.fade_from[n] and n + 1 < len(begins)]
            heard = levels_heard(levels, limit)
            assert set(sounding + fading) <= set(heard)
            assert len(heard) <= (3 if limit in limits else len(sounding + fading))


def test_between_the_fades_one_level_is_heard() -> None:
    levels = levels_up_to(380)
    assert levels_heard(levels, 0.99 * float(levels.fade_from[4])) == range(4, 5)
    assert levels_heard(levels, 0.5 * float(levels.fade_from[4] + levels.fade_to[4])) == range(4, 6)
    assert levels_heard(levels, 0.55) == range(len(levels.highest), len(levels.highest))
