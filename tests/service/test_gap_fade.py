"""The edges of a gap: nothing is touched without one, and nothing steps with one."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from service.sinks.gap_fade import Joins
from synth.encode.formats import Block

FADE = 20  # frames
CHANNELS = 2


def softened(buffers: list[tuple[int, int]], cuts: tuple[int, ...] = (), level: float = 1.0) -> Block:
    """Return buffers of (frames, frames of them that sound), all at `level`; before those in `cuts`, a cut."""
    joins, done = Joins(FADE, CHANNELS), []
    for number, (frames, sounding) in enumerate(buffers):
        out = np.zeros((frames, CHANNELS), dtype=np.float32)
        out[:sounding] = level, -level
        if number in cuts:
            joins.cut()
        joins.soften(out, sounding)
        done.append(out)
    return np.concatenate(done)


def test_without_a_gap_nothing_is_touched() -> None:
    assert np.array_equal(softened([(48, 48)] * 5), np.tile([1.0, -1.0], (240, 1)))


def test_a_gap_falls_to_silence_and_rises_from_it() -> None:
    sound = softened([(48, 48), (48, 10), (48, 0), (48, 48)])[:, 0]
    assert np.all(sound[:58] == 1.0) and np.all(sound[58 + FADE : 144] == 0.0) and np.all(sound[144 + FADE :] == 1.0)
    assert np.all(np.diff(sound[58 : 58 + FADE]) < 0) and np.all(np.diff(sound[144 : 144 + FADE]) > 0)


def test_a_cut_leads_from_the_old_sound_into_the_new() -> None:
    sound = softened([(48, 48), (48, 48)], cuts=(1,))[:, 1]
    assert np.abs(np.diff(sound)).max() < 1e-6, "a fall and a rise of the same sound add up to it"


BUFFERS = st.integers(1, 60).flatmap(lambda frames: st.tuples(st.just(frames), st.integers(0, frames)))


@given(st.lists(BUFFERS, min_size=1, max_size=20), st.sets(st.integers(0, 19)))
def test_whatever_comes_no_step_is_larger_than_a_rise_on_a_fall(buffers: list[tuple[int, int]], cuts: set[int]) -> None:
    sound = softened([(FADE, FADE), *buffers], tuple(cut + 1 for cut in cuts))
    assert np.abs(np.diff(sound, axis=0)).max() <= 2.0 / (FADE - 1) + 1e-5
    assert np.abs(sound).max() <= 1.0, "the limiter comes before: nothing may rise above it again"
