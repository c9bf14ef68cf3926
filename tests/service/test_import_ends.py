"""Imports end with their clients, each client has a bounded number under way, and clients take turns."""

from __future__ import annotations

import os
import socket
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import httpx
import pytest

from service.compute.uploads import Uploads
from service.problems import Problem
from tests.service.harness import PATIENCE, Running, problem, serving, settings_of, until
from tests.service.plain_engine import PlainEngine

SCAN = b"1\n2\n3\n2\n" * 20
LARGE = SCAN + b"# " + b"c" * 3_000_000 + b"\n"  # more than a form keeps in memory
HELD = """
import os, time
if os.path.exists({new!r}):
    open({new!r} + str(os.getpid()), "w").close()
    while os.path.exists({old!r}):
        time.sleep(0.005)
"""


class Hold:
    """Holds importing processes at their start: those that start while `new` exists, for as long as `old` does."""

    def __init__(self, folder: Path) -> None:
        self.new, self.old = folder / "new", folder / "old"
        self.new.touch()
        self.old.touch()

    def one_is_held(self) -> bool:
        return any(self.new.parent.glob("new?*"))


@pytest.fixture
def hold(own_process: Path) -> Iterator[Hold]:
    folder = own_process.parent
    own_process.write_text(HELD.format(new=str(folder / "new"), old=str(folder / "old")))
    made = Hold(folder)
    yield made
    made.old.unlink(missing_ok=True)


