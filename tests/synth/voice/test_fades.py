"""The fades of a finite render."""

from __future__ import annotations

import numpy as np

from synth.voice.fades import fade_envelope


def test_fades_rise_from_nothing_and_end_in_nothing() -> None:
    whole = fade_envelope(0, 1000, 1000, 100)
    assert whole[0] < 1e-3 and whole[-1] < 1e-3
    assert np.all(whole[100:900] == 1.0)
    assert np.array_equal(whole, whole[::-1])
    assert np.all(np.diff(whole[:100]) > 0)
    parts = [fade_envelope(first, 125, 1000, 100) for first in range(0, 1000, 125)]
    assert np.array_equal(np.concatenate(parts), whole)
