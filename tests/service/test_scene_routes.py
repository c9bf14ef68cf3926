"""The schema of a scene, its picture, and the detection threshold."""

from __future__ import annotations

import math
import re
import threading
from pathlib import Path
from typing import Any, get_args

import numpy as np
import pytest
import soundfile
from fastapi import FastAPI

import ridgewave as rw
from service.app import create_app
from service.http.routes.scene import BODY, ThresholdParameters
from service.synth_engine import SynthEngine
from synth.perception.threshold import DEFAULT, THRESHOLDS
from synth.plan import contact_picture as picture
from synth.scene.scene import scene_schema
from tests.service.harness import ask, problem, settings_of, until
from tests.service.plain_engine import PlainEngine


def refused(app: FastAPI, body: Any, kind: str = "request-refused") -> dict[str, Any]:
    """Return the first fault of a refused picture."""
    fault: dict[str, Any] = problem(ask(app, "POST", "/v1/picture", json=body), 422, kind)["errors"][0]
    return fault


def test_the_schema_is_that_of_a_scene(app: FastAPI) -> None:
    answer = ask(app, "GET", "/v1/scene/schema.json")
    assert answer.headers["content-type"] == "application/schema+json"
    assert answer.json() == scene_schema()
    assert {"finger", "texture", "scan"} <= set(answer.json()["properties"])
    assert '"x-unit"' in answer.text.replace(" ", "")


def test_a_picture_comes_from_the_solver() -> None:
    app = create_app(settings_of(), SynthEngine(0))
    scene = {"scan": {"load": "0.1 N"}, "effects": {"inertia": {}}}
    made = ask(app, "POST", "/v1/picture", json={"scene": scene, "points": 64, "phases": 8}).json()
    assert made["texture"]["period"] == 0.8e-3 and made["response"]["load"] == 0.1
    assert len(made["texture"]["heights"]) == len(made["finger"]["heights"]) == 64
    assert len(made["response"]["heights"]) == len(made["touching"]) == 8
    assert made["left_out"] == ["inertia"]
    assert all(edges and len(edges) % 2 == 0 for edges in made["touching"])


def test_an_analysis_is_that_of_the_command_and_refuses_what_is_not_steady() -> None:
    app = create_app(settings_of(), SynthEngine(0))
    scene = {"texture": {"period": "0.4 mm"}, "scan": {"load": 0.4}}
    assert ask(app, "POST", "/v1/analyze", json=scene).json() == rw.analyze(scene)
    changes: list[dict[str, Any]] = [
        {"texture": {"kind": "dots"}}, {"texture": {"period": "1 um"}}, {"effects": {"inertia": {}}},
    ]  # fmt: skip
    for change in changes:
        document = problem(ask(app, "POST", "/v1/analyze", json=change), 422, "scene-refused")
        assert document["errors"][0]["hint"]


@pytest.mark.parametrize(
    ("name", "kind"),
    [("scan.wav", "audio/wav"), ("scan.flac", "audio/x-flac"), ("file.wav", "application/octet-stream")],
)
def test_a_recording_is_analysed_as_in_python(name: str, kind: str, tmp_path: Path) -> None:
    app, path = create_app(settings_of(), SynthEngine(0)), tmp_path / name
    t = np.arange(24_000) / 8000.0
    soundfile.write(path, 0.5 * np.cos(2.0 * np.pi * 200.0 * t), 8000, subtype="PCM_16")
    headers = {"Content-Type": kind}
    found = ask(app, "POST", "/v1/analyze?quantity=acceleration&scale=9.81", content=path.read_bytes(), headers=headers)
    assert found.json() == rw.analyze(path, quantity="acceleration", scale=9.81)
    own = rw.render({}, output={"duration": "1 s"}).save(tmp_path / f"own-{name}")
    found = ask(app, "POST", "/v1/analyze", content=own.read_bytes(), headers=headers)
    assert found.json() == rw.analyze(own), "a file of ridgewave says its quantity and its scale"


def test_a_recording_that_cannot_be_analysed_is_refused_with_what_to_write(tmp_path: Path) -> None:
    app, path, wav = create_app(settings_of(), SynthEngine(0)), tmp_path / "scan.wav", {"Content-Type": "audio/wav"}
    soundfile.write(path, 0.1 * np.ones(8000), 8000)
    whole = path.read_bytes()
    long = tmp_path / "long.flac"
    soundfile.write(long, np.zeros(20_000_000, np.int16), 48000)
    assert long.stat().st_size < 400_000
    known, packed = "?scale=1&quantity=velocity", long.read_bytes()
    cases = [
        ("?scale", "", whole), ("?quantity", "?scale=1", whole), ("?channel", f"{known}&channel=4", whole),
        ("/recording", known, whole[:20]), ("/recording", known, packed),
    ]  # fmt: skip
    for pointer, query, content in cases:
        answer = ask(app, "POST", f"/v1/analyze{query}", content=content, headers=wav)
        document = problem(answer, 422, "request-refused")
        assert document["errors"][-1]["pointer"] == pointer and document["errors"][-1]["hint"]
    asked = ask(app, "POST", "/v1/analyze?scale=2", json={})
    assert problem(asked, 422, "request-refused")["errors"][0]["pointer"] == "?scale"
    problem(ask(app, "POST", "/v1/analyze?scale=-1", content=whole, headers=wav), 422, "request-refused")
    problem(ask(app, "POST", "/v1/analyze", content=whole, headers={"Content-Type": "audio/mpeg"}), 415, "not-json")


