"""Effects with every finger, texture and scan, alone and two by two: accepted, finite, and without steps at block ends.

The pairs are those of the table of docs/effects.md.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from docs.figures.effect_pairs import BEGIN, END, FINGERS, PAGE, SCANS, TEXTURES, Pair, pairs, scene_of, table
from synth import open_voice, parse_scene
from synth.errors import SceneError
from synth.plan.prepare import prepare
from synth.scene.effects_section import declaration, effect_names
from synth.voice.voice import Voice
from tests.few import thorough

FRAMES, BLOCK = 400, 80
EVERY = list(pairs())
ACCEPTED = [pair for pair in EVERY if not pair.refusal]
LIKE_ELSEWHERE = 1.5  # second difference at the ends of blocks, over the largest elsewhere


def test_the_table_of_the_page_is_the_one_that_the_command_makes() -> None:
    made = PAGE.read_text("utf-8").partition(BEGIN)[2].partition(END)[0]
    assert made == table(), "run python -m docs.figures.effect_pairs"


def test_a_refusal_names_the_finger_and_says_why() -> None:
    refused = [pair for pair in EVERY if pair.refusal]
    assert {(pair.effect, pair.finger) for pair in refused} == {
        (effect, finger) for effect in ("contact_growth", "curvature") for finger in ("fingertip", "probe")
    }
    assert all("round" in pair.refusal and f"a {pair.finger}" in pair.refusal for pair in refused)


def rendered(names: tuple[str, ...], pair: Pair, *, paced: bool = False) -> Any:
    """Return the frames of a scene with effects, in blocks of BLOCK frames."""
    scene = parse_scene(scene_of(names, pair.finger, pair.texture, pair.scan))
    voice = Voice(prepare(scene, paced=True), paced=True) if paced else open_voice(scene)
    return np.concatenate([voice.render(BLOCK).astype(float) for _ in range(FRAMES // BLOCK)])


def check(found: Any) -> None:
    """Assert that a render is finite, moves, and has no step where blocks end."""
    assert np.all(np.isfinite(found)) and np.all(np.ptp(found[:, :1], axis=0) > 0.0)
    bends = np.abs(np.diff(found, 2, axis=0))
    bends /= np.maximum(np.max(bends, axis=0), 1e-12)
    ends = np.zeros(len(bends), bool)
    for first in range(BLOCK - 2, len(bends), BLOCK):
        ends[first : first + 2] = True
    assert np.all(np.max(bends[ends], axis=0) <= LIKE_ELSEWHERE * np.max(bends[~ends], axis=0))


def covering(names: tuple[str, ...], every: list[Pair]) -> Iterator[Pair]:
    """Yield scenes of `every` that have each finger, texture and scan of it at least once, each time another set."""
    shift = sum(map(ord, "".join(names)))
    axes = [sorted({getattr(pair, field) for pair in every}) for field in ("finger", "texture", "scan")]
    known = {(pair.finger, pair.texture, pair.scan): pair for pair in every}
    for number in range(max(map(len, axes))):
        place = tuple(axis[(number + shift // (1 + depth)) % len(axis)] for depth, axis in enumerate(axes))
        if place in known:
            yield known[place]


def named(pair: Pair) -> str:
    """Return the name of a pair in reports."""
    return f"{pair.effect}-{pair.finger}-{pair.texture}-{pair.scan}"


QUICK_ALONE = {
    next(pair for pair in covering((name,), [one for one in ACCEPTED if one.effect == name]) if pair.scan != "path")
    for name in effect_names()
}
"""A path takes up to ten times as long as other scans; `test_points_over_area` has some."""


@pytest.mark.parametrize(
    "pair", [pair if pair in QUICK_ALONE else thorough(pair) for pair in ACCEPTED], ids=lambda pair: named(pair)
)
def test_an_accepted_pair_renders(pair: Pair) -> None:
    check(rendered((pair.effect,), pair))


def couples() -> list[tuple[tuple[str, str], Pair]]:
    """Return each two effects that do not replace the same thing, with each finger, texture and scan in some scene."""
    found = []
    for names in itertools.combinations(effect_names(), 2):
        first, second = map(declaration, names)
        if first.replaces and first.replaces == second.replaces:
            continue
        scenes = [set((one.finger, one.texture, one.scan) for one in ACCEPTED if one.effect == name) for name in names]
        both = scenes[0] & scenes[1]
        every = [Pair(names[0], *one, "") for one in sorted(both)]
        found += [(names, pair) for pair in covering(names, every)]
    return found


COUPLES = couples()


def refused_at_a_load_that_changes(names: tuple[str, ...], pair: Pair) -> bool:
    """Return whether docs/effects.md says that these two effects are refused together in this scene."""
    return names == ("contact_growth", "viscous_skin") and pair.scan in ("recording", "path")


QUICK = [couple for couple in COUPLES if couple[1].scan in ("constant", "stroke") and couple[1].finger != "fingertip"]
"""Scenes that take a second or two; those of the whole list take minutes."""


@pytest.mark.parametrize(
    "couple",
    [couple if couple in QUICK[:: len(QUICK) // 6] else thorough(couple) for couple in COUPLES],
    ids=lambda couple: f"{'+'.join(couple[0])}-{named(couple[1])}",
)
def test_two_effects_combine(couple: tuple[tuple[str, str], Pair]) -> None:
    names, pair = couple
    if refused_at_a_load_that_changes(names, pair):
        with pytest.raises(SceneError, match="only at a constant load"):
            rendered(names, pair)
        return
    check(rendered(names, pair, paced=len(pair.texture) % 2 == 0))


def test_the_couples_have_every_finger_texture_and_scan() -> None:
    for names in {names for names, _pair in COUPLES}:
        here = [pair for other, pair in COUPLES if other == names]
        assert {pair.texture for pair in here} == set(TEXTURES)
        assert {pair.scan for pair in here} == set(SCANS)
        combs = any(len(declaration(name).fingers) == 1 for name in names)
        assert {pair.finger for pair in here} == ({"comb"} if combs else set(FINGERS))
