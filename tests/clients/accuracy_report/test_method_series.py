"""How the methods of an accuracy document are grouped and sized, and the levels of error beside them."""

from __future__ import annotations

import math
import re

import pytest

from clients.accuracy_report.method_series import (
    chosen_row,
    cost_of,
    error_levels,
    felt_error,
    front_of,
    series_of,
    size_of,
    with_unit,
)
from tests.accuracy_case import CHOSEN, document


def test_methods_that_differ_in_size_alone_are_one_series_and_families_keep_their_order() -> None:
    found = [(series.family, series.kind, len(series.rows)) for series in series_of(document())]
    assert found == [
        ("baseline", "", 8),
        ("baseline", "tabled", 8),
        ("sampled", "", 7),
        ("exact", "", 6),
        ("table", "", 3),
        ("harmonics", "", 14),
        ("closed", "", 1),
    ]


def test_sizes_rise_within_a_series_whatever_the_order_of_the_rows() -> None:
    turned = document()
    turned["methods"].reverse()
    for series in series_of(turned):
        sizes = [int(found[0]) for row in series.rows if (found := re.search(r"\d+", row["method"]))]
        assert sizes == sorted(sizes)


def test_an_unknown_family_comes_last() -> None:
    made = document()
    made["methods"][0]["family"] = "oracle"
    assert series_of(made)[-1].family == "oracle"


@pytest.mark.parametrize(
    ("method", "size"),
    [
        ("sum of harmonics, 1024 phases", "1024 phases"),
        ("response table, to a 2000th", "to a 2000th"),
        ("exact solver, oversampling 8", "oversampling 8"),
        ("brentq at 25 points a ridge", "25 points a ridge"),
        ("closed form", "closed form"),
    ],
)
def test_the_size_of_a_method_is_a_part_of_its_name(method: str, size: str) -> None:
    assert size_of(method) == size


def test_the_cost_spreads_the_set_up_over_the_sound() -> None:
    row = {"setup_seconds": 3.0, "seconds_per_second": 0.25}
    assert cost_of({"duration": 2.0}, row) == 1.75


def test_along_the_front_errors_fall_while_costs_rise() -> None:
    made = document()
    front = front_of(made)
    assert len(front) > 5
    errors, costs = [row["max_error"] for row in front], [cost_of(made, row) for row in front]
    assert errors == sorted(errors, reverse=True)
    assert costs == sorted(costs)


def test_the_plans_choice_is_found_or_missing() -> None:
    row = chosen_row(document())
    assert row is not None and row["method"] == CHOSEN
    assert chosen_row(document(chosen="nothing")) is None


def test_below_the_felt_error_every_method_keeps_the_margin() -> None:
    made = document()
    for place, row in enumerate(made["methods"]):  # errors of one size are felt differently
        if row["threshold_margin_db"] is not None:
            row["threshold_margin_db"] += 13.0 * math.sin(place)
    felt = felt_error(made)
    assert felt is not None
    below = [row["threshold_margin_db"] for row in made["methods"] if 0.0 < row["max_error"] < felt]
    assert below and min(below) > 6.0


def test_the_felt_error_of_one_method_is_its_error_grown_by_its_margin() -> None:
    row = {"max_error": 1e-3, "threshold_margin_db": 26.0}
    assert felt_error({"methods": [row]}) == pytest.approx(1e-2)
    assert felt_error({"methods": [{"max_error": 0.0, "threshold_margin_db": None}]}) is None


@pytest.mark.parametrize(("asked", "level"), [(0.01, 0.01), ("exact", 1e-6), ("imperceptible", None)])
def test_the_tolerance_is_a_level_unless_it_is_the_threshold(asked: float | str, level: float | None) -> None:
    made = document()
    made["scene"]["accuracy"]["tolerance"] = asked
    found = [place for place, words in error_levels(made) if words.startswith("tolerance")]
    assert found == ([] if level is None else [level])


@pytest.mark.parametrize(
    ("value", "unit", "words"),
    [
        (1.934e-6, "m", "1.93 um"),
        (37.89, "m/s^2", "37.9 m/s^2"),
        (0.0402, "m/s", "40.2 mm/s"),
        (9.999e-4, "s", "1 ms"),
        (0.0, "s", "0 s"),
        (3.2e-15, "m", "3e-15 m"),
    ],
)
def test_values_have_three_digits_and_a_prefixed_unit(value: float, unit: str, words: str) -> None:
    assert with_unit(value, unit) == words
