"""What a plan tells first of a contact, against the oracle and against what is rendered."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from synth import explain, open_voice
from synth.scene.scene import parse_scene
from tests.reference import stiffness_oracle
from tests.reference.stiffness_oracle import contact_in_metres
from tests.synth.engine_cases import physical, touch_of


def told(document: dict[str, Any]) -> dict[str, Any]:
    return explain(document).response


@pytest.mark.parametrize("load", [0.05, 0.3, 3.0])
def test_stiffness_touching_length_and_groups_are_those_of_the_oracle(load: float) -> None:
    document = {"scan": {"load": load}}
    found, touch = told(document), touch_of(parse_scene(document))
    wanted = stiffness_oracle.stiffness(touch)
    touching = contact_in_metres(touch, np.arange(64) / 64).contact_length
    assert found["stiffness"] == pytest.approx(wanted.k, rel=1e-12)
    assert found["contact_fraction"] == pytest.approx(float(np.mean(touching)) / touch.contact_length, rel=1e-2)
    assert list(found["groups"].values()) == pytest.approx([wanted.tau, wanted.period_ratio, 0.5, wanted.W], rel=1e-12)


def test_the_rms_is_that_of_the_samples_and_the_level_that_of_the_strongest_line() -> None:
    document = {"output": {"channels": ["displacement", "acceleration"]}}
    found, voice = told(document), open_voice(document)
    samples = physical(voice, 4800)  # ten periods of 100 Hz
    assert list(found["rms"].values()) == pytest.approx(np.std(samples, axis=0), rel=1e-4)
    lines = 2.0 / 4800 * np.abs(np.fft.rfft(samples[:, 0]))[::10][1:]
    felt = 1e-6 * 10.0 ** (-18.0 / 20.0)  # of a fingertip at 300 Hz, where the strongest line stands
    assert found["fundamental_hz"] == pytest.approx(100.0)
    assert found["sensation_level_db"] == pytest.approx(20.0 * math.log10(lines[2] / felt), abs=0.05)


def test_what_is_not_known_is_null() -> None:
    simulated = told({"effects": {"inertia": {}}})
    assert simulated["rms"] is None and simulated["sensation_level_db"] is None and simulated["stiffness"] > 0.0
    assert told({"finger": {"ridge_amplitude": 0}})["groups"] is None
    assert told({"scan": {"speed": 0}})["rms"] is None
