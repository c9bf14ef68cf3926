"""The fields of each kind of texture: defaults, ends of ranges, refusals and their words, and the written document."""

from __future__ import annotations

import math
import struct
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from synth.errors import SceneError
from synth.scene.merge import merge_patch
from synth.scene.rules import Quantity
from synth.scene.scene import parse_scene, scene_document, scene_from
from synth.scene.section import rule_of
from synth.scene.texture_registry import SHARED, kinds, kinds_with, special_fields
from synth.scene.texture_section import Texture
from synth.surfaces import profile_of, surface_data
from synth.surfaces.measured import LARGEST_FILE, MOST_INLINE
from synth.surfaces.surface_data import SurfaceData, remember, surface_at
from tests.synth.scene.scene_cases import faults_of

WAVE = [0.0, 20e-6, 0.0, -20e-6]
ROWS = [WAVE, [0.0, 10e-6, 0.0, 0.0]]
NEEDED: dict[str, dict[str, Any]] = {
    "profile": {"heights": WAVE, "spacing": "0.1 mm"},
    "heightmap": {"rows": ROWS, "spacing": "0.1 mm"},
}
COMPANY: dict[str, dict[str, Any]] = {
    "ramp": {"height": 0.0, "period": 1.0, "duty": 0.5},
    "edge_radius": {"height": 0.0},
    "rms_height": {"period": 0.2},
    "period_across": {"period": 1.0, "thread_height": 0.0},
    "aspect": {"period": 0.1, "longest": 4.9e-3, "shortest": 4e-3},
    "thread_width": {"period": 10e-3},
    "thread_height": {"period": 10e-3},
    "rms_slope": {"period": 1e-3, "shortest": 1e-4},
    "longest": {"period": 1.0, "shortest": 0.5e-3},
    "shortest": {"period": 5e-3},
    "dot_diameter": {"period": 0.1, "row_distance": 0.1, "dot_height": 1e-6},
    "dot_top": {"period": 0.1, "row_distance": 0.1, "dot_height": 1e-6, "dot_diameter": 20e-3},
    "row_distance": {"period": 0.1, "dot_height": 1e-6},
    "dot_height": {"period": 4e-3},
    "spacing": {"rows": [[0.0, 1e-8, 0.0, -1e-8] * 250] * 2},
    "spacing_across": {"rows": [[0.0, 0.0], [0.0, 0.0]]},
}
"""Other fields that let a field reach an end of its range; BEYOND lists the ends that no other fields allow."""
BEYOND = {("ramp", 1), ("shortest", 1), ("longest", 0), ("dot_top", 1), ("spacing", 1)}
NUMBERS = ["spacing"]
NUMBERS += [name for name in special_fields() if name not in SHARED and isinstance(rule_of(Texture, name), Quantity)]


def texture(kind: str, **fields: Any) -> dict[str, Any]:
    return {"texture": {"kind": kind, **NEEDED.get(kind, {}), **fields}}


def npy(kind: str, shape: tuple[int, ...], content: bytes) -> bytes:
    """Return an .npy file with this header, true or not."""
    header = repr({"descr": kind, "fortran_order": False, "shape": shape}).ljust(117).encode() + b"\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header)) + header + content


@pytest.mark.parametrize("kind", kinds())
def test_a_kind_by_its_name_alone_is_a_scene_that_reads_back(kind: str) -> None:
    scene = parse_scene(texture(kind))
    document = scene_document(scene)
    assert parse_scene(document) == scene
    assert hash(parse_scene(document)) == hash(scene)
    assert document["texture"]["kind"] == kind == profile_of(scene).kind
    shared = {"kind", "phase", "youngs_modulus", "poisson_ratio"}
    assert set(document["texture"]) == shared | set(kinds()[kind].names) - {"roughness", "file"}


@pytest.mark.parametrize("kind", kinds())
def test_period_and_amplitude_are_those_of_the_profile(kind: str) -> None:
    scene = parse_scene(texture(kind))
    profile = profile_of(scene)
    assert scene.texture.period == profile.period
    assert scene.texture.amplitude == profile.equivalent().amplitude
    assert profile_of(scene) is profile


def test_the_document_of_a_sinusoid_is_as_it_was() -> None:
    assert scene_document(parse_scene({}))["texture"] == {
        "kind": "sinusoid",
        "period": 0.8e-3,
        "amplitude": 20e-6,
        "phase": math.sqrt(2.0),
        "youngs_modulus": None,
        "poisson_ratio": 0.5,
    }
    closed = profile_of(parse_scene({})).cosine
    assert closed is not None
    assert (closed.amplitude, closed.phase, closed.period) == (20e-6, math.sqrt(2.0), 0.8e-3)


