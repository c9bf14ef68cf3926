"""What a live voice is given that solves eq. 1 along its motion: the points of an area."""

from __future__ import annotations

import pytest

from synth.contact.scene_contact import contact_of
from synth.plan.direct_plan import COARSER, MOST_TURNED, affordable, predicted_work
from synth.response_cache import ResponseCache
from synth.scene.scene import parse_scene


@pytest.mark.parametrize("length", ["4 mm", "6 mm", "12 mm"])
def test_the_points_of_an_area_are_as_close_as_the_bound_on_work_allows(length: str) -> None:
    document = {"finger": {"kind": "fingertip", "contact_length": length}, "texture": {"kind": "dots"}}
    scene = parse_scene(document | {"output": {"sample_rate": 8000}})

    def work(coarser: float) -> float:
        return predicted_work(scene, contact_of(scene, coarser=coarser))

    kept: float = affordable(scene, ResponseCache()).coarser  # type: ignore[attr-defined]
    assert work(kept) <= 1.1 * MOST_TURNED  # a lattice has whole numbers of points
    assert all(work(one) > 0.9 * MOST_TURNED for one in COARSER if one < kept)
