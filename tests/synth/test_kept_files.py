"""Solved responses and tables as files: found again bit for bit, and only where they are worth it."""

from __future__ import annotations

import os
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from synth import kept_files
from synth.contact.scene_contact import contact_of
from synth.kept_files import FileEntry, FileForm, KeptFiles
from synth.motion.motion import Update
from synth.plan import contact_choice, direct_plan, scene_series, scene_table, usual_hand
from synth.response.spectrum import SPECTRUM_FORM, Spectrum
from synth.response_cache import ResponseCache
from synth.scene.scene import parse_scene
from synth.surfaces.surface_data import SurfaceData, remember
from synth.voice.hand_voice import HandVoice

TEXT: FileForm[Any] = FileForm(".txt", lambda entry: entry.text.encode(), lambda content: Text(content.decode()))
USUAL = {"finger": {"kind": "fingertip"}, "texture": {"kind": "denim-72x56"}}
KINDS = {".json": 4, ".safetensors": 1}  # two series, their columns and the usual peaks; the table


class Text:
    """An entry."""

    memory_bytes = 1

    def __init__(self, text: str) -> None:
        self.text = text


def forbid(monkeypatch: pytest.MonkeyPatch) -> None:
    def solved(*_arguments: Any, **_keywords: Any) -> Any:
        raise AssertionError("solved again")

    monkeypatch.setattr(scene_table, "make_table", solved)
    monkeypatch.setattr(scene_series, "solve_spectrum", solved)
    monkeypatch.setattr(usual_hand, "_series", solved)


def opened(folder: Path | None, scene: dict[str, Any]) -> HandVoice:
    return HandVoice(parse_scene(scene), cache=ResponseCache(files=None if folder is None else KeptFiles(folder)))


def stroked(voice: HandVoice) -> np.ndarray[Any, Any]:
    """Return what a short stroke sounds like."""
    blocks = []
    for step in range(20):
        voice.touch(Update(seq=step, position=0.001 * step, speed=None, load=0.3 + 0.02 * step, time=0.01 * step))
        blocks.append(voice.render(480))
    return np.concatenate(blocks)


def entry(document: dict[str, Any]) -> FileEntry[Any] | None:
    """Return by what a result of a scene is found."""
    scene = parse_scene(document)
    return scene_table.entry_of(scene, contact_of(scene), (), TEXT)


