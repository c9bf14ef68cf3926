"""SCENE, --set and --duration become one scene, or one message."""

from __future__ import annotations

import argparse
import io
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from clients.command_line.parser import parse
from clients.command_line.scene_argument import patch_of, read_document, read_scene, value_of
from service.store.own_textures import own_store
from service.store.store import Quota
from synth.errors import InvalidRequest
from synth.scene.catalogue import catalogue
from synth.surfaces.surface_data import SurfaceData


def words(*given: str) -> argparse.Namespace:
    return parse(["explain", *given])


def fault_of(*given: str) -> str:
    with pytest.raises(InvalidRequest) as caught:
        read_scene(words(*given))
    return str(caught.value)


@pytest.fixture
def scene_file(tmp_path: Path) -> str:
    path = tmp_path / "scene.json"
    path.write_text('{"texture": {"period": "2 mm", "roughness": "10 um"}, "scan": {"load": 0.5}}')
    return str(path)


def test_a_file_is_read(scene_file: str) -> None:
    scene = read_scene(words(scene_file))
    assert (scene.texture.period, scene.scan.load) == (0.002, 0.5)


def test_a_dash_is_standard_input(monkeypatch: pytest.MonkeyPatch) -> None:
    stdin = io.TextIOWrapper(io.BytesIO(b'{"scan": {"speed": "20 mm/s"}}'))
    monkeypatch.setattr("sys.stdin", stdin)
    assert read_scene(words("-")).scan.speed == 0.02


@pytest.mark.parametrize(("given", "limit"), [("full", 19200.0), ("null", 1000.0), ("2kHz", 2000.0), ("300", 300.0)])
def test_a_band_is_a_frequency_or_full(given: str, limit: float) -> None:
    name = catalogue()[0].name
    assert read_scene(words(name, "--set", f"output.bandwidth={given}")).output.band_limit == limit


@pytest.mark.parametrize("name", [entry.name for entry in catalogue()])
def test_every_name_of_the_catalogue_is_a_scene(name: str) -> None:
    assert read_scene(words(name)).texture.period > 0


def test_the_everyday_scan_of_a_name_is_a_scene_that_changes_apply_to() -> None:
    scene = read_scene(words("denim-72x56", "--everyday", "--set", "scan.load=0.5N"))
    assert (scene.finger.kind, scene.scan.load, scene.scan.speed) == ("fingertip", 0.5, 0.08)
    assert scene.texture == read_scene(words("denim-72x56")).texture
    assert read_scene(words("denim-72x56")).finger.kind == "comb"


