"""What README.md and docs/ tell people to type works: shell and Python blocks run, JSON blocks are scenes.

The shell blocks of a page run in order in one shell, in a folder that has docs/ in it, with `ridgewave` and `python3`
on the path and, where a block talks to 127.0.0.1:8000, a real service behind it. Plain lines of `ridgewave` need
no shell and no process of their own.
"""

from __future__ import annotations

import json
import os
import re
import shlex
import shutil
import subprocess
import sys
import sysconfig
import wave
from collections.abc import Iterator
from pathlib import Path

import pytest

from clients.command_line.parser import parse
from synth.scene.catalogue import catalogue
from synth.scene.scene import parse_scene
from tests.conftest import in_this_process
from tests.readme_blocks import CodeBlock, code_blocks, marked_command
from tests.service.programs import program

ROOT = Path(__file__).resolve().parent.parent
PAGES = sorted([ROOT / "README.md", *(ROOT / "docs").rglob("*.md")])
WRITTEN_ADDRESS = "127.0.0.1:8000"
LANGUAGES = {"sh", "python", "json", "text", "toml", "http", ""}
"""What a fence may name: sh, python and json are tried here; text, http and none are for reading."""

Folders = dict[Path, Path]


WITH_A_SERVICE, LIVE = "with a service", "with the live service"
TESTED_ELSEWHERE = ("the main job", "a stream that changes", "the tests", WITH_A_SERVICE, LIVE)
"""Marks of blocks that run elsewhere: the first two have tests of their own below, the third is what .ci/run runs, and
those of the Python client run in tests/clients/test_client_docs.py."""
RUN_ELSEWHERE = ROOT / "docs" / "http.md"
"""The page whose shell blocks run in tests/test_service_docs.py."""


def tried(page: Path, language: str) -> list[CodeBlock]:
    """Return the blocks of a language on a page that are tried here."""
    return [
        block
        for block in code_blocks(page.read_text("utf-8"))
        if block.language == language and block.mark not in TESTED_ELSEWHERE and not block.mark.startswith("not run: ")
    ]


def blocks(language: str) -> list[object]:
    """Return the blocks of a language that are tried, as test parameters that name page and line."""
    return [
        pytest.param(page, block, id=f"{page.relative_to(ROOT)}:{block.line}")
        for page in PAGES
        for block in tried(page, language)
    ]


