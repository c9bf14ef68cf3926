"""The waveforms of a study: each file is the render of its scene, and the manifest says what is in it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import ridgewave as rw
from synth.encode.sound import render
from synth.study import chunks, waveforms
from synth.study.chunks import chunks_of
from synth.study.running import run
from synth.study.spec import StudySpec, read_spec
from synth.study.waveforms import MANIFEST, is_rendered, render_chunk, write_manifest

SPEC: dict[str, Any] = {
    "scene": {"output": {"duration": "0.1 s", "channels": [{"quantity": "velocity"}, {"quantity": "acceleration"}]}},
    "axes": {
        "texture": [{"kind": "grating", "period": "1 mm", "height": "30 um"}, {"kind": "rough", "seed": 4}],
        "scan.speed": ["40 mm/s", "80 mm/s"],
    },
}


@pytest.fixture(autouse=True)
def _small(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(chunks, "CHUNK", 2)


def made(folder: Path, spec: StudySpec) -> list[dict[str, Any]]:
    """Render a study, and return the lines of its manifest."""
    run(spec, folder, workers=1, work=render_chunk, is_done=is_rendered)
    write_manifest(list(chunks_of(spec)), folder, "CC0-1.0")
    return [json.loads(line) for line in (folder / MANIFEST).read_text().splitlines()]


def bytes_of(folder: Path) -> dict[str, bytes]:
    return {str(one.relative_to(folder)): one.read_bytes() for one in sorted(folder.rglob("*")) if one.is_file()}


def test_each_file_is_the_render_of_its_scene(tmp_path: Path) -> None:
    rows = made(tmp_path, read_spec(SPEC))
    assert [row["number"] for row in rows] == list(range(4))
    for row in rows:
        sound, own = rw.load(tmp_path / row["file"]), rw.render(row["scene"])
        np.testing.assert_allclose(sound.values, own.values, atol=2e-7 * np.max(own.full_scale))
        assert row["quantities"] == ["velocity", "acceleration"] and row["units"] == ["m/s", "m/s^2"]
        assert (row["sample_rate"], row["frames"], row["licence"]) == (48000, 4800, "CC0-1.0")
        np.testing.assert_allclose(row["peak"], np.max(np.abs(own.values), axis=0), rtol=1e-6)
        np.testing.assert_allclose(row["rms"], np.sqrt(np.mean(own.values**2, axis=0)), rtol=1e-6)
        assert row["scene"]["scan"]["speed"] == row["axes"]["scan.speed"]
    assert [row["seeds"]["texture"] for row in rows] == [None, None, 4, 4]


def test_equal_textures_are_in_one_split_and_all_splits_are_used(tmp_path: Path) -> None:
    splits = {}
    for number in range(60):
        document = {"texture": {"period": 1e-3 + 1e-5 * number}}
        there, faster = (waveforms.split_of(rw.parse_scene(document, scan={"speed": u})) for u in (0.04, 0.08))
        shifted = waveforms.split_of(rw.parse_scene(document, texture={"phase": 0.1 * number}))
        assert there == faster == shifted
        splits[number] = there
    counts = [list(splits.values()).count(name) for name in ("train", "validation", "test")]
    assert counts[0] > 35 and min(counts) >= 2


def test_an_interrupted_dataset_goes_on_and_has_the_same_bytes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    spec, rendered = read_spec(SPEC), list[int]()
    made(tmp_path / "whole", spec)

    def stopping(scene: Any) -> Any:
        rendered.append(1)
        if len(rendered) == 4:
            raise KeyboardInterrupt
        return render(scene)

    monkeypatch.setattr(waveforms, "render", stopping)
    with pytest.raises(KeyboardInterrupt):
        made(tmp_path / "parts", spec)
    assert not (tmp_path / "parts" / MANIFEST).exists()
    made(tmp_path / "parts", spec)
    assert len(rendered) == 6, "the first chunk is not rendered again"
    assert bytes_of(tmp_path / "whole") == bytes_of(tmp_path / "parts")


def test_a_scene_that_cannot_be_rendered_is_told(tmp_path: Path) -> None:
    axes = {"groups.ridges": [20.0, 300.0], "finger.ridge_period": [2e-4, 5e-4]}
    rows = made(tmp_path, read_spec(SPEC | {"axes": axes}))
    failed = [row for row in rows if row["file"] is None]
    assert [row["number"] for row in failed] == [3] and "length" in failed[0]["reason"]
    assert len(list(tmp_path.rglob("*.flac"))) == 3
