"""A client that `openapi-python-client` generates from /openapi.json renders, explains, and changes a session."""

from __future__ import annotations

import asyncio
import importlib
import io
import math
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import soundfile

from tests.service.harness import PATIENCE, Running, kept_engine, serving

PACKAGE = "generated_ridgewave"
CALLS = {
    "render": ("render", "explain", "analyze", "measure_accuracy"),
    "scene": ("draw_picture", "get_scene_schema", "get_threshold"),
    "sessions": ("open_session", "get_session", "change_session", "delete_session", "stream_session"),
    "play": ("play_session", "end_play", "list_devices"),
    "textures": (
        "list_textures",
        "import_texture",
        "get_texture",
        "get_texture_picture",
        "rename_texture",
        "delete_texture",
        "export_texture",
    ),
    "tables": ("make_table", "get_table"),
    "live": ("get_live_schema", "get_live_schema_v2", "get_recording"),
    "operations": ("stop_all", "get_health", "get_readiness", "get_metrics", "get_docs"),
}
SHORT = {"output": {"duration": 0.05, "sample_rate": 8000}}


@pytest.fixture(scope="module")
def running(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Running]:
    with serving(kept_engine(), file_folder=tmp_path_factory.mktemp("recordings")) as server:
        yield server


@pytest.fixture(scope="module")
def package(running: Running, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """Generate the client without its formatter, and make it importable."""
    folder = tmp_path_factory.mktemp("generated")
    config = folder / "config.yml"
    picture = "content_type_overrides:\n  image/png: application/octet-stream\n"  # it knows no pictures, and would warn
    config.write_text(f"post_hooks: []\n{picture}")
    source = [f"--url={running.url}/openapi.json", "--fail-on-warning", "--meta=none"]
    places = [f"--config={config}", f"--output-path={folder / PACKAGE}"]
    command = [sys.executable, "-m", "openapi_python_client", "generate", *source, *places]
    done = subprocess.run(command, capture_output=True, text=True, timeout=3 * PATIENCE, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(folder))
        yield folder / PACKAGE


@pytest.fixture
def client(package: Path, running: Running) -> Any:
    return part("client").Client(base_url=running.url, timeout=PATIENCE)


def part(name: str) -> Any:
    return importlib.import_module(f"{PACKAGE}.{name}")


def call(tag: str, name: str) -> Any:
    return part(f"api.{tag}.{name}")


def scene(**sections: Any) -> Any:
    """Return a `Scene` of the client, made of its own classes."""
    models = part("models")
    return models.Scene(**{name: getattr(models, name.capitalize())(**fields) for name, fields in sections.items()})


def test_every_call_is_generated(package: Path) -> None:
    made = {
        folder.name: {file.stem for file in folder.glob("[a-z]*.py")} for folder in (package / "api").glob("[a-z]*")
    }
    assert made == {tag: set(names) for tag, names in CALLS.items()}


def test_it_renders_a_wav(client: Any) -> None:
    made = call("render", "render").sync(client=client, body=scene(scan={"load": "0.5 N"}, **SHORT))
    samples, rate = soundfile.read(io.BytesIO(made.payload.read()))
    assert (len(samples), rate) == (400, 8000)


def test_the_default_of_an_absent_field_is_not_sent(client: Any) -> None:
    rough = scene(texture={"roughness": "10 um"}, finger={"roughness": "20 um"}, **SHORT)
    plan = call("render", "explain").sync(client=client, body=rough)
    assert plan.scene.texture.amplitude == pytest.approx(math.pi / 2 * 1e-5)  # eq. 3
    kind = part("models").TextureKind.GRATING_1MM_31UM
    plan = call("render", "explain").sync(client=client, body=scene(texture={"kind": kind}, **SHORT))
    assert plan.scene.texture.period == pytest.approx(1e-3)


def test_a_refusal_is_a_problem(client: Any) -> None:
    told = call("render", "explain").sync(client=client, body=scene(scan={"load": -1.0}))
    assert isinstance(told, part("models").Problem)
    assert (told.status, told.errors[0].pointer) == (422, "/scan/load")


def test_it_opens_changes_reads_and_deletes_a_session(client: Any) -> None:
    opened = call("sessions", "open_session").sync(client=client, body=scene(scan={"load": 0.2}, **SHORT))
    changed = call("sessions", "change_session").sync(opened.id, client=client, body=scene(scan={"load": "0.5 N"}))
    read = call("sessions", "get_session").sync(opened.id, client=client)
    assert (opened.scene.scan.load, changed.scene.scan.load, read.scene.scan.load) == (0.2, 0.5, 0.5)
    assert read.full_scale == opened.full_scale
    assert call("sessions", "delete_session").sync_detailed(opened.id, client=client).status_code == 204
    assert call("sessions", "get_session").sync(opened.id, client=client).status == 404


def test_a_token_is_the_key_and_owns_its_sessions(package: Path, tmp_path: Path) -> None:
    with serving(kept_engine(), api_keys="mine,yours", file_folder=tmp_path) as keyed:
        mine, yours = (part("client").AuthenticatedClient(base_url=keyed.url, token=key) for key in ("mine", "yours"))
        opened = call("sessions", "open_session").sync(client=mine, body=scene(**SHORT))
        read = call("sessions", "get_session")
        assert read.sync(opened.id, client=mine).id == opened.id
        assert read.sync(opened.id, client=yours).status == 404
        nobody = part("client").Client(base_url=keyed.url)
        assert read.sync(opened.id, client=nobody).status == 401


def test_it_works_in_an_event_loop(client: Any) -> None:
    async def conversation() -> None:
        async with client:
            made = await call("render", "render").asyncio(client=client, body=scene(**SHORT))
            assert soundfile.info(io.BytesIO(made.payload.read())).frames == 400
            plan = await call("render", "explain").asyncio(client=client, body=scene(**SHORT))
            assert plan.simulated and plan.estimated_error["acceleration"] > 0.0
            opened = await call("sessions", "open_session").asyncio(client=client, body=scene(**SHORT))
            speed = scene(scan={"speed": "0.2 m/s"})
            changed = await call("sessions", "change_session").asyncio(opened.id, client=client, body=speed)
            read = await call("sessions", "get_session").asyncio(opened.id, client=client)
            assert changed.scene.scan.speed == read.scene.scan.speed == 0.2
            gone = await call("sessions", "delete_session").asyncio_detailed(opened.id, client=client)
            assert gone.status_code == 204

    asyncio.run(conversation())