@pytest.fixture(scope="module")
def scripts(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with `ridgewave`, `python` and `python3`, all of this checkout and this interpreter."""
    folder = tmp_path_factory.mktemp("scripts")
    for name, words in {"ridgewave": "-m clients", "python": "", "python3": ""}.items():
        script = folder / name
        script.write_text(f'#!/bin/sh\nexec "{sys.executable}" {words} "$@"\n')
        script.chmod(0o755)
    return folder


@pytest.fixture(scope="module")
def shell(scripts: Path, environment: dict[str, str]) -> dict[str, str]:
    """Return the environment of a block."""
    return {**environment, "PATH": f"{scripts}{os.pathsep}{environment['PATH']}"}


@pytest.fixture(scope="module")
def folders(tmp_path_factory: pytest.TempPathFactory) -> Folders:
    """Return a working folder for each page, in which docs/ is at hand."""
    made = {}
    for page in PAGES:
        made[page] = tmp_path_factory.mktemp(page.stem)
        shutil.copytree(ROOT / "docs", made[page] / "docs")
    return made


@pytest.fixture(scope="module")
def service_address(shell: dict[str, str], tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """Return host:port of a service that runs as `ridgewave serve` runs it."""
    service = subprocess.Popen(
        ["ridgewave", "serve", "--port", "0"],
        cwd=tmp_path_factory.mktemp("service"),
        env=shell,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert service.stderr is not None
    said = service.stderr.readline()
    found = re.search(r"http://(\S+)", said)
    assert found, said + service.stderr.read()
    yield found.group(1)
    service.terminate()
    service.communicate(timeout=60)


def test_a_command_that_is_not_run_is_one_that_parses() -> None:
    """`ridgewave` lines of every shell block, those that are not run too: a wrong option ends the process."""
    lines = [
        line.removesuffix("\\")
        for page in PAGES
        for block in code_blocks(page.read_text("utf-8"))
        if block.language == "sh"
        for line in block.text.splitlines()
        if re.match(r"([A-Z_]+=\S+ )*ridgewave ", line)
    ]
    assert len(lines) > 10
    for line in lines:
        words = shlex.split(line)
        parse(words[words.index("ridgewave") + 1 :])


def test_every_block_names_a_known_language_and_reasons_are_given() -> None:
    for page in PAGES:
        for block in code_blocks(page.read_text("utf-8")):
            assert block.language in LANGUAGES, f"{page.name}:{block.line}"
            if block.mark.startswith("not run"):
                assert re.fullmatch(r"not run: .{10,}", block.mark), f"{page.name}:{block.line}: say why"


@pytest.mark.parametrize(
    "page", [page for page in PAGES if page != RUN_ELSEWHERE], ids=lambda page: str(page.relative_to(ROOT))
)
def test_the_shell_blocks_of_a_page_run(
    page: Path, folders: Folders, shell: dict[str, str], request: pytest.FixtureRequest
) -> None:
    """What fails is the block whose line was told last. Plain lines of `ridgewave` alone run in this process."""
    found = tried(page, "sh")
    lines = [line for block in found for line in block.text.splitlines()]
    if all(re.fullmatch(r"ridgewave [^$`|<>&;*\\]+", line) for line in lines):
        for line in lines:
            done = in_this_process(shlex.split(line)[1:], folders[page])
            assert done.returncode == 0, f"{line}\n{done.stderr.decode()}"
        return
    text = "\n".join(f"echo {page.name}:{block.line} >&2\n{block.text}" for block in found)
    if WRITTEN_ADDRESS in text:
        text = text.replace(WRITTEN_ADDRESS, request.getfixturevalue("service_address"))
    program = ["bash", "-euo", "pipefail", "-c"]
    ran = subprocess.run(
        [*program, text], cwd=folders[page], env=shell, capture_output=True, text=True, timeout=300, check=False
    )
    assert ran.returncode == 0, ran.stdout + ran.stderr


@pytest.mark.parametrize(("page", "block"), blocks("python"))
def test_a_python_block_runs(page: Path, block: CodeBlock, folders: Folders, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(folders[page])
    exec(compile(block.text, f"{page.name}:{block.line}", "exec"), {"__name__": "__main__"})


@pytest.mark.parametrize(("page", "block"), blocks("json"))
def test_a_json_block_is_json_and_a_scene_where_it_looks_like_one(page: Path, block: CodeBlock) -> None:
    document = json.loads(block.text)
    sections = {"finger", "texture", "scan", "effects", "output", "accuracy"}
    if page.name in ("README.md", "scene.md") or (isinstance(document, dict) and set(document) <= sections):
        parse_scene(document)


def test_the_main_job_does_what_the_readme_says(folders: Folders, shell: dict[str, str]) -> None:
    """The render of the first command, with this environment in the place of the one it makes."""
    make, install, render = marked_command((ROOT / "README.md").read_text("utf-8"), "the main job").split(" && ")
    assert make == "python3 -m venv .venv"
    assert install.startswith(".venv/bin/pip install ")
    folder = folders[ROOT / "README.md"]
    done = subprocess.run(
        ["bash", "-c", render.replace(".venv/bin/", "")], cwd=folder, env=shell, capture_output=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert (folder / "out.wav").stat().st_size > 2 * 48000 * 4


def test_the_installed_script_is_the_command_line(tmp_path: Path) -> None:
    """Where the project is installed, its script runs from any folder, on the installed packages."""
    script = Path(sysconfig.get_path("scripts")) / "ridgewave"
    if not script.exists():
        pytest.skip("ridgewave is not installed in this environment")
    done = subprocess.run([script, "textures", "--json"], cwd=tmp_path, capture_output=True, check=True)
    assert len(json.loads(done.stdout)["textures"]) == len(catalogue())


def test_the_readmes_stream_is_sound_that_changed(
    folders: Folders, shell: dict[str, str], service_address: str
) -> None:
    """The block with the session leaves a WAV file that Python's own reader takes, two seconds of it."""
    program("curl", "curl")
    page = ROOT / "README.md"
    (block,) = [block for block in code_blocks(page.read_text("utf-8")) if block.mark == "a stream that changes"]
    text = block.text.replace(WRITTEN_ADDRESS, service_address)
    folder = folders[page]
    subprocess.run(["bash", "-euo", "pipefail", "-c", text], cwd=folder, env=shell, check=True, timeout=300)
    with wave.open(str(folder / "stream.wav")) as sound:
        frames = sound.readframes(3 * 48000)
        assert len(frames) == 2 * 2 * 48000
    assert json.loads((folder / "changed.json").read_text())


def test_links_between_pages_lead_somewhere() -> None:
    dead = [
        f"{page.relative_to(ROOT)}: {link}"
        for page in PAGES
        for link in re.findall(r"\]\(([^)#\s]+)[^)]*\)", page.read_text("utf-8"))
        if "://" not in link and not (page.parent / link).exists()
    ]
    assert not dead, "\n".join(dead)
