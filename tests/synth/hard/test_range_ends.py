"""Every numeric field of a scene at both ends of its range, in all pairs, and anywhere between: fit samples, or a
refusal of the combination that says so.
"""

from __future__ import annotations

import functools
import itertools
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from synth.errors import SceneError
from synth.response_cache import ResponseCache
from synth.scene.scene import Scene, parse_scene
from synth.voice.voice import blocks, open_voice, total_frames
from tests.few import paired
from tests.synth.hard.bounds import ALL, check_fit, merged
from tests.synth.hard.ranges import COMBINED, FIELDS, OF_ONE_KIND, Field, inside, rules

BASE: dict[str, Any] = {
    "finger": {"contact_length": 5e-4},
    "output": {**ALL, "bandwidth": 1000.0, "sample_rate": 8000},
    "accuracy": {"tolerance": 3e-2},
}
"""One ridge, few harmonics, and a wide tolerance, where a pair does not ask for others: a scene takes milliseconds."""
FRAMES = 256
CACHE = ResponseCache()
TOGETHER = 14  # fields at their ends in one scene: fewer takes more scenes, more hides the ends behind each other

End = tuple[Field, float]


def allowed_scene(*documents: dict[str, Any]) -> Scene | None:
    """Return the scene of the documents, or None where their combination is refused, as it must be then."""
    try:
        return parse_scene(merged(BASE, *documents))
    except SceneError as error:
        assert all(any(words in fault.allowed for words in COMBINED) for fault in error.faults)
        return None


@functools.cache
def fits(*ends: End) -> bool:
    """Return whether the fields can stand at these ends in one scene."""
    return allowed_scene(*(field.document(end) for field, end in ends)) is not None


def covering_scenes() -> list[list[End]]:
    """Return fields at their ends such that every two that can stand together do so in one of the scenes at least.

    Each scene begins with a pair that is still missing, and takes what adds most pairs until nothing does.
    """
    every = [(field, end) for field in FIELDS for end in field.ends]
    missing = {
        frozenset(pair): pair
        for pair in itertools.combinations(every, 2)
        if pair[0][0].path != pair[1][0].path and fits(*pair)
    }
    scenes = []
    while missing:
        scene = list(next(iter(missing.values())))
        while len(scene) < TOGETHER:
            taken = {field.path for field, _end in scene}
            added = {
                each: sum(frozenset((each, held)) in missing for held in scene)
                for each in every
                if each[0].path not in taken
            }
            useful = sorted((each for each in added if added[each]), key=lambda each: -added[each])
            best = next((each for each in useful if fits(*scene, each)), None)
            if best is None:
                break
            scene.append(best)
        for pair in itertools.combinations(scene, 2):
            missing.pop(frozenset(pair), None)
        scenes.append(scene)
    return scenes


def check(*documents: dict[str, Any]) -> bool:
    """Assert that the first and the last block of a whole render are fit; return False where there is no such scene."""
    scene = allowed_scene(*documents)
    if scene is None:
        return False
    voice = open_voice(scene, cache=CACHE)
    check_fit(voice, next(blocks(voice, FRAMES)))
    voice.seek(max(0, total_frames(scene) - FRAMES))
    for block in blocks(voice, FRAMES):
        check_fit(voice, block)
    return True


def test_every_rule_of_the_scene_is_known_to_the_table() -> None:
    """A field of a new kind must be given its ends in `ranges`, or be named here as one without numbers."""
    without_numbers = {
        "finger.kind",
        "texture.kind",
        "texture.surface",
        "texture.ends",
        "scan.trajectory",
        "effects",
        "output.quantity",
        "output.channels",
        "accuracy.threshold",
    }
    assert {path for path, _rule in rules()} == {field.path for field in FIELDS} | without_numbers | OF_ONE_KIND
    assert len(FIELDS) >= 27


@pytest.mark.parametrize("field", FIELDS, ids=lambda field: field.name)
def test_a_field_at_either_end(field: Field) -> None:
    for end in field.ends:
        assert check(field.company, field.document(end))


@pytest.mark.parametrize(("field", "tolerance"), paired(FIELDS, ["exact", "imperceptible"]))
def test_a_field_at_either_end_where_the_tolerance_is_named(field: Field, tolerance: str) -> None:
    narrow = {
        "output": {"bandwidth": 10.5},
        "accuracy": {"tolerance": tolerance},
    }  # one harmonic at 10 Hz
    coarse = {"finger": {"ridge_period": 5e-3}, "texture": {"period": 8e-3}}
    for end in field.ends:
        assert check(narrow, coarse, field.company, field.document(end))


def test_two_fields_at_their_ends_are_refused_only_where_they_cannot_stand_together() -> None:
    for one, other in itertools.combinations(FIELDS, 2):
        if one.path != other.path:
            allowed = [fits((one, a), (other, b)) for a, b in itertools.product(one.ends, other.ends)]
            assert any(allowed) != one.displaces(other), (one.name, other.name)


