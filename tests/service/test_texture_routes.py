"""Imported textures over HTTP: report, keep, use in scenes, export, rename, delete; each key has its own."""

from __future__ import annotations

import base64
import errno
import gzip
import io
from collections.abc import AsyncIterator, Iterator
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest
from fastapi import FastAPI
from PIL import Image

from service.app import create_app
from service.compute.import_process import Imports
from service.synth_engine import SynthEngine
from synth.scene.catalogue import catalogue_names
from tests.service.harness import ask, problem, settings_of
from tests.synth.surfaces.maps.map_sets import CASES, made, surface
from tests.synth.surfaces.maps.test_attacking_sets import ATTACKS
from tests.synth.surfaces.readers.refused_files import REFUSED

HEIGHTS = 20.0 * np.sin(2.0 * np.pi * np.arange(200) / 200)  # um
SCAN = "\n".join(map(repr, HEIGHTS.tolist())).encode()
GIVEN = {"unit": "um", "pixel": "5 um"}
KEYS = ({"Authorization": "Bearer one"}, {"Authorization": "Bearer two"})


@pytest.fixture
def own(tmp_path: Path) -> Iterator[FastAPI]:
    """An application with a data folder of its own."""
    made = create_app(settings_of(data_folder=tmp_path / "data"), SynthEngine(1 << 26))
    yield made
    made.state.service.finish()


@pytest.fixture
def keyed(tmp_path: Path, read_here: None) -> Iterator[FastAPI]:
    made = create_app(
        settings_of(data_folder=tmp_path / "data", api_keys="one,two", textures_per_key=2, texture_bytes_per_key=2000),
        SynthEngine(1 << 26),
    )
    yield made
    made.state.service.finish()


def post(app: FastAPI, content: bytes = SCAN, file: str = "scan.csv", query: str = "", **rest: Any) -> httpx.Response:
    data = rest.pop("data", {**GIVEN, "name": "cloth"})
    return ask(app, "POST", f"/v1/textures{query}", files={"file": (file, content)}, data=data, **rest)


@pytest.mark.parametrize(("code", "status", "kind"), [(-11, 422, "request-refused"), (-9, 503, "cannot-render")])
def test_a_parser_that_crashes_is_told_apart_from_one_that_is_stopped(
    own: FastAPI, monkeypatch: pytest.MonkeyPatch, code: int, status: int, kind: str
) -> None:
    async def ended(_imports: Imports, _request: bytes) -> tuple[int, bytes, bytes]:
        return code, b"", b""

    monkeypatch.setattr(Imports, "_outcome", ended)
    refused = problem(post(own), status, kind)
    assert ("crashes" in str(refused)) == (code == -11)


async def pieces() -> AsyncIterator[bytes]:
    """Yield a body whose length is not announced."""
    yield b'--x\r\nContent-Disposition: form-data; name="file"; filename="a.csv"\r\n\r\n'
    for _ in range(2000):
        yield b"1"


def names(app: FastAPI, **rest: Any) -> list[str]:
    return [entry["name"] for entry in ask(app, "GET", "/v1/textures", **rest).json()["textures"] if entry["stored"]]


def test_a_dry_run_reports_and_keeps_nothing(own: FastAPI, tmp_path: Path) -> None:
    answer = post(own, query="?dry_run=true")
    assert answer.status_code == 200
    document = answer.json()
    report = document["report"]
    assert document["kept"] is False and "scene" not in document and report["file"] == "scan.csv"
    assert report["rq"] == pytest.approx(20e-6 / np.sqrt(2.0)) and report["size"] == [pytest.approx(1e-3)]
    picture = base64.b64decode(document["picture"].removeprefix("data:image/png;base64,"))
    assert Image.open(io.BytesIO(picture)).format == "PNG"
    assert names(own) == [] and not (tmp_path / "data").exists()


