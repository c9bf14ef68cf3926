"""Playing on the server's machine into recordings in the one folder; `test_play_on_devices` plays on devices."""

from __future__ import annotations

import errno
import os
import time
from collections.abc import Callable
from pathlib import Path

import httpx
import numpy as np
import numpy.typing as npt
import pytest
import soundfile

from service.sinks import FileSink
from synth.errors import CannotRender
from synth.scene.scene import parse_scene
from tests.file_metadata import read_metadata
from tests.service.harness import Running, problem, serving, until
from tests.service.plain_engine import FULL_SCALE, PlainEngine, PlainLive

RATE = 48000
FADE = round(0.01 * RATE)


def live(frames: int) -> npt.NDArray[np.float32]:
    """Return the default scene's live voice, faded out at the end."""
    samples = PlainLive(parse_scene({})).render(frames)[:, 0]
    samples[-FADE:] *= 0.5 + 0.5 * np.cos(np.pi * np.arange(1, FADE + 1) / FADE)
    return samples


def folder_of(running: Running) -> Path:
    return Path(running.service.settings.file_folder)


def start(running: Running, device: object, scene: dict[str, object] | None = None) -> tuple[str, httpx.Response]:
    path = f"/v1/sessions/{running.open_session(scene)}/play"
    return path, running.client.post(path, json={"device": device})


