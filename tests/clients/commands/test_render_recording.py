"""`ridgewave render` of a recording: the samples that a live session sent, in any file format."""

from __future__ import annotations

import json
import math
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import soundfile

import ridgewave as rw
from synth.motion.motion import Update
from synth.scene.scene import parse_scene
from synth.voice.hand_voice import HandVoice
from tests.conftest import RunsRidgewave

RATE = 8000


@pytest.fixture(scope="module")
def session(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, np.ndarray]:
    """Return the file of a recording, and the samples that were heard while it was made."""
    scene = parse_scene({"output": {"sample_rate": RATE, "bandwidth": 800}})
    voice = HandVoice(scene, record=True)
    blocks = []
    for number in range(100):
        voice.touch(Update(number, 0.01 * number, 8e-4 * number, None, 0.25))
        blocks.append(voice.render(80))
    voice.release()
    blocks.append(voice.render(200))
    path = tmp_path_factory.mktemp("recording") / "stroke.json"
    path.write_text(json.dumps(voice.recording()))
    return path, np.concatenate(blocks)


def test_the_file_holds_the_samples_that_were_sent(
    session: tuple[Path, np.ndarray], tmp_path: Path, ridgewave: RunsRidgewave
) -> None:
    path, heard = session
    out = tmp_path / "out.wav"
    done = ridgewave("render", str(path), "-o", str(out), "--json")
    assert done.returncode == 0, done.stderr
    samples, rate = soundfile.read(out, dtype="float32", always_2d=True)
    assert rate == RATE
    assert np.array_equal(samples, heard)
    assert json.loads(done.stdout)["frames"] == len(heard)


def test_a_recording_on_an_imported_surface_is_rendered_by_the_command_and_in_python(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, environment: dict[str, str], ridgewave: RunsRidgewave
) -> None:
    own = {"XDG_DATA_HOME": str(tmp_path / ".data")}
    monkeypatch.setenv("XDG_DATA_HOME", own["XDG_DATA_HOME"])
    np.save(tmp_path / "track.npy", 1e-5 * np.sin(np.arange(300) * math.tau / 50))
    imported = ridgewave("import", str(tmp_path / "track.npy"), "--unit", "m", "--pixel", "20um", "--name", "track")
    assert imported.returncode == 0, imported.stderr
    surface = rw.parse_scene("track").texture.surface
    finger = {"kind": "probe"}
    document = {"finger": finger, "texture": {"kind": "profile", "surface": surface}, "output": {"sample_rate": RATE}}
    voice = HandVoice(parse_scene(document), record=True)
    voice.touch(Update(0, 0.0, None, 0.05, 0.25))
    heard = voice.render(400)
    path = tmp_path / "session.json"
    path.write_text(json.dumps(voice.recording()))
    done = ridgewave("render", str(path), "-o", str(tmp_path / "out.wav"), stdout=subprocess.PIPE)  # another process
    assert done.returncode == 0, done.stderr
    script = "import ridgewave as rw; rw.render('session.json').save('own.wav')"
    subprocess.run([sys.executable, "-c", script], cwd=tmp_path, env={**environment, **own}, check=True)
    for name in ("out.wav", "own.wav"):
        assert np.array_equal(soundfile.read(tmp_path / name, dtype="float32", always_2d=True)[0], heard)


def test_sixteen_bit_files_are_what_a_sixteen_bit_session_sends(
    session: tuple[Path, np.ndarray], tmp_path: Path, ridgewave: RunsRidgewave
) -> None:
    from synth.encode.formats import SoundFormat, encode_all

    path, heard = session
    out = tmp_path / "out.l16"
    assert ridgewave("render", str(path), "-o", str(out)).returncode == 0
    assert out.read_bytes() == encode_all(heard, SoundFormat.L16, RATE, None)


@pytest.mark.parametrize("words", [["--set", "texture.period=1mm"], ["--duration", "2"]])
def test_a_recording_accepts_no_changes(
    words: list[str], session: tuple[Path, np.ndarray], tmp_path: Path, ridgewave: RunsRidgewave
) -> None:
    out = tmp_path / "out.wav"
    done = ridgewave("render", str(session[0]), "-o", str(out), *words)
    assert done.returncode == 2
    assert words[0].encode() in done.stderr and b"recording" in done.stderr
    assert not out.exists()


def test_a_truncated_recording_is_refused_with_its_place(tmp_path: Path, ridgewave: RunsRidgewave) -> None:
    path = tmp_path / "broken.json"
    path.write_text(json.dumps({"format": "ridgewave-recording", "version": 1, "scene": {}, "events": []}))
    done = ridgewave("render", str(path), "-o", str(tmp_path / "out.wav"))
    assert done.returncode == 2
    assert b"frames: got nothing" in done.stderr and b"Traceback" not in done.stderr


def test_an_exact_render_is_close_and_for_a_scene_it_is_refused(
    session: tuple[Path, np.ndarray], tmp_path: Path, ridgewave: RunsRidgewave
) -> None:
    path, heard = session
    out = tmp_path / "out.wav"
    done = ridgewave("render", str(path), "-o", str(out), "--exact", "--json")
    assert done.returncode == 0, done.stderr
    samples = soundfile.read(out, dtype="float32", always_2d=True)[0]
    assert 0.0 < np.max(np.abs(samples - heard)) <= 1e-2 * np.ptp(heard)
    scene = tmp_path / "scene.json"
    scene.write_text("{}")
    done = ridgewave("render", str(scene), "-o", str(out), "--exact")
    assert done.returncode == 2 and b"--exact" in done.stderr and b"recording" in done.stderr