def test_an_imported_texture_is_listed_shown_exported_renamed_and_deleted(own: FastAPI) -> None:
    made = post(own)
    assert made.status_code == 201 and made.headers["location"] == "/v1/textures/cloth"
    listed = ask(own, "GET", "/v1/textures").json()["textures"]
    assert [entry["name"] for entry in listed] == [*catalogue_names(), "cloth"]
    shown = ask(own, "GET", "/v1/textures/cloth").json()
    assert {**shown, "numbers": {}} == {**listed[-1], "numbers": {}} and listed[-1]["group"] == "Yours"
    assert shown["scene"] == made.json()["scene"] and shown["stored"] is True
    picture = ask(own, "GET", "/v1/textures/cloth/picture")
    assert picture.headers["cache-control"] == "private, no-cache" and picture.content.startswith(b"\x89PNG")
    saved = ask(own, "GET", "/v1/textures/cloth/surface?format=npy")
    np.testing.assert_allclose(np.load(io.BytesIO(saved.content)), HEIGHTS * 1e-6, atol=1e-11)
    assert ask(own, "GET", "/v1/textures/cloth/surface?format=x3p").content.startswith(b"PK")
    renamed = ask(own, "PATCH", "/v1/textures/cloth", json={"name": "wool"})
    assert renamed.status_code == 200 and renamed.json()["scene"] == shown["scene"]
    problem(ask(own, "GET", "/v1/textures/cloth"), 404, "not-found")
    assert ask(own, "DELETE", "/v1/textures/wool").status_code == 204
    (fault,) = problem(ask(own, "DELETE", "/v1/textures/wool"), 404, "not-found")["errors"]
    assert fault["pointer"] == "name"


@pytest.mark.parametrize(
    ("data", "pointers"),
    [
        ({}, {"/unit", "/pixel"}),
        ({**GIVEN, "level": "flat"}, {"/level"}),
        ({**GIVEN, "name": "../etc"}, {"/name"}),
        ({**GIVEN, "name": "sinusoid"}, {"/name"}),
        ({**GIVEN, "colour": "red"}, {"/colour"}),
        ({**GIVEN, "height": "1 mm"}, {"/height"}),
    ],
)
@pytest.mark.usefixtures("read_here")
def test_what_is_missing_or_wrong_is_refused_with_its_field(
    own: FastAPI, data: dict[str, str], pointers: set[str]
) -> None:
    document = problem(post(own, data=data), 422, "request-refused")
    assert {fault["pointer"] for fault in document["errors"]} == pointers and names(own) == []


def test_the_body_is_a_form_with_one_file_of_a_bounded_size(own: FastAPI, tmp_path: Path) -> None:
    problem(ask(own, "POST", "/v1/textures", json={}), 415, "not-multipart")
    problem(ask(own, "POST", "/v1/textures", files={"other": ("a.csv", SCAN)}), 422, "request-refused")
    problem(
        ask(own, "POST", "/v1/textures", files=[("file", ("a", SCAN)), ("file", ("b", SCAN))]), 422, "request-refused"
    )
    broken = {"Content-Type": "multipart/form-data; boundary=x"}
    problem(ask(own, "POST", "/v1/textures", content=b"--x\r\nno form", headers=broken), 422, "request-refused")
    problem(
        ask(own, "POST", "/v1/textures", content=b"x", headers={"Content-Type": "multipart/form-data"}),
        422,
        "request-refused",
    )
    small = create_app(settings_of(data_folder=tmp_path / "small", max_import=1024), SynthEngine(0))
    problem(post(small), 413, "too-large")
    problem(ask(small, "POST", "/v1/textures", content=pieces(), headers=broken), 413, "too-large")


@pytest.mark.parametrize("charset", ["undefined", "punycode", "raw_unicode_escape", "utf-7"])
def test_a_form_in_another_charset_is_refused(own: FastAPI, charset: str) -> None:
    headers = {"Content-Type": f"multipart/form-data; boundary=x; charset={charset}"}
    disposition = rb'form-data; name="file"; filename="a-+2AA-\ud800-9.csv"'
    body = b"--x\r\nContent-Disposition: " + disposition + b"\r\n\r\n1\r\n--x--\r\n"
    document = problem(ask(own, "POST", "/v1/textures", content=body, headers=headers), 422, "request-refused")
    assert charset in document["detail"] and "UTF-8" in document["detail"]


@pytest.mark.usefixtures("read_here")
def test_of_files_that_are_refused_nothing_is_kept_and_nothing_is_lost(own: FastAPI) -> None:
    kept = post(own).json()["address"]
    for one in REFUSED:
        answer = post(own, one.content, one.name, data={**one.options, "name": "refused"})
        told = problem(answer, answer.status_code, "request-refused" if answer.status_code == 422 else "cannot-render")
        assert answer.status_code == 422 or "surfaces" in str(told), one.name
    assert names(own) == ["cloth"] and ask(own, "GET", "/v1/textures/cloth").json()["address"] == kept


