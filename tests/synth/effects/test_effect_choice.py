"""The order of effects, and what is told of a change."""

from __future__ import annotations

from typing import Any

import numpy as np

from synth.effects.effect import BalanceEffect, Price
from synth.effects.simulation.terms import Terms
from synth.plan.effect_choice import PUT_IN, Called, Spared, in_order, judged, relative_change
from synth.scene.section import Section


def effect(name: str, *after: str) -> BalanceEffect:
    class One(BalanceEffect):
        """An effect that does nothing."""

        summary = "Nothing."
        settings = Section
        price = Price(0.0, 0)

        def reason(self, scene: Any, settings: Any) -> str:
            return "None."

        def balanced(self, terms: Terms, settings: Any) -> Terms:
            return terms

    One.name, One.after = name, after
    return One()


def test_effects_follow_their_names_but_for_what_must_come_before() -> None:
    found = in_order([effect("c"), effect("a", "d", "not there"), effect("d"), effect("b", "c")])
    assert [one.name for one in found] == ["c", "b", "d", "a"]


def test_a_change_is_told_in_words_and_numbers() -> None:
    change = (0, 2), (2e-5, 3e-4), -100.0
    spared = judged(effect("a"), None, *change, 1e-3)
    assert isinstance(spared, Spared)
    assert spared.reason == "It moves the acceleration by 0.0003 of its peak-to-peak at 100 Hz, tolerance 0.001."
    assert isinstance(judged(effect("a"), None, *change, 0.9 * 3e-4 / PUT_IN), Called)


def test_a_change_is_relative_to_what_moves_without_it() -> None:
    before = np.array([0.0, 2.0, 1.0])
    assert relative_change(before, before + np.array([0.0, 0.0, 0.5])) == 0.25
    assert relative_change(np.zeros(3), np.zeros(3)) == 0.0
    assert relative_change(np.zeros(3), before) == np.inf
