"""What a newcomer passes by mistake is refused with what to write, and not by an error of Python."""

from __future__ import annotations

import io
import json
from decimal import Decimal
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import soundfile
import xarray

import ridgewave as rw

OUTPUT = {"duration": 0.05, "sample_rate": 8000}
KINDS = [("x.wav", None), ("x.wav", "pcm16"), ("x.wav", "pcm24")]
NO_PATHS: list[Any] = [None, 5, [], {}, b"x.wav", np.zeros(3), io.StringIO("x")]


@pytest.fixture(scope="module")
def sound() -> rw.Sound:
    return rw.render({"output": OUTPUT})


@pytest.mark.parametrize("wrong", NO_PATHS, ids=lambda value: type(value).__name__)
def test_what_is_no_path_is_refused(wrong: Any, sound: rw.Sound) -> None:
    for function in (rw.load, rw.import_texture, sound.save):
        with pytest.raises(rw.InvalidRequest, match="the path of a"):
            function(wrong)


def test_json_text_is_no_name_and_a_mapping_is_no_text() -> None:
    wrongs: list[Any] = [{"texture": {}}, None, 5, [], io.StringIO("{}"), np.zeros(3)]
    for wrong in wrongs:
        with pytest.raises(rw.SceneError, match="JSON text"):
            rw.Scene.from_json(wrong)
    for text in (json.dumps({"texture": {}}), '  {\n "scan"', "[]"):
        with pytest.raises(rw.SceneError, match=r"rw\.Scene\.from_json"):
            rw.parse_scene(text)
    for nothing in ("", " \n"):
        with pytest.raises(rw.SceneError, match="the name of a texture"):
            rw.parse_scene(nothing)


def test_a_sound_is_a_scene(sound: rw.Sound) -> None:
    assert rw.parse_scene(sound) == sound.scene
    np.testing.assert_array_equal(rw.render(sound).frames, sound.frames)
    assert rw.parse_scene(sound, scan={"load": 0.5}).scan.load == 0.5
    assert rw.explain(sound).scene["output"]["sample_rate"] == 8000


def test_a_refused_ending_is_answered_with_every_ending(sound: rw.Sound, tmp_path: Path) -> None:
    with pytest.raises(rw.InvalidRequest, match=r"\.flac.*\.npy, \.csv"):
        sound.save(tmp_path / "x.aiff")


@pytest.mark.parametrize(("name", "subtype"), KINDS)
def test_a_cut_wav_says_so(name: str, subtype: str | None, sound: rw.Sound, tmp_path: Path) -> None:
    whole = sound.save(tmp_path / name, subtype).read_bytes()
    samples = whole.index(b"data") + 8
    for kept in (len(whole) - 1, len(whole) - 300, samples + 30, samples):
        with pytest.warns(rw.RenderWarning, match="incomplete: its header says 400 frames") as told:
            cut = rw.load(io.BytesIO(whole[:kept]))
        assert f"has {len(cut.frames)}." in str(told[0].message) and len(cut.frames) < 400
        assert cut.scene == sound.scene
    for kept in (samples - 9, 100, 13, 3, 0):
        with pytest.raises(rw.InvalidRequest, match=r"incomplete|empty|not recognised"):
            rw.load(io.BytesIO(whole[:kept]))


@pytest.mark.parametrize("part", [0.1, 0.5, 0.9, 0.999])
def test_a_cut_flac_is_refused(part: float, sound: rw.Sound, tmp_path: Path) -> None:
    whole = sound.save(tmp_path / "x.flac").read_bytes()
    (tmp_path / "cut.flac").write_bytes(whole[: int(part * len(whole))])
    with pytest.raises(rw.InvalidRequest, match="incomplete or damaged"):
        rw.load(tmp_path / "cut.flac")


@pytest.mark.parametrize(
    ("rows", "told"),
    [
        (np.zeros((2, 2, 2)), "three dimensions"),
        ([[[0.0] * 3] * 3] * 3, "three dimensions"),
        ([], "It is empty"),
        (np.zeros((3, 0)), "It is empty"),
        ([[0.0, 0.0]], "at least two rows"),
        ([[0.0, 0.0], [0.0]], "of one length"),
        (np.zeros((300, 300)), "Import larger maps"),
        (np.ma.masked_array(np.zeros((2, 2)), [[False, False], [True, False]]), r"np\.interp"),
    ],
)
def test_rows_that_are_no_map_are_refused_with_what_to_write(rows: Any, told: str) -> None:
    with pytest.raises(rw.SceneError, match=told):
        rw.Scene(texture={"kind": "heightmap", "rows": rows})


def test_lists_with_a_gap_or_too_many_numbers_are_refused_with_what_to_do() -> None:
    for gap in ([0.0, np.nan, 0.0], np.ma.masked_array(np.zeros(3), [False, True, False])):
        with pytest.raises(rw.SceneError, match=r"heights\.1: .*np\.interp"):
            rw.Scene(texture={"kind": "profile", "heights": gap})
    with pytest.raises(rw.SceneError, match=r"trajectory\.1\.1: .*np\.interp"):
        rw.Scene(scan={"trajectory": np.array([[0.0, 0.0, 0.3], [0.1, np.nan, 0.3]])})
    with pytest.raises(rw.SceneError, match=r"in Python texture\.file"):
        rw.Scene(texture={"kind": "profile", "heights": np.zeros(65_537)})


def test_numbers_and_names_of_other_types_are_read() -> None:
    names = np.array(["velocity", "displacement"])
    output: list[Any] = [names, tuple(names), ["velocity", "displacement"]]
    scenes = [rw.Scene(output={"channels": channels}) for channels in output]
    assert scenes[0] == scenes[1] == scenes[2]
    speeds: list[Any] = [
        Decimal("0.08"),
        np.array("80 mm/s"),
        np.array(["80 mm/s"]),
        np.str_("80 mm/s"),
        Fraction(2, 25),
    ]
    assert {rw.Scene(scan={"speed": speed}).scan.speed for speed in speeds} == {0.08}
    heights: list[Any] = [range(0, 2, 1), [Decimal(0), 1], np.array([0, 1])]
    for given in heights:
        with pytest.raises(rw.SceneError, match=r"heights\.1: got .*at most 10 mm"):
            rw.Scene(texture={"kind": "profile", "heights": given})
    phases = {"kind": "harmonics", "amplitudes": [1e-6] * 3, "phases": range(3)}
    assert rw.Scene(texture=phases).texture.document()["phases"] == [0.0, 1.0, 2.0]
    for wrong in (Decimal("NaN"), Decimal("sNaN"), Decimal("1e999999")):
        with pytest.raises(rw.SceneError, match="finite"):
            rw.Scene(scan={"speed": wrong})
    bare = xarray.DataArray([0.0, 1e-6], attrs={"units": ""})
    assert rw.Scene(texture={"kind": "profile", "heights": bare}).texture.document()["heights"] == [0.0, 1e-6]


def test_an_open_file_is_loaded_from_its_beginning(sound: rw.Sound, tmp_path: Path) -> None:
    for name in ("x.wav", "x.flac"):
        with sound.save(tmp_path / name).open("rb") as file:
            file.seek(20)
            assert rw.load(file).scene == sound.scene
    other = io.BytesIO()
    soundfile.write(other, np.zeros(8), 8000, format="WAV")
    with pytest.warns(rw.RenderWarning, match="The file has no scale"):
        assert len(rw.load(other).frames) == 8
