"""Random scenes with effects: no exception but a refusal in words, nothing that is not finite, silence where it is."""

from __future__ import annotations

import pytest

from tests.few import few
from tests.synth.effects.random_scenes import outcome, random_scene


@pytest.mark.parametrize("seed", few(range(24), 10))
def test_a_random_scene_renders_or_is_refused_in_words(seed: int) -> None:
    kind, words = outcome(random_scene(seed))
    assert kind in ("renders", "cannot", "refused")
    assert words
