"""The turns of a stroke, where it is so slow that all harmonics of the texture are in the band, against eq. 1."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from synth.plan.prepare import prepare
from synth.response_cache import ResponseCache
from synth.scene.scene import parse_scene
from synth.voice.solved_frames import SolvedFrames
from tests.few import thorough
from tests.synth.engine_cases import QUANTITIES

RATE, SECONDS, STEPS = 8000, 0.4, 64  # Hz, s, and solutions a frame of the oracle
SCENES: dict[str, dict[str, Any]] = {
    "the default": {},
    "a grating": {"finger": {"contact_length": "3 mm"}, "texture": {"kind": "grating", "period": "2 mm"}},
    "a rough line": {"finger": {"contact_length": "3 mm"}, "texture": {"kind": "sandpaper-p100"}},
    "a probe": {"finger": {"kind": "probe"}, "texture": {"kind": "sandpaper-p100"}},
}
STROKES: list[dict[str, Any]] = [{}, {"length": "5 mm", "speed": "50 mm/s", "turn_time": "40 ms"}]


@pytest.mark.parametrize("stroke", [STROKES[0], thorough(STROKES[1])], ids=str)
@pytest.mark.parametrize("name", SCENES)
def test_a_stroke_errs_by_no_more_than_is_told_where_it_turns(name: str, stroke: dict[str, Any]) -> None:
    output = {"channels": list(QUANTITIES), "sample_rate": RATE, "duration": SECONDS}
    scene = parse_scene({**SCENES[name], "scan": {"stroke": stroke}, "output": output})
    solved, frames = prepare(scene, ResponseCache()), round(SECONDS * RATE)
    assert solved.frames is not None and solved.contact is not None and solved.reads_series

    def rendered(plan: Any, heights: Any = None) -> Any:
        block = np.empty((frames, len(QUANTITIES)), np.float32)
        SolvedFrames(solved, plan, heights).read(0, block)
        return block.astype(float)

    found = rendered(solved.frames)
    finer: Any = solved.contact.refined() or solved.contact
    wanted = rendered(replace(solved.frames, count=STEPS * solved.frames.stride), finer.heights)
    errors = np.max(np.abs(found - wanted), axis=0) * [one.full_scale for one in solved.channels]
    for channel, error in zip(solved.channels, errors, strict=True):
        assert error <= channel.error * channel.extent
