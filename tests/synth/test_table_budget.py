"""Stores of tables share a limit: what one takes another cannot have, and every one has the least."""

from __future__ import annotations

import gc
from dataclasses import dataclass

import numpy as np
import pytest

from synth.motion.update_smoothing import Update
from synth.response import table_budget
from synth.response.cache import ResponseCache
from synth.response.load_cells import TableStore
from synth.response.phase_cells import QUINTIC
from synth.response.spectrum import Complex
from synth.response.speed_levels import levels_up_to
from synth.response.table_budget import TableBudget
from synth.scene.scene import parse_scene
from synth.voice.hand_voice import HandVoice

MB = 1 << 20


@dataclass(eq=False)
class Holder:
    memory_bytes: int


def test_room_is_what_the_others_left_within_the_most_and_the_least() -> None:
    budget = TableBudget(400 * MB)
    first, second, third = Holder(0), Holder(0), Holder(0)
    for holder in (first, second, third):
        budget.enter(holder)
    assert budget.room_of(first) == table_budget.POOL_BYTES
    first.memory_bytes = 250 * MB
    assert budget.room_of(second) == 150 * MB and budget.room_of(first) == table_budget.POOL_BYTES
    second.memory_bytes = 145 * MB
    assert budget.room_of(third) == table_budget.LEAST_BYTES
    assert budget.used_bytes == 395 * MB


def test_who_is_gone_holds_nothing() -> None:
    budget = TableBudget(400 * MB)
    holder = Holder(300 * MB)
    budget.enter(holder)
    assert budget.used_bytes == 300 * MB
    del holder
    gc.collect()
    assert budget.used_bytes == 0


def test_hands_on_many_scenes_stay_within_the_limit_and_sound_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    least, limit = 200_000, 1_500_000
    monkeypatch.setattr(table_budget, "LEAST_BYTES", least)
    caches = ResponseCache(0), ResponseCache(0, limit)
    periods = ("0.5 mm", "0.7 mm", "0.9 mm", "1.1 mm", "1.3 mm")
    output = {"sample_rate": 8000, "bandwidth": 500}
    voices = [
        [HandVoice(parse_scene({"texture": {"period": period}, "output": output}), cache=cache) for cache in caches]
        for period in periods
    ]
    try:
        for number in range(60):
            for free, bounded in voices:
                update = Update(number, number * 0.01, 1e-3 * number, None, 0.35 + 0.01 * (number % 20))
                free.touch(update)
                bounded.touch(update)
                assert (free.render(80) == bounded.render(80)).all()
        assert caches[0].table_bytes > limit + least
        assert caches[1].table_bytes <= limit + least * len(periods)
    finally:
        for pair in voices:
            for voice in pair:
                voice.close()


class Crowded:
    """Rows that, while a table is made of them, have others made in the same store, as another thread may."""

    def __init__(self) -> None:
        self.edges = np.linspace(0.1, 1.0, 10)
        self.store: TableStore | None = None
        self.others: list[int] = []

    def cubic(self, low: float, high: float, harmonics: int) -> tuple[Complex, ...]:
        store, others, self.others = self.store, self.others, []
        for interval in others:
            assert store is not None
            store.build(range(2), interval, self.edges)
        n = np.arange(harmonics + 1)
        return tuple(np.exp(1j * n * (low + power)) / (1.0 + n) ** 2 for power in range(4))


def test_a_table_is_whole_though_the_pool_is_begun_anew_while_it_is_made(monkeypatch: pytest.MonkeyPatch) -> None:
    def of(rows: Crowded, limit: int) -> TableStore:
        rows.store = TableStore(rows, levels_up_to(8), QUINTIC, 2.0, budget=TableBudget(limit))
        return rows.store

    alone, crowded = Crowded(), Crowded()
    monkeypatch.setattr(table_budget, "LEAST_BYTES", 1)
    roomy = of(alone, 100 * MB)
    interval_bytes = roomy._size(range(2)) * 8
    narrow = of(crowded, 2 * interval_bytes)
    narrow.build(range(1), 4, crowded.edges)
    crowded.others = [0, 1, 2]
    pool, tables = narrow.build(range(2), 4, crowded.edges)
    assert pool is not narrow.view(crowded.edges)[0], "the pool was not begun anew"
    wanted, places = roomy.build(range(2), 4, alone.edges)
    for level in range(2):
        here, there, size = tables[level, 5], places[level, 5], roomy._size((level,))
        assert here >= 0
        assert np.array_equal(pool[here : here + size], wanted[there : there + size])
    assert narrow.memory_bytes <= 2 * interval_bytes
