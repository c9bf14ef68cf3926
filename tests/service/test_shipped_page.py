"""`ridgewave serve` and `python -m service` bring the page, unless RIDGEWAVE_WEB names another."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path

import pytest

from clients.commands import serve
from service import __main__ as plain_command
from service.http import page_files
from service.operations.settings import Settings
from service.operations.settings_environment import as_environment, read_settings

ARGUMENTS = argparse.Namespace(host=None, port=0, uds=None, workers=None)


Command = Callable[[], int]
COMMANDS: dict[str, Command] = {
    "ridgewave serve": lambda: serve.run(ARGUMENTS),
    "python -m service": plain_command.main,
}


@pytest.fixture(params=COMMANDS)
def command(request: pytest.FixtureRequest) -> Command:
    return COMMANDS[request.param]


@pytest.fixture
def told(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> list[Settings]:
    """The settings that the service would run with; a folder with an index stands for the page."""
    settings: list[Settings] = []

    def run_service(given: Settings, *_: object) -> int:
        settings.append(given)
        return 0

    (tmp_path / "own").mkdir()
    (tmp_path / "own" / "index.html").write_text("<!doctype html>")
    (tmp_path / "other").mkdir()
    monkeypatch.setattr(page_files, "SHIPPED", tmp_path / "own")
    monkeypatch.setattr(serve, "run_service", run_service)
    monkeypatch.setattr(plain_command, "run", run_service)
    monkeypatch.delenv("RIDGEWAVE_WEB", raising=False)
    return settings


def test_the_page_of_the_package_is_served(command: Command, told: list[Settings], tmp_path: Path) -> None:
    assert command() == 0
    assert told[0].web == str(tmp_path / "own")


def test_another_folder_wins(
    command: Command, told: list[Settings], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("RIDGEWAVE_WEB", str(tmp_path / "other"))
    assert command() == 0
    assert told[0].web == str(tmp_path / "other")


def test_a_package_without_a_page_serves_none(
    command: Command, told: list[Settings], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(page_files, "SHIPPED", tmp_path / "nothing")
    assert command() == 0
    assert told[0].web == ""


def test_workers_are_told_of_the_page(command: Command, told: list[Settings], tmp_path: Path) -> None:
    assert command() == 0
    assert read_settings(as_environment(told[0])).web == str(tmp_path / "own")
