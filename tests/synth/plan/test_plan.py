"""The plan: what is simulated, what is left out, the reasons, the cost, and the description of the contact."""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np
import pytest

import ridgewave
from synth.accuracy.costing import explain
from synth.plan.plan import plan_of
from synth.plan.prepare import prepare
from synth.scene.effects_section import effect_names
from synth.scene.scene import parse_scene, scene_document
from synth.voice.voice import Voice, open_voice
from tests.reference import stiffness_oracle
from tests.reference.stiffness_oracle import contact_in_metres
from tests.synth.engine_cases import QUANTITIES, physical, scene_of, touch_of

POINTS = [[0, 0, 0.3], [0.1, 6e-3, 0.4], [0.2, 1e-2, 0.25], [0.3, 8e-3, 0.3]]
BAND = "components above the band"
FEW = {"quantity": "displacement", "sample_rate": 8000, "bandwidth": 300}


EFFECTS = list(effect_names())


def plan(**sections: Any) -> Any:
    return plan_of(prepare(scene_of(**sections)))


def names(parts: Any) -> list[str]:
    return [part.name for part in parts]


def test_a_constant_scan_needs_no_table() -> None:
    made = plan()
    assert names(made.simulated) == ["contact response"]
    assert names(made.left_out) == ["response table", *EFFECTS]
    assert made.response["method"] == "harmonics"
    assert made.response["channels"][0]["reader"] == "series of 191 harmonics"
    assert made.response["fundamental_hz"] == pytest.approx(100.0)
    assert made.response["harmonics"] == 191
    assert made.response["band_limit_hz"] == 19200.0
    assert f"{made.response['phases_solved']} phases" in made.simulated[0].reason


def test_what_lies_above_the_default_band_is_said_to_be_left_out() -> None:
    made = plan_of(prepare(parse_scene({})))
    assert names(made.left_out) == [BAND, "response table", *EFFECTS]
    assert '1000 Hz; "full"' in made.left_out[0].reason
    assert (made.response["harmonics"], made.response["band_limit_hz"]) == (9, 1000.0)
    narrow = plan_of(prepare(parse_scene({"output": {"sample_rate": 2000}})))
    assert BAND not in names(narrow.left_out) and narrow.response["band_limit_hz"] == 800.0


@pytest.mark.parametrize("scan", [{"stroke": {}}, {"trajectory": POINTS}])
def test_a_scan_that_moves_is_solved_for_a_file_and_read_from_a_table_for_a_stream(scan: dict[str, Any]) -> None:
    for paced, name in ((False, "solved frames"), (True, "response table")):
        made = plan_of(prepare(scene_of(scan=scan, output=FEW), paced=paced))
        assert names(made.simulated) == ["contact response", name]
        assert names(made.left_out) == [BAND, *EFFECTS]
        assert made.response["method"] == name


def test_full_contact_is_said_to_be_closed_form() -> None:
    made = plan(scan={"load": 60})
    assert made.response["method"] == made.response["solver"] == "closed form"
    assert made.response["channels"][0]["reader"] == "series of 1 harmonic"
    assert "closed form" in made.simulated[0].reason


@pytest.mark.parametrize("sections", [{"texture": {"amplitude": 0}}, {"scan": {"load": 0}}])
def test_silence_is_said_to_be_silence(sections: dict[str, Any]) -> None:
    made = plan(**sections)
    assert made.response["method"] == "silence"
    assert not made.simulated and names(made.left_out) == ["contact response", *EFFECTS]
    assert made.left_out[0].reason in made.warnings


def test_each_quantity_has_its_error_and_it_is_below_the_tolerance() -> None:
    made = plan(output={"channels": list(QUANTITIES)})
    assert set(made.estimated_error) == set(QUANTITIES)
    assert all(0.0 < error <= 1e-3 for error in made.estimated_error.values())


def test_a_stream_that_moves_tells_what_its_table_errs_by_at_its_loads() -> None:
    solved = Voice(prepare(scene_of(scan={"trajectory": POINTS}, output=FEW), paced=True), paced=True).solved
    assert solved.table is not None
    made = plan_of(solved)
    (name,) = made.estimated_error
    loads = [load for _time, _place, load in POINTS]
    told = solved.table.error.over((min(loads), max(loads)), name, solved.highest)
    assert told < made.estimated_error[name] < told + 1e-3
    assert made.response["table"]["bytes"] <= 4_000_000
    assert made.response["table"]["hash"] == solved.table.hash


def test_channels_tell_their_full_scale_and_extent() -> None:
    made = plan(output={"channels": ["displacement", {"quantity": "velocity", "full_scale": 0.5}]})
    first, second = made.response["channels"]
    assert (first["quantity"], first["unit"], second["unit"]) == ("displacement", "m", "m/s")
    assert second["full_scale"] == 0.5
    signal = open_voice(scene_of(output={"quantity": "displacement"})).render(9600).astype(float)
    assert first["peak_to_peak"] == pytest.approx(np.ptp(signal) * first["full_scale"], rel=2e-3)