@pytest.mark.usefixtures("read_here")
def test_a_packed_body_is_refused_with_what_to_send(own: FastAPI) -> None:
    packed = {"Content-Type": "multipart/form-data; boundary=x", "Content-Encoding": "gzip"}
    answer = ask(own, "POST", "/v1/textures", content=gzip.compress(b"--x--"), headers=packed)
    assert "without Content-Encoding" in str(problem(answer, 415, "not-multipart"))
    assert answer.headers["accept-encoding"] == "identity" and names(own) == []


@pytest.mark.usefixtures("read_here")
def test_a_profile_with_unequal_steps_is_resampled(own: FastAPI) -> None:
    content = b"X [um];Z [um]\n0;0\n1;2\n2.3;4.6\n4.1;8.2\n6;12\n"
    files = {"file": ("scan.csv", content)}
    fault = problem(ask(own, "POST", "/v1/textures", files=files), 422, "request-refused")["errors"][0]
    assert fault["pointer"] == "/resample" and "resample" in fault["hint"]
    made = ask(own, "POST", "/v1/textures", files=files, data={"resample": "0.5 um"})
    assert made.status_code == 201 and made.json()["report"]["points"] == [13]
    saved = ask(own, "GET", "/v1/textures/scan/surface?format=npy")
    np.testing.assert_allclose(np.diff(np.load(io.BytesIO(saved.content))), 1e-6, rtol=1e-4)


def set_of_maps(folder: Path) -> bytes:
    return made(CASES["Poly Haven, packed, ZIP"], surface(1), folder).read_bytes()


@pytest.mark.usefixtures("read_here")
def test_a_set_of_maps_is_a_texture_with_its_synthetic_waves(own: FastAPI, tmp_path: Path) -> None:
    content = set_of_maps(tmp_path)
    fault = problem(post(own, content, "wall.zip", data={"name": "wall"}), 422, "request-refused")["errors"][0]
    assert fault["pointer"] == "/width" and "no map states its size" in fault["allowed"] and names(own) == []
    answer = post(own, content, "wall.zip", data={"name": "wall", "width": "80 mm", "hurst": "0.7"}).json()
    texture = {"kind": "heightmap", "surface": answer["address"], "ends": "join", "synthetic_hurst": 0.7}
    assert answer["scene"]["texture"] == texture | {"synthetic_shortest": 6e-5, "synthetic_seed": 0}
    picture = Image.open(io.BytesIO(base64.b64decode(answer["picture"].partition(",")[2])))
    assert picture.info["Description"] == "synthetic, not shown: waves of 625 um to 60 um"
    entry = ask(own, "GET", "/v1/textures/wall").json()
    assert entry["scene"] == answer["scene"] and entry["report"]["synthetic"]["hurst"] == 0.7
    saved = np.load(io.BytesIO(ask(own, "GET", "/v1/textures/wall/surface?format=npy").content))
    assert saved.shape == (256, 256)  # what was measured


def test_a_set_that_attacks_is_refused_and_leaves_no_file(
    own: FastAPI, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "temporary"
    folder.mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(folder))
    monkeypatch.setenv("TMPDIR", str(folder))
    for name in ("a name above its folder", "a bomb that lies", "a picture that is a bomb"):
        make, words = ATTACKS[name]
        answer = post(own, make(), "wall.zip", data={"name": "wall", "width": "80 mm"})
        assert words in str(problem(answer, 422, "request-refused"))
        assert not list(folder.iterdir()) and names(own) == []


@pytest.mark.usefixtures("read_here")
def test_a_data_folder_that_cannot_be_written_has_no_path_in_its_message(tmp_path: Path) -> None:
    (tmp_path / "file").write_bytes(b"")
    app = create_app(settings_of(data_folder=tmp_path / "file" / "data"), SynthEngine(1 << 26))
    told = str(problem(post(app), 503, "cannot-render"))
    assert "RIDGEWAVE_DATA_FOLDER" in told and str(tmp_path) not in told


def test_a_part_without_a_filename_is_told_what_it_lacks(own: FastAPI) -> None:
    answer = ask(own, "POST", "/v1/textures", files={"file": (None, SCAN), "unit": (None, "um")})
    assert "with a filename" in problem(answer, 422, "request-refused")["detail"]


def _part(name: str, content: str) -> bytes:
    return f'--x\r\nContent-Disposition: form-data; name="{name}"\r\n\r\n{content}\r\n'.encode()


