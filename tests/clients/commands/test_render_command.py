"""`ridgewave render` and `explain`: the file, the result, the messages, and no unfinished files."""

from __future__ import annotations

import json
import os
import resource
import signal
import subprocess
import sys
import time
from functools import partial
from pathlib import Path

import numpy as np
import pytest
import soundfile

from synth import render
from synth.scene.scene import parse_scene, scene_document
from tests.conftest import RunsRidgewave
from tests.file_metadata import read_metadata

SCENE = {
    "texture": {"period": "0.9 mm"},
    "output": {"duration": 0.25, "channels": ["displacement", "velocity"], "sample_rate": 8000},
}


@pytest.fixture
def scene_path(tmp_path: Path) -> str:
    path = tmp_path / "scene.json"
    path.write_text(json.dumps(SCENE))
    return str(path)


def test_the_file_holds_the_samples_of_python(scene_path: str, tmp_path: Path, ridgewave: RunsRidgewave) -> None:
    done = ridgewave("render", scene_path, "-o", "out.wav")
    assert (done.returncode, done.stderr) == (0, b"")
    scene = parse_scene(SCENE)
    sound, rate = soundfile.read(tmp_path / "out.wav", dtype="float32")
    assert rate == 8000
    assert np.array_equal(sound, render(scene).frames)
    metadata = read_metadata(tmp_path / "out.wav")
    assert metadata is not None
    assert metadata.quantities == ("displacement", "velocity")
    assert metadata.scene == json.loads(json.dumps(scene_document(scene)))


def test_flac_at_a_rate_that_it_cannot_hold_is_refused(tmp_path: Path, ridgewave: RunsRidgewave) -> None:
    done = ridgewave("render", "grating-1mm-31um", "-o", "out.flac", "--set", "output.sample_rate=65537")
    assert done.returncode == 2 and not list(tmp_path.glob("out*"))
    assert b"output.sample_rate: got 65537 Hz" in done.stderr and b"Write WAV" in done.stderr


def test_the_result_is_available_as_json(scene_path: str, tmp_path: Path, ridgewave: RunsRidgewave) -> None:
    done = ridgewave("render", scene_path, "-o", "out.flac", "--json", "--set", "output.full_scale=null")
    assert done.returncode == 0, done.stderr
    result = json.loads(done.stdout)
    sound, _ = soundfile.read(tmp_path / "out.flac", dtype="float32")
    assert (result["file"], result["format"], result["frames"]) == ("out.flac", "flac", 2000)
    assert [channel["unit"] for channel in result["channels"]] == ["m", "m/s"]
    peaks = [channel["peak"] for channel in result["channels"]]
    assert peaks == pytest.approx(np.abs(sound).max(axis=0), abs=2**-23)
    assert result["times_real_time"] > 0


def test_two_renders_are_the_same_bytes(scene_path: str, tmp_path: Path, ridgewave: RunsRidgewave) -> None:
    for name in ("one.wav", "two.wav"):
        assert ridgewave("render", scene_path, "-o", name).returncode == 0
    assert (tmp_path / "one.wav").read_bytes() == (tmp_path / "two.wav").read_bytes()


def test_standard_output_carries_the_same_file(scene_path: str, tmp_path: Path, ridgewave: RunsRidgewave) -> None:
    piped = ridgewave("render", scene_path, "-o", "-")
    assert b"full scale" in piped.stderr
    (tmp_path / "piped.wav").write_bytes(piped.stdout)
    ridgewave("render", scene_path, "-o", "out.wav")
    ours, _ = soundfile.read(tmp_path / "piped.wav")
    theirs, _ = soundfile.read(tmp_path / "out.wav")
    assert np.array_equal(ours, theirs)


def test_beside_a_sound_on_standard_output_the_result_is_json_with_its_warnings(ridgewave: RunsRidgewave) -> None:
    done = ridgewave("render", "grating-1mm-31um", "-o", "-", "--json", "--duration", "0.1")
    assert done.stdout.startswith(b"RIFF")
    result = json.loads(done.stderr)
    assert result["file"] == "standard output"
    assert "u / lambda2 is missing" in result["warnings"][0]


def test_a_scene_from_standard_input(tmp_path: Path, ridgewave: RunsRidgewave) -> None:
    done = ridgewave("render", "-", "-o", "out.raw", input=json.dumps(SCENE).encode())
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "out.raw").stat().st_size == 2000 * 2 * 4


def test_progress_on_request(scene_path: str, ridgewave: RunsRidgewave) -> None:
    done = ridgewave("render", scene_path, "-o", "out.wav", "--progress")
    assert b"rendering: 100 %" in done.stderr