@pytest.mark.parametrize("name", ["take.wav", "take.flac"])
def test_a_recording_holds_the_sound_in_real_time_and_fades_out(running: Running, name: str) -> None:
    began = time.perf_counter()
    path, answer = start(running, f"file:{name}")
    assert answer.status_code == 202 and answer.json()["state"] == "playing"
    session = path.removesuffix("/play")
    until(lambda: running.client.get(session).json()["play"]["frames"] >= RATE // 2)
    assert not (folder_of(running) / name).exists(), "an unfinished recording has its name already"
    report = running.client.delete(path).json()
    took = time.perf_counter() - began
    assert report["state"] == "finished" and report["failure"] is None
    samples, rate = soundfile.read(folder_of(running) / name, dtype="float32")
    assert (rate, len(samples)) == (RATE, report["frames"])
    assert RATE // 2 <= len(samples) <= (took + 0.05) * RATE
    np.testing.assert_allclose(samples, live(len(samples)), rtol=0, atol=1e-6)
    metadata = read_metadata(folder_of(running) / name)
    assert metadata is not None and metadata.full_scale == (FULL_SCALE,)
    problem(running.client.delete(path), 404, "not-found")


def test_a_change_is_recorded_too(running: Running) -> None:
    path, _ = start(running, "file:change.wav")
    session = path.removesuffix("/play")
    assert running.client.patch(session, json={"scan": {"speed": "160 mm/s"}}).status_code == 200
    until(lambda: running.client.get(session).json()["play"]["frames"] >= RATE // 2)
    running.client.delete(path)
    samples, _ = soundfile.read(folder_of(running) / "change.wav", dtype="float32")
    body = samples[RATE // 4 : RATE // 2]
    assert np.argmax(np.abs(np.fft.rfft(body))) * RATE / len(body) == pytest.approx(200.0, abs=4.0)


def test_a_session_plays_once_at_a_time_and_streams_meanwhile(running: Running) -> None:
    path, answer = start(running, "file:one.wav")
    assert answer.status_code == 202
    problem(running.client.post(path, json={"device": "file:two.wav"}), 409, "busy")
    with running.listening(path.split("/")[3]) as listener:
        assert listener.frames(4800).any()
    assert running.client.delete(path).json()["state"] == "finished"
    assert running.client.post(path, json={"device": "file:two.wav"}).status_code == 202
    assert running.client.delete(path).status_code == 200
    assert sorted(entry.name for entry in folder_of(running).iterdir()) == ["one.wav", "two.wav"]


@pytest.mark.parametrize(
    "name",
    ["", "../x.wav", "/x.wav", "a/b.wav", ".hidden.wav", "x.mp3", "x.wav.part", "x", "x.wav\n", "..wav", "x\0.wav"],
)
def test_a_name_that_could_leave_the_folder_is_refused(running: Running, name: str) -> None:
    _, answer = start(running, f"file:{name}")
    document = problem(answer, 422, "request-refused")
    assert document["errors"][0]["pointer"] == "/device"
    assert not list(folder_of(running).iterdir())


def test_a_recording_is_never_overwritten_nor_a_link_followed(running: Running, tmp_path: Path) -> None:
    (folder_of(running) / "there.wav").write_bytes(b"precious")
    (folder_of(running) / "link.wav").symlink_to(tmp_path / "outside.wav")
    for name in ("there.wav", "link.wav"):
        document = problem(start(running, f"file:{name}")[1], 409, "name-taken")
        assert str(folder_of(running)) not in document["detail"]
    assert (folder_of(running) / "there.wav").read_bytes() == b"precious"
    assert not (tmp_path / "outside.wav").exists()


@pytest.mark.parametrize("body", [b"[]", b"", b"{", b'{"device": true}', b'{"device": {}}', b'{"file": "x.wav"}'])
def test_a_body_that_names_no_device_is_refused(running: Running, body: bytes) -> None:
    path = f"/v1/sessions/{running.open_session()}/play"
    answer = running.client.post(path, content=body, headers={"Content-Type": "application/json"})
    problem(answer, 422, "request-refused")


def test_a_folder_that_cannot_be_made_is_told(tmp_path: Path) -> None:
    (tmp_path / "file").write_bytes(b"")
    with serving(PlainEngine(), file_folder=tmp_path / "file" / "folder") as running:
        path, answer = start(running, "file:x.wav")
        problem(answer, 503, "cannot-render")
        assert running.client.get(path.removesuffix("/play")).json()["play"] is None


FAULTS = (
    "ENOSPC",
    "EDQUOT",
    "EROFS",
    "EACCES",
    "EPERM",
    "ENOENT",
    "ENOTDIR",
    "EISDIR",
    "EIO",
    "ENAMETOOLONG",
    "EMFILE",
)


def failing(fault: str, path: object) -> Callable[..., None]:
    """Return what fails as the operating system does, which names the path in its error."""

    def fail(*_: object, **__: object) -> None:
        number = getattr(errno, fault)
        raise OSError(number, os.strerror(number), str(path))

    return fail


@pytest.mark.parametrize("fault", FAULTS)
def test_a_recording_that_cannot_be_begun_tells_the_reason_and_no_path(
    running: Running, monkeypatch: pytest.MonkeyPatch, fault: str
) -> None:
    folder = folder_of(running)
    monkeypatch.setattr("synth.encode.part_file.PartFile._opened", failing(fault, folder / "x.wav.part"))
    answer = start(running, "file:x.wav")[1]
    detail = problem(answer, 503, "cannot-render")["detail"]
    assert detail.startswith("cannot write file:x.wav: ") and str(folder) not in answer.text
    assert folder.name not in detail and len(detail) > len("cannot write file:x.wav: .")


@pytest.mark.parametrize("name", ["x.wav", "x.flac"])
@pytest.mark.parametrize("where", ["while it is written", "when it is completed"])
def test_a_recording_that_fails_later_tells_the_reason_and_no_path(
    running: Running, monkeypatch: pytest.MonkeyPatch, where: str, name: str
) -> None:
    folder = folder_of(running)
    path, answer = start(running, f"file:{name}")
    assert answer.status_code == 202
    if where == "when it is completed":
        monkeypatch.setattr("synth.encode.part_file.os.replace", failing("ENOSPC", folder / name))
    else:
        player = running.service.sessions.find(path.split("/")[3], None).player
        assert player is not None and isinstance(player._sink, FileSink) and player._sink._writer is not None
        monkeypatch.setattr(player._sink._writer._encoder, "write", failing("ENOSPC", folder / name))
        until(lambda: not player.playing)
    answer = running.client.delete(path)
    assert answer.json()["failure"] == f"cannot write file:{name}: the disk is full."
    assert str(folder) not in answer.text and not list(folder.iterdir())


def test_a_recording_in_flac_at_a_rate_that_it_cannot_hold_is_refused(running: Running) -> None:
    answer = start(running, "file:x.flac", {"output": {"sample_rate": 65_537}})[1]
    (fault,) = problem(answer, 422, "request-refused")["errors"]
    assert fault["pointer"] == "/output/sample_rate" and not list(folder_of(running).iterdir())


def test_a_name_that_is_being_recorded_is_taken(running: Running) -> None:
    path, _ = start(running, "file:x.wav")
    document = problem(start(running, "file:x.wav")[1], 409, "name-taken")
    assert str(folder_of(running)) not in document["detail"]
    running.client.delete(path)


def test_a_failing_sink_is_told_by_the_session(running: Running, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object, **__: object) -> None:
        raise CannotRender("the disk is full.")

    monkeypatch.setattr("service.sinks.file_sink.FileSink.write", fail)
    path, answer = start(running, "file:full.wav")
    assert answer.status_code == 202
    session = path.removesuffix("/play")
    until(lambda: running.client.get(session).json()["play"]["state"] == "failed")
    assert running.client.get(session).json()["play"]["failure"] == "the disk is full."


def test_a_play_ends_by_itself_at_the_longest_duration(tmp_path: Path) -> None:
    with serving(PlainEngine(), file_folder=tmp_path, max_duration=0.25) as running:
        path, _ = start(running, "file:long.wav")
        until(lambda: running.client.get(path.removesuffix("/play")).json()["play"]["state"] == "finished")
        assert soundfile.info(tmp_path / "long.wav").frames == round(0.25 * RATE)


def test_devices_are_listed_and_their_absence_explained(running: Running, monkeypatch: pytest.MonkeyPatch) -> None:
    assert isinstance(running.client.get("/v1/devices").json()["devices"], list)

    def missing() -> None:
        raise CannotRender("audio devices need PortAudio.")

    monkeypatch.setattr("service.http.routes.play.list_devices", missing)
    answer = running.client.get("/v1/devices")
    assert answer.status_code == 200
    assert answer.json()["devices"] == [] and "PortAudio" in answer.json()["note"]


def test_ending_the_server_completes_a_recording(tmp_path: Path) -> None:
    with serving(PlainEngine(), file_folder=tmp_path) as running:
        path, _ = start(running, "file:cut.wav")
        until(lambda: running.client.get(path.removesuffix("/play")).json()["play"]["frames"] > RATE // 10)
    samples, _ = soundfile.read(tmp_path / "cut.wav", dtype="float32")
    np.testing.assert_allclose(samples, live(len(samples)), rtol=0, atol=1e-6)
