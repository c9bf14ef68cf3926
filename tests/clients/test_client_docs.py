"""The examples of docs/client.md run unchanged, except for the address of the service.

The live ones, and that of README.md, talk to the last of `LIVE_SERVICES`.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from clients.http_client.sync_client import Client, Session
from clients.live_client.live_interface import LiveOptions
from tests.clients.live_client.live_services import LIVE_SERVICES, serving_live
from tests.readme_blocks import CodeBlock, code_blocks
from tests.service.harness import Running, serving
from tests.service.plain_engine import PlainEngine
from tests.test_readme import LIVE, PAGES, ROOT, WITH_A_SERVICE

HTTP_ADDRESS, LIVE_ADDRESS = "http://127.0.0.1:8000", "ws://127.0.0.1:8000/v1/live"
ARGUMENTS = {"scene", *LiveOptions.__annotations__, "connect", "client"}
OWN = {"carry", "carry_open", "close"}
"""What `Client` offers to the other classes of the client, and what `with` calls."""


def examples() -> list[object]:
    return [
        pytest.param(block, id=f"{page.relative_to(ROOT)}:{block.line}")
        for page in PAGES
        for block in code_blocks(page.read_text("utf-8"))
        if block.mark in (WITH_A_SERVICE, LIVE)
    ]


@pytest.fixture(scope="module")
def running(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Running]:
    with serving(PlainEngine(), file_folder=tmp_path_factory.mktemp("recordings")) as server:
        yield server


@pytest.fixture(scope="module")
def live_url() -> Iterator[str]:
    with serving_live() as urls:
        yield urls[LIVE_SERVICES[-1]]


@pytest.mark.parametrize("block", examples())
def test_an_example_runs(
    block: CodeBlock, running: Running, live_url: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert block.language == "python"
    assert (LIVE_ADDRESS in block.text) == (block.mark == LIVE), "the mark says what the example talks to"
    monkeypatch.chdir(tmp_path)
    text = block.text.replace(LIVE_ADDRESS, live_url).replace(HTTP_ADDRESS, running.url)
    exec(compile(text, f"line {block.line}", "exec"), {"__name__": "__main__"})


def test_the_page_has_every_exception_and_argument() -> None:
    import clients

    page = (ROOT / "docs" / "client.md").read_text("utf-8")
    raised = {name for name in clients.__all__ if name.endswith(("Error", "Lost", "Ended"))} - {"ProblemError"}
    assert all(f"`{name}`" in page for name in raised | {"InvalidRequest"})
    assert all(f"`{name}`" in page for name in ARGUMENTS)


def test_the_page_has_every_call() -> None:
    page = (ROOT / "docs" / "client.md").read_text("utf-8")
    calls = {name for kind in (Client, Session) for name in vars(kind) if not name.startswith("_")} - OWN
    assert [name for name in sorted(calls) if f"{name}(" not in page] == []