def endings(folder: Path) -> dict[str, int]:
    found: dict[str, int] = {}
    for path in folder.iterdir() if folder.exists() else ():
        found[path.suffix] = found.get(path.suffix, 0) + 1
    return found


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder in which the usual scene is kept."""
    made = tmp_path_factory.mktemp("kept")
    opened(made, USUAL)
    return made


def test_a_later_process_solves_nothing_and_sounds_the_same(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    solved = stroked(opened(None, USUAL))
    assert endings(folder) == KINDS
    forbid(monkeypatch)
    assert np.abs(solved).max() > 0.0
    np.testing.assert_array_equal(stroked(opened(folder, USUAL)), solved)
    with pytest.raises(AssertionError, match="solved again"):
        opened(None, USUAL)


def test_a_surface_that_is_solved_directly_is_found_again_too(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    rough = {"finger": {"kind": "fingertip"}, "texture": {"kind": "sandpaper-p40"}}
    solved, first = opened(None, rough), opened(tmp_path, rough)
    assert endings(tmp_path) == {".json": 5}, "two series, their columns, the usual peaks and the direct plan"
    sound = stroked(first)
    np.testing.assert_array_equal(sound, stroked(solved))
    monkeypatch.setattr(direct_plan, "_planned", lambda *_, **__: pytest.fail("planned again"))
    forbid(monkeypatch)
    np.testing.assert_array_equal(stroked(opened(tmp_path, rough)), sound)


def test_a_change_of_a_live_stream_reads_what_the_opening_of_another_kept(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    voice = opened(None, USUAL | {"texture": {"kind": "corduroy-14-wale"}})
    voice._cache = ResponseCache(files=KeptFiles(folder))
    forbid(monkeypatch)
    voice.apply(voice.prepare(parse_scene(USUAL)))
    assert np.abs(stroked(voice)).max() > 0.0


def test_a_series_is_read_bit_for_bit() -> None:
    values = np.random.default_rng(1).standard_normal(18).view(np.complex128) * 1e-7
    series = Spectrum(values, (1e-3, 2.5e-4), 128, False, "segments")
    read = SPECTRUM_FORM.read(SPECTRUM_FORM.write(series))
    np.testing.assert_array_equal(read.harmonics, values)
    assert (read.errors, read.phases, read.closed, read.solver) == (series.errors, 128, False, "segments")


@pytest.mark.parametrize(
    "change",
    [
        {"texture": {"kind": "denim-72x56", "phase": 1.0}},
        {"texture": {"period": "0.7 mm"}},
        {"finger": {"kind": "fingertip", "seed": 3}},
        {"effects": {"inertia": {}}},
    ],
)
def test_what_a_slider_passes_through_is_not_kept(tmp_path: Path, change: dict[str, Any]) -> None:
    assert entry(USUAL | change) is None and entry(USUAL) is not None


def test_a_texture_over_an_area_is_found_again_too(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    narrow = {"sample_rate": 8000, "bandwidth": 300}  # quick to solve
    dots = {"finger": {"kind": "fingertip"}, "texture": {"kind": "golf-ball-dimples"}, "output": narrow}
    sound = stroked(opened(tmp_path, dots))
    assert endings(tmp_path) == {".json": 6}, "two series, error of cells, spread of points, peaks, plan"
    monkeypatch.setattr(contact_choice, "harmonics_of", lambda *_: pytest.fail("cells judged again"))
    monkeypatch.setattr(direct_plan, "_planned", lambda *_, **__: pytest.fail("planned again"))
    forbid(monkeypatch)
    np.testing.assert_array_equal(stroked(opened(tmp_path, dots)), sound)


def test_a_part_of_a_contact_and_a_line_off_the_middle_of_an_area_are_not_kept() -> None:
    other = contact_of(parse_scene(USUAL | {"texture": {"kind": "corduroy-14-wale"}}))
    assert scene_table.entry_of(parse_scene(USUAL), other, (), TEXT) is None
    dots = USUAL | {"texture": {"kind": "golf-ball-dimples"}}
    assert entry(dots) is not None
    assert entry(dots | {"scan": {"y": "1 mm"}}) is None and entry(dots | {"scan": {"direction": 0.1}}) is None


def test_an_imported_surface_is_kept_and_one_that_is_changed_is_not() -> None:
    address = remember(SurfaceData(np.array([0.0, 1e-6, 0.0, -1e-6], np.float32), (1e-4,)))
    texture = {"kind": "profile", "surface": address}
    entries = [entry({"texture": texture | more}) for more in ({}, {"ends": "mirror"})]
    assert entries[0] is not None and address in entries[0].text and entries[1] is None


def test_what_decides_an_entry_is_in_its_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    files, made = KeptFiles(tmp_path), iter("abcdef")
    one, other = (FileEntry(text, TEXT) for text in ("one", "other"))

    def got(entry: FileEntry[Any]) -> str:
        return str(files.get(entry, lambda: Text(next(made))).text)

    assert [got(one), got(other), got(one), got(other)] == ["a", "b", "a", "b"]
    monkeypatch.setattr(kept_files, "source_hash", lambda: "another version")
    assert [got(one), got(one)] == ["c", "c"]


def test_a_damaged_file_is_made_again(tmp_path: Path, folder: Path) -> None:
    shutil.copytree(folder, tmp_path, dirs_exist_ok=True)
    whole = {path: path.read_bytes() for path in tmp_path.iterdir()}
    for number, path in enumerate(whole):
        path.write_bytes(whole[path][: [0, 100, -1, len(whole[path]) // 2][number % 4]])
    opened(tmp_path, USUAL)
    assert {path: path.read_bytes() for path in tmp_path.iterdir()} == whole


def test_without_a_folder_to_write_to_it_is_solved_each_time(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    files, made = KeptFiles(tmp_path / "file"), iter("ab")
    one = FileEntry("one", TEXT)
    assert [files.get(one, lambda: Text(next(made))).text for _ in range(2)] == ["a", "b"]


def test_the_files_that_were_not_used_for_longest_go_first(tmp_path: Path) -> None:
    files = KeptFiles(tmp_path, most_bytes=250)

    def use(name: str, at: float) -> None:
        files.get(FileEntry(name, TEXT), lambda: Text(name * 100))
        for path in tmp_path.iterdir():
            if path.read_text() == name * 100:
                os.utime(path, (at, at))

    for at, name in enumerate("abac"):
        use(name, at)
    assert sorted(path.read_text()[0] for path in tmp_path.iterdir()) == ["a", "c"]