def test_every_pair_of_ends_that_can_stand_together_plays() -> None:
    scenes = covering_scenes()
    assert len(scenes) < 60
    for ends in scenes:
        try:
            assert check(*(field.document(end) for field, end in ends))
        except AssertionError as error:
            error.add_note(", ".join(f"{field.name} = {end}" for field, end in ends))
            raise


@settings(max_examples=20, suppress_health_check=[HealthCheck.too_slow])
@given(
    pair=st.lists(st.sampled_from(FIELDS), min_size=2, max_size=2, unique_by=lambda field: field.path),
    places=st.tuples(st.floats(0.0, 1.0), st.floats(0.0, 1.0)),
)
def test_two_fields_anywhere_in_their_ranges(pair: list[Field], places: tuple[float, float]) -> None:
    check(*(field.document(inside(field, place)) for field, place in zip(pair, places, strict=True)))


@settings(max_examples=12, suppress_health_check=[HealthCheck.too_slow])
@given(
    chosen=st.lists(st.sampled_from(FIELDS), min_size=3, max_size=6, unique_by=lambda field: field.path),
    low=st.lists(st.booleans(), min_size=6, max_size=6),
)
def test_several_fields_at_their_ends(chosen: list[Field], low: list[bool]) -> None:
    check(*(field.document(field.ends[at]) for field, at in zip(chosen, low, strict=False)))


TRAJECTORIES: dict[str, list[list[float]]] = {
    "the closest points": [[0.01 + 1e-6 * i, 1e-6 * i, 0.3] for i in range(40)],
    "the fastest": [[0.1 * i, 1.0 * i, 0.3] for i in range(6)],
    "there and back at the fastest": [[0.1 * i, 1.0 * (i % 2), 0.3] for i in range(6)],
    "the farthest": [[0.0, -1e4, 0.3], [1.0, -1e4 + 0.01, 0.3], [2.0, -1e4, 0.3], [80000.0, 1e4, 0.3]],
    "the latest": [[86397.0, 0.0, 0.3], [86398.0, 0.01, 0.3], [86399.0, 0.0, 0.3], [86400.0, 0.01, 0.3]],
    "the lightest": [[0.1 * i, 1e-3 * i, 0.0] for i in range(6)],
    "the heaviest": [[0.1 * i, 1e-3 * i, 1e3] for i in range(6)],
    "all loads": [[0.1 * i, 1e-3 * i, 10.0 ** (3 * (-1) ** i)] for i in range(6)],
    "standing still": [[0.1 * i, 0.0, 0.3] for i in range(6)],
}


@pytest.mark.parametrize("name", TRAJECTORIES)
def test_a_trajectory_at_the_ends_of_its_ranges(name: str) -> None:
    """Between points a spline may be faster and heavier than at them: here finite, and within the displacement."""
    points = TRAJECTORIES[name]
    output = {"channels": [ALL["channels"][0]], "bandwidth": 300.0, "sample_rate": 8000, "duration": 86400.0}
    few = {"finger": {"contact_length": 5e-3}, "accuracy": {"tolerance": 3e-2}}  # ridges, steps
    texture = {"period": 1.6e-3 if "fastest" in name else 0.8e-3}  # the shorter, the more solutions a frame takes
    voice = open_voice(parse_scene({"scan": {"trajectory": points}, "texture": texture, "output": output, **few}))
    heard = False
    for time in (0.0, points[0][0], points[1][0], points[-1][0] - 0.01, points[-1][0], 86399.9):
        voice.seek(round(max(time, 0.0) * 8000))
        block = voice.render(400)
        check_fit(voice, block)
        heard = heard or bool(np.max(np.abs(block)) > 1e-8)  # m: less is left of a finger that comes down within 20 ms
    assert heard == (name not in ("the lightest", "the closest points", "the fastest"))  # 1 and 10 m/s: above the band


def test_a_recording_in_acceleration_at_the_highest_rate_holds_its_tolerance() -> None:
    """Its rows took 26 s to open; solved at its frames it takes two, and nothing is left to warn of."""
    points = [
        [0, 0, 0.3],
        [0.1, 4e-3, 0.2],
        [0.2, 8e-3, 0.05],
        [0.25, 0.01, 0.02],
        [0.3, 0.012, 0.04],
        [0.4, 0.016, 0.25],
    ]
    output = {"channels": [ALL["channels"][2]], "sample_rate": 192000}
    voice = open_voice(parse_scene({"scan": {"trajectory": points}, "output": output}))
    block = voice.render(76800)
    check_fit(voice, block)
    assert block.any() and not voice.warnings
    assert voice.plan.estimated_error["acceleration"] <= 1e-3
