"""A stored texture's name in a scene: everywhere the service parses one, for its key only, and by its address after."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fastapi import FastAPI

import ridgewave as rw
from service.app import create_app
from service.store.data_folder import data_folder
from service.store.store import Quota, Store
from service.synth_engine import SynthEngine
from synth.scene.scene import parse_scene
from synth.surfaces.surface_data import SurfaceData
from tests.conftest import RunsRidgewave
from tests.service.harness import ask, problem, serving, settings_of

X = np.arange(160)
LINE = SurfaceData((20e-6 * np.sin(2.0 * np.pi * X / 160)).astype(np.float32), (5e-6,))
FINGER = {"contact_length": "2 mm"}
SHORT = {"finger": FINGER, "output": {"duration": 0.1}}
SINUSOID = SHORT | {"texture": {"period": "0.8 mm", "amplitude": "20 um", "phase": 0.0}}
NAMED = SHORT | {"texture": {"kind": "wave", "phase": 0.0}}


def with_wave(folder: Path, owner: str = "") -> Store:
    store = Store(folder)
    store.keep(owner, "wave", LINE, "profile", {"file": "wave.csv"}, Quota())
    return store


@pytest.fixture
def own(tmp_path: Path) -> Iterator[FastAPI]:
    with_wave(tmp_path / "data")
    made = create_app(settings_of(data_folder=tmp_path / "data"), SynthEngine(1 << 26))
    yield made
    made.state.service.sessions.close()
    made.state.service.finish()


def test_explain_picture_table_and_session_take_the_name_and_hold_the_address(own: FastAPI) -> None:
    plan = ask(own, "POST", "/v1/explain", json=NAMED)
    assert plan.status_code == 200, plan.text
    assert plan.json()["scene"]["texture"]["surface"] == LINE.address
    assert ask(own, "POST", "/v1/picture", json={"scene": NAMED}).status_code == 200
    assert ask(own, "POST", "/v1/tables", json=NAMED).status_code == 201
    made = ask(own, "POST", "/v1/sessions", json=NAMED)
    assert made.status_code == 201 and made.json()["scene"]["texture"]["surface"] == LINE.address


def test_a_session_is_changed_to_a_stored_texture(own: FastAPI) -> None:
    session = ask(own, "POST", "/v1/sessions", json=SHORT).json()["id"]
    changed = ask(own, "PATCH", f"/v1/sessions/{session}", json={"texture": {"kind": "wave"}})
    assert changed.status_code == 200, changed.text
    assert changed.json()["scene"]["texture"]["surface"] == LINE.address
    problem(ask(own, "PATCH", f"/v1/sessions/{session}", json={"texture": {"kind": "none"}}), 422, "scene-refused")


def test_a_scene_of_before_a_rename_plays_the_same_after_it(own: FastAPI) -> None:
    before = ask(own, "POST", "/v1/explain", json=NAMED).json()["scene"]
    assert ask(own, "PATCH", "/v1/textures/wave", json={"name": "sea"}).status_code == 200
    problem(ask(own, "POST", "/v1/explain", json=NAMED), 422, "scene-refused")
    assert ask(own, "POST", "/v1/explain", json=before).json()["scene"] == before


def test_the_wave_sounds_as_the_sinusoid_it_was_sampled_from(own: FastAPI) -> None:
    quantity = {"output": {"duration": 0.1, "quantity": "displacement", "full_scale": "1 mm"}}
    sound, wanted = (
        np.frombuffer(ask(own, "POST", "/v1/render?format=f32le", json={**scene, **quantity}).content, np.float32)
        for scene in (NAMED, SINUSOID)
    )
    shift = np.max(np.abs(np.fft.rfft(wanted))) / np.max(np.abs(np.fft.rfft(sound)))
    assert shift == pytest.approx(1.0, abs=0.01) and len(sound) == len(wanted)


@pytest.mark.slow
@pytest.mark.usefixtures("made_up_measurement")
def test_processes_of_renders_measurements_and_live_sessions_find_the_surface(tmp_path: Path) -> None:
    import httpx

    with_wave(tmp_path / "data")
    with serving(data_folder=tmp_path / "data") as running:
        for path in ("explain", "render?format=f32le", "accuracy"):
            answer = httpx.post(f"{running.url}/v1/{path}", json=NAMED, timeout=200.0)
            assert answer.status_code == 200, answer.text
        url = running.url.replace("http", "ws") + "/v1/live"
        with rw.Live(NAMED, url=url) as live:
            assert live.read(480).shape == (480, 1)
            for kind in ("sinusoid", "wave"):
                live.change({"texture": {"kind": kind}})
                live.read(4800)


def test_the_command_line_takes_the_name_as_a_scene_and_in_one(ridgewave: RunsRidgewave, tmp_path: Path) -> None:
    np.savetxt(tmp_path / "wave.csv", LINE.heights * 1e6)
    done = ridgewave("import", "wave.csv", "--unit", "um", "--pixel", "5um", "--json")
    assert done.returncode == 0, done.stderr.decode()
    address = json.loads(done.stdout)["address"]
    for words in (["wave"], ["-", "--set", "texture.kind=wave"]):
        done = ridgewave("explain", *words, "--json", input=b"{}")
        assert done.returncode == 0, done.stderr.decode()
        assert json.loads(done.stdout)["scene"]["texture"]["surface"] == address
    listed = json.loads(ridgewave("textures", "--json").stdout)["textures"]
    assert listed[-1]["name"] == "wave" and listed[-1]["stored"] and not listed[0]["stored"]
    assert json.loads(ridgewave("textures", "wave").stdout)["texture"] == {"kind": "profile", "surface": address}
    assert ridgewave("textures", "wave", "--export", "out.npy").returncode == 0
    np.testing.assert_allclose(np.load(tmp_path / "out.npy"), LINE.heights, atol=1e-11)
    assert ridgewave("textures", "wave", "--rename", "sea").returncode == 0
    assert ridgewave("textures", "wave", "--delete").returncode == 2
    assert ridgewave("textures", "sea", "--delete").returncode == 0


def test_a_dry_run_writes_a_picture_and_keeps_nothing(ridgewave: RunsRidgewave, tmp_path: Path) -> None:
    np.savetxt(tmp_path / "wave.csv", LINE.heights * 1e6)
    words = ("import", "wave.csv", "--unit", "um", "--pixel", "5um", "--dry-run")
    done = ridgewave(*words, "--picture", "wave.png")
    assert done.returncode == 0 and (tmp_path / "wave.png").read_bytes().startswith(b"\x89PNG")
    assert b"Rq, rms height       14.14 um" in done.stdout.replace(b"  ", b"  ") or b"14.14 um" in done.stdout
    assert b"nothing was kept" in done.stderr and not (tmp_path / ".data").exists()
    refused = ridgewave("import", "wave.csv", "--json")
    assert refused.returncode == 2
    assert {fault["pointer"] for fault in json.loads(refused.stderr)["errors"]} == {"/unit", "/pixel"}


def test_python_takes_the_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("RIDGEWAVE_DATA_FOLDER", str(tmp_path))
    with_wave(data_folder(str(tmp_path)))
    voice: Any = rw.open_voice(NAMED)
    texture = {"kind": "profile", "surface": LINE.address, "phase": 0.0}
    assert voice.scene == parse_scene({**NAMED, "texture": texture})
