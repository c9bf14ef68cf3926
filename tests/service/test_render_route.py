"""`POST /v1/render` and `/v1/explain` with the plain engine: formats, sizes, headers and limits."""

from __future__ import annotations

import errno
import io
import tempfile
from typing import Any

import numpy as np
import pytest
import soundfile
from fastapi import FastAPI

from service.app import create_app
from service.compute.render_steps import WHOLE_SAMPLES
from service.compute.renders import UnderWay
from synth.encode.formats import SoundFormat, encode_all, quantise
from synth.scene.scene import parse_scene
from tests.file_metadata import read_metadata
from tests.service.harness import ask, problem, settings_of
from tests.service.plain_engine import FULL_SCALE, PlainEngine, sine

SHORT = {"output": {"duration": 0.25, "channels": ["acceleration", "displacement"]}}
LONG = {"output": {"duration": 1.5 * WHOLE_SAMPLES / 48000 / 2, "channels": ["acceleration", "displacement"]}}


def expected(scene: dict[str, Any]) -> Any:
    parsed = parse_scene(scene)
    return sine(parsed, 0, round(parsed.output.duration * parsed.output.sample_rate))


@pytest.mark.parametrize("scene", [SHORT, LONG], ids=["in one piece", "piece by piece"])
@pytest.mark.parametrize("name", ["wav", "wav16", "wav24", "flac"])
def test_a_file_holds_the_voice_to_the_last_frame(app: FastAPI, scene: dict[str, Any], name: str) -> None:
    answer = ask(app, "POST", f"/v1/render?format={name}", json=scene)
    assert answer.status_code == 200
    assert int(answer.headers["content-length"]) == len(answer.content)
    assert answer.headers["content-type"] == ("audio/flac" if name == "flac" else "audio/wav")
    bits = {"wav": None, "wav16": 16}.get(name, 24)
    if bits is None:
        samples, rate = soundfile.read(io.BytesIO(answer.content), dtype="float32")
        wanted = expected(scene)
    else:
        samples, rate = soundfile.read(io.BytesIO(answer.content), dtype="int32")
        wanted = quantise(expected(scene), bits) << (32 - bits)
    assert rate == 48000
    np.testing.assert_array_equal(samples, wanted)
    metadata = read_metadata(answer.content)
    assert metadata is not None and metadata.full_scale == (FULL_SCALE, FULL_SCALE)


@pytest.mark.parametrize("name", ["wav", "wav16", "wav24"])
def test_a_sound_sent_in_pieces_equals_the_file(app: FastAPI, name: str) -> None:
    answer = ask(app, "POST", f"/v1/render?format={name}", json=LONG)
    assert len(answer.content) > 3_000_000
    metadata = read_metadata(answer.content)
    assert answer.content == encode_all(expected(LONG), SoundFormat(name), 48000, metadata)


@pytest.mark.parametrize("scene", [SHORT, LONG], ids=["in one piece", "piece by piece"])
def test_raw_samples_are_described_by_headers(app: FastAPI, scene: dict[str, Any]) -> None:
    answer = ask(app, "POST", "/v1/render", json=scene, headers={"Accept": "application/octet-stream"})
    assert answer.content == expected(scene).astype("<f4").tobytes()
    assert answer.headers["ridgewave-format"] == "f32le;rate=48000;channels=2"
    assert answer.headers["ridgewave-full-scale"] == "12.5, 12.5"
    assert answer.headers["ridgewave-quantities"] == "acceleration, displacement"


def test_l16_is_big_endian_with_its_rate(app: FastAPI) -> None:
    answer = ask(app, "POST", "/v1/render", json=SHORT, headers={"Accept": "audio/L16"})
    assert answer.headers["content-type"] == "audio/L16;rate=48000;channels=2"
    assert answer.content == quantise(expected(SHORT), 16).astype(">i2").tobytes()


def test_l16_above_48_khz_is_refused_with_the_field(app: FastAPI) -> None:
    answer = ask(app, "POST", "/v1/render?format=l16", json={"output": {"sample_rate": 96000}})
    assert problem(answer, 422, "request-refused")["errors"][0]["pointer"] == "/output/sample_rate"


def test_server_timing_names_the_stages(app: FastAPI) -> None:
    answer = ask(app, "POST", "/v1/render", json=SHORT)
    stages = [entry.partition(";dur=") for entry in answer.headers["server-timing"].split(", ")]
    assert [name for name, _, _ in stages] == ["scene", "voice", "render", "encode"]
    assert all(float(milliseconds) >= 0 for _, _, milliseconds in stages)


@pytest.mark.parametrize("route", ["explain", "analyze"])
def test_documents_that_are_computed_tell_their_stages(app: FastAPI, route: str) -> None:
    answer = ask(app, "POST", f"/v1/{route}", json={})
    stages = [entry.partition(";dur=") for entry in answer.headers["server-timing"].split(", ")]
    assert [name for name, _, _ in stages] == ["scene", route, "encode"]
    assert all(float(took) >= 0.0 for _, _, took in stages)


def test_without_an_acceptable_format_nothing_is_rendered(app: FastAPI, engine: PlainEngine) -> None:
    answer = ask(app, "POST", "/v1/render", json=SHORT, headers={"Accept": "audio/mpeg"})
    problem(answer, 406, "not-acceptable")
    assert engine.opened == []