@pytest.fixture
def temporary(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return the folder of all temporary files."""
    folder = tmp_path / "temporary"
    folder.mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(folder))
    return folder


@pytest.fixture
def served(tmp_path: Path, temporary: Path) -> Iterator[Running]:
    with serving(PlainEngine(), data_folder=tmp_path / "data", api_keys="one,two", imports_per_client=10) as running:
        yield running


def children() -> set[int]:
    """Return the processes that this one has started and not waited for, zombies included."""
    found = set()
    for entry in Path("/proc").iterdir():
        with suppress(OSError, ValueError):
            if int((entry / "stat").read_text().rpartition(")")[2].split()[1]) == os.getpid():
                found.add(int(entry.name))
    return found


def left_in(folder: Path) -> list[str]:
    """Return the temporary files, and the open ones without a name."""
    opened = []
    for entry in Path("/proc/self/fd").iterdir():
        with suppress(OSError):
            opened.append(os.readlink(entry))
    return [*(str(path) for path in folder.rglob("*")), *(path for path in opened if path.startswith(str(folder)))]


def form(name: str, content: bytes) -> bytes:
    fields = {"unit": "um", "pixel": "5 um", "name": name}
    parts = [f'--x\r\nContent-Disposition: form-data; name="{key}"\r\n\r\n{value}\r\n' for key, value in fields.items()]
    head = '--x\r\nContent-Disposition: form-data; name="file"; filename="a.csv"\r\n\r\n'
    return ("".join(parts) + head).encode() + content + b"\r\n--x--\r\n"


def upload(running: Running, name: str, key: str = "one", content: bytes = SCAN, share: float = 1.0) -> socket.socket:
    """Send an import, or a share of it, and return its connection."""
    body = form(name, content)
    connection = socket.create_connection(("127.0.0.1", httpx.URL(running.url).port or 80), timeout=PATIENCE)
    head = f"POST /v1/textures HTTP/1.1\r\nHost: localhost\r\nAuthorization: Bearer {key}\r\n"
    head += f"Content-Type: multipart/form-data; boundary=x\r\nContent-Length: {len(body)}\r\n\r\n"
    connection.sendall(head.encode() + body[: int(share * len(body))])
    return connection


def status(connection: socket.socket) -> int:
    """Return the status of the answer, and close the connection."""
    with connection:
        return int(connection.recv(12).split()[1])


def kept(running: Running, key: str = "one") -> set[str]:
    listed = running.client.get("/v1/textures", headers={"Authorization": f"Bearer {key}"}).json()["textures"]
    return {entry["name"] for entry in listed if entry["stored"]}


@pytest.mark.parametrize("content", [SCAN, LARGE], ids=["small", "large"])
def test_an_import_that_is_read_ends_with_its_client(
    served: Running, hold: Hold, temporary: Path, content: bytes
) -> None:
    before = children()
    connection = upload(served, "cloth", content=content)
    until(hold.one_is_held)
    assert len(children() - before) == 1 and left_in(temporary)
    connection.close()
    until(lambda: served.service.uploads.under_way == 0)
    assert children() <= before, "killed and reaped"
    assert left_in(temporary) == []
    hold.old.unlink()
    assert status(upload(served, "felt")) == 201
    assert kept(served) == {"felt"}


def test_an_import_that_waits_ends_with_its_client(served: Running, hold: Hold, temporary: Path) -> None:
    before = children()
    first = upload(served, "first")
    until(hold.one_is_held)
    others = [upload(served, f"other{number}", content=LARGE) for number in range(3)]
    until(lambda: served.service.uploads.under_way == 4)
    for other in others:
        other.close()
    until(lambda: served.service.uploads.under_way == 1)
    assert len(children() - before) == 1
    hold.old.unlink()
    assert status(first) == 201
    assert children() <= before and left_in(temporary) == [] and kept(served) == {"first"}


def test_an_upload_ends_with_its_client(served: Running, temporary: Path) -> None:
    connections = [upload(served, f"cloth{number}", content=LARGE, share=0.7) for number in range(3)]
    until(lambda: served.service.uploads.under_way == 3 and len(left_in(temporary)) == 3)
    for connection in connections:
        connection.close()
    until(lambda: served.service.uploads.under_way == 0)
    assert left_in(temporary) == [] and served.service.uploads.held_bytes == 0 and kept(served) == set()


def test_ten_uploads_of_one_client_do_not_delay_another_one(served: Running, hold: Hold) -> None:
    before = children()
    many = [upload(served, f"cloth{number}") for number in range(10)]
    until(hold.one_is_held)
    until(lambda: served.service.uploads.under_way == 10)
    assert len(children() - before) == 1, "one client has one of the two places"
    hold.new.unlink()  # the next process is not held
    assert status(upload(served, "mine", "two")) == 201
    assert served.service.uploads.under_way == 10, "all those of the other client are still under way"
    hold.old.unlink()
    assert [status(one) for one in many] == [201] * 10


def test_imports_beyond_the_bounds_of_a_client_are_refused_in_words(tmp_path: Path, hold: Hold) -> None:
    bounds: dict[str, Any] = {"imports_per_client": 2, "import_bytes_per_client": 5_000_000, "max_imports": 3}
    with serving(PlainEngine(), data_folder=tmp_path / "data", api_keys="one,two,three", **bounds) as running:

        def post(key: str, content: bytes = SCAN) -> httpx.Response:
            files, headers = {"file": ("a.csv", content)}, {"Authorization": f"Bearer {key}"}
            return running.client.post("/v1/textures", files=files, headers=headers)

        problem(post("one", LARGE + LARGE), 413, "too-large")
        waiting = [upload(running, "first", content=LARGE, share=0.1)]
        until(lambda: running.service.uploads.held_bytes > len(LARGE))
        refused = post("one", LARGE)
        told = problem(refused, 429, "too-many-imports")["detail"]
        assert "RIDGEWAVE_IMPORT_BYTES_PER_CLIENT" in told and refused.headers["retry-after"] == "5"
        waiting.append(upload(running, "second"))
        until(lambda: running.service.uploads.under_way == 2)
        refused = post("one")
        told = problem(refused, 429, "too-many-imports")["detail"]
        assert "RIDGEWAVE_IMPORTS_PER_CLIENT" in told and refused.headers["retry-after"] == "5"
        waiting.append(upload(running, "third", "two"))
        until(lambda: running.service.uploads.under_way == 3)
        refused = post("three")
        problem(refused, 503, "full")
        assert refused.headers["retry-after"] == "5"
        for connection in waiting:
            connection.close()
        until(lambda: running.service.uploads.under_way == 0)
        hold.old.unlink()
        assert status(upload(running, "fourth")) == 201


def test_bytes_that_were_not_announced_are_held_as_they_arrive() -> None:
    uploads = Uploads(settings_of(import_bytes_per_client=2000))
    with uploads.begin("a") as one, uploads.begin("a") as two, uploads.begin("b") as other:
        one.hold(1200)
        one.hold(700)  # less than it holds
        two.hold(800)
        other.hold(2000)
        with pytest.raises(Problem, match="too-many-imports"):
            two.hold(801)
        assert uploads.held_bytes == 4000 and uploads.under_way == 3
    assert uploads.held_bytes == uploads.under_way == 0
