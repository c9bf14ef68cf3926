"""Runs a configuration of docs/ with a real nginx, in front of services on this machine."""

from __future__ import annotations

import re
import socket
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from tests.service.harness import ROOT, until
from tests.service.programs import program

CONFIGURATION, NODES = ROOT / "docs" / "nginx.conf", ROOT / "docs" / "nginx-nodes.conf"
TEMPORARY = ("client_body", "proxy", "fastcgi", "uwsgi", "scgi")  # folders that nginx makes at its start
HTTP_BLOCK = re.compile(r"^http \{$", re.M)
LISTEN = re.compile(r"^( *)listen 80\b", re.M)
SERVICE = re.compile(r"\b127\.0\.0\.1:(80\d\d)\b")


def placed(configuration: Path, port: int, services: list[int]) -> str:
    """Return `configuration` for a test: nginx listens on `port`, the services on 8000, 8001, ... are `services`."""
    text = configuration.read_text(encoding="utf-8")
    text, listens = LISTEN.subn(rf"\1listen 127.0.0.1:{port}", text)
    folders = "".join(f"\n    {name}_temp_path {name};" for name in TEMPORARY)
    text, blocks = HTTP_BLOCK.subn(f"http {{\n    access_log off;{folders}", text)
    assert listens == 1 and blocks == 1, f"{configuration.name} has another shape than this expects"
    return SERVICE.sub(lambda found: f"127.0.0.1:{services[int(found[1]) - 8000]}", text)


@contextmanager
def nginx(folder: Path, *services: int, configuration: Path = CONFIGURATION) -> Iterator[int]:
    """Yield the port of an nginx that runs `configuration` in front of the services on these ports."""
    command = program("nginx", "nginx")
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = int(free.getsockname()[1])
    (folder / "nginx.conf").write_text(placed(configuration, port, list(services)), encoding="utf-8")
    log = folder / "error.log"
    words = [command, "-p", str(folder), "-c", "nginx.conf", "-e", "error.log"]
    process = subprocess.Popen([*words, "-g", "daemon off; pid nginx.pid; error_log error.log;"])
    try:
        until(lambda: process.poll() is not None or _listens(port))
        assert process.poll() is None, log.read_text()
        yield port
    finally:
        process.terminate()
        process.wait(60.0)


def _listens(port: int) -> bool:
    with socket.socket() as probe:
        return probe.connect_ex(("127.0.0.1", port)) == 0
