"""`POST /v1/accuracy`: the document, its refusals, one at a time, and what never waits for it."""

from __future__ import annotations

import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager

import httpx
import numpy as np
import pytest
from fastapi import FastAPI

from service.compute.accuracy_process import measure_apart
from service.compute.measurements import RETRY_SECONDS
from synth.errors import CannotRender, InvalidRequest, SceneError
from synth.scene.scene import parse_scene
from tests.accuracy_case import CHOSEN, document
from tests.service.harness import Running, ask, kept_engine, problem, serving, until
from tests.service.plain_engine import PlainEngine

CHANNELS = {"output": {"channels": ["acceleration", "displacement"]}}


@contextmanager
def measuring(running: Running, engine: PlainEngine) -> Iterator[list[httpx.Response]]:
    """Within, a measurement that does not end by itself is under way; what it is answered arrives in the list."""
    engine.slow = True
    answers: list[httpx.Response] = []
    thread = threading.Thread(
        target=lambda: answers.append(httpx.post(f"{running.url}/v1/accuracy", json={}, timeout=60.0))
    )
    thread.start()
    until(lambda: "accuracy" in engine.opened)
    yield answers
    running.service.measurements.close()
    thread.join(60.0)


def test_the_answer_is_the_document(app: FastAPI) -> None:
    answer = ask(app, "POST", "/v1/accuracy", json={"scan": {"load": "0.1 N"}})
    assert (answer.status_code, answer.headers["content-type"]) == (200, "application/json")
    made = answer.json()
    assert made["scene"]["scan"]["load"] == 0.1
    assert made["methods"] == document()["methods"]


def test_where_there_is_no_error_the_decibels_are_null_over_the_wire(running: Running) -> None:
    answer = running.client.post("/v1/accuracy", json={})
    assert b"Infinity" not in answer.content and b"NaN" not in answer.content
    free = [row for row in answer.json()["methods"] if row["max_error"] == 0.0]
    assert free and all(row["worst_harmonic_db"] is None and row["threshold_margin_db"] is None for row in free)


@pytest.mark.parametrize(
    ("query", "quantity"),
    [("", "acceleration"), ("?quantity=displacement", "displacement"), ("?live=true", "acceleration")],
)
def test_the_quantity_is_the_first_or_the_one_asked_for(app: FastAPI, query: str, quantity: str) -> None:
    assert ask(app, "POST", f"/v1/accuracy{query}", json=CHANNELS).json()["quantity"] == quantity


@pytest.mark.parametrize("query", ["?quantity=velocity", "?quantity=loudness", "?quantity=", "?quantty=velocity"])
def test_a_quantity_that_the_scene_lacks_is_refused_by_name(app: FastAPI, engine: PlainEngine, query: str) -> None:
    answer = ask(app, "POST", f"/v1/accuracy{query}", json=CHANNELS)
    (fault,) = problem(answer, 422, "request-refused")["errors"]
    assert fault["pointer"] == query.partition("=")[0]
    assert engine.opened == []


def test_a_wrong_scene_is_refused_with_its_field(app: FastAPI) -> None:
    answer = ask(app, "POST", "/v1/accuracy", json={"scan": {"load": -1}})
    assert problem(answer, 422, "scene-refused")["errors"][0]["pointer"] == "/scan/load"


def test_a_form_and_a_large_body_are_refused_as_everywhere(app: FastAPI) -> None:
    problem(ask(app, "POST", "/v1/accuracy", data={"scene": "{}"}), 415, "not-json")
    problem(ask(app, "POST", "/v1/accuracy", json={"x": "y" * 2_000_000}), 413, "too-large")


def test_what_cannot_be_measured_says_why(app: FastAPI, engine: PlainEngine) -> None:
    engine.refuse = "Nothing moves."
    answer = ask(app, "POST", "/v1/accuracy", json={})
    assert problem(answer, 503, "cannot-render")["detail"] == "Nothing moves."


def test_a_bug_of_ours_is_an_id_and_the_next_measurement_runs(app: FastAPI, engine: PlainEngine) -> None:
    engine.mistake = True
    answer = ask(app, "POST", "/v1/accuracy", json={})
    assert "secret" not in answer.text
    assert problem(answer, 500, "internal")["instance"].startswith("urn:uuid:")
    engine.mistake = False
    assert ask(app, "POST", "/v1/accuracy", json={}).status_code == 200


def test_a_second_one_is_told_to_come_back_and_the_first_goes_on(running: Running, engine: PlainEngine) -> None:
    with measuring(running, engine) as answers:
        second = running.client.post("/v1/accuracy", json={})
        problem(second, 503, "full")
        assert second.headers["retry-after"] == str(RETRY_SECONDS)
        assert not answers and engine.opened.count("accuracy") == 1


