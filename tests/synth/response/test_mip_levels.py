"""Levels: what the band lets through sounds in full, what is beyond does not, and nothing starts with a step."""

from __future__ import annotations

import numpy as np
import pytest

from synth.response.mip_levels import WIDTH, MipLevels


@pytest.mark.parametrize("harmonics", [1, 2, 3, 10, 64, 200])
def test_gains_are_one_in_the_band_and_zero_above_it(harmonics: int) -> None:
    levels = MipLevels.up_to(harmonics)
    n = np.arange(1, harmonics + 1)
    for turns in np.geomspace(1e-3, 3.0, 2000):
        gains = levels.gains(float(turns))
        assert np.all(gains[n * turns <= 1.0] == pytest.approx(1.0))
        assert np.all(gains[n * turns >= WIDTH] == 0.0)
        assert np.all((gains >= 0.0) & (gains <= 1.0 + 1e-12))


def test_gains_move_without_a_step() -> None:
    levels = MipLevels.up_to(64)
    gains = np.array([levels.gains(float(turns)) for turns in np.geomspace(0.05, 0.2, 6000)])
    assert (
        np.max(np.abs(np.diff(gains, axis=0))) < 2.5e-2
    )  # a fade is 2 % of the speed wide: some hundred of these steps


def test_two_levels_sound_at_most() -> None:
    levels = MipLevels.up_to(64)
    assert max(np.count_nonzero(levels.shares(float(turns))) for turns in np.geomspace(1e-3, 2.0, 5000)) == 2
