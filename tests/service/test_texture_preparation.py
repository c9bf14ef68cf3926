"""Textures that are solved ahead: kept where a service finds them, by one process at a time, which ends with it."""

from __future__ import annotations

import fcntl
import os
import signal
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest

from service.compute import texture_preparation
from service.compute.texture_preparation import LOCK, TexturePreparation, solve_ahead
from service.lifespan import Service
from service.store.data_folder import tables_folder
from service.store.store import Quota, Store
from service.synth_engine import SynthEngine
from synth.errors import CannotRender
from synth.kept_files import KeptFiles
from synth.scene.catalogue import FINGER, catalogue
from synth.scene.scene import parse_scene
from synth.scene.texture_registry import default_textures
from synth.surfaces.surface_data import SurfaceData
from tests.few import paired
from tests.service.harness import Running, serving, settings_of, until
from tests.service.plain_engine import PlainEngine

SCAN = "\n".join(f"{20.0 * np.sin(0.1 * np.pi * point):.4f}" for point in range(100)).encode()


@pytest.fixture
def solved(monkeypatch: pytest.MonkeyPatch) -> list[dict[str, Any]]:
    """Return the textures that are solved, with a catalogue of three. The first one cannot be solved."""
    found: list[dict[str, Any]] = []
    every = catalogue()[:3]

    def solve(texture: dict[str, Any], folder: Path) -> None:
        found.append(texture)
        if len(found) == 1:
            raise CannotRender("too fine")
        KeptFiles(tables_folder(folder)).get(texture_preparation._mark(texture), dict)

    monkeypatch.setattr(texture_preparation, "solve_ahead", solve)
    monkeypatch.setattr(texture_preparation, "step_back", lambda: None)
    monkeypatch.setattr(texture_preparation, "catalogue", lambda: every)
    monkeypatch.setattr(texture_preparation, "default_textures", list)
    monkeypatch.setattr("signal.signal", lambda *_: None)
    return found


def prepare(folder: Path) -> None:
    """Prepare in this process."""
    folder.mkdir(exist_ok=True)
    with (folder / LOCK).open("wb") as lock:
        texture_preparation.main(folder, lock.fileno())


def imported(folder: Path, name: str, kind: str = "profile") -> dict[str, Any]:
    """Keep a texture in the store, and return its partial scene."""
    heights = np.full((2, 2) if kind == "heightmap" else 2, len(name), np.float32)
    spacing = (1e-6, 1e-6) if kind == "heightmap" else (1e-6,)
    kept = Store(folder).keep("", name, SurfaceData(heights, spacing), kind, {"file": name}, Quota())
    return kept.document