@pytest.mark.parametrize(
    "document", [{}, {"scan": {"stroke": {}}, "output": FEW}, {"texture": {"amplitude": 0}}, {"scan": {"speed": 0}}]
)
def test_an_explanation_is_a_json_document_with_everything(document: dict[str, Any]) -> None:
    scene = parse_scene(document)
    made = explain(scene).document()
    assert set(made) == {"scene", "simulated", "left_out", "response", "estimated_error", "cost", "warnings"}
    assert made["scene"] == scene_document(scene)
    assert json.loads(json.dumps(made, allow_nan=False)) == made
    cost = made["cost"]
    assert cost["setup_seconds"] > 0 and cost["ns_per_frame"] > 0 and cost["memory_bytes"] > 0
    rate = scene.output.sample_rate
    assert cost["times_real_time"] == pytest.approx(1e9 / (cost["ns_per_frame"] * rate), rel=1e-9)


def test_a_plan_without_a_cost_says_none() -> None:
    assert plan().document()["cost"] is None


def test_explaining_changes_nothing_in_what_is_rendered() -> None:
    scene = scene_of()
    before = open_voice(scene).render(1000)
    explain(scene)
    assert np.array_equal(open_voice(scene).render(1000), before)


def test_imperceptible_says_which_tolerance_it_became_and_what_that_saved() -> None:
    made = explain(scene_of(accuracy={"tolerance": "imperceptible"})).document()
    told = made["response"]["imperceptible"]
    assert told["threshold"] == "fingertip" and told["against"] == 1e-6
    assert 1e-6 < told["tolerance"] == made["response"]["tolerance"] < 3e-2
    tight = plan(accuracy={"tolerance": 1e-6}).response
    assert told["saved"]["phases_solved"] == tight["phases_solved"] - made["response"]["phases_solved"] > 0
    assert told["saved"]["setup_seconds"] > 0
    assert told["sentence"] in made["simulated"][0]["reason"]
    assert f"saves {told['saved']['phases_solved']} solved phases" in told["sentence"]


def test_what_is_told_of_imperceptible_where_the_load_varies_is_its_tolerance() -> None:
    accuracy = {"tolerance": "imperceptible"}
    told = explain(scene_of(scan={"trajectory": POINTS}, output=FEW, accuracy=accuracy)).response["imperceptible"]
    assert told["saved"] is None and 1e-6 < told["tolerance"] <= 3e-2


def summary_of(document: dict[str, Any]) -> dict[str, Any]:
    return explain(document).response


@pytest.mark.parametrize("load", [0.05, 0.3, 3.0])
def test_stiffness_touching_length_and_groups_are_those_of_the_oracle(load: float) -> None:
    document = {"scan": {"load": load}}
    found, touch = summary_of(document), touch_of(parse_scene(document))
    wanted = stiffness_oracle.stiffness(touch)
    touching = contact_in_metres(touch, np.arange(64) / 64).contact_length
    assert found["stiffness"] == pytest.approx(wanted.k, rel=1e-12)
    assert found["contact_fraction"] == pytest.approx(float(np.mean(touching)) / touch.contact_length, rel=1e-2)
    assert list(found["groups"].values()) == pytest.approx([wanted.tau, wanted.period_ratio, 0.5, wanted.W], rel=1e-12)


def test_the_rms_is_that_of_the_samples_and_the_level_that_of_the_strongest_line() -> None:
    document = {"output": {"channels": ["displacement", "acceleration"]}}
    found, voice = summary_of(document), open_voice(document)
    samples = physical(voice, 4800)  # ten periods of 100 Hz
    assert list(found["rms"].values()) == pytest.approx(np.std(samples, axis=0), rel=1e-4)
    lines = 2.0 / 4800 * np.abs(np.fft.rfft(samples[:, 0]))[::10][1:]
    felt = 1e-6 * 10.0 ** (-18.0 / 20.0)  # threshold of a fingertip at 300 Hz, the strongest line
    assert found["fundamental_hz"] == pytest.approx(100.0)
    assert found["sensation_level_db"] == pytest.approx(20.0 * math.log10(lines[2] / felt), abs=0.05)


def test_the_rms_is_that_of_the_samples_with_effects_and_of_z_itself() -> None:
    output = {"channels": ["acceleration", "approach"], "duration": 1.0}
    every: tuple[dict[str, Any], ...] = ({}, {"inertia": {}}, {"viscous_skin": {}})
    for effects in every:
        scene = {"effects": effects, "texture": {"period": "1 mm"}, "output": output}  # whole periods
        told, sound = summary_of(scene), ridgewave.render(scene)
        for name, values in zip(("acceleration", "approach"), sound.values.T.astype(float), strict=True):
            assert told["rms"][name] == pytest.approx(np.sqrt(np.mean(values**2)), rel=1e-4)
        assert told["sensation_level_db"] > 0.0 and told["stiffness"] > 0.0


def test_what_is_not_known_is_null() -> None:
    assert summary_of({"finger": {"ridge_amplitude": 0}})["groups"] is None
    assert summary_of({"scan": {"speed": 0}})["rms"] is None
