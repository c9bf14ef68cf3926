"""The safety limiter is last on every way that live, device or integer sound leaves, and nothing asks it away.

One scene goes every way whose full scale is 30,000 times too small: what is merely clipped would be a row of -1 and 1.
"""

from __future__ import annotations

import io
import json
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import numpy.typing as npt
import pytest
import soundfile

from clients.command_line import main
from service.app import create_app
from service.operations.settings import setting_fields
from service.operations.settings_environment import read_settings
from synth import open_voice, parse_scene
from synth.arrays import Block
from synth.encode.formats import ENDINGS, SoundFormat
from synth.encode.samples import quantise
from synth.scene.scene import scene_schema
from synth.voice.limiter import Limiter, look_ahead
from tests.conftest import RunsRidgewave
from tests.service.alsa_recorder import DEVICE, AlsaRecorder, Listening, require_portaudio
from tests.service.harness import Child, Running, kept_engine, problem, serving, until
from tests.service.live.client import live
from tests.service.plain_engine import PlainEngine

RATE = 8000
OUTPUT = {"sample_rate": RATE, "duration": 1.0, "full_scale": 1e-3, "bandwidth": "full"}
SCENE: dict[str, Any] = {"output": OUTPUT}
ON_A_DEVICE = {"output": {**OUTPUT, "sample_rate": 48000, "duration": 0.3}}
INTEGERS = [sound_format for sound_format in SoundFormat if not sound_format.is_float]
STREAMED = [sound_format for sound_format in SoundFormat if sound_format is not SoundFormat.FLAC]
OFF = {name: "off" for name in ("limiter", "limit", "safety", "clip")} | {"unlimited": "1", "gain_reduction": "0"}
SWITCH = re.compile(r"limiter|unlimit|safety|clip|headroom|gain_reduction")

Samples = npt.NDArray[Any]


@pytest.fixture(scope="module")
def running(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Running]:
    with serving(kept_engine(), file_folder=tmp_path_factory.mktemp("recordings"), lead=0.0) as server:
        yield server


@pytest.fixture(scope="module")
def rendered() -> Block:
    return open_voice(parse_scene(SCENE)).render(RATE)


def decoded(body: bytes, sound_format: SoundFormat) -> Samples:
    """Return the samples of one channel: float32, or integers of the format's bits."""
    if sound_format is SoundFormat.L16:
        return np.frombuffer(body, ">i2")
    if sound_format is SoundFormat.F32LE:
        return np.frombuffer(body, "<f4")
    samples: Samples
    samples, _ = soundfile.read(io.BytesIO(body), dtype="float32" if sound_format.is_float else "int32")
    return samples if sound_format.is_float else samples >> (32 - sound_format.bits)


def is_limited(sound: Samples, bits: int = 32) -> bool:
    """Return whether `sound` is within full scale, reaches it nearly, and is hardly ever at it."""
    level = np.abs(sound.astype(float)) / (1.0 if bits == 32 else 2.0 ** (bits - 1))
    at_the_edge = np.count_nonzero(level >= 1.0 - 2.0 ** (2 - min(bits, 24)))
    return bool(0.5 < level.max() <= 1.0 and at_the_edge < 0.05 * len(level))


def wanted(rendered: Block, bits: int) -> Samples:
    """Return the whole render, limited and rounded."""
    limited = np.concatenate(list(Limiter(1, RATE, look_ahead(RATE)).limited([rendered])))
    return quantise(limited, bits)[:, 0]


def test_the_scene_is_far_too_loud_and_clipping_would_be_seen(rendered: Block) -> None:
    assert np.abs(rendered).max() > 1e4
    assert not is_limited(rendered)
    assert not is_limited(np.clip(rendered, -1, 1))
    assert not is_limited(quantise(rendered, 16), 16)