@pytest.mark.parametrize("name", [name for name in special_fields() if name not in SHARED])
def test_a_field_of_one_kind_is_refused_with_all_others(name: str) -> None:
    value = {"heights": WAVE, "amplitudes": [1e-6], "phases": [0.0], "file": "a.csv", "rows": ROWS}.get(name, 1)
    owners = kinds_with(name)
    for kind in kinds():
        if kind not in owners:
            document = texture(kind, **{name: value})
            (fault,) = [one for one in faults_of(document) if "the fields of kind" in one.allowed]
            assert fault.pointer == f"/texture/{name}"
            assert f'"{owners[0]}"' in fault.hint


@pytest.mark.parametrize("name", NUMBERS)
@pytest.mark.parametrize("end", [0, 1])
def test_an_end_of_a_range_is_accepted_and_what_is_beyond_is_refused(name: str, end: int) -> None:
    kind, rule = kinds_with(name)[0], rule_of(Texture, name)
    assert isinstance(rule, Quantity)
    value = (rule.low, rule.high)[end]
    company = texture(kind, **COMPANY.get(name, {}))["texture"]
    if (name, end) in BEYOND:
        assert all(fault.allowed != rule.allowed for fault in faults_of({"texture": {**company, name: value}}))
    else:
        assert getattr(parse_scene({"texture": {**company, name: value}}).texture, name) == value
    outside = [math.nextafter(rule.high, math.inf), math.inf] if end else [-1.0 if rule.low else -1e-300, math.nan]
    for wrong in outside:
        fault = next(one for one in faults_of({"texture": {**company, name: wrong}}))
        assert (fault.pointer, fault.allowed) == (f"/texture/{name}", rule.allowed)


@pytest.mark.parametrize(
    ("document", "pointer", "words"),
    [
        (texture("profile", heights=[1e-6]), "/texture/heights", "The list has 1"),
        (texture("profile", heights=[]), "/texture/heights", "a list of 2 to 65536"),
        (texture("profile", heights=[0.0] * (MOST_INLINE + 1)), "/texture/heights", "texture.file takes up to 2000000"),
        (texture("profile", heights=range(10_000_000)), "/texture/heights", "a list of 2 to 65536"),
        (texture("profile", heights={"0": 1}), "/texture/heights", "Write a list"),
        (texture("heightmap", heights=[[0, 1e-5], [1e-5, 0]]), "/texture/heights", "texture.rows"),
        (texture("profile", heights=[0, math.nan]), "/texture/heights/1", "finite"),
        (texture("profile", heights=[0, math.inf]), "/texture/heights/1", "finite"),
        (texture("profile", heights=[0, "20 umm"]), "/texture/heights/1", "units"),
        (texture("profile", heights=[0, None]), "/texture/heights/1", "0.8 mm"),
        ({"texture": {"kind": "profile"}}, "/texture/heights", "Write a list"),
        (texture("profile", heights=[0, 0, 1e-3, 0, 0], spacing=1e-5), "/texture/heights", "from height 1 to 2 is 100"),
        (texture("profile", heights=[0, 1e-4, 2e-4, 3e-4], spacing=1e-5), "/texture/heights", "mirror"),
        (texture("profile", heights=[0, 5e-3, 0, -5e-3], spacing=1e-3), "/texture/heights", "0.002 m high at most"),
        (texture("profile", heights=[0, 1e-9], spacing=1e-7), "/texture/spacing", "length"),
        (texture("profile", file="/etc/hostname"), "/texture/file", "only the command line"),
        (texture("harmonics", phases=[0.0]), "/texture/phases", "2 amplitudes and 1 phases"),
        (texture("harmonics", amplitudes=[]), "/texture/amplitudes", "1 to 64"),
        (texture("harmonics", amplitudes=[1e-6] * 65), "/texture/amplitudes", "1 to 64"),
        (texture("harmonics", amplitudes=[0.6e-3, 0.6e-3]), "/texture/amplitudes", "sum is 1 mm"),
        (texture("harmonics", amplitudes=[-1e-6]), "/texture/amplitudes/0", "at least 0 m"),
        (texture("harmonics", period=1e-6), "/texture/amplitudes", "slopes of 20 at most"),
        (texture("grating", ramp=1e-4, edge_radius=1e-4), "/texture/edge_radius", "not both"),
        (texture("grating", ramp="0.5 mm"), "/texture/ramp", "at most 400 um"),
        (texture("grating", ramp="1 um"), "/texture/height", "slopes of 20 at most"),
        (texture("grating", edge_radius="20 um"), "/texture/edge_radius", "more than height / 2"),
        (texture("grating", edge_radius="10 mm"), "/texture/edge_radius", "at most 1010 um"),
        (texture("rough", rms_height=1e-6, rms_slope=0.1), "/texture/rms_slope", "not both"),
        (texture("rough", longest="30 mm"), "/texture/longest", "at most the period"),
        (texture("rough", longest="1 mm", shortest="2 mm"), "/texture/shortest", "below the longest"),
        (texture("rough", longest="9 mm", shortest="8 mm"), "/texture/shortest", "No whole fraction"),
        (texture("rough", shortest="1 um"), "/texture/shortest", "20000 waves"),
        (texture("rough", rms_slope=5), "/texture/rms_slope", "high at most"),
        (texture("rough", seed=0.5), "/texture/seed", "whole number"),
        (texture("rough_area", rms_height=1e-6, rms_slope=0.1), "/texture/rms_slope", "not both"),
        (texture("rough_area", longest="30 mm"), "/texture/longest", "at most 20 mm"),
        (texture("rough_area", aspect=3, longest="9 mm"), "/texture/longest", "would be 27 mm"),
        (texture("rough_area", shortest="10 um"), "/texture/shortest", "512 waves"),
        (texture("rough_area", longest="1 mm", shortest="2 mm"), "/texture/shortest", "below the longest"),
        (texture("rough_area", rms_slope=5), "/texture/rms_slope", "high at most"),
        (texture("weave", weave="knit"), "/texture/weave", "sateen"),
        (texture("weave", thread_width=0), "/texture/thread_width", "0.1 to 1"),
        (texture("weave", period="10 um"), "/texture/thread_height", "slopes of 20 at most"),
    ],
    ids=lambda item: item if isinstance(item, str) else "",
)
def test_bad_input_is_refused_with_the_field_and_what_to_write(
    document: Mapping[str, Any], pointer: str, words: str
) -> None:
    fault = next(fault for fault in faults_of(document) if fault.pointer == pointer)
    assert words in fault.sentence()