@pytest.mark.parametrize(
    "query", ["?format=mp3", "?formt=wav", "?format=wav&format=", "?format=flac&format=wav", "?format=WAV"]
)
def test_a_wrong_parameter_is_refused_by_name(app: FastAPI, query: str) -> None:
    answer = ask(app, "POST", f"/v1/render{query}", json={})
    assert problem(answer, 422, "request-refused")["errors"][0]["pointer"].startswith("?form")


def test_flac_at_a_rate_that_it_cannot_hold_is_refused_with_the_rule(app: FastAPI, engine: PlainEngine) -> None:
    for rate in (65_537, 96_001):
        scene = {"output": {"duration": 0.01, "sample_rate": rate}}
        (fault,) = problem(ask(app, "POST", "/v1/render?format=flac", json=scene), 422, "request-refused")["errors"]
        assert fault["pointer"] == "/output/sample_rate" and "multiples of 10 Hz" in fault["allowed"]
        answer = ask(app, "POST", "/v1/render", json=scene, headers={"Accept": "audio/flac, audio/wav;q=0.1"})
        assert answer.headers["content-type"] == "audio/wav"
        answer = ask(app, "POST", "/v1/render", json=scene, headers={"Accept": "audio/flac"})
        assert "audio/flac" not in problem(answer, 406, "not-acceptable")["detail"]


def test_a_render_beyond_the_longest_is_refused_with_the_field(app: FastAPI) -> None:
    answer = ask(app, "POST", "/v1/render", json={"output": {"duration": 3601}})
    (fault,) = problem(answer, 422, "scene-refused")["errors"]
    assert fault["pointer"] == "/output/duration" and "3600 s" in fault["allowed"]


def test_warnings_are_in_a_header(app: FastAPI, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tests.service.plain_engine.PlainVoice.warnings", ("below 1 nm:\nsilence", "2 µm"))
    answer = ask(app, "POST", "/v1/render", json=SHORT)
    assert answer.headers["ridgewave-warning"] == "below 1 nm: silence 2 ?m"


def test_too_many_renders_get_503_and_retry_after() -> None:
    app = create_app(settings_of(max_renders=1), PlainEngine())
    service = app.state.service
    running = UnderWay(service.renders, "somebody")
    service.renders._all.add(running)
    answer = ask(app, "POST", "/v1/render", json={})
    problem(answer, 503, "full")
    assert answer.headers["retry-after"] == "1"
    running.close()
    assert [ask(app, "POST", "/v1/render", json=LONG).status_code for _ in range(3)] == [200] * 3
    assert service.renders.under_way == 0
    service.finish()


def test_explain_returns_the_plan(app: FastAPI) -> None:
    answer = ask(app, "POST", "/v1/explain", json={"scan": {"load": "0.1 N"}})
    assert answer.status_code == 200
    assert answer.json()["scene"]["scan"]["load"] == 0.1


def test_a_render_that_is_not_possible_has_its_reason(app: FastAPI, engine: PlainEngine) -> None:
    engine.refuse = "the moon is in the way."
    document = problem(ask(app, "POST", "/v1/render", json={}), 503, "cannot-render")
    assert document["detail"] == "the moon is in the way."


@pytest.mark.parametrize("path", ["/v1/render", "/v1/explain", "/v1/sessions"])
def test_an_internal_error_shows_an_id_and_nothing_else(
    app: FastAPI, engine: PlainEngine, path: str, caplog: pytest.LogCaptureFixture
) -> None:
    engine.mistake = True
    answer = ask(app, "POST", path, json={})
    document = problem(answer, 500, "internal")
    assert "secret" not in answer.text and "Traceback" not in answer.text
    assert document["instance"].startswith("urn:uuid:")
    assert document["instance"] in caplog.text and "a secret that no peer may learn" in caplog.text


class FullDisk(io.BytesIO):
    """A temporary file on a full disk. Closing it writes what its buffer holds, as for any file of Python."""

    name = 16

    def close(self) -> None:
        raise OSError(errno.ENOSPC, "No space left on device", "/secret/ridgewave-x")

    def write(self, data: Any) -> int:
        raise OSError(errno.ENOSPC, "No space left on device", "/secret/ridgewave-x")


def test_a_long_flac_without_room_for_its_temporary_file_has_its_reason(
    app: FastAPI, monkeypatch: pytest.MonkeyPatch
) -> None:
    long = {"output": {"duration": 1.5 * WHOLE_SAMPLES / 48000}}
    monkeypatch.setattr(tempfile, "TemporaryFile", lambda **_: FullDisk())
    detail = problem(ask(app, "POST", "/v1/render?format=flac", json=long), 503, "cannot-render")["detail"]
    assert "temporary file" in detail and "request WAV" in detail and "secret" not in detail

    def none(**_: object) -> None:
        raise FileNotFoundError(errno.ENOENT, "No usable temporary directory found in ['/secret']")

    monkeypatch.setattr(tempfile, "TemporaryFile", none)
    detail = problem(ask(app, "POST", "/v1/render?format=flac", json=long), 503, "cannot-render")["detail"]
    assert "temporary file" in detail and "secret" not in detail