@pytest.mark.parametrize("at_once", [1 << 20, 1 << 10], ids=["whole", "piece by piece"])
@pytest.mark.parametrize("sound_format", SoundFormat)
def test_integer_answers_are_limited_and_float_ones_are_whole(
    running: Running, rendered: Block, monkeypatch: pytest.MonkeyPatch, sound_format: SoundFormat, at_once: int
) -> None:
    monkeypatch.setattr("service.compute.render_steps.WHOLE_SAMPLES", at_once)
    monkeypatch.setattr("service.compute.render_steps.PIECE_SAMPLES", 1000)
    answer = running.client.post(f"/v1/render?format={sound_format}", json=SCENE, headers=headers_off())
    assert answer.status_code == 200, answer.text
    sound = decoded(answer.content, sound_format)
    if sound_format.is_float:
        np.testing.assert_array_equal(sound, rendered[:, 0])
    else:
        np.testing.assert_array_equal(sound, wanted(rendered, sound_format.bits))
        assert is_limited(sound, sound_format.bits)
    told = "ridgewave-warning" in answer.headers
    assert told == (not sound_format.is_float and (at_once > RATE or sound_format is SoundFormat.FLAC))
    assert not told or re.search(r"limiter .* by up to \d+\.\d dB", answer.headers["ridgewave-warning"])


@pytest.mark.parametrize("sound_format", STREAMED)
def test_streams_are_limited_floats_too(running: Running, sound_format: SoundFormat) -> None:
    session = running.open_session(SCENE)
    path = f"/v1/sessions/{session}/stream?duration=0.3&format={sound_format}"
    answer = running.client.get(path, headers=headers_off())
    assert answer.status_code == 200, answer.text
    assert is_limited(decoded(answer.content, sound_format), sound_format.bits)