@pytest.mark.usefixtures("read_here")
def test_a_form_that_was_cut_is_refused_and_not_read_without_its_last_part(own: FastAPI) -> None:
    file = _part('file"; filename="a.csv', "1\n2\n3\n2")
    whole = file + _part("unit", "um") + _part("pixel", "5um") + _part("level", "tilt")
    for end, closed in (
        *((b"", False), (b"--x\r\n", False), (b"--x-", False)),
        *((b"--x--", True), (b"--x--\r\nsome words", True)),
    ):
        for pieces in ([whole + end], [(whole + end)[place : place + 1] for place in range(len(whole + end))]):

            async def body(pieces: list[bytes] = pieces) -> AsyncIterator[bytes]:
                for piece in pieces:
                    yield piece

            headers = {"Content-Type": "multipart/form-data; boundary=x"}
            answer = ask(own, "POST", "/v1/textures?dry_run=true", content=body(), headers=headers)
            if closed:
                assert answer.json()["report"]["level"] == "tilt"
            else:
                assert "closing boundary" in problem(answer, 422, "request-refused")["detail"]


def full(*_: object, **__: object) -> None:
    """Fail as a write to a full disk does."""
    raise OSError(errno.ENOSPC, "No space left on device", "/secret")


@pytest.mark.parametrize(
    "place",
    ["tempfile.SpooledTemporaryFile.write", "tempfile.TemporaryDirectory", "shutil.copyfileobj", "numpy.save"],
)
@pytest.mark.usefixtures("read_here")
def test_without_room_for_its_temporary_files_an_import_has_its_reason(
    own: FastAPI, monkeypatch: pytest.MonkeyPatch, place: str
) -> None:
    monkeypatch.setattr(place, full)
    detail = problem(post(own), 503, "cannot-render")["detail"]
    assert "temporary files" in detail and "secret" not in detail
    monkeypatch.undo()
    assert names(own) == []


def test_a_file_with_a_path_in_its_name_is_kept_in_the_store_only(own: FastAPI, tmp_path: Path) -> None:
    made = post(own, file="../../escape.csv", data=GIVEN).json()
    assert made["name"] == "escape" and made["report"]["file"] == "escape.csv"
    assert {path.name for path in (tmp_path / "data").iterdir()} <= {
        f"textures.sqlite{end}" for end in ("", "-wal", "-shm")
    }


def test_writes_of_other_pages_are_refused(own: FastAPI) -> None:
    for headers in ({"Origin": "https://evil.example"}, {"Sec-Fetch-Site": "cross-site"}):
        problem(post(own, headers=headers), 403, "origin-refused")
    assert names(own) == []


def test_a_texture_belongs_to_its_key(keyed: FastAPI) -> None:
    mine, yours = KEYS
    problem(post(keyed), 401, "key-required")
    assert post(keyed, headers=mine).status_code == 201
    assert names(keyed, headers=mine) == ["cloth"] and names(keyed, headers=yours) == []
    for method, path in (("GET", ""), ("DELETE", ""), ("GET", "/surface"), ("GET", "/picture"), ("PATCH", "")):
        body: dict[str, Any] = {"json": {"name": "mine"}} if method == "PATCH" else {}
        problem(ask(keyed, method, f"/v1/textures/cloth{path}", headers=yours, **body), 404, "not-found")
    scene = {"texture": {"kind": "cloth"}}
    problem(ask(keyed, "POST", "/v1/explain", json=scene, headers=yours), 422, "scene-refused")
    assert post(keyed, headers=yours).status_code == 201


def test_quotas_and_names_that_are_taken(keyed: FastAPI) -> None:
    mine = KEYS[0]
    assert post(keyed, headers=mine).status_code == post(keyed, headers=mine).status_code == 201  # the same again
    other = "\n".join(map(repr, (2.0 * HEIGHTS).tolist())).encode()
    problem(post(keyed, other, headers=mine), 409, "name-taken")
    large = SCAN + b"\n" + SCAN + b"\n" + SCAN
    problem(post(keyed, large, data={**GIVEN, "name": "large"}, headers=mine), 413, "store-full")
    assert post(keyed, other, data={**GIVEN, "name": "felt"}, headers=mine).status_code == 201
    problem(post(keyed, other, data={**GIVEN, "name": "third"}, headers=mine), 413, "store-full")
    problem(ask(keyed, "PATCH", "/v1/textures/felt", json={"name": "cloth"}, headers=mine), 409, "name-taken")


def test_a_bomb_gets_a_fault_and_the_service_goes_on(own: FastAPI) -> None:
    from tests.synth.surfaces.readers.bad_files import png_of

    problem(post(own, png_of(40_000, 40_000, content=bytes(1000)), "bomb.png"), 422, "request-refused")
    assert post(own).status_code == 201
