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
WHOLE_HOST = "        location / {\n"
ANSWER_SECONDS = re.compile(r"\b3s;")  # how long a node may take to answer
SLOW_SECONDS = 30
SERVICE = re.compile(r"\b127\.0\.0\.1:(80\d\d)\b")


def placed(configuration: Path, port: int, services: list[int], seconds: int) -> str:
    """Return `configuration` for a test: nginx listens on `port`, the services on 8000, 8001, ... are `services`.

    seconds: after which a node counts as one that does not answer.
    """
    text = configuration.read_text(encoding="utf-8")
    text, listens = LISTEN.subn(rf"\1listen 127.0.0.1:{port}", text)
    folders = "".join(f"\n    {name}_temp_path {name};" for name in TEMPORARY)
    text, blocks = HTTP_BLOCK.subn(f"http {{\n    access_log access.log;{folders}", text)
    text, waits = ANSWER_SECONDS.subn(f"{seconds}s;", text)
    assert listens == blocks == 1 and waits >= 2, f"{configuration.name} has another shape than this expects"
    return SERVICE.sub(lambda found: f"127.0.0.1:{services[int(found[1]) - 8000]}", text)


def under_a_path(folder: Path, prefix: str, *, removed: bool) -> Path:
    """Return a copy of docs/nginx.conf in which the service is under `prefix` alone, as its comment says.

    removed: the proxy removes the prefix.
    """
    text = CONFIGURATION.read_text(encoding="utf-8")
    assert text.count(WHOLE_HOST) == 1
    text = text.replace(WHOLE_HOST, WHOLE_HOST.replace("/", f"{prefix}/"))
    if removed:
        text = text.replace("proxy_pass ", f"rewrite ^{prefix}(/.*)$ $1 break; proxy_pass ")
    copy = folder / "under-a-path.conf"
    copy.write_text(text, encoding="utf-8")
    return copy


@contextmanager
def nginx(
    folder: Path, *services: int, configuration: Path = CONFIGURATION, seconds: int = SLOW_SECONDS
) -> Iterator[int]:
    """Yield the port of an nginx that runs `configuration` in front of the services on these ports.

    It logs each request, when it has ended, to the file access.log in `folder`.
    seconds: after which a node counts as one that does not answer; on a busy machine all are slow.
    """
    command = program("nginx", "nginx")
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = int(free.getsockname()[1])
    (folder / "nginx.conf").write_text(placed(configuration, port, list(services), seconds), encoding="utf-8")
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