def test_a_picture_has_the_heights_over_an_area() -> None:
    app = create_app(settings_of(), SynthEngine(0))
    dots = {"kind": "dots", "period": 2e-3, "row_distance": 3e-3, "stagger": 0.5, "dot_height": 40e-6, "phase": 0}
    body = {"scene": {"texture": dots}, "points": 64, "phases": 0, "area": 32}
    texture = ask(app, "POST", "/v1/picture", json=body).json()["texture"]
    heights = np.array(texture["area"])
    assert (texture["period"], texture["across"], heights.shape) == (2e-3, 6e-3, (32, 32))
    assert heights[0] == pytest.approx(texture["heights"][::2], rel=1e-3), "row 0 is the line"
    assert heights[16] == pytest.approx(np.roll(heights[0], 16)), "the second row of dots is half a period further"
    assert np.ptp(heights) == pytest.approx(40e-6, rel=1e-3) and np.ptp(heights[8]) == 0.0
    line = ask(app, "POST", "/v1/picture", json={"points": 64, "phases": 0, "area": 32}).json()["texture"]
    none = ask(app, "POST", "/v1/picture", json=body | {"area": 0}).json()["texture"]
    assert set(line) == set(none) == {"period", "heights"}


def test_an_empty_body_is_the_default_scene() -> None:
    made = ask(create_app(settings_of(), SynthEngine(0)), "POST", "/v1/picture", json={}).json()
    assert len(made["texture"]["heights"]) == picture.POINTS and len(made["touching"]) == picture.PHASES
    assert made["left_out"] == []


@pytest.mark.parametrize(
    ("body", "pointer"),
    [
        ({"points": 15}, "/points"),
        ({"points": 8193}, "/points"),
        ({"points": 64.5}, "/points"),
        ({"points": True}, "/points"),
        ({"points": "64"}, "/points"),
        ({"phases": -1}, "/phases"),
        ({"phases": 1025}, "/phases"),
        ({"area": -1}, "/area"),
        ({"area": 257}, "/area"),
        ({"area": 8.5}, "/area"),
        ({"phase": 3}, ""),
        ({"scan": {}}, ""),
        ([], ""),
        ({"scene": {"texture": {"amplitude": 0}, "finger": {"ridge_amplitude": 0}}}, "/scene/finger/ridge_amplitude"),
        (
            {"scene": {"texture": {"period": 1e-6}, "finger": {"contact_length": 0.1}}, "phases": 1024},
            "/phases",
        ),
    ],
)
def test_an_invalid_picture_is_refused(body: Any, pointer: str) -> None:
    fault = refused(create_app(settings_of(), SynthEngine(0)), body)
    assert fault["pointer"] == pointer and fault["allowed"] and fault["hint"]


def test_the_faults_of_a_scene_point_into_the_body(app: FastAPI, engine: PlainEngine) -> None:
    fault = refused(app, {"scene": {"texture": {"period": "3 s"}}}, "scene-refused")
    assert fault["pointer"] == "/scene/texture/period"
    others: tuple[Any, ...] = (None, "grating-1mm-31um", [], 3)
    for scene in others:
        assert refused(app, {"scene": scene}, "scene-refused")["pointer"] == "/scene"
    assert engine.opened == []


UNSOLVABLE: dict[str, tuple[dict[str, Any], str]] = {
    "a finger too flat": ({"effects": {"curvature": {"radius": 1000}}}, "/finger"),
    "a texture too large for its finger": (
        {
            "finger": {"contact_length": "10 um"},
            "texture": {
                "kind": "dots",
                "period": "0.2 m",
                "row_distance": "0.1 m",
                "dot_diameter": "20 um",
                "dot_height": "1 um",
            },
        },
        "/texture",
    ),
}