@pytest.mark.parametrize(("name", "kind", "bits"), [("f32le", "<f4", 32), ("s16le", "<i2", 16)])
def test_live_streams_are_limited_floats_too(running: Running, name: str, kind: str, bits: int) -> None:
    with live(running) as client:
        client.hello(scene=SCENE, format=name)
        for seq, (speed, load) in enumerate([(0.1, 0.5), (0.3, 1.0), (-0.3, 0.2), (0.2, 0.8)], 1):
            client.contact(seq, speed=speed, load=load)
            client.say("more", frames=RATE // 4)
            while client.sound < seq * RATE // 4 * bits // 8:
                assert client.next() is not None
        client.say("stop")
        client.until("end")
        sound = np.frombuffer(b"".join(part for part in client.received if isinstance(part, bytes)), kind)
    assert is_limited(sound, bits)
    assert max(message["gain_reduction_db"] for message in client.texts("limited")) > 60.0


@pytest.mark.parametrize("name", OFF)
def test_no_field_of_a_live_message_is_its_switch(running: Running, name: str) -> None:
    with live(running) as client:
        client.say("hello", scene=SCENE, **{name: OFF[name]})
        client.rest()
        assert client.code == 1008 and client.texts("problem")[0]["problem"] == "/docs#problem-message-refused"


def test_a_change_is_limited_too(running: Running) -> None:
    session = running.open_session({"output": OUTPUT, "scan": {"load": 0.0}})
    with running.listening(session) as listener:
        assert not listener.frames(RATE // 10).any()
        patch = {"scan": {"load": "1 N", "speed": "300 mm/s"}}
        assert running.client.patch(f"/v1/sessions/{session}", json=patch, headers=headers_off()).status_code == 200
        assert is_limited(listener.frames(RATE // 2))


@pytest.mark.parametrize("name", ["take.wav", "take.flac"])
def test_plays_are_limited_and_tell_so(running: Running, name: str) -> None:
    session = f"/v1/sessions/{running.open_session(SCENE)}"
    answer = running.client.post(f"{session}/play", json={"device": f"file:{name}"}, headers=headers_off())
    assert answer.status_code == 202, answer.text
    until(lambda: running.client.get(session).json()["play"]["frames"] >= RATE // 4)
    report = running.client.delete(f"{session}/play").json()
    assert report["gain_reduction_db"] > 60.0
    sound_format = SoundFormat.WAV if name.endswith(".wav") else SoundFormat.FLAC
    recording = (Path(running.service.settings.file_folder) / name).read_bytes()
    assert is_limited(decoded(recording, sound_format), sound_format.bits)


@pytest.mark.device
def test_devices_are_limited(tmp_path: Path) -> None:
    require_portaudio()
    recorder = AlsaRecorder(tmp_path, fifo=True)
    listening = Listening(recorder)
    child = Child("service", tmp_path, ALSA_CONFIG_PATH=str(tmp_path / "asound.conf"), RIDGEWAVE_LIMITER="off")
    try:
        with httpx.Client(base_url=child.url(), timeout=60.0) as client:
            session = "/v1/sessions/" + client.post("/v1/sessions", json=ON_A_DEVICE).json()["id"]
            assert client.post(f"{session}/play", json={"device": DEVICE}).status_code == 202
            until(lambda: client.get(session).json()["play"]["frames"] >= 14_400)
            assert client.delete(f"{session}/play").json()["failure"] is None
    finally:
        heard = listening.end()
        child.end()
        recorder.close()
    assert is_limited(heard)


@pytest.mark.thorough  # its default sibling plays into a recording
@pytest.mark.device
def test_the_command_line_plays_limited_on_devices(tmp_path: Path) -> None:
    require_portaudio()
    recorder = AlsaRecorder(tmp_path, fifo=True)
    listening = Listening(recorder)
    environment = {"ALSA_CONFIG_PATH": str(tmp_path / "asound.conf"), "RIDGEWAVE_LIMITER": "off"}
    try:
        done = played(["--device", DEVICE, "--json"], ON_A_DEVICE, tmp_path, environment)
        assert done.returncode == 0, done.stderr
        assert json.loads(done.stdout)["gain_reduction_db"] > 60.0
    finally:
        heard = listening.end()
        recorder.close()
    assert is_limited(heard)


def played(words: list[str], scene: object, folder: Path, environment: dict[str, str]) -> Any:
    """Return the finished `ridgewave play - WORDS`."""
    root = str(Path(__file__).resolve().parents[1])
    command = [sys.executable, "-m", "clients", "play", "-", *words]
    return subprocess.run(
        command, cwd=folder, input=json.dumps(scene), env={"PYTHONPATH": root, **environment},
        capture_output=True, text=True, timeout=60, check=False,
    )  # fmt: skip


def test_the_command_line_plays_limited_into_recordings(tmp_path: Path, ridgewave: RunsRidgewave) -> None:
    scene = json.dumps({"output": {**OUTPUT, "duration": 0.3}}).encode()
    done = ridgewave("play", "-", "--device", "file:take.wav", input=scene)
    assert done.returncode == 0, done.stderr
    assert b"limiter" in done.stderr
    assert is_limited(soundfile.read(tmp_path / "take.wav", dtype="float32")[0])


@pytest.mark.parametrize(("ending", "subtype"), [(end, subtype) for end, kinds in ENDINGS.items() for subtype in kinds])
def test_exports_of_integers_are_limited_and_of_floats_whole(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], rendered: Block, ending: str, subtype: str
) -> None:
    sound_format = ENDINGS[ending][subtype]
    (tmp_path / "scene.json").write_text(json.dumps(SCENE))
    target = tmp_path / f"sound{ending}"
    words = ["render", str(tmp_path / "scene.json"), "-o", str(target), "--json"]
    assert main([*words, "--subtype", subtype]) == 0
    result = json.loads(capsys.readouterr().out)
    sound = decoded(target.read_bytes(), sound_format)
    if sound_format.is_float:
        np.testing.assert_array_equal(sound, rendered[:, 0])
        assert (result["gain_reduction_db"], result["warnings"]) == (0.0, [])
    else:
        np.testing.assert_array_equal(sound, wanted(rendered, sound_format.bits))
        assert result["gain_reduction_db"] > 60.0 and "limiter" in result["warnings"][0]


def headers_off() -> dict[str, str]:
    """Headers that would be its switch, if there were one."""
    return {f"Ridgewave-{name.replace('_', '-').title()}": value for name, value in OFF.items()}


@pytest.mark.parametrize("name", OFF)
def test_no_field_and_no_query_is_its_switch(running: Running, name: str) -> None:
    """They are refused, or do nothing."""
    for scene in ({"output": {**OUTPUT, name: False}}, {**SCENE, name: False}, {**SCENE, "effects": {name: {}}}):
        problem(running.client.post("/v1/render?format=wav16", json=scene), 422, "scene-refused")
        problem(running.client.post("/v1/sessions", json=scene), 422, "scene-refused")
    session = running.open_session(SCENE)
    for call in (
        running.client.post(f"/v1/render?format=wav16&{name}={OFF[name]}", json=SCENE),
        running.client.get(f"/v1/sessions/{session}/stream?format=wav16&duration=0.2&{name}={OFF[name]}"),
    ):
        if call.status_code == 200:
            assert is_limited(decoded(call.content, SoundFormat.WAV16), 16)
        else:
            problem(call, 422, "request-refused")
    body = {"device": f"file:{name}.wav", name: False}
    problem(running.client.post(f"/v1/sessions/{session}/play", json=body), 422, "request-refused")


@pytest.mark.parametrize("word", ["--no-limiter", "--limiter=off", "--unlimited"])
@pytest.mark.parametrize("command", ["play", "render", "serve"])
def test_no_word_of_the_command_line_is_its_switch(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], command: str, word: str
) -> None:
    rest = {"play": ["-"], "render": ["-", "-o", str(tmp_path / "a.wav")], "serve": []}[command]
    with pytest.raises(SystemExit) as refused:
        main([command, *rest, word])
    assert refused.value.code == 2
    assert word.partition("=")[0] in capsys.readouterr().err


def test_no_name_that_the_service_knows_speaks_of_it() -> None:
    """Settings, the scene's fields, and whatever OpenAPI tells of queries, headers and bodies of requests."""
    assert [entry.name for entry in setting_fields() if SWITCH.search(entry.name)] == []
    assert read_settings({f"RIDGEWAVE_{name.upper()}": value for name, value in OFF.items()}) == read_settings({})
    assert [name for name in names(scene_schema()) if SWITCH.search(name)] == []
    asked = [
        part
        for methods in create_app(read_settings({}), PlainEngine()).openapi()["paths"].values()
        for call in methods.values()
        for part in (call.get("parameters", []), call.get("requestBody", {}))
    ]
    assert [name for name in names(asked) if SWITCH.search(name)] == []


def names(document: Any) -> Iterator[str]:
    """Yield every key of a document, and every "name" in it."""
    if isinstance(document, dict):
        for key, value in document.items():
            yield key
            if key == "name" and isinstance(value, str):
                yield value
            yield from names(value)
    elif isinstance(document, list):
        for value in document:
            yield from names(value)


def test_every_call_that_sounds_is_walked_here() -> None:
    """Of OpenAPI's calls, those that answer with sound; plays, whose sound goes elsewhere, have a test by name."""
    paths = create_app(read_settings({}), PlainEngine()).openapi()["paths"]
    sounding = {
        (method, path)
        for path, methods in paths.items()
        # bytes that are no sound: a response table, the heights of a surface
        if not path.startswith("/v1/tables/") and not path.endswith("/surface")
        for method, call in methods.items()
        for answer in call["responses"].values()
        if any(kind.startswith("audio/") or kind == "application/octet-stream" for kind in answer.get("content", {}))
    }
    assert sounding == {("post", "/v1/render"), ("get", "/v1/sessions/{session_id}/stream")}
