"""Masking and just-noticeable differences, against numbers of their sources and cases that follow from their words."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import pytest

import ridgewave as rw
from synth.perception.discrimination import Sensation, told_apart
from synth.perception.skin import mask_of, unmasked
from synth.perception.threshold import pacinian


@pytest.mark.parametrize(
    ("level", "masker", "frequency", "mask"),
    [  # worked out by hand from the formula: level - 5 + 5 f0 / 1400 - 30 ((f - f0) / f0)^2
        (40.0, 140.0, 140.0, 35.5),
        (40.0, 140.0, 210.0, 28.0),
        (40.0, 140.0, 70.0, 28.0),
        (40.0, 280.0, 560.0, 6.0),
        (12.0, 700.0, 70.0, -14.8),
    ],
)
def test_the_mask_is_that_of_the_formula(level: float, masker: float, frequency: float, mask: float) -> None:
    found = mask_of(np.array([level]), np.array([masker]), np.array([frequency]))
    assert found.item() == pytest.approx(mask, abs=1e-9)


def count(lines: dict[float, float]) -> int:
    """Return how many of the lines {frequency: dB over the Pacinian threshold} are felt."""
    f = np.array(list(lines))
    threshold = np.asarray(pacinian(f), np.float64)
    return unmasked(f, threshold + np.array(list(lines.values())), threshold)


def test_a_line_is_felt_alone_and_not_beside_a_strong_neighbour() -> None:
    assert count({200.0: 3.0}) == 1
    assert count({200.0: -3.0}) == 0
    assert count({200.0: 40.0, 220.0: 3.0}) == 1, "20 Hz beside 40 dB"
    assert count({60.0: 40.0, 300.0: 3.0}) == 2, "four times the frequency: the mask has fallen by 480 dB"
    assert count({}) == 0


def test_masks_add_up() -> None:
    """Two maskers raise the threshold by 3 dB over that of one of them."""
    f = np.array([100.0, 110.0, 105.0])
    threshold = np.full(3, -200.0)
    masks = mask_of(np.array([40.0, 40.0]), f[:2], f[2:])[0]
    both = 10.0 * np.log10(np.sum(10.0 ** (masks / 10.0)))
    assert both == pytest.approx(np.mean(masks) + 3.01, abs=0.1)
    for above, felt in ((0.05, 3), (-0.05, 2)):
        assert unmasked(f, np.array([40.0, 40.0, both + above]), threshold) == felt


def test_a_weak_line_masks_nothing() -> None:
    f, threshold = np.array([100.0, 400.0, 410.0]), np.full(3, -200.0)
    assert unmasked(f, np.array([60.0, 14.0, 8.0]), threshold) == 3, "46 dB below the strongest"
    assert unmasked(f, np.array([60.0, 16.0, 8.0]), threshold) == 2, "44 dB below it"


def vibration(intensity: float, frequency: float = 100.0, **others: bool) -> Sensation:
    """Return a vibration that is felt, without a pattern unless `others` say so."""
    return Sensation(intensity, frequency, **({"vibration": True, "pattern": False} | others))


@pytest.mark.parametrize(
    ("decibels", "frequency", "verdict"),
    [
        (2.1, 1.0, "not told apart"), (-2.1, 1.0, "not told apart"), (2.4, 1.0, "open"), (2.6, 1.0, "told apart"),
        (-2.6, 1.0, "told apart"), (0.0, 1.17, "not told apart"), (0.0, 1.0 / 1.17, "not told apart"),
        (0.0, 1.2, "open"), (0.0, 1.18, "not told apart"), (0.0, 1.0 / 1.18, "not told apart"),
        (0.0, 1.26, "told apart"), (0.0, 1.0 / 1.26, "told apart"), (2.1, 1.26, "told apart"),
    ],
)  # fmt: skip
def test_differences_are_told_by_the_jnd_of_israr_tan_and_reed(decibels: float, frequency: float, verdict: str) -> None:
    found = told_apart(vibration(10.0), vibration(10.0 * 10.0 ** (decibels / 20.0), 100.0 * frequency))
    assert found.verdict == verdict
    assert found.level_db == pytest.approx(decibels) and found.frequency == pytest.approx(frequency - 1.0)


def test_what_is_felt_is_told_from_what_is_not() -> None:
    still = Sensation(0.0, 0.0, vibration=False, pattern=False)
    faint = vibration(0.9, vibration=False)
    kinds = {
        "still": still, "faint": faint, "vibrating": vibration(3.0), "pattern": vibration(3.0, pattern=True),
    }  # fmt: skip
    for (name, one), (other, two) in itertools.combinations(kinds.items(), 2):
        expected = "not told apart" if {name, other} == {"still", "faint"} else "told apart"
        assert told_apart(one, two).verdict == told_apart(two, one).verdict == expected, (name, other)


def test_scenes_are_told_apart_by_their_speed_and_not_from_themselves() -> None:
    scene: dict[str, Any] = {"texture": {"period": "0.5 mm"}, "scan": {"load": 0.4}}
    one, same, faster = (rw.analyze(scene, scan={"speed": speed}) for speed in (0.08, 0.081, 0.11))
    assert rw.told_apart(one, same)["verdict"] == "not told apart"
    sound = rw.analyze(rw.render(scene, output={"duration": "1 s"}))
    with pytest.raises(rw.InvalidRequest, match="two scenes, or two recordings"):
        rw.told_apart(one, sound)
    found = rw.told_apart(one, faster)
    assert found["verdict"] == "told apart" and found["frequency"] == pytest.approx(0.375, abs=0.01)
