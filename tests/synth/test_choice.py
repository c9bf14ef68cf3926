"""The plan takes the cheapest method that holds the tolerance, and what it takes does hold it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from synth.plan.method_choice import cheapest_reader, cheapest_spectrum
from synth.plan.preparation import prepare
from synth.response.spectrum import Demand, curves, points_for, solve_spectrum
from tests.synth.engine_cases import contact_of, scene_of
from tests.synth.test_steady import series, summed


def response(**sections: Any) -> Any:
    from synth.plan.plan import plan_of

    return plan_of(prepare(scene_of(**sections))).response


def reader_of(**sections: Any) -> str:
    return str(response(**sections)["channels"][0]["reader"])


def test_a_few_harmonics_are_summed_and_many_are_read_from_a_table() -> None:
    assert reader_of(scan={"speed": 6.0}) == "sum of 2 harmonics"
    assert reader_of().startswith("cubic table of ")
    assert response(scan={"speed": 6.0})["method"] == "harmonics"


def test_full_contact_is_a_sum_of_one_harmonic() -> None:
    full = response(scan={"load": 60.0})
    assert (full["method"], full["solver"]) == ("closed form", "closed form")
    assert full["channels"][0]["reader"] == "sum of 1 harmonic"


def test_a_loose_tolerance_is_read_along_straight_lines() -> None:
    made = reader_of(output={"quantity": "displacement", "sample_rate": 192000}, accuracy={"tolerance": 3e-2})
    assert made.startswith("linear table")


WIDE = {
    "finger": {"contact_length": "0.1 m", "ridge_period": "0.2 mm"},
    "texture": {"period": "0.2 mm", "amplitude": "20 um"},
    "scan": {"load": 3.0, "speed": "20 mm/s"},
    "output": {"quantity": "displacement", "bandwidth": 1000},
    "accuracy": {"tolerance": 3e-2},
}


def test_a_wide_contact_at_a_loose_tolerance_is_sampled() -> None:
    made = response(**WIDE)
    assert made["solver"].startswith("sampled")
    assert response(**(WIDE | {"accuracy": {"tolerance": 1e-6}}))["solver"] == "exact solver"


def test_a_sampled_series_holds_the_tolerance_that_it_tells() -> None:
    scene = scene_of(**WIDE)
    contact, highest = contact_of(scene), 9
    found = cheapest_spectrum(contact, scene.scan.load, Demand(highest, (0,), 3e-2), highest)
    truth = solve_spectrum(contact, scene.scan.load, Demand(highest, (0,), 1e-5), highest)
    assert found.solver.startswith("sampled")
    points = points_for(highest)
    error = np.max(np.abs(curves(found.harmonics - truth.harmonics, 0, points)))
    assert error <= found.errors[0] * np.ptp(curves(truth.harmonics, 0, points))


@pytest.mark.parametrize("tolerance", [3e-2, 1e-3, 1e-6])
@pytest.mark.parametrize("count", [1, 5, 40, 700])
@pytest.mark.parametrize("rate", [1000, 48000, 192000])
def test_the_cheapest_reader_keeps_its_tolerance(tolerance: float, count: int, rate: int) -> None:
    harmonics = series(count)
    reading = cheapest_reader(harmonics, tolerance, rate)
    out = np.empty((4001, 1), np.float32)
    step = int(2**64 * 0.6180339887)
    reading.reader.read(0, step, 1.0, out, 0)
    theta = np.array([(frame * step) % 2**64 / 2**64 for frame in range(4001)])
    truth = summed(harmonics, theta)
    error = np.max(np.abs(out[:, 0] - truth))
    extent = np.ptp(curves(harmonics, 0, points_for(count)))
    assert reading.error <= tolerance
    assert error <= reading.error * extent + 6e-8 * np.max(np.abs(truth))
