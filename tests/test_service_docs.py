"""docs/http.md, docs/settings.md and docs/problems.md cannot drift: what exists has its line, what has a line exists.

The calls of docs/http.md run, as the one script they are, against a service.
"""

from __future__ import annotations

import json
import re
import subprocess
from pathlib import Path
from typing import Any

from service import problems
from service.app import create_app
from service.http.security import OPEN_FOLDER, OPEN_PATHS
from service.operations import settings
from service.operations.health import Health
from service.operations.settings_environment import read_settings
from synth.errors import Fault
from tests.readme_blocks import code_blocks
from tests.service.harness import PATIENCE, serving
from tests.service.plain_engine import PlainEngine
from tests.service.programs import program

DOCS = Path(__file__).resolve().parents[1] / "docs"
HTTP, SETTINGS, PROBLEMS, OPERATIONS, SECURITY, LIVE = (
    (DOCS / name).read_text(encoding="utf-8")
    for name in ("http.md", "settings.md", "problems.md", "operations.md", "security.md", "live.md")
)


def calls() -> set[tuple[str, str]]:
    """Return (method, path) of every route that OpenAPI tells of."""
    paths = create_app(read_settings({}), PlainEngine()).openapi()["paths"]
    return {(method.upper(), path) for path, methods in paths.items() for method in methods}


def rows(page: str) -> list[list[str]]:
    """Return the cells of the page's tables, without their heads."""
    lines = [line for line in page.splitlines() if line.startswith("|") and not line.startswith("| ---")]
    cells = [[cell.strip().strip("`") for cell in line.strip("|").split(" | ")] for line in lines]
    return cells[1:]


def test_every_route_has_a_section_and_every_section_a_route() -> None:
    sections = re.findall(r"^### `([A-Z]+) (\S+)`$", HTTP, re.M)
    assert len(sections) == len(set(sections))
    assert set(sections) == calls()


def test_every_route_has_a_curl_example() -> None:
    for section in re.split(r"^### ", HTTP, flags=re.M)[1:]:
        title = section.partition("\n")[0]
        assert "curl " in section and "$BASE" in section, title


def test_every_path_that_the_pages_name_exists() -> None:
    known = {path for _, path in calls()} | {"/openapi.json", "/v1/live", "/vr", OPEN_FOLDER}
    named = set(re.findall(r"`(?:[A-Z]+ )?(/[a-z][a-z0-9_/{}.]*)`", HTTP + SETTINGS + PROBLEMS + LIVE))
    assert named and named <= known


def test_every_setting_has_its_line_and_every_line_a_setting() -> None:
    wanted = [
        [settings.variable(entry.name), settings.default_text(entry), entry.metadata["allowed"], sentence(entry)]
        for entry in settings.setting_fields()
    ]
    assert rows(SETTINGS) == wanted
    named = set(re.findall(r"RIDGEWAVE_[A-Z_]+", HTTP + PROBLEMS + SETTINGS + LIVE))
    assert named == {settings.variable(entry.name) for entry in settings.setting_fields()}


def test_every_setting_has_its_place_in_the_pages_on_operations_or_security() -> None:
    named = set(re.findall(r"RIDGEWAVE_[A-Z_]+", OPERATIONS + SECURITY))
    assert named == {settings.variable(entry.name) for entry in settings.setting_fields()}


def test_every_bound_on_a_caller_has_its_place_in_the_page_on_security() -> None:
    bounds = {
        settings.variable(entry.name)
        for entry in settings.setting_fields()
        if re.match("max_|streams_per_|request|session_|cache_", entry.name)
    }
    assert bounds <= set(re.findall(r"RIDGEWAVE_[A-Z_]+", SECURITY))


def test_every_path_that_needs_no_key_is_named_in_the_page_on_security() -> None:
    paragraph = SECURITY.partition("- **Keys.**")[2].partition("- **")[0]
    assert {path.strip("`") for path in re.findall(r"`/[^`]*`", paragraph)} == OPEN_PATHS | {OPEN_FOLDER}


def test_every_field_of_a_healthy_answer_has_its_line() -> None:
    section = OPERATIONS.partition("\n## Health\n")[2].partition("\n## ")[0]
    document = Health(read_settings({})).document(ready=True, workers=1, starved=0.0)
    assert re.findall(r"^\| `(\w+)` \|", section, re.M) == list(document)


def sentence(entry: object) -> str:
    text: str = entry.metadata["sentence"]  # type: ignore[attr-defined]
    return text


def test_every_problem_has_its_line_and_every_line_a_problem() -> None:
    wanted = [[str(kind.status), kind.name, kind.title, kind.when] for kind in problems.TYPES.values()]
    assert rows(PROBLEMS) == wanted


def test_every_problem_is_raised_somewhere() -> None:
    source = "".join(path.read_text(encoding="utf-8") for path in (DOCS.parent / "service").rglob("*.py"))
    for name in problems.TYPES:
        assert source.count(f'"{name}"') >= 2, f"{name} is in the table and nowhere else"


def test_the_example_of_a_problem_has_the_shape_of_one() -> None:
    (block,) = (block for block in code_blocks(PROBLEMS) if block.language == "json")
    example = json.loads(block.text)
    fault = Fault(**example["errors"][0])
    assert problems.Problem("scene-refused", fault.sentence(), (fault,)).document() == example


def test_the_page_of_the_service_describes_every_problem_and_setting() -> None:
    from service.http.reference_page import reference_page

    page = reference_page(create_app(read_settings({}), PlainEngine()).openapi())
    for kind in problems.TYPES.values():
        assert f'id="{kind.uri.partition("#")[2]}"' in page
    for entry in settings.setting_fields():
        assert settings.variable(entry.name) in page
    assert "<script" not in page and "http" not in page.replace("RFC", "").lower().split("</style>")[0]


def test_the_calls_of_the_page_run_from_top_to_bottom(tmp_path: Path) -> None:
    program("curl", "curl")
    script = "set -eu -o pipefail\n" + "".join(block.text for block in code_blocks(HTTP) if block.language == "sh")
    folders: Any = {"file_folder": tmp_path / "recordings", "data_folder": tmp_path / "recordings" / "data"}
    with serving(PlainEngine(), **folders) as running:
        script = script.replace("http://127.0.0.1:8000", running.url)
        done = subprocess.run(
            ["bash", "-c", script], cwd=tmp_path, capture_output=True, text=True, timeout=3 * PATIENCE, check=False
        )
    assert done.returncode == 0, done.stderr
    made = {path.name for path in tmp_path.iterdir()} - {"recordings"}
    sounds = {"touch.wav", "touch.flac", "live.wav", "one-second.wav"}
    others = {"accuracy.json", "calls.html", "denim.png", "recording.json", "table.safetensors", "wave.csv", "wave.x3p"}
    assert made == sounds | others
    assert (tmp_path / "recordings" / "take-1.wav").stat().st_size > 0
