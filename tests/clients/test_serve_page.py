"""`ridgewave serve` brings its page, unless RIDGEWAVE_WEB names another."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import pytest

from clients import serve_command
from service.settings import Settings, as_environment, read_settings

ARGUMENTS = argparse.Namespace(host=None, port=0, workers=None)


@pytest.fixture
def told(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> list[Settings]:
    """The settings that the service would run with; a folder with an index stands for the page."""
    settings: list[Settings] = []

    def run_service(given: Settings) -> int:
        settings.append(given)
        return 0

    (tmp_path / "own").mkdir()
    (tmp_path / "own" / "index.html").write_text("<!doctype html>")
    (tmp_path / "other").mkdir()
    monkeypatch.setattr(serve_command, "PAGE", tmp_path / "own")
    monkeypatch.setattr(serve_command, "run_service", run_service)
    monkeypatch.delenv("RIDGEWAVE_WEB", raising=False)
    return settings


def web_of(told: list[Settings]) -> str:
    assert serve_command.run(ARGUMENTS) == 0
    return told.pop().web


def test_the_page_of_the_package_is_served(told: list[Settings], tmp_path: Path) -> None:
    assert web_of(told) == str(tmp_path / "own")


def test_another_folder_wins(told: list[Settings], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("RIDGEWAVE_WEB", str(tmp_path / "other"))
    assert web_of(told) == str(tmp_path / "other")


def test_a_package_without_a_page_serves_none(told: list[Settings], tmp_path: Path, monkeypatch: Any) -> None:
    monkeypatch.setattr(serve_command, "PAGE", tmp_path / "nothing")
    assert web_of(told) == ""


def test_workers_are_told_of_the_page(told: list[Settings], tmp_path: Path) -> None:
    assert serve_command.run(ARGUMENTS) == 0
    assert read_settings(as_environment(told[0])).web == str(tmp_path / "own")
