"""The dimensionless groups of eq. 7: scenes that share them move alike, and a scene can be made from them."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import ridgewave as rw
from synth.contact.scene_contact import contact_of
from synth.study.steady_outcome import outcome_of

PHASES = np.arange(64) / 64
NAMES = ("ridges", "period_ratio", "amplitude_ratio", "load")


def drawn(random: np.random.Generator) -> dict[str, float]:
    """Return random groups of a sparse or a half full contact."""
    ends = {"ridges": (5.0, 35.0), "period_ratio": (0.2, 8.0), "amplitude_ratio": (0.05, 2.0), "load": (0.02, 4.0)}
    return {name: float(math.exp(random.uniform(*np.log(pair)))) for name, pair in ends.items()}


def base(random: np.random.Generator) -> rw.Scene:
    """Return a random finger, whose contact length and load give way to the groups."""
    finger = {
        "ridge_period": float(random.uniform(0.3e-3, 0.7e-3)),
        "ridge_amplitude": float(random.uniform(2e-5, 8e-5)),
        "youngs_modulus": float(random.uniform(5e4, 5e5)),
    }
    return rw.parse_scene({"finger": finger, "scan": {"speed": float(random.uniform(0.01, 0.2))}})


def test_a_thousand_scenes_with_equal_groups_have_equal_z() -> None:
    worst = 0.0
    for seed in range(1000):
        random = np.random.default_rng([3, seed])
        groups, heights = drawn(random), []
        for scene in (rw.Scene.from_groups(base(random), **groups) for _ in range(2)):
            z = contact_of(scene).approach(PHASES, scene.scan.load)[0] / scene.finger.ridge_amplitude
            heights.append(z)
        worst = max(worst, float(np.max(np.abs(heights[0] - heights[1]))))
    assert worst < 1e-10


def test_a_scene_made_from_groups_has_them() -> None:
    for seed in range(200):
        random = np.random.default_rng([4, seed])
        groups = drawn(random)
        found = rw.Scene.from_groups(base(random), **groups).groups
        assert found is not None and found == pytest.approx(groups, rel=1e-12)
        again = rw.Scene.from_groups(base(random), **found).groups
        assert again == pytest.approx(groups, rel=1e-12)


def test_groups_that_are_not_given_keep_their_fields() -> None:
    scene = rw.parse_scene({"scan": {"load": 0.7}})
    found = rw.Scene.from_groups(scene, period_ratio=2.0)
    assert found.texture.period == 2.0 * scene.finger.ridge_period
    assert (found.scan.load, found.finger, found.texture.amplitude) == (0.7, scene.finger, scene.texture.amplitude)


@pytest.mark.parametrize(
    ("groups", "scene", "word"),
    [
        ({"tau": 20.0}, {}, "ridges"),
        ({"ridges": -1.0}, {}, "above 0"),
        ({"ridges": "20"}, {}, "no unit"),
        ({"load": 1.0}, {"finger": {"kind": "fingertip"}}, "comb"),
        ({"load": 1.0}, {"texture": {"kind": "grating"}}, "sinusoid"),
        ({"ridges": 1e6}, {}, "contact_length"),
    ],
)
def test_what_has_no_groups_is_refused_in_words(groups: dict[str, Any], scene: dict[str, Any], word: str) -> None:
    with pytest.raises(rw.SceneError, match=word):
        rw.Scene.from_groups(rw.parse_scene(scene), **groups)


def test_a_smooth_finger_has_no_groups() -> None:
    assert rw.parse_scene({"finger": {"ridge_amplitude": 0.0}}).groups is None


@pytest.mark.parametrize("ratio", [0.37, 1.3, 2.6, 20.5])
def test_full_contact_moves_by_the_sinc_law(ratio: float) -> None:
    scene = rw.Scene.from_groups(ridges=20.3, period_ratio=ratio, amplitude_ratio=0.5, load=60.0)
    found = outcome_of(scene, 64, 4)
    wanted = 0.5 * abs(np.sinc(20.3 / ratio)) * scene.finger.ridge_amplitude
    assert found["contact_fraction"] == pytest.approx(1.0)
    assert found["line_amplitude"][0] == pytest.approx(wanted, rel=1e-6)


def test_speed_changes_times_and_not_amplitudes() -> None:
    slow, fast = (
        outcome_of(rw.parse_scene({"scan": {"speed": speed}, "output": {"bandwidth": "full"}}), 256, 8)
        for speed in (0.02, 0.06)
    )
    np.testing.assert_allclose(slow["line_amplitude"], fast["line_amplitude"], rtol=1e-12)
    assert fast["fundamental"] == pytest.approx(3.0 * slow["fundamental"])
