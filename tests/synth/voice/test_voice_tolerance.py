"""A steady render keeps its tolerance against the oracle's synthesis, and contains only its harmonics."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from synth.contact.scene_contact import contact_of
from synth.response.load_grid import heaviest_row
from synth.scene.scene import parse_scene
from synth.voice.voice import open_voice
from tests.few import few, thorough
from tests.reference.spectral_checks import alias_residue, fit_harmonics, fold_distance
from tests.synth.engine_cases import QUANTITIES, RATES, physical, random_document, spread
from tests.synth.hard.bounds import check_steady


@pytest.mark.parametrize("rate", few(RATES, 1))
def test_the_default_scene_keeps_its_tolerance(rate: int) -> None:
    check_steady(
        parse_scene({"output": {"channels": list(QUANTITIES), "sample_rate": rate, "bandwidth": "full"}}), 1e-3
    )


@pytest.mark.parametrize("seed", few(range(50), 2))
def test_random_scenes_keep_their_tolerance(seed: int) -> None:
    random = np.random.default_rng(1000 + seed)
    check_steady(parse_scene(random_document(random, RATES[seed % 4])), 1e-3)


@pytest.mark.parametrize(
    ("seed", "below"),
    [(13, 0.003), (5, 0.03), thorough(13, 0.03), *(thorough(seed, 0.003) for seed in (35, *range(6)))],
)
def test_a_scan_just_below_full_contact_keeps_its_tolerance(seed: int, below: float) -> None:
    """Two valleys part for a short time only, between the phases of a series that seems to have converged."""
    document = random_document(np.random.default_rng(5000 + seed), 48000)
    full, is_full = heaviest_row(contact_of(parse_scene(document)), 1000.0)
    assert is_full
    document["scan"]["load"] = (1.0 - below) * full
    check_steady(parse_scene(document), 1e-3)


@pytest.mark.slow
@pytest.mark.parametrize("seed", few(range(6), 3))
def test_any_tolerance_is_kept(seed: int) -> None:
    random = np.random.default_rng(2000 + seed)
    tolerance = spread(random, 1e-5, 3e-2)
    check_steady(parse_scene(random_document(random, RATES[seed % 4], tolerance)), tolerance)


@pytest.mark.parametrize("seed", range(2))
def test_exact_is_exact_to_a_millionth(seed: int) -> None:
    document = random_document(np.random.default_rng(3000 + seed), 8000)
    check_steady(parse_scene(document | {"accuracy": {"tolerance": "exact"}}), 1e-6)


def test_backwards_is_the_same_surface_the_other_way() -> None:
    def rendered(speed: float) -> Any:
        scene = parse_scene(
            {
                "finger": {"contact_length": "3 mm"},
                "scan": {"speed": speed},
                "output": {"channels": list(QUANTITIES), "bandwidth": "full"},
            }
        )
        if speed < 0:
            check_steady(scene, 1e-3)
        return physical(open_voice(scene), 601)

    forth, back = rendered(0.096), rendered(-0.096)  # 400 frames a period
    assert np.max(np.abs(back[1:400, 0] - forth[1:400, 0][::-1])) <= 1e-6 * np.ptp(forth[:, 0])
    assert np.max(np.abs(back[1:400, 1] + forth[1:400, 1][::-1])) <= 1e-6 * np.ptp(forth[:, 1])
    assert np.max(np.abs(back[1:400, 2] - forth[1:400, 2][::-1])) <= 1e-6 * np.ptp(forth[:, 2])


@pytest.mark.parametrize("bandwidth", [150.0, thorough(1000.0)])
def test_a_bandwidth_cuts_lower_and_keeps_the_tolerance_below(bandwidth: float) -> None:
    output = {"channels": list(QUANTITIES), "bandwidth": bandwidth}
    scene = parse_scene({"finger": {"contact_length": "3 mm"}, "output": output})
    check_steady(scene, 1e-3)
    signal = physical(open_voice(scene), 9600)[:, 2]
    lines = np.abs(fit_harmonics(signal, 48000, 100.0, 20_000.0).coefficients)
    kept = int(np.ceil(bandwidth / 100.0)) - 1
    assert np.max(lines[kept + 1 :]) <= 3e-4 * np.max(lines[1:])  # the rest is the table's error, not the texture
    assert lines[kept] > 1e-2 * np.max(lines[1:])


PERIOD = 0.8e-3
# m/s, two octaves; 0.4 of a frame off a whole number of frames per period, so that no alias hides behind a harmonic
SWEEP = 48000 * PERIOD / (np.floor(628 / 2.0 ** (np.arange(9) / 4.0)) + 0.4)


@pytest.mark.parametrize("speed", few(SWEEP.tolist(), 5))
def test_a_sweep_of_speeds_shows_no_alias(speed: float) -> None:
    frames = 9600
    for quantity in QUANTITIES:
        scene = parse_scene({"scan": {"speed": speed}, "output": {"quantity": quantity, "bandwidth": "full"}})
        fundamental = speed / PERIOD
        assert fold_distance(48000, fundamental, frames) > 6  # so that an alias could be seen
        residue = alias_residue(open_voice(scene).render(frames)[:, 0], 48000, fundamental)
        assert residue.relative_peak <= 1e-3


@pytest.mark.parametrize("rate", [8000, 48000])
def test_nothing_sounds_above_045_of_the_rate(rate: int) -> None:
    scene = parse_scene(
        {"scan": {"speed": 0.0613}, "output": {"quantity": "acceleration", "sample_rate": rate, "bandwidth": "full"}}
    )
    fundamental = 0.0613 / scene.texture.period
    signal = open_voice(scene).render(rate // 2)[:, 0]
    lines = np.abs(fit_harmonics(signal, rate, fundamental, 0.49 * rate).coefficients)
    above = np.arange(lines.size) * fundamental > 0.45 * rate
    assert above.any()
    assert np.max(lines[above]) <= 3e-4 * np.max(lines[1:])
    below = (np.arange(lines.size) * fundamental < 0.40 * rate) & (np.arange(lines.size) * fundamental > 0.3 * rate)
    assert np.max(lines[below]) > 1e-2 * np.max(lines[1:])