@pytest.mark.parametrize(
    ("before", "patch", "gone"),
    [
        ({"kind": "rough", "rms_height": 1e-6}, {"rms_slope": 0.1}, "rms_height"),
        ({"kind": "rough", "rms_slope": 0.1}, {"rms_height": 1e-6}, "rms_slope"),
        ({"kind": "grating", "ramp": 1e-4}, {"edge_radius": 1e-4}, "ramp"),
        ({"kind": "grating", "edge_radius": 1e-4}, {"ramp": 1e-4}, "edge_radius"),
        ({"kind": "sinusoid", "amplitude": 1e-5}, {"roughness": 1e-5}, "amplitude"),
    ],
)
def test_a_partial_scene_displaces_what_it_writes_in_another_way(
    before: dict[str, Any], patch: dict[str, Any], gone: str
) -> None:
    changed = merge_patch({"texture": before}, {"texture": patch})
    assert gone not in changed["texture"]  # type: ignore[operator]
    assert parse_scene(changed) == parse_scene({"texture": {"kind": before["kind"], **patch}})
    complete = scene_document(parse_scene({"texture": before}))
    assert parse_scene(merge_patch(complete, {"texture": patch})) == parse_scene(changed)


def test_naming_another_kind_replaces_the_texture() -> None:
    complete = scene_document(parse_scene(texture("rough", hurst=0.5, phase=1.0)))
    assert parse_scene(merge_patch(complete, texture("grating"))) == parse_scene(texture("grating"))


def test_one_order_of_harmonics_is_a_sinusoid() -> None:
    one = profile_of(parse_scene(texture("harmonics", amplitudes=["20 um", 0], phases=["90 deg", 1], phase=0.5)))
    same = profile_of(parse_scene({"texture": {"amplitude": "20 um", "phase": 0.5 + math.pi / 2}}))
    assert one.cosine == same.cosine


@pytest.mark.parametrize("ending", [".npy", ".csv", ".txt"])
def test_a_file_of_heights_is_read_where_paths_may_be(tmp_path: Path, ending: str) -> None:
    path = tmp_path / f"heights{ending}"
    np.save(path, WAVE) if ending == ".npy" else path.write_text("\n".join(map(repr, WAVE)) + "\n")
    read = scene_from({"texture": {"kind": "profile", "file": str(path), "spacing": "0.1 mm"}})
    assert read == parse_scene(texture("profile"))
    assert scene_document(read)["texture"]["heights"] == WAVE