@pytest.mark.parametrize(
    ("texture", "scan"),
    paired(
        [{"texture": {"kind": "grating-400um-30um"}}, default_textures()[0]],
        [{}, {"scan": {"speed": 0, "load": 0}}],  # of the page, and of VR
    ),
)
def test_a_hand_on_a_texture_that_is_done_opens_from_files(
    texture: dict[str, Any], scan: dict[str, Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    solve_ahead(texture, tmp_path)
    monkeypatch.setattr(KeptFiles, "_write", lambda *_: pytest.fail("something is solved again"))
    SynthEngine(1 << 26, tmp_path).open_hand(parse_scene({"finger": FINGER, **texture, **scan}))


def test_every_texture_is_prepared_once_even_after_one_that_cannot_be(tmp_path: Path, solved: list[Any]) -> None:
    prepare(tmp_path)
    assert solved == [entry.document for entry in catalogue()[:3]]
    prepare(tmp_path)
    assert solved[3:] == solved[:1], "only what was not done is tried again"


def test_the_newest_imported_textures_are_first(
    tmp_path: Path, solved: list[Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(texture_preparation, "MOST_IMPORTED", {"profile": 2, "heightmap": 1})
    documents = [imported(tmp_path, "a" * number) for number in range(1, 5)]
    area = imported(tmp_path, "area", "heightmap")
    prepare(tmp_path)
    assert solved[:3] == [documents[3], documents[2], area]
    assert len(solved) == 6


def test_what_is_imported_meanwhile_is_next_and_what_is_deleted_is_left_out(
    tmp_path: Path, solved: list[Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    solve, later = texture_preparation.solve_ahead, list[dict[str, Any]]()

    def change(texture: dict[str, Any], folder: Path) -> None:
        if not later:
            Store(folder).delete("", "first")
            later.append(imported(folder, "second-one"))
        solve(texture, folder)

    monkeypatch.setattr(texture_preparation, "solve_ahead", change)
    imported(tmp_path, "first")
    newest = imported(tmp_path, "new")
    prepare(tmp_path)
    assert solved[:2] == [newest, *later]
    assert len(solved) == 5


def test_one_process_at_a_time_prepares_a_data_folder(tmp_path: Path) -> None:
    preparation = TexturePreparation(tmp_path)
    with (tmp_path / LOCK).open("wb") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        preparation.begin()
        assert preparation._process is None
    preparation.begin()
    first = preparation._process
    preparation.begin()
    assert first is not None and preparation._process is first, "it has the file locked from its beginning"
    preparation.close()
    preparation.finish()


def test_an_import_just_before_the_file_is_free_is_not_missed(
    tmp_path: Path, solved: list[Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    flock, late = fcntl.flock, list[dict[str, Any]]()

    def unlock(lock: int, operation: int) -> None:
        if operation == fcntl.LOCK_UN and not late:
            late.append(imported(tmp_path, "late"))
        flock(lock, operation)

    monkeypatch.setattr(fcntl, "flock", unlock)
    prepare(tmp_path)
    assert solved[3:] == late


def test_it_ends_when_the_service_has_gone(tmp_path: Path, solved: list[Any], monkeypatch: pytest.MonkeyPatch) -> None:
    parents = iter([7, 7, 1])
    monkeypatch.setattr(os, "getppid", lambda: next(parents))
    prepare(tmp_path)
    assert len(solved) == 1


def test_it_ends_with_the_service(tmp_path: Path) -> None:
    preparation = TexturePreparation(tmp_path)
    preparation.begin()
    process = preparation._process
    assert process is not None and process.poll() is None
    preparation.close()
    preparation.finish()
    assert process.poll() is not None
    preparation.begin()
    assert preparation._process is process, "none is started after the end"


def test_a_process_that_is_killed_leaves_no_zombie(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    preparation = TexturePreparation(tmp_path)
    preparation.begin()
    process = preparation._process
    assert process is not None
    os.kill(process.pid, signal.SIGKILL)
    until(lambda: not Path(f"/proc/{process.pid}").exists())
    until(lambda: "ended with -9" in caplog.text)
    preparation.begin()
    assert preparation._process is not process, "the next import begins another one"
    preparation.close()
    preparation.finish()


@pytest.mark.parametrize(("asked", "serves_only"), [("on", True), ("off", True), ("on", False)])
def test_a_process_that_only_serves_begins_it_unless_a_setting_says_no(
    asked: str, serves_only: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    begun: list[Path] = []
    monkeypatch.setattr(TexturePreparation, "begin", lambda self: begun.append(self.folder))
    monkeypatch.setattr("gc.freeze", lambda: None)
    service = Service(settings_of(prepare_textures=asked, data_folder=tmp_path), PlainEngine())
    service.serves_only = serves_only
    service.warm_up()
    service.finish()
    assert begun == ([tmp_path] if asked == "on" and serves_only else [])


@pytest.fixture
def served(tmp_path: Path, read_here: None) -> Iterator[Running]:
    """Yield a service that only serves, with a setting that allows to prepare textures."""
    with serving(PlainEngine(), data_folder=tmp_path, prepare_textures="on") as running:
        until(lambda: running.service.warm)
        running.service.serves_only = True
        yield running


def post(running: Running) -> httpx.Response:
    return running.client.post(
        "/v1/textures", files={"file": ("scan.csv", SCAN)}, data={"unit": "um", "pixel": "5 um", "name": "cloth"}
    )


def test_an_import_is_solved_ahead(served: Running, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    begun: list[Path] = []
    monkeypatch.setattr(TexturePreparation, "begin", lambda self: begun.append(self.folder))
    monkeypatch.setattr(texture_preparation, "step_back", lambda: None)
    monkeypatch.setattr(texture_preparation, "catalogue", list)
    monkeypatch.setattr(texture_preparation, "default_textures", list)
    monkeypatch.setattr("signal.signal", lambda *_: None)
    assert post(served).status_code == 201
    assert begun == [tmp_path]
    prepare(tmp_path)  # what the process does, at the usual priority
    (texture,) = Store(tmp_path).textures("")
    monkeypatch.setattr(KeptFiles, "_write", lambda *_: pytest.fail("something is solved again"))
    SynthEngine(1 << 26, tmp_path).open_hand(parse_scene(texture.everyday))


def test_a_dry_run_or_a_refused_import_or_one_with_the_setting_off_begins_nothing(
    served: Running, monkeypatch: pytest.MonkeyPatch
) -> None:
    begun: list[Path] = []
    monkeypatch.setattr(TexturePreparation, "begin", lambda self: begun.append(self.folder))
    files = {"file": ("scan.csv", SCAN)}
    assert served.client.post("/v1/textures?dry_run=true", files=files, data={"unit": "um", "pixel": "5 um"}).is_success
    assert served.client.post("/v1/textures", files=files).status_code == 422
    assert begun == []
    served.service.settings = settings_of(prepare_textures="off")
    assert post(served).status_code == 201
    assert begun == []
