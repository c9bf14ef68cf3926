"""`import ridgewave`: what it offers, that it loads nothing before it is used, and fields that change a scene."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import ridgewave as rw
from service.store.own_textures import own_store
from service.store.store import Quota
from synth.scene.catalogue import catalogue_names
from synth.surfaces.surface_data import SurfaceData

SHORT = {"duration": 0.05, "sample_rate": 8000, "quantity": "displacement"}


def test_every_public_name_is_there_and_listed() -> None:
    assert sorted(rw.__all__) == dir(rw)
    assert all(getattr(rw, name) is not None for name in rw.__all__)
    with pytest.raises(AttributeError, match="no attribute 'sweeep'"):
        _ = rw.sweeep


def test_the_import_loads_neither_engine_nor_network() -> None:
    text = "import sys, ridgewave; print({'numpy', 'numba', 'httpx', 'synth.scene.scene'} & set(sys.modules))"
    done = subprocess.run([sys.executable, "-c", text], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "set()"


def test_a_scene_is_a_name_a_mapping_a_path_or_a_scene(tmp_path: Path) -> None:
    path = tmp_path / "scene.json"
    path.write_text(json.dumps({"texture": {"period": "1 mm", "amplitude": "31 um"}}), "utf-8")
    named = rw.parse_scene("grating-1mm-31um").texture
    texture = {"kind": "sinusoid", "period": named.period, "amplitude": named.amplitude}
    scenes: list[Any] = ["grating-1mm-31um", {"texture": texture}, path, rw.parse_scene("grating-1mm-31um")]
    sounds = [rw.render(scene, output=SHORT, scan={"speed": 0.05}) for scene in scenes]
    assert all(rw.parse_scene(sound.scene).scan.speed == 0.05 and len(sound.frames) == 400 for sound in sounds)
    for number in (1, 3):
        np.testing.assert_array_equal(sounds[number].frames, sounds[0].frames)


def test_fields_change_a_scene_as_a_patch_does() -> None:
    given = rw.parse_scene({"texture": {"amplitude": "10 um"}, "output": SHORT})
    voice = rw.open_voice(given, texture={"roughness": "10 um"}, scan={"load": "0.5 N"})
    assert voice.scene.texture.amplitude == pytest.approx(15.708e-6, rel=1e-4)
    assert voice.scene.scan.load == 0.5 and voice.scene.output == given.output
    assert given.scan.load == 0.3


def test_a_plan_of_a_changed_scene_tells_of_the_change() -> None:
    plan = rw.explain({"output": SHORT}, effects={"inertia": {}})
    assert "inertia" in [part["name"] for part in plan.document()["simulated"]]


def test_a_wrong_field_is_refused_with_what_to_write() -> None:
    with pytest.raises(rw.SceneError, match="loadd"):
        rw.render({}, scan={"loadd": 1.0})
    nothing: list[Any] = [None, [], 1, b"{}"]
    for wrong in nothing:
        with pytest.raises(rw.SceneError, match="a JSON object"):
            rw.render(wrong, output=SHORT)


def test_imported_textures_are_listed_after_the_catalogue(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("RIDGEWAVE_DATA_FOLDER", str(tmp_path))
    assert list(rw.textures()) == list(catalogue_names())
    surface = SurfaceData(np.array([0.0, 1e-6, 0.0, -1e-6], np.float32), (1e-4,))
    own_store().keep("", "cloth", surface, "profile", {"file": "a.csv", "notes": ["Coarse"]}, Quota())
    assert list(rw.textures()) == [*catalogue_names(), "cloth"]
    entry = rw.textures()["cloth"]
    assert (entry.title, entry.group, entry.note) == ("Imported from a.csv", "Yours", "Coarse.")
    for scene, finger in ((entry.document, "comb"), (entry.everyday, "fingertip")):
        told = rw.explain(scene).document()["scene"]
        assert (told["texture"]["surface"], told["finger"].get("kind", "comb")) == (surface.address, finger)
    assert rw.explain("cloth").document()["scene"] == rw.explain(entry.document).document()["scene"]
    with pytest.raises(rw.SceneError, match='nearest name is "cloth"'):
        rw.explain("clothh")


def test_the_catalogue_gives_scenes_by_name() -> None:
    textures = rw.textures()
    entry = textures["denim-72x56"]
    assert isinstance(entry, rw.CatalogueEntry) and len(textures) >= 40
    assert rw.parse_scene(entry.document) == rw.parse_scene("denim-72x56")
    everyday = rw.parse_scene(entry.everyday)
    assert (everyday.finger.kind, everyday.texture) == ("fingertip", rw.parse_scene("denim-72x56").texture)


def test_the_page_on_python_has_every_public_name() -> None:
    page = (Path(rw.__file__).resolve().parents[1] / "docs" / "python.md").read_text("utf-8")
    assert [name for name in rw.__all__ if f"`{name}`" not in page] == []
