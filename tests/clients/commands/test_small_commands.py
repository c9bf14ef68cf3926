"""`textures`, `devices`, `play` into a file, invalid requests to `serve`, and closed pipes."""

from __future__ import annotations

import json
import os
import subprocess
from pathlib import Path

import numpy as np
import pytest
import soundfile

from synth.scene.catalogue import catalogue, lookup
from synth.scene.scene import parse_scene
from tests.conftest import RunsRidgewave
from tests.few import thorough


def test_textures_lists_every_entry_with_its_source(ridgewave: RunsRidgewave) -> None:
    listed = json.loads(ridgewave("textures", "--json").stdout)["textures"]
    assert [entry["name"] for entry in listed] == [entry.name for entry in catalogue()]
    assert all(number["source"] for entry in listed for number in entry["numbers"].values())
    shown = ridgewave("textures").stdout.decode()
    assert all(entry.name in shown for entry in catalogue())
    places = [shown.index(group) for group in dict.fromkeys(entry.group.upper() for entry in catalogue())]
    assert places == sorted(places)


def test_tables_are_made_ahead_for_a_service_of_the_same_folder(ridgewave: RunsRidgewave, tmp_path: Path) -> None:
    done = ridgewave("textures", "corduroy-14-wale", "--prepare")
    folder = tmp_path / ".data" / "ridgewave" / "tables"
    assert (done.returncode, done.stdout) == (
        0,
        b"",
    ) and f"{folder} has what was solved for 1 textures".encode() in done.stderr
    assert sorted(path.suffix for path in folder.iterdir()) == [".json"] * 5 + [".safetensors"]
    assert ridgewave("textures", "no-such-texture", "--prepare").returncode == 2


def test_a_texture_by_name_is_a_scene_to_edit(ridgewave: RunsRidgewave) -> None:
    entry = catalogue()[0]
    done = ridgewave("textures", entry.name)
    assert parse_scene(json.loads(done.stdout)) == parse_scene(entry.name)
    told = done.stderr.decode()
    assert all(f"{field}: {source}" in told for field, source in entry.sources.items() if field.startswith("texture."))


def test_the_everyday_scan_of_a_texture_is_a_scene_to_edit(ridgewave: RunsRidgewave) -> None:
    entry = lookup("denim-72x56")
    done = ridgewave("textures", entry.name, "--everyday")
    assert json.loads(done.stdout) == entry.everyday
    assert f"scan.speed: {entry.sources['scan.speed']}" in done.stderr.decode()
    assert json.loads(ridgewave("textures", entry.name, "--json").stdout) == entry.description()


def test_an_everyday_scan_needs_a_name(ridgewave: RunsRidgewave) -> None:
    done = ridgewave("textures", "--everyday")
    assert (done.returncode, b"--everyday" in done.stderr) == (2, True)


def test_an_unknown_texture_is_an_invalid_request(ridgewave: RunsRidgewave) -> None:
    assert ridgewave("textures", "sandpaper").returncode == 2


def test_a_full_disk_is_reported(ridgewave: RunsRidgewave) -> None:
    with open("/dev/full", "wb") as full:
        done = ridgewave("textures", stdout=full)
    assert done.returncode == 1
    assert done.stderr == b"ridgewave: no space left on device\n"


def test_a_closed_pipe_causes_no_traceback(ridgewave: RunsRidgewave) -> None:
    ours, theirs = os.pipe()
    os.close(ours)
    done = ridgewave("textures", stdout=theirs)
    os.close(theirs)
    assert (done.returncode, done.stderr) == (1, b"")


def test_unknown_words_are_invalid_requests(ridgewave: RunsRidgewave) -> None:
    for words in (("rendre", "x"), ("render", "x"), ("render", "x", "-o", "a.wav", "--subtype", "float64")):
        done = ridgewave(*words)
        assert done.returncode == 2
        assert b"Traceback" not in done.stderr


