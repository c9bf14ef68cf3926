"""Textures that are solved ahead: kept where a service finds them, by one process at a time, which ends with it."""

from __future__ import annotations

import fcntl
import os
from pathlib import Path
from typing import Any

import pytest

from service.compute import texture_preparation
from service.compute.texture_preparation import LOCK, TexturePreparation
from service.lifespan import Service
from service.store.data_folder import tables_folder
from synth.errors import CannotRender
from synth.scene import catalogue
from tests.service.harness import settings_of
from tests.service.plain_engine import PlainEngine


@pytest.fixture
def solved(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Return the textures that are solved, of a catalogue of three. The first one cannot be solved."""
    found: list[str] = []

    def solve(scene: Any, _folder: Path) -> None:
        found.append(scene.texture.kind)
        if len(found) == 1:
            raise CannotRender("too fine")

    monkeypatch.setattr(texture_preparation, "solve_ahead", solve)
    monkeypatch.setattr(texture_preparation, "step_back", lambda: None)
    monkeypatch.setattr("signal.signal", lambda *_: None)
    every = catalogue.catalogue()
    monkeypatch.setattr(catalogue, "catalogue", lambda: every[:3])
    return found


def test_what_is_solved_ahead_is_kept_in_the_data_folder(tmp_path: Path) -> None:
    from synth.scene.scene import parse_scene

    texture_preparation.solve_ahead(
        parse_scene({"finger": {"kind": "fingertip"}, "texture": {"kind": "denim-72x56"}}), tmp_path
    )
    assert {path.suffix for path in tables_folder(tmp_path).iterdir()} == {".json", ".safetensors"}


def test_every_texture_is_prepared_even_after_one_that_cannot_be(tmp_path: Path, solved: list[str]) -> None:
    texture_preparation.main(tmp_path / "new")
    assert len(solved) == 3


def test_one_process_at_a_time_prepares_a_data_folder(tmp_path: Path, solved: list[str]) -> None:
    with (tmp_path / LOCK).open("wb") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        texture_preparation.main(tmp_path)
    assert solved == []


def test_it_ends_when_the_service_has_gone(tmp_path: Path, solved: list[str], monkeypatch: pytest.MonkeyPatch) -> None:
    parents = iter([7, 7, 1])
    monkeypatch.setattr(os, "getppid", lambda: next(parents))
    texture_preparation.main(tmp_path)
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