@pytest.mark.parametrize("route", ["render", "explain", "sessions", "picture"])
@pytest.mark.parametrize("name", UNSOLVABLE)
def test_a_scene_whose_contact_cannot_be_solved_is_refused_with_its_field(route: str, name: str) -> None:
    scene, pointer = UNSOLVABLE[name]
    within = route == "picture"
    answer = ask(
        create_app(settings_of(), SynthEngine(0)), "POST", f"/v1/{route}", json={"scene": scene} if within else scene
    )
    (fault,) = problem(answer, 422, "scene-refused")["errors"]
    assert fault["pointer"] == ("/scene" if within else "") + pointer
    assert re.search(r"\d u?m\b", fault["value"]) and fault["allowed"] and fault["hint"].startswith("Write ")


def test_the_document_has_the_ranges_of_the_engine() -> None:
    points, phases = BODY["properties"]["points"], BODY["properties"]["phases"]  # type: ignore[index]
    assert (points["minimum"], points["maximum"]) == (picture.FEWEST_POINTS, picture.MOST_POINTS)
    assert (phases["minimum"], phases["maximum"]) == (0, picture.MOST_PHASES)


def test_pictures_count_as_renders() -> None:
    gate = threading.Event()
    engine = PlainEngine(gate=gate)
    app = create_app(settings_of(max_renders=1), engine)
    first = threading.Thread(target=ask, args=(app, "POST", "/v1/picture"), kwargs={"json": {}})
    first.start()
    try:
        until(lambda: engine.opened == ["picture"])
        answer = ask(app, "POST", "/v1/picture", json={})
        problem(answer, 503, "full")
        assert answer.headers["retry-after"]
    finally:
        gate.set()
        first.join()
    assert ask(app, "POST", "/v1/picture", json={}).status_code == 200


def test_the_service_answers_while_a_picture_is_made() -> None:
    gate = threading.Event()
    engine = PlainEngine(gate=gate)
    app = create_app(settings_of(), engine)
    first = threading.Thread(target=ask, args=(app, "POST", "/v1/picture"), kwargs={"json": {}})
    first.start()
    try:
        until(lambda: engine.opened == ["picture"])
        assert ask(app, "GET", "/healthz").status_code == 200
    finally:
        gate.set()
        first.join()


def test_a_threshold_is_that_of_the_curve(app: FastAPI) -> None:
    made = ask(app, "GET", "/v1/threshold?name=fingertip&low=10&high=1000&points=3").json()
    assert made["name"] == "fingertip"
    assert made["frequencies"] == pytest.approx([10.0, 100.0, 1000.0])
    (felt,) = ask(app, "GET", "/v1/threshold?low=300&high=600&points=2").json()["displacement"][:1]
    assert felt == pytest.approx(1e-6 * 10 ** (-18 / 20))  # -18 dB re 1 um, the lowest there is
    assert len(ask(app, "GET", "/v1/threshold").json()["displacement"]) == 200


def test_every_curve_is_available(app: FastAPI) -> None:
    assert set(get_args(ThresholdParameters.model_fields["name"].annotation)) == set(THRESHOLDS)
    assert ask(app, "GET", "/v1/threshold").json()["name"] == DEFAULT
    for name in THRESHOLDS:
        made = ask(app, "GET", f"/v1/threshold?name={name}").json()
        assert made["name"] == name and all(felt > 0 and math.isfinite(felt) for felt in made["displacement"])


@pytest.mark.parametrize(
    ("query", "pointer"),
    [
        ("name=elbow", "?name"),
        ("low=0", "?low"),
        ("high=1e6", "?high"),
        ("low=nan", "?low"),
        ("points=1", "?points"),
        ("points=10001", "?points"),
        ("low=100&high=100", "?low"),
        ("colour=red", "?colour"),
    ],
)
def test_an_invalid_threshold_is_refused(app: FastAPI, query: str, pointer: str) -> None:
    document = problem(ask(app, "GET", f"/v1/threshold?{query}"), 422, "request-refused")
    assert document["errors"][0]["pointer"] == pointer


@pytest.mark.parametrize(
    ("query", "allowed", "hint"),
    [
        ("threshold?low=0", "0.1 to 100000 Hz", "Write a number without its unit, such as 0.1."),
        ("threshold?points=1e9", "a whole number, 2 to 10000", "Write a number, such as 2."),
        ("threshold?name=fingertop", "fingertip, probe, pen", "Write fingertip."),
        ("threshold?colour=red", "the parameters name, low, high, points", "Leave it out."),
        ("threshold?lo=1", "the parameters name, low, high, points", 'The nearest known parameter is "low".'),
        ("sessions/none/stream?duration=1s", "0.001 s or more", "Write a number without its unit, such as 0.001."),
        ("textures/none/surface?format=x3", "npy, x3p", "Write x3p."),
    ],
)
def test_a_fault_of_a_query_has_the_range_with_its_unit_and_what_to_write(
    app: FastAPI, query: str, allowed: str, hint: str
) -> None:
    (fault,) = problem(ask(app, "GET", f"/v1/{query}"), 422, "request-refused")["errors"]
    assert (fault["allowed"], fault["hint"]) == (allowed, hint)