def test_it_takes_no_place_among_renders_and_no_thread_of_theirs() -> None:
    engine = PlainEngine()
    with serving(engine, max_renders=1) as running, measuring(running, engine):
        for _ in range(3):
            assert running.client.post("/v1/render", json={"output": {"duration": 0.1}}).status_code == 200
        assert running.client.post("/v1/explain", json={}).status_code == 200


def test_a_stream_plays_on_meanwhile(running: Running, engine: PlainEngine) -> None:
    session = running.open_session()
    with running.listening(session) as listener:
        listener.frames(480)
        with measuring(running, engine):
            assert np.abs(listener.frames(48000)).max() > 0.5


def test_who_hangs_up_ends_the_measurement_and_makes_room(running: Running, engine: PlainEngine) -> None:
    engine.slow = True
    host, _, port = running.url.removeprefix("http://").rpartition(":")
    with socket.create_connection((host, int(port))) as client:
        head = (
            f"POST /v1/accuracy HTTP/1.1\r\nHost: {host}\r\nContent-Type: application/json\r\nContent-Length: 2\r\n\r\n"
        )
        client.sendall(head.encode() + b"{}")
        until(lambda: "accuracy" in engine.opened)
        assert "given up" not in engine.opened
    until(lambda: "given up" in engine.opened)
    engine.slow = False
    until(lambda: running.client.post("/v1/accuracy", json={}).status_code == 200)


def test_a_shutdown_ends_it_and_takes_no_more(running: Running, engine: PlainEngine) -> None:
    with measuring(running, engine) as answers:
        running.service.begin_closing()
        until(lambda: bool(answers))
    assert engine.opened[-1] == "given up"
    problem(running.client.post("/v1/accuracy", json={}), 503, "closing")


def test_openapi_has_every_field_of_the_document(app: FastAPI) -> None:
    described = ask(app, "GET", "/openapi.json").json()
    schema = described["components"]["schemas"]["AccuracyTable"]
    made = document()
    assert set(schema["properties"]) == set(made)
    assert set(schema["properties"]["methods"]["items"]["properties"]) == set(made["methods"][0])
    call = described["paths"]["/v1/accuracy"]["post"]
    assert call["responses"]["200"]["content"] == {
        "application/json": {"schema": {"$ref": "#/components/schemas/AccuracyTable"}}
    }
    assert [parameter["name"] for parameter in call["parameters"]] == ["quantity", "live"]
    assert {"200", "413", "415", "422", "503"} <= set(call["responses"])


def test_a_measurement_that_nobody_waits_for_is_never_begun_or_is_ended() -> None:
    given_up = threading.Event()
    given_up.set()
    with pytest.raises(CannotRender, match="given up"):
        measure_apart(parse_scene({}), None, given_up)


@pytest.mark.usefixtures("own_process")
def test_the_measuring_process_hands_on_that_a_scene_is_refused() -> None:
    flat = {"finger": {"kind": "probe", "tip_radius": "100 mm", "youngs_modulus": "1 kPa"}, "scan": {"load": "900 N"}}
    with pytest.raises(SceneError, match="which touches within"):
        measure_apart(parse_scene(flat), None, threading.Event())


@pytest.mark.thorough
@pytest.mark.usefixtures("own_process")
def test_the_measuring_process_hands_on_that_a_quantity_is_missing_or_a_scene_silent() -> None:
    with pytest.raises(InvalidRequest) as refused:
        measure_apart(parse_scene({}), "velocity", threading.Event())
    assert "velocity" in refused.value.faults[0].value and not isinstance(refused.value, SceneError)
    with pytest.raises(InvalidRequest, match="silent"):
        measure_apart(parse_scene({"texture": {"amplitude": 0}}), None, threading.Event())


@pytest.mark.usefixtures("own_process")
def test_a_measuring_process_that_fails_is_our_bug(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("service.compute.accuracy_process.scene_document", lambda _scene: {"nothing": "known"})
    with pytest.raises(RuntimeError, match="the measuring process ended with 1"):
        measure_apart(parse_scene({}), None, threading.Event())


def test_a_measuring_process_that_the_system_kills_is_no_bug(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("service.compute.accuracy_process._answer_of_process", lambda _asked, _given_up: (-9, b"", b""))
    with pytest.raises(CannotRender, match="memory"):
        measure_apart(parse_scene({}), None, threading.Event())


@pytest.mark.usefixtures("made_up_measurement")
def test_the_engine_measures_over_the_wire() -> None:
    with serving(kept_engine()) as running:
        answer = running.client.post("/v1/accuracy", json={"scan": {"load": 0.1}}, timeout=500.0)
    assert answer.status_code == 200, answer.text
    made = answer.json()
    assert (made["scene"]["scan"]["load"], made["quantity"], made["chosen"]) == (0.1, "acceleration", CHOSEN)
    assert made["methods"] == document()["methods"]
