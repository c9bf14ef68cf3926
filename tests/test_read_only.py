"""Every command for an unprivileged user on a read-only file system without a home, with and without a filled cache."""

from __future__ import annotations

import io
import re
import shutil
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import httpx
import pytest
import soundfile

from tests.few import few, thorough
from tests.read_only import NOBODY, ROOT, STRANGER, command, copied_tree, environment, interpreter
from tests.service.harness import PATIENCE, START, until

UNKEPT = "ridgewave cannot keep its compiled kernels"
RENDER = ["-m", "clients", "render", "grating-1mm-31um", "--duration", "0.1", "-o", "-"]
SERVE = ["-m", "clients", "serve", "--port", "0"]
LONG = {"output": {"duration": 30}}
HOMES: list[dict[str, str]] = [
    {},
    {"HOME": "/nonexistent"},
    {"HOME": "/", "NUMBA_CACHE_DIR": "/nonexistent/kernels", "RIDGEWAVE_DATA_FOLDER": "/nonexistent/data"},
]

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def empty() -> Iterator[Path]:
    """A tree without compiled kernels."""
    interpreter()
    with copied_tree() as tree:
        yield tree


@pytest.fixture(scope="module")
def filled(empty: Path) -> Iterator[Path]:
    """The same tree, after its owner has served and rendered. It begins with what the tests have compiled so far."""
    for kernel in ROOT.glob("synth/**/__pycache__/*.nb[ic]"):
        (empty / kernel.relative_to(ROOT)).parent.mkdir(exist_ok=True)
        shutil.copy2(kernel, empty / kernel.relative_to(ROOT))
    variables = environment(empty, HOME="/root", RIDGEWAVE_PREPARE_TEXTURES="off")
    with served([interpreter(), *SERVE], variables):
        subprocess.run([interpreter(), *RENDER], cwd="/", env=variables, check=True, capture_output=True)
    assert list(empty.rglob("*.nbi"))
    yield empty
    for kept in empty.rglob("*.nb[ic]"):
        kept.unlink()


def run(tree: Path, words: list[str], home: dict[str, str], user: int = NOBODY) -> subprocess.CompletedProcess[bytes]:
    return subprocess.run(
        command([interpreter(), *words], tree, user), env=environment(tree, **home), capture_output=True, timeout=START
    )


@contextmanager
def served(words: list[str], variables: dict[str, str]) -> Iterator[tuple[str, list[str]]]:
    """Run a service until it is ready; yield its address, and the lines of its log, which are complete afterwards."""
    process = subprocess.Popen(words, cwd="/", env=variables, stderr=subprocess.PIPE, text=True)
    lines: list[str] = []
    assert process.stderr is not None
    try:
        address = ""
        while not address:
            lines.append(process.stderr.readline())
            assert lines[-1], "".join(lines)
            found = re.search(r"listening on (http://[^\s\"]+)", lines[-1])
            address = found[1] if found else ""
        until(lambda: process.poll() is not None or _is_ready(address), START)
        assert process.poll() is None
        yield address, lines
    finally:
        process.terminate()
        lines += process.communicate(timeout=PATIENCE)[1].splitlines(keepends=True)


def _is_ready(address: str) -> bool:
    try:
        return httpx.get(f"{address}/readyz", timeout=5.0).status_code == 200
    except httpx.TransportError:
        return False


@pytest.mark.parametrize(("home", "user"), [(HOMES[0], STRANGER), thorough(HOMES[2], NOBODY)])
def test_a_render_without_a_cache(empty: Path, home: dict[str, str], user: int) -> None:
    done = run(empty, RENDER, home, user)
    assert done.returncode == 0, done.stderr.decode()
    assert len(soundfile.read(io.BytesIO(done.stdout))[0]) == 4800
    assert done.stderr.decode().count(UNKEPT) == 1


@pytest.mark.thorough
def test_a_service_without_a_cache(empty: Path) -> None:
    works(empty, HOMES[2])


@pytest.mark.parametrize("home", few(HOMES, 1))
def test_a_render_reads_a_filled_cache(filled: Path, home: dict[str, str]) -> None:
    for user in (NOBODY, STRANGER):
        done = run(filled, RENDER, home, user)
        assert done.returncode == 0, done.stderr.decode()
        assert len(soundfile.read(io.BytesIO(done.stdout))[0]) == 4800
        assert UNKEPT not in done.stderr.decode(), "something was compiled"


def test_a_service_with_a_filled_cache(filled: Path) -> None:
    works(filled, {})


def works(tree: Path, home: dict[str, str]) -> None:
    """Assert that a hardened service of `tree` renders, streams, and says what it lacks."""
    variables = environment(tree, RIDGEWAVE_LOG_FORMAT="json", **home)
    with served(command([interpreter(), *SERVE], tree), variables) as (address, lines):
        client = httpx.Client(base_url=address, timeout=START)
        assert len(client.post("/v1/render?format=f32le", json={"output": {"duration": 0.1}}).content) == 4 * 4800
        session = client.post("/v1/sessions", json={}).json()["id"]
        assert len(client.get(f"/v1/sessions/{session}/stream?duration=0.1&format=f32le").content) == 4 * 4800
        assert client.get("/v1/textures").status_code == 200
        long_flac = client.post("/v1/render?format=flac", json=LONG)
        imported = client.post("/v1/textures", files={"file": ("a.csv", b"1\n2\n")}, data={"name": "mine"})
        played = client.post(f"/v1/sessions/{session}/play", json={"device": "file:a.wav"})
        for answer, setting in ((long_flac, "TMPDIR"), (imported, "TMPDIR"), (played, "RIDGEWAVE_FILE_FOLDER")):
            assert answer.status_code == 503 and setting in answer.json()["detail"]
    log = "".join(lines)
    assert log.count(UNKEPT) == 1 and "Traceback" not in log
    assert all(line.startswith("{") for line in lines), "a line of a process of the service is no JSON"


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["-c", "import ridgewave as rw; print(rw.render({}, output={'duration': 0.1}))"], None),
        (["-m", "clients", "--version"], None),
        (["-m", "clients", "textures"], None),
        (["-m", "clients", "explain", "grating-1mm-31um"], None),
        (["-m", "clients", "devices"], None),
        (["-m", "clients", "completion", "bash"], None),
        (["-m", "clients", "render", "grating-1mm-31um", "-o", "/tmp/out.wav"], "/tmp/out.wav"),
        (["-m", "clients", "import", "/etc/hosts"], "TMPDIR"),
        (["-m", "clients", "accuracy", "grating-1mm-31um", "-o", "/tmp/out"], "MPLCONFIGDIR"),
        (["-m", "clients", "textures", "--prepare"], "RIDGEWAVE_DATA_FOLDER"),
        (["-m", "clients", "serve", "--port", "0", "--workers", "2"], "TMPDIR"),
        (["-m", "clients", "serve", "--uds", "/tmp/out.sock"], "/tmp/out.sock"),
    ],
)
def test_every_other_command_works_or_says_what_it_needs(filled: Path, words: list[str], told: str | None) -> None:
    done = run(filled, words, {}, STRANGER)
    messages = done.stderr.decode()
    assert "Traceback" not in messages, messages
    if told is None:
        assert done.returncode == 0, messages
    else:
        assert done.returncode == 1 and told in messages.splitlines()[-1]