def long_file(folder: Path, amplitude: float = 1e-6) -> Path:
    """Return a file of more heights than a document holds."""
    np.save(folder / "long.npy", amplitude * np.cos(2.0 * math.pi * np.arange(MOST_INLINE + 1) / 1000.0))
    return folder / "long.npy"


def test_a_long_file_is_written_down_as_the_address_of_its_heights_and_its_path(tmp_path: Path) -> None:
    path = long_file(tmp_path)
    scene = scene_from({"texture": {"kind": "profile", "file": str(path), "spacing": "1 um"}})
    texture = scene_document(scene)["texture"]
    data = surface_at(texture["surface"])
    assert data is not None
    assert len(data.heights) == MOST_INLINE + 1
    assert (texture["file"], texture.get("heights"), texture["spacing"]) == (str(path), None, 1e-6)
    assert scene.texture.period == pytest.approx((MOST_INLINE + 1) * 1e-6)
    assert scene_from(scene_document(scene)) == scene == parse_scene(scene_document(scene))


def test_a_document_whose_file_has_changed_is_refused_where_its_surface_is_unknown(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    fields = {"kind": "profile", "file": str(long_file(tmp_path)), "spacing": "1 um"}
    document = scene_document(scene_from({"texture": fields}))
    monkeypatch.setattr(surface_data, "_read", {})
    assert scene_document(scene_from(document)) == document  # its file is read again
    long_file(tmp_path, 2e-6)
    monkeypatch.setattr(surface_data, "_read", {})
    with pytest.raises(SceneError, match="other heights now"):
        scene_from(document)
    assert faults_of(document)[0].pointer == "/texture/surface"  # what a service tells
    assert "known here" in faults_of(document)[0].sentence()


def remembered(heights: Any, *spacing: float) -> dict[str, Any]:
    """Return a scene of these heights, as a surface that is known here."""
    address = remember(SurfaceData(np.asarray(heights, np.float32), spacing))
    return {"texture": {"kind": "profile", "surface": address}}


SLOPE = np.linspace(0.0, 1e-3, 1000)


@pytest.mark.parametrize(
    ("document", "pointer", "words"),
    [
        ({"texture": {"kind": "profile", "surface": "0" * 64}}, "/texture/surface", "Import it here first"),
        ({"texture": {"kind": "profile", "surface": "0" * 63}}, "/texture/surface", "64 hexadecimal digits"),
        ({"texture": {"kind": "profile", "surface": 7}}, "/texture/surface", "64 hexadecimal digits"),
        (remembered(SLOPE, 1e-5), "/texture/surface", 'does not close. Remove the trend, or write ends "mirror"'),
        (remembered([0, 0, 1e-3, 0], 1e-5), "/texture/surface", "from height 1 to 2 is 100"),
        (remembered(np.zeros(1_000_001), 1e-5), "/texture/surface", "1 um to 10 m"),
        (remembered(np.zeros(2_000_001), 1e-6), "/texture/surface", "2 to 2000000 heights"),
        (remembered(np.zeros((3, 4)), 1e-5, 1e-5), "/texture/surface", "heightmap"),
        (remembered([0.0], 1e-5), "/texture/surface", "It has 1."),
        (texture("profile", ends="wrap"), "/texture/ends", '"join", "mirror"'),
        (texture("profile", surface="0" * 64), "/texture/heights", "nothing beside surface"),
    ],
)
def test_bad_surfaces_are_refused(document: dict[str, Any], pointer: str, words: str) -> None:
    fault = faults_of(document)[0]
    assert fault.pointer == pointer
    assert words in fault.sentence()


def test_a_spacing_beside_a_surface_is_refused_where_it_is_another() -> None:
    fields = remembered(1e-6 * np.sin(0.1 * np.arange(500)), 1e-5)["texture"]
    assert parse_scene({"texture": {**fields, "spacing": "10 um"}}) == parse_scene({"texture": fields})
    fault = faults_of({"texture": {**fields, "spacing": "20 um"}})[0]
    assert (fault.pointer, "its own heights and spacing" in fault.hint) == ("/texture/spacing", True)


def test_mirrored_ends_have_no_step_and_twice_the_length() -> None:
    scene = parse_scene({"texture": {**remembered(SLOPE, 1e-5)["texture"], "ends": "mirror", "phase": 0}})
    profile = profile_of(scene)
    assert profile.period == scene.texture.period == pytest.approx(2.0 * 999 * 1e-5)
    places = np.linspace(0.0, 999e-5, 77)
    assert profile.slope_bound == pytest.approx(0.1, rel=2e-3)
    assert profile.heights(-places) == pytest.approx(profile.heights(places), abs=1e-12)
    assert profile.heights(places) == pytest.approx(places * 0.1001001 - 0.5e-3, abs=1e-9)


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("a.wav", b"RIFF", ".npy of one dimension"),
        ("a.csv", b"", "2 to 2000000 heights"),
        ("a.csv", b"1e-6\n", "It contains 1"),
        ("a.csv", b"0.0,1e-6\n0.1,2e-6\n", "cannot be read"),
        ("a.txt", b"0 1e-6\n1e-5 2e-6\n", "2 dimensions"),
        ("a.csv", b"height\n1e-6\n", "cannot be read"),
        ("a.csv", b"0\nnan\n", "Height 1 is nan"),
        ("a.csv", b"0\n20\n", "write metres"),
        ("a.npy", b"\x93NUMPY\x01\x00 cut", "cannot be read"),
        ("a.csv", b"20 um\n0 um\n", "cannot be read"),
        ("a.csv", b"0,1e-6,0\n", "cannot be read"),
        ("a.csv", b"\xff\xfe\x00\x01\n", "cannot be read"),
        ("a.txt", b"0\n" * 2_000_001, "It contains more"),
        ("a.npy", npy("<f8", (3,), bytes(16)), "cannot be read"),
        ("a.npy", npy("<f8", (10**12,), bytes(64)), "cannot be read"),
        ("a.npy", npy("|O", (2,), bytes(16)), "cannot be read"),
        ("a.npy", b"PK\x03\x04", "cannot be read"),
        ("a.npy", npy("<c16", (2,), bytes(32)), "complex128"),
        ("a.npy", npy("<f8", (), bytes(8)), "0 dimensions"),
        ("a.npy", npy("<f8", (1,), bytes(8)), "It contains 1"),
        ("a.npy", npy("|i1", (2_000_001,), bytes(2_000_001)), "It contains more"),
        ("a.npy", npy("<i8", (2,), struct.pack("<2q", 0, 1)), "write metres"),
        ("a.npy", npy("<f8", (2,), struct.pack("<2d", 0.0, math.nan)), "Height 1 is nan"),
        ("missing.csv", None, "Check the path"),
        ("missing\0.csv", None, "Check the path"),
    ],
)
def test_a_file_that_is_no_heights_is_refused(tmp_path: Path, name: str, content: bytes | None, words: str) -> None:
    if content is not None:
        (tmp_path / name).write_bytes(content)
    with pytest.raises(SceneError) as refused:
        scene_from({"texture": {"kind": "profile", "file": str(tmp_path / name)}})
    assert refused.value.faults[0].pointer == "/texture/file"
    assert words in refused.value.faults[0].sentence()