def test_play_into_a_recording_ramps_in_and_out(ridgewave: RunsRidgewave, tmp_path: Path) -> None:
    done = ridgewave("play", "grating-1mm-31um", "--duration", "0.3", "--device", "file:take.wav", "--json")
    assert done.returncode == 0, done.stderr
    sound, rate = soundfile.read(tmp_path / "take.wav")
    assert json.loads(done.stdout)["seconds"] == pytest.approx(len(sound) / rate)
    assert len(sound) >= 0.3 * rate
    assert 0.1 < np.abs(sound).max() <= 1.0
    assert abs(sound[0]) < 0.01
    assert sound[-1] == 0.0


def test_a_recording_never_replaces_one(ridgewave: RunsRidgewave, tmp_path: Path) -> None:
    (tmp_path / "take.wav").write_bytes(b"precious")
    done = ridgewave("play", "grating-1mm-31um", "--duration", "0.1", "--device", "file:take.wav")
    assert done.returncode == 1
    assert (tmp_path / "take.wav").read_bytes() == b"precious"


def test_a_recording_cannot_leave_its_folder(ridgewave: RunsRidgewave) -> None:
    assert ridgewave("play", "grating-1mm-31um", "--device", "file:../take.wav").returncode == 2


@pytest.mark.parametrize("words", [("--port", "70000"), ("--workers", "0"), ("--host", "not a host")])
def test_serve_refuses_settings_that_are_wrong(ridgewave: RunsRidgewave, words: tuple[str, ...]) -> None:
    done = ridgewave("serve", *words)
    assert done.returncode == 2
    assert done.stderr.startswith(f"ridgewave: {words[0]}: got ".encode())
    assert b"RIDGEWAVE_" not in done.stderr
    assert b"Traceback" not in done.stderr


def test_serve_beyond_loopback_without_a_key_does_not_start(ridgewave: RunsRidgewave) -> None:
    try:
        done = ridgewave("serve", "--host", "0.0.0.0", "--port", "0", timeout=300)
    except subprocess.TimeoutExpired:
        pytest.fail("it started")
    assert done.returncode in (1, 2)
    assert b"RIDGEWAVE_API_KEYS" in done.stderr
    assert b"Traceback" not in done.stderr


@pytest.mark.parametrize(("closed", "code"), [thorough((2,), 0), ((0, 2), 0), ((1,), 1), thorough((1, 2), 1)])
def test_closed_standard_streams_are_no_bug(
    ridgewave: RunsRidgewave, tmp_path: Path, closed: tuple[int, ...], code: int
) -> None:
    def close() -> None:
        for descriptor in closed:
            os.close(descriptor)

    done = ridgewave("render", "grating-1mm-31um", "-o", "out.wav", preexec_fn=close)
    told = b"" if 2 in closed else b"ridgewave: standard input or output is closed.\n"
    assert (done.returncode, done.stderr.endswith(told)) == (code, True), done.stderr
    assert b"Traceback" not in done.stderr and b"Exception" not in done.stderr
    assert soundfile.info(tmp_path / "out.wav").frames == 96_000


@pytest.mark.parametrize(
    ("encoding", "name", "escaped"),
    [
        ("utf-8", "\udcff.wav", rb"\udcff.wav"),
        ("latin-1", "\u03bb.f32", rb"\u03bb.f32"),
        thorough("utf-8", "\u03bb.f32", "\u03bb.f32".encode()),
        thorough("latin-1", "\udcff.wav", rb"\udcff.wav"),
    ],
    ids=ascii,
)
def test_names_that_the_encoding_of_the_output_lacks_are_printed_as_escapes(
    ridgewave: RunsRidgewave, tmp_path: Path, environment: dict[str, str], encoding: str, name: str, escaped: bytes
) -> None:
    own = {"XDG_DATA_HOME": str(tmp_path / ".data"), "PYTHONIOENCODING": f"{encoding}:strict"}
    output = {"env": {**environment, **own}}
    done = ridgewave("render", "grating-1mm-31um", "-o", name, **output)
    assert (done.returncode, done.stdout.startswith(escaped)) == (0, True), done.stderr
    assert (tmp_path / name).exists()
    listed = json.loads(ridgewave("render", "grating-1mm-31um", "-o", name, "--json", **output).stdout.decode(encoding))
    assert listed["file"].endswith(name)