@pytest.fixture
def cloth(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """Return the name of an imported texture."""
    monkeypatch.setenv("RIDGEWAVE_DATA_FOLDER", str(tmp_path))
    surface = SurfaceData(np.array([0.0, 1e-6, 0.0, -1e-6], np.float32), (1e-4,))
    own_store().keep("", "my-cloth", surface, "profile", {"file": "a.csv"}, Quota())
    return "my-cloth"


def test_an_imported_texture_has_an_everyday_scan_too(cloth: str) -> None:
    alone, everyday = read_scene(words(cloth)), read_scene(words(cloth, "--everyday", "--set", "scan.load=0.5N"))
    assert (alone.finger.kind, everyday.finger.kind) == ("comb", "fingertip")
    assert alone.texture == everyday.texture and alone.texture.kind == "profile"
    assert (everyday.scan.load, everyday.scan.speed) == (0.5, 0.08)


def test_the_nearest_name_may_be_that_of_an_imported_texture(cloth: str) -> None:
    for arguments in (("my-clot",), ("my-clot", "--everyday"), ("denim-72x56", "--set", "texture.kind=my-clot")):
        assert f'"{cloth}"' in fault_of(*arguments)
    assert '"denim-72x56"' in fault_of("denim-72x5")


@pytest.mark.usefixtures("cloth")
def test_only_a_name_has_an_everyday_scan(scene_file: str) -> None:
    for scene in (scene_file, "-", "none.json"):
        assert "a texture's name as SCENE" in fault_of(scene, "--everyday")


def test_a_catalogue_name_wins_over_a_file_of_that_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    name = catalogue()[0].name
    (tmp_path / name).write_text("not a scene")
    monkeypatch.chdir(tmp_path)
    assert read_document(name) == catalogue()[0].document


def test_a_file_needs_no_ending(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "mine").write_text("{}")
    monkeypatch.chdir(tmp_path)
    assert read_document("mine") == {}


def test_changes_apply_in_order(scene_file: str) -> None:
    scene = read_scene(words(scene_file, "--set", "texture.period=0.6mm", "--set", "texture.period=0.7 mm"))
    assert scene.texture.period == pytest.approx(0.0007)
    assert scene.scan.load == 0.5


def test_a_changed_amplitude_replaces_the_roughness_of_the_file(scene_file: str) -> None:
    assert read_scene(words(scene_file, "--set", "texture.amplitude=7um")).texture.amplitude == pytest.approx(7e-6)


def test_a_null_restores_the_default(scene_file: str) -> None:
    assert read_scene(words(scene_file, "--set", "scan.load=null")).scan.load == 0.3


@pytest.mark.parametrize(("given", "seconds"), [("5", 5.0), ("0.25", 0.25), ("2 min", 120.0), ("250ms", 0.25)])
def test_duration_takes_seconds_or_a_unit_and_wins(scene_file: str, given: str, seconds: float) -> None:
    scene = read_scene(words(scene_file, "--set", "output.duration=9", "--duration", given))
    assert scene.output.duration == pytest.approx(seconds)


@pytest.mark.parametrize(
    ("given", "patch"),
    [
        ("texture.period=0.6mm", {"texture": {"period": "0.6mm"}}),
        ("scan.load=0.5", {"scan": {"load": 0.5}}),
        ("output.full_scale=null", {"output": {"full_scale": None}}),
        ('output.channels=["velocity"]', {"output": {"channels": ["velocity"]}}),
        ('scan.stroke={"length": "20 mm"}', {"scan": {"stroke": {"length": "20 mm"}}}),
        ("texture.kind=a=b", {"texture": {"kind": "a=b"}}),
        ("texture.kind=", {"texture": {"kind": ""}}),
        ("scan.speed=NaN", {"scan": {"speed": "NaN"}}),
        ("scan.speed=-Infinity", {"scan": {"speed": "-Infinity"}}),
    ],
)
def test_a_change_is_json_if_it_parses_otherwise_text(given: str, patch: dict[str, Any]) -> None:
    assert patch_of(given) == patch


@pytest.mark.parametrize(
    ("change", "path"),
    [
        ('scan={"load": 1, "load": 2}', "scan.load"),
        ('output={"channels": [{"quantity": "velocity", "quantity": "velocity"}]}', "output.channels.0.quantity"),
        ('effects.inertia={"mass": 1, "mass": 1}', "effects.inertia.mass"),
    ],
)
def test_a_field_twice_in_the_json_of_a_change_is_refused(scene_file: str, change: str, path: str) -> None:
    assert fault_of(scene_file, "--set", change).startswith(f"{path}: got the same field more than once")


def test_json_that_is_nested_too_deeply_is_refused(scene_file: str) -> None:
    assert "nested too deeply" in fault_of(scene_file, "--set", f"scan={100_000 * '['}")


@given(st.recursive(st.none() | st.booleans() | st.integers() | st.text(), lambda inner: st.lists(inner, max_size=3)))
def test_every_json_value_is_taken_as_json(value: object) -> None:
    assert value_of(json.dumps(value)) == value


@pytest.mark.parametrize("change", ["texture.period", "=3", ".period=3", "texture..period=3", "texture.=3", "a. =3"])
def test_a_change_without_a_path_or_a_value_is_refused(scene_file: str, change: str) -> None:
    message = fault_of(scene_file, "--set", change)
    assert "--set" in message
    assert "texture.period=0.6mm" in message


def test_a_change_inside_a_list_says_what_to_write(scene_file: str) -> None:
    assert "FIELD=[...]" in fault_of(scene_file, "--set", "output.channels.0.quantity=velocity")


@pytest.mark.parametrize(
    ("change", "meant"),
    [
        ("texture.period=0.6", '"0.6 mm"'),
        ('texture={"period": 0.6}', '"0.6 mm"'),
        ("finger.contact_length=0.05", '"0.05 mm"'),
        ("scan.load=300", '"300 mN"'),
        ("scan.speed=8", '"8 mm/s"'),
    ],
)
def test_a_number_that_is_probably_in_the_wrong_unit_is_refused(scene_file: str, change: str, meant: str) -> None:
    message = fault_of(scene_file, "--set", change)
    assert meant in message and change.partition("=")[0] in message


def test_a_unit_or_a_usual_number_is_accepted(scene_file: str) -> None:
    assert read_scene(words(scene_file, "--set", "texture.period=0.6m")).texture.period == 0.6
    assert read_scene(words(scene_file, "--set", "texture.period=0.0006")).texture.period == 0.0006


def test_a_misspelt_field_names_its_path(scene_file: str) -> None:
    assert "texture.perod" in fault_of(scene_file, "--set", "texture.perod=1mm")


def test_all_faults_are_reported_at_once(scene_file: str) -> None:
    message = fault_of(scene_file, "--set", "scan.load=-1", "--set", "texture.period=3kg", "--duration", "soon")
    assert all(field in message for field in ("scan.load", "texture.period", "output.duration"))


@pytest.mark.parametrize(
    ("content", "told"),
    [
        (b"", "nothing"),
        (b"period: 3", "not JSON"),
        (b"[1, 2]", "a list"),
        (b"RIFF\xff\xff", "not UTF-8"),
        (b'{"scan": {}, "scan": {}}', "more than once"),
        (b'{"scan": {"speed": NaN}}', "scan.speed"),
        (b'{"scan": {"load": 1e999}}', "scan.load"),
    ],
)
def test_a_file_that_is_no_scene_is_refused(tmp_path: Path, content: bytes, told: str) -> None:
    path = tmp_path / "scene.json"
    path.write_bytes(content)
    assert told in fault_of(str(path))


def test_a_missing_file_and_a_folder_are_refused(tmp_path: Path) -> None:
    assert "exists" in fault_of(str(tmp_path / "none.json"))
    assert "folder" in fault_of(str(tmp_path))


def test_an_unknown_name_suggests_the_nearest() -> None:
    assert "grating-1mm-31um" in fault_of("grating-1mm")
