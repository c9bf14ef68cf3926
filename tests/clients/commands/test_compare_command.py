"""`ridgewave compare`: its table, its JSON and its figure."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import soundfile

import ridgewave as rw
from tests.conftest import RunsRidgewave

SCENE = "grating-1mm-31um"


def test_recordings_are_set_beside_the_model(ridgewave: RunsRidgewave, tmp_path: Path) -> None:
    sound = rw.render(SCENE, output={"duration": "1 s", "sample_rate": 8000})
    paths = [str(sound.save(tmp_path / name)) for name in ("one.wav", "two.flac")]
    done = ridgewave("compare", SCENE, *paths, "--json", "-o", str(tmp_path / "scans.svg"))
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    assert [one["name"] for one in told] == ["one.wav", "two.flac"]
    assert all(abs(one["speed"] - 0.08) < 4e-4 for one in told)
    assert b"<svg" in (tmp_path / "scans.svg").read_bytes()
    table = ridgewave("compare", SCENE, paths[0])
    assert b"mm/s fits" in table.stdout and b" dB" in table.stdout


def test_what_is_missing_is_told(ridgewave: RunsRidgewave, tmp_path: Path) -> None:
    soundfile.write(tmp_path / "plain.wav", np.random.default_rng(1).standard_normal(8000), 8000, subtype="FLOAT")
    done = ridgewave("compare", SCENE, str(tmp_path / "plain.wav"))
    assert done.returncode == 2 and b"--quantity" in done.stderr
    noise = ridgewave("compare", SCENE, str(tmp_path / "plain.wav"), "--quantity", "velocity")
    assert noise.returncode == 0 and b"No line stands out" in noise.stderr
    gone = ridgewave("compare", SCENE, str(tmp_path / "none.wav"), "--quantity", "velocity")
    assert gone.returncode in (1, 2) and b"Traceback" not in gone.stderr


def test_the_channel_that_was_read_is_told_where_none_is_named(ridgewave: RunsRidgewave, tmp_path: Path) -> None:
    sound = rw.render(SCENE, effects={"tangential": {}}, output={"duration": "1 s", "sample_rate": 8000})
    own, plain = sound.save(tmp_path / "own.wav"), tmp_path / "plain.wav"
    soundfile.write(plain, sound.values[:, [0, 0, 1]], 8000, subtype="FLOAT")
    warned, others = b"channel 0 was read", b"--channel on the command line, from 0 to "
    for command, words in (
        (["compare", SCENE, str(own)], b"1 (0 is acceleration, 1 is tangential_force)"),
        (["analyze", str(plain), "--quantity", "acceleration", "--scale", "1"], b"2."),
    ):
        done = ridgewave(*command)
        assert done.returncode == 0 and warned in done.stderr and others + words in done.stderr
        assert warned not in ridgewave(*command, "--channel", "0").stderr
    both = ridgewave("analyze", str(own), "--beside", str(own))
    assert both.stderr.count(warned) == 2
    (found,) = rw.compare(SCENE, sound)
    assert any(warned.decode() in text for text in found.warnings)
    assert any(warned.decode() in text for text in rw.analyze(sound)["warnings"])
