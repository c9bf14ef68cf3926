"""Effects over HTTP: renders in every format, plans, sessions of two channels, changes, and what is refused."""

from __future__ import annotations

import io
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
import soundfile

from synth import open_voice, parse_scene, render
from synth.encode.formats import quantise
from tests.file_metadata import read_metadata
from tests.service.harness import START, Running, kept_engine, problem, serving, until

RATE = 8000
QUICK: dict[str, Any] = {
    "output": {"quantity": "displacement", "sample_rate": RATE, "duration": 0.1},
    "accuracy": {"tolerance": 1e-2},
}


@pytest.fixture(scope="module")
def running(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Running]:
    with serving(kept_engine(), file_folder=tmp_path_factory.mktemp("recordings")) as server:
        until(lambda: server.client.get("/readyz").status_code == 200, START)
        yield server


@pytest.mark.parametrize("effects", [{"inertia": {}}, {"viscous_skin": {}}, {"curvature": {}, "tangential": {}},
                                     {"propagation": {}},
                                     {"adhesion": {}, "inertia": {}, "tangential": {}}], ids="+".join)  # fmt: skip
def test_a_render_is_the_engines_in_every_format(running: Running, effects: dict[str, Any]) -> None:
    document = QUICK | {"effects": effects}
    scene = parse_scene(document)
    wanted, scales = render(scene).frames, open_voice(scene).full_scale
    for name in ("wav", "flac", "l16", "f32le"):
        answer = running.client.post(f"/v1/render?format={name}", json=document)
        assert answer.status_code == 200, answer.text
        assert tuple(float(text) for text in answer.headers["ridgewave-full-scale"].split(", ")) == scales
        if name == "f32le":
            assert answer.content == wanted.astype("<f4").tobytes()
            assert answer.headers["ridgewave-quantities"].split(", ") == list(open_voice(scene).quantities)
        elif name == "l16":
            assert answer.content == quantise(wanted, 16).astype(">i2").tobytes()
        else:
            samples, _rate = soundfile.read(io.BytesIO(answer.content), dtype="float32", always_2d=True)
            np.testing.assert_allclose(samples, wanted, rtol=0, atol=0.0 if name == "wav" else 2.0**-22)
            metadata = read_metadata(answer.content)
            assert metadata is not None and metadata.full_scale == scales


def test_explain_says_what_auto_chose_and_why(running: Running) -> None:
    effects = {"inertia": "auto", "contact_growth": "auto"}
    document = running.client.post("/v1/explain", json=QUICK | {"effects": effects}).json()
    named = {one["name"]: one for part in ("simulated", "left_out") for one in document[part]}
    assert set(effects) <= set(named)
    for name in effects:
        assert "of its peak-to-peak" in named[name]["reason"]


def test_a_session_with_a_force_has_two_channels_and_two_scales(running: Running) -> None:
    session = running.open_session(QUICK | {"effects": {"tangential": {}}})
    shown = running.client.get(f"/v1/sessions/{session}").json()
    assert shown["channels"] == 2 and shown["quantities"] == ["displacement", "tangential_force"]
    assert len(shown["full_scale"]) == 2
    answer = running.client.get(f"/v1/sessions/{session}/stream?duration=0.1&format=f32le")
    assert len(answer.headers["ridgewave-full-scale"].split(", ")) == 2
    assert answer.headers["ridgewave-format"] == f"f32le;rate={RATE};channels=2"
    samples = np.frombuffer(answer.content, "<f4").reshape(-1, 2)
    assert len(samples) == round(0.1 * RATE) and np.all(np.ptp(samples, axis=0) > 0.0)


@pytest.mark.parametrize("adding", [True, False], ids=["adding", "taking away"])
@pytest.mark.parametrize("streaming", [True, False], ids=["streaming", "idle"])
def test_a_change_of_the_channels_is_refused(running: Running, adding: bool, streaming: bool) -> None:
    session = running.open_session(QUICK if adding else QUICK | {"effects": {"tangential": {}}})
    patch: dict[str, Any] = {"effects": {"tangential": {} if adding else None}}
    if streaming:
        with running.listening(session, channels=1 if adding else 2) as listener:
            listener.frames(100)
            answer = running.client.patch(f"/v1/sessions/{session}", json=patch)
    else:
        answer = running.client.patch(f"/v1/sessions/{session}", json=patch)
    (fault,) = problem(answer, 409, "fixed")["errors"]
    assert fault["pointer"] == "/effects" and "session" in fault["hint"]
    assert "tangential_force" in f"{fault['value']} {fault['allowed']}"


