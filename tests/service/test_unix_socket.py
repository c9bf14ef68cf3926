"""A Unix socket: its mode, what becomes of one that is there already, several workers, and nginx in front."""

from __future__ import annotations

import os
import shutil
import signal
import socket
import stat
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import httpx
import numpy as np
import pytest

from service.app import create_app
from service.server import listen, require_key
from service.unix_socket import identity, listen_on_path, remove_own
from synth.errors import CannotRender
from tests.few import thorough
from tests.service.harness import PATIENCE, ROOT, START, settings_of, until
from tests.service.nginx import CONFIGURATION, nginx
from tests.service.plain_engine import PlainEngine

WORKERS = "tests.service.serve_plain_workers"


@pytest.fixture
def folder() -> Iterator[Path]:
    """A folder with a short path, as a socket needs."""
    made = Path(tempfile.mkdtemp(prefix="rw"))
    yield made
    shutil.rmtree(made)


@contextmanager
def serving_at(path: Path, module: str, **environment: str) -> Iterator[subprocess.Popen[bytes]]:
    """Run a service at `path` that answers."""
    variables = {"RIDGEWAVE_UDS": str(path), "RIDGEWAVE_PREPARE_TEXTURES": "off", "TMPDIR": str(path.parent)}
    process = subprocess.Popen([sys.executable, "-m", module], cwd=ROOT, env={**os.environ, **variables, **environment})
    try:
        until(lambda: process.poll() is not None or answers(path), START)
        assert process.poll() is None
        yield process
    finally:
        process.terminate()
        process.wait(PATIENCE)


def client_at(path: Path) -> httpx.Client:
    return httpx.Client(transport=httpx.HTTPTransport(uds=str(path)), base_url="http://localhost", timeout=PATIENCE)


def answers(path: Path) -> bool:
    with suppress(httpx.TransportError), client_at(path) as client:
        return client.get("/readyz").status_code == 200
    return False


def test_only_user_and_group_may_connect_and_no_key_is_required(folder: Path) -> None:
    settings = settings_of(uds=folder / "one.sock", host="0.0.0.0")
    require_key(settings)
    before = os.umask(0)
    try:
        with listen(settings):
            assert stat.S_IMODE(os.stat(settings.uds).st_mode) == 0o660
    finally:
        assert os.umask(before) == 0, "the umask of the process stays"


def test_a_socket_that_nobody_serves_is_replaced(folder: Path) -> None:
    path = folder / "one.sock"
    listen_on_path(str(path), 1).close()
    assert path.is_socket()
    with listen_on_path(str(path), 1), socket.socket(socket.AF_UNIX) as caller:
        caller.connect(str(path))


@pytest.mark.parametrize("what", ["a socket in use", "a full queue", "a file", "a folder", "a link to nowhere"])
def test_what_is_not_a_stale_socket_is_left_alone(folder: Path, what: str) -> None:
    path = folder / "one.sock"
    with socket.socket(socket.AF_UNIX) as owner, socket.socket(socket.AF_UNIX) as waiting:
        if what in ("a socket in use", "a full queue"):
            owner.bind(str(path))
            owner.listen(0 if what == "a full queue" else 8)
            if what == "a full queue":
                waiting.connect(str(path))
        elif what == "a file":
            path.write_text("words")
        elif what == "a folder":
            path.mkdir()
        else:
            path.symlink_to(folder / "nowhere")
        before = os.lstat(path).st_ino
        with pytest.raises(CannotRender, match=rf"cannot listen on the Unix socket {path}: "):
            listen_on_path(str(path), 1)
        assert os.lstat(path).st_ino == before


def test_a_folder_that_is_missing_is_named(folder: Path) -> None:
    with pytest.raises(CannotRender, match="no such file or directory"):
        listen_on_path(str(folder / "none" / "one.sock"), 1)


def test_the_socket_of_another_process_is_not_removed(folder: Path) -> None:
    path = str(folder / "one.sock")
    with listen_on_path(path, 1):
        own = identity(path)
        os.rename(path, path + ".kept")  # so that its number is not given again
        with listen_on_path(path, 1):
            remove_own(path, own)
            assert identity(path) is not None
    remove_own(path + ".kept", own)
    assert identity(path + ".kept") is None


def test_a_peer_at_the_socket_is_this_machine_and_elsewhere_it_is_unknown(folder: Path) -> None:
    scope = {"type": "http", "client": None, "headers": [(b"x-forwarded-for", b"203.0.113.7")]}
    proxies = ("127.0.0.1",)
    for uds, trusted, expected in (
        (str(folder / "one.sock"), proxies, "203.0.113.7"),
        (str(folder / "one.sock"), (), "loopback"),
        (None, proxies, "unknown"),
    ):
        settings = settings_of(uds=uds, trusted_proxies=",".join(trusted) or None)
        assert create_app(settings, PlainEngine()).state.service.limits.address(scope) == expected


@pytest.mark.parametrize("end", [signal.SIGTERM, thorough(signal.SIGKILL)])
def test_several_workers_listen_on_one_socket(folder: Path, end: signal.Signals) -> None:
    path = folder / "http.sock"
    with serving_at(path, WORKERS, RIDGEWAVE_WORKERS="2") as process:
        with client_at(path) as client:
            until(lambda: client.get("/healthz").json()["workers"] == 2)
            assert client.post("/v1/render", json={"output": {"duration": 0.1}}).status_code == 200
        process.send_signal(end)
        process.wait(PATIENCE)
        assert path.exists() == (end is signal.SIGKILL)
    if end is signal.SIGKILL:
        until(lambda: not answers(path))  # the workers have ended too
        with serving_at(path, "tests.service.serve_plain"):
            pass
        assert not path.exists()


def test_nginx_passes_a_session_its_stream_and_a_stop_to_the_socket(folder: Path) -> None:
    path = folder / "http.sock"
    text = CONFIGURATION.read_text(encoding="utf-8").replace("server 127.0.0.1:8000;", f"server unix:{path};")
    assert str(path) in text
    if os.geteuid() == 0:  # else nginx drops to a user that is not of the socket's group
        text = "user root;\n" + text
    (folder / "own.conf").write_text(text, encoding="utf-8")
    (folder / "nginx").mkdir()
    with (
        serving_at(path, "tests.service.serve_plain"),
        nginx(folder / "nginx", configuration=folder / "own.conf") as port,
        httpx.Client(base_url=f"http://127.0.0.1:{port}", timeout=PATIENCE) as client,
    ):
        session = client.post("/v1/sessions", json={}).json()["id"]
        sound = client.get(f"/v1/sessions/{session}/stream?format=f32le&duration=0.2").content
        assert len(sound) == 0.2 * 48000 * 4 and any(sound)
        with client.stream("GET", f"/v1/sessions/{session}/stream?format=f32le") as answer:
            parts = answer.iter_raw()
            next(parts)
            stopped = httpx.post(f"http://127.0.0.1:{port}/v1/stop", timeout=PATIENCE).json()
            rest = b"".join(parts)
        assert stopped["stopped"]["sessions"] == 1 and np.frombuffer(rest[-4:], "<f4") == 0.0