def test_an_invalid_request_is_one_message_and_no_file(
    scene_path: str, tmp_path: Path, ridgewave: RunsRidgewave
) -> None:
    done = ridgewave("render", scene_path, "-o", "out.wav", "--set", "scan.load=-1", "--set", "texture.period=2 kg")
    assert (done.returncode, done.stdout) == (2, b"")
    assert b"scan.load" in done.stderr
    assert b"texture.period" in done.stderr
    assert b"Traceback" not in done.stderr
    assert os.listdir(tmp_path) == ["scene.json"]


@pytest.mark.parametrize(
    ("output", "told"), [("none/out.wav", b"does not exist"), ("scene.json/out.wav", b"cannot write")]
)
def test_an_unwritable_output_is_reported(scene_path: str, output: str, told: bytes, ridgewave: RunsRidgewave) -> None:
    done = ridgewave("render", scene_path, "-o", output)
    assert done.returncode == 1
    assert told in done.stderr
    assert b"Traceback" not in done.stderr


def test_a_full_disk_leaves_nothing(scene_path: str, tmp_path: Path, ridgewave: RunsRidgewave) -> None:
    def small_files_only() -> None:  # enough for what the compiler caches, too little for 12.8 MB of sound
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (8 * 2**20, 8 * 2**20))

    (tmp_path / "out.wav").write_bytes(b"an older render")
    done = ridgewave("render", scene_path, "-o", "out.wav", "--duration", "200", preexec_fn=small_files_only)
    assert done.returncode == 1, done.stderr
    assert b"cannot write" in done.stderr
    assert b"Traceback" not in done.stderr
    assert (tmp_path / "out.wav").read_bytes() == b"an older render"
    assert sorted(os.listdir(tmp_path)) == ["out.wav", "scene.json"]


def peak_memory(words: list[str], folder: Path, environment: dict[str, str]) -> int:
    """Return the largest resident size, in bytes, of `ridgewave WORDS` as a process of its own.

    A small process starts it: a child counts the size of what it was forked from as its own.
    """
    watch = (
        "import resource, subprocess, sys; subprocess.run(sys.argv[1:], check=True, stdout=subprocess.DEVNULL); "
        "print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)"
    )
    command = [sys.executable, "-c", watch, sys.executable, "-m", "clients", *words]
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, check=True)
    return int(done.stdout) * 1024


def test_two_minutes_take_no_more_memory_than_a_second(
    scene_path: str, tmp_path: Path, environment: dict[str, str]
) -> None:
    words = ["render", scene_path, "-o", "out.wav", "--json", "--set", "output.sample_rate=48 kHz", "--duration"]
    short = peak_memory([*words, "1"], tmp_path, environment)
    long = peak_memory([*words, "120"], tmp_path, environment)
    assert (tmp_path / "out.wav").stat().st_size > 46e6
    assert long - short < 20e6
    assert long < 300e6


@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_an_interrupted_render_leaves_nothing(
    tmp_path: Path, environment: dict[str, str], number: signal.Signals, code: int
) -> None:
    command = [sys.executable, "-m", "clients", "render", "grating-1mm-31um", "--duration", "20 h", "-o", "out.wav"]
    heeded = partial(signal.signal, signal.SIGINT, signal.SIG_DFL)  # it is ignored below a job in the background
    process = subprocess.Popen(command, cwd=tmp_path, env=environment, stderr=subprocess.PIPE, preexec_fn=heeded)
    deadline = time.monotonic() + 100
    while not any(path.stat().st_size > 100_000 for path in tmp_path.glob("*.part")):
        assert process.poll() is None, process.stderr
        assert time.monotonic() < deadline, "the render did not begin"
        time.sleep(0.01)
    process.send_signal(number)
    _, message = process.communicate(timeout=300)
    assert process.returncode == code
    assert b"no unfinished file" in message
    assert b"Traceback" not in message
    assert os.listdir(tmp_path) == []


def test_explain_as_json_has_the_parts_of_a_plan(scene_path: str, ridgewave: RunsRidgewave) -> None:
    done = ridgewave("explain", scene_path, "--json")
    assert done.returncode == 0, done.stderr
    plan = json.loads(done.stdout)
    wanted = {"scene", "simulated", "left_out", "response", "estimated_error", "cost", "warnings"}
    assert wanted <= set(plan)
    assert set(plan["estimated_error"]) == {"displacement", "velocity"}
    assert {"setup_seconds", "ns_per_frame", "times_real_time", "memory_bytes"} <= set(plan["cost"])


def test_explain_prints_every_part_for_people(scene_path: str, ridgewave: RunsRidgewave) -> None:
    done = ridgewave("explain", scene_path)
    shown = done.stdout.decode()
    plan = json.loads(ridgewave("explain", scene_path, "--json").stdout)
    assert all(part in shown for part in ("Simulated", "Left out", "Contact response", "Estimated error", "Cost"))
    assert all(item["name"] in shown for item in plan["simulated"])