def test_the_full_scale_of_an_added_channel_is_fixed_too(running: Running) -> None:
    session = running.open_session(QUICK | {"effects": {"tangential": {}}})
    before = running.client.get(f"/v1/sessions/{session}").json()
    answer = running.client.patch(f"/v1/sessions/{session}", json={"effects": {"tangential": {"full_scale": "7 N"}}})
    (fault,) = problem(answer, 409, "fixed")["errors"]
    assert fault["pointer"] == "/effects/tangential/full_scale"
    change = {"effects": {"tangential": {"friction_coefficient": 0.2}}}
    assert running.client.patch(f"/v1/sessions/{session}", json=change).status_code == 200
    after = running.client.get(f"/v1/sessions/{session}").json()
    assert after["full_scale"] == before["full_scale"]
    assert after["scene"]["effects"]["tangential"]["friction_coefficient"] == 0.2


def test_a_session_that_propagates_keeps_its_channel_and_takes_another_place(running: Running) -> None:
    session = running.open_session(QUICK | {"effects": {"propagation": {}}})
    shown = running.client.get(f"/v1/sessions/{session}").json()
    assert shown["quantities"] == ["displacement", "propagated_displacement"]
    change: dict[str, Any] = {"effects": {"propagation": {"place": "skin"}}}
    assert running.client.patch(f"/v1/sessions/{session}", json=change).status_code == 200
    change = {"effects": {"propagation": {"quantity": "velocity"}}}
    answer = running.client.patch(f"/v1/sessions/{session}", json=change)
    (fault,) = problem(answer, 422, "scene-refused")["errors"]
    assert fault["pointer"] == "/effects/propagation/quantity"


def test_settings_of_an_effect_are_changed_by_a_patch(running: Running) -> None:
    session = running.open_session(QUICK | {"effects": {"inertia": {"mass": "5 g", "damping": 2}}})
    answer = running.client.patch(f"/v1/sessions/{session}", json={"effects": {"inertia": {"mass": "8 g"}}})
    assert answer.status_code == 200, answer.text
    effects = running.client.get(f"/v1/sessions/{session}").json()["scene"]["effects"]
    assert (effects["inertia"]["mass"], effects["inertia"]["damping"]) == (0.008, 2.0)
    answer = running.client.patch(f"/v1/sessions/{session}", json={"effects": {"inertia": None, "viscous_skin": {}}})
    assert answer.status_code == 200, answer.text
    assert set(running.client.get(f"/v1/sessions/{session}").json()["scene"]["effects"]) == {"viscous_skin"}


@pytest.mark.parametrize(
    ("effects", "pointer", "words"),
    [
        ({"inertia": {"mass": "2 kg"}}, "/effects/inertia/mass", ("1 kg",)),
        ({"inertia": {"damping": -1}}, "/effects/inertia/damping", ("N s/m",)),
        ({"viscous_skin": {"time_constant": "5 mm"}}, "/effects/viscous_skin/time_constant", ("s",)),
        ({"adhesion": {"stress": 0}}, "/effects/adhesion/stress", ("Pa",)),
        ({"tangential": {"friction_coefficient": 11}}, "/effects/tangential/friction_coefficient", ("10",)),
        ({"tangential": "auto"}, "/effects/tangential", ("null",)),
        ({"propagation": {"distance": "1 m"}}, "/effects/propagation/distance", ("500 mm",)),
        ({"propagation": {"quantity": "velocity"}}, "/effects/propagation/quantity", ("displacement", "velocity")),
        ({"contact_growth": {"exponent": 2}}, "/effects/contact_growth/exponent", ("1",)),
        ({"curvature": {"radius": "1 um"}}, "/effects/curvature/radius", ("mm",)),
        ({"inertial": {}}, "/effects/inertial", ("inertia",)),
        ({"inertia": {"weight": 1}}, "/effects/inertia/weight", ("mass",)),
        ({"inertia": 5}, "/effects/inertia", ("object",)),
    ],
    ids=lambda value: value if isinstance(value, str) else None,
)  # fmt: skip
def test_a_bad_setting_is_told_with_its_range(
    running: Running, effects: dict[str, Any], pointer: str, words: tuple[str, ...]
) -> None:
    answer = running.client.post("/v1/render", json=QUICK | {"effects": effects})
    (fault,) = problem(answer, 422, "scene-refused")["errors"]
    assert fault["pointer"] == pointer
    assert fault["hint"]
    assert all(word in f"{fault['allowed']} {fault['hint']}" for word in words), fault