@pytest.mark.parametrize(
    ("heights", "words"),
    [
        (np.array([0.0, 0.0, 1e-3, 0.0]), "from height 1 to 2 is 100. Remove the step or the spike"),
        (np.linspace(0.0, 1e-3, 1000), "Remove the trend, or write"),
        (np.array([0.0, 3e-3]), "slopes of 20 at most"),
    ],
)
def test_a_file_is_held_to_what_a_list_is_held_to(tmp_path: Path, heights: Any, words: str) -> None:
    np.save(tmp_path / "a.npy", heights)
    with pytest.raises(SceneError) as refused:
        scene_from({"texture": {"kind": "profile", "file": str(tmp_path / "a.npy"), "spacing": "10 um"}})
    assert refused.value.faults[0].pointer == "/texture/heights"
    assert words in refused.value.faults[0].sentence()


@pytest.mark.parametrize("ending", [".npy", ".csv"])
def test_a_huge_file_is_refused_before_it_is_read(tmp_path: Path, ending: str) -> None:
    path = tmp_path / f"huge{ending}"
    with path.open("wb") as hole:
        hole.truncate(LARGEST_FILE + 1)
    with pytest.raises(SceneError, match=r"texture\.file: got .*; allowed: a file of at most 67108864 bytes"):
        scene_from({"texture": {"kind": "profile", "file": str(path)}})


def test_a_folder_and_an_archive_of_arrays_are_no_heights(tmp_path: Path) -> None:
    (tmp_path / "folder.npy").mkdir()
    np.savez(tmp_path / "a.npz", heights=np.zeros(4))
    (tmp_path / "a.npz").rename(tmp_path / "archive.npy")
    for name in ("folder.npy", "archive.npy"):
        with pytest.raises(SceneError, match=r"texture\.file"):
            scene_from({"texture": {"kind": "profile", "file": str(tmp_path / name)}})


def test_heights_beside_a_file_are_refused(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match="not both"):
        scene_from({"texture": {"kind": "profile", "heights": WAVE, "file": str(tmp_path / "a.npy")}})
