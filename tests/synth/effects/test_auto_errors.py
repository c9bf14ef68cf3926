""" "auto" leaves out an effect whose simulation errs by more than the effect changes."""

from __future__ import annotations

import pytest

from synth.plan.effect_choice import LeftOut, SimulatedEffect, Tried, effect_called, largest_of, unresolved

ORDERS = (0, 2)


@pytest.mark.parametrize(
    ("change", "errors", "said"),
    [
        ((0.01, 0.03), (0.001, 1.4), "errs by 1.4 of the peak-to-peak of the acceleration, more than the 0.03"),
        ((0.01, 0.9), (0.6, 0.5), "errs by 0.6 of the peak-to-peak of the displacement, more than the 0.01"),
    ],
)
def test_it_says_both_figures(change: tuple[float, ...], errors: tuple[float, ...], said: str) -> None:
    left = unresolved(effect_called("inertia"), ORDERS, change, errors, (0.0, 0.0), 1e-3)
    assert left is not None and said in left.reason and left.effect_on_output in change


def test_an_error_below_the_change_or_the_tolerance_decides_nothing() -> None:
    none = 0.0, 0.0
    assert unresolved(effect_called("inertia"), ORDERS, (0.1, 0.5), (0.05, 0.4), none, 1e-3) is None
    assert unresolved(effect_called("inertia"), ORDERS, (1e-6, 1e-6), (5e-4, 9e-4), none, 1e-3) is None


def test_an_error_that_the_scene_has_without_the_effect_decides_nothing() -> None:
    change, errors = (0.01, 0.03), (0.001, 0.3)
    assert unresolved(effect_called("inertia"), ORDERS, change, errors, (0.001, 0.25), 1e-3) is None
    assert unresolved(effect_called("inertia"), ORDERS, change, errors, (0.001, 0.1), 1e-3) is not None


def test_one_that_is_left_out_does_not_hide_one_that_matters() -> None:
    effect = effect_called("inertia")
    hopeless = Tried(LeftOut("adhesion", "It errs.", None), (0.9,), None)
    good = Tried(SimulatedEffect(effect, effect.settings()), (0.2,), None)
    best, others = largest_of([hopeless, good])
    assert best is good and [one.name for one in others] == ["adhesion"]
