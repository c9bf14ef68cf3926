"""Sessions on real PortAudio devices that keep time: sample for sample, stopped, stalled for a while, and gone."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import numpy.typing as npt
import pytest

from tests.service.alsa_recorder import DEVICE, AlsaRecorder, Listening, require_portaudio
from tests.service.harness import Child, Listener, problem, until
from tests.service.test_play import FADE, RATE, live

pytestmark = pytest.mark.device

OTHER = "ridgewave_other"
Devices = tuple[httpx.Client, Child, Listening, Listening]
STEP = 0.0105  # the largest between two samples of the plain sine; a knock is larger


@dataclass
class OnDevice:
    """A service in a process of its own that plays on a recording device, beside another such device."""

    client: httpx.Client
    session: str
    child: Child
    listening: Listening
    other: Listening

    def play(self) -> dict[str, Any]:
        """What the session shows of its play."""
        document: dict[str, Any] = self.client.get(self.session).json()["play"]
        return document

    def heard_on_the_other(self, since: int) -> bool:
        """Whether the other device sounded after so many frames."""
        recording = bytes(self.other.recording[4 * since :])
        return bool(np.frombuffer(recording[: len(recording) // 4 * 4], "<f4").any())

    def begin(self, device: str) -> httpx.Response:
        """Ask for a play on `device`."""
        return self.client.post(f"{self.session}/play", json={"device": device})


@contextmanager
def devices(folder: Path) -> Iterator[Devices]:
    """Yield a client of a service, the service, and its two devices."""
    require_portaudio()
    recorders = [AlsaRecorder(folder, fifo=True, name=name) for name in (DEVICE, OTHER)]
    child = Child("tests.service.serve_plain", folder, ALSA_CONFIG_PATH=str(folder / "asound.conf"))
    listening, other = (Listening(recorder) for recorder in recorders)
    try:
        with httpx.Client(base_url=child.url(), timeout=60.0) as client:
            assert {DEVICE, OTHER} <= {device["name"] for device in client.get("/v1/devices").json()["devices"]}
            yield client, child, listening, other
    finally:
        for one in (listening, other):
            one.end()
        child.end()
        for recorder in recorders:
            recorder.close()


def begun(client: httpx.Client, child: Child, listening: Listening, other: Listening, frames: int) -> OnDevice:
    """Return a new session that has played `frames` on the first device."""
    session = "/v1/sessions/" + client.post("/v1/sessions", json={}).json()["id"]
    playing = OnDevice(client, session, child, listening, other)
    answer = playing.begin(DEVICE)
    assert answer.status_code == 202, answer.text
    until(lambda: playing.play()["frames"] >= frames)
    return playing


@contextmanager
def on_device(folder: Path) -> Iterator[OnDevice]:
    """Yield a session that has played for a second, on devices of its own."""
    with devices(folder) as made:
        yield begun(*made, RATE)


@pytest.fixture(scope="module")
def kept_devices(
    tmp_path_factory: pytest.TempPathFactory,
) -> Iterator[Devices]:
    with devices(tmp_path_factory.mktemp("devices")) as made:
        yield made


@pytest.fixture
def playing(kept_devices: Devices) -> Iterator[OnDevice]:
    """Yield a session that plays, on devices that tests share."""
    made = begun(*kept_devices, RATE // 4)
    yield made
    made.client.post("/v1/stop")


def sounding_live(frames: int) -> npt.NDArray[np.float32]:
    """Return the live sound of `frames`, faded out, without the zeros at its ends."""
    whole = live(frames)
    loud = np.flatnonzero(whole)
    return whole[loud[0] : loud[-1] + 1]


@pytest.mark.alone  # no underrun: the service must have the processor when a block is due
def test_a_session_plays_on_a_device_sample_for_sample(tmp_path: Path) -> None:
    with on_device(tmp_path) as playing:
        until(lambda: playing.play()["frames"] >= 3 * RATE)
        report = playing.client.delete(f"{playing.session}/play").json()
        heard = playing.listening.end()
    assert (report["state"], report["underruns"], report["dropped_frames"]) == ("finished", 0, 0), report
    np.testing.assert_array_equal(heard, sounding_live(report["frames"]))


@pytest.mark.alone  # no underrun, as above
def test_a_stop_silences_a_device_without_playing_what_it_holds(tmp_path: Path) -> None:
    with on_device(tmp_path) as playing:
        at = playing.listening.frames
        assert playing.client.post("/v1/stop").json()["stopped"]["plays"] == 1
        playing.child.process.terminate()
        playing.child.process.wait(60.0)
        heard = playing.listening.end()
    ramp = round(0.005 * RATE)  # the sink's own, in the device's callback
    wanted = sounding_live(len(heard) + 2 * FADE)
    np.testing.assert_array_equal(heard[:-ramp], wanted[: len(heard) - ramp])
    assert np.abs(np.diff(heard)).max() < 0.03, "a step"
    assert len(heard) - at < 0.1 * RATE, "more than the device's and the pipe's own buffers was heard"


@pytest.mark.alone  # it compares what was heard with what was rendered by then
def test_what_a_short_stall_made_stale_is_not_played(tmp_path: Path) -> None:
    """The device's own buffer is heard, then silence between soft edges, then the sound as it is rendered now."""
    with on_device(tmp_path) as playing:
        at = playing.listening.frames
        with playing.listening.stalling():
            time.sleep(1.0)
        until(lambda: playing.play()["frames"] >= 2 * RATE)
        report = playing.client.delete(f"{playing.session}/play").json()
        heard = playing.listening.end()
    assert (report["state"], report["failure"]) == ("finished", None), report
    assert report["dropped_frames"] >= 4 * 480 and report["underruns"] >= 1, report
    wanted = sounding_live(report["frames"])
    both = min(len(heard), len(wanted))  # a device that waited for its sound has heard more than was rendered
    gap = int(np.flatnonzero(heard[:both] != wanted[:both])[0])
    assert gap < at + 0.1 * RATE, "more than the device's and the pipe's own buffers was heard after the stall"
    np.testing.assert_array_equal(heard[-RATE // 2 :], wanted[-RATE // 2 :])
    assert np.abs(np.diff(heard)).max() < STEP, "a knock"


def test_a_device_plays_one_session_at_a_time(playing: OnDevice) -> None:
    """By whichever of its names it is asked for; as soon as its play or its session has ended it is free."""
    devices = playing.client.get("/v1/devices").json()["devices"]
    index = next(device["index"] for device in devices if device["name"] == DEVICE)
    second = "/v1/sessions/" + playing.client.post("/v1/sessions", json={}).json()["id"]
    for name in (DEVICE, index, str(index), DEVICE.removeprefix("ridgewave_")):
        answer = playing.client.post(f"{second}/play", json={"device": name})
        assert f"{DEVICE} plays already" in problem(answer, 409, "busy")["detail"]
    assert playing.client.get(second).json()["play"] is None
    other = playing.client.post(f"{second}/play", json={"device": OTHER})
    assert other.status_code == 202, other.text
    assert playing.client.delete(f"{second}/play").json()["failure"] is None
    assert playing.play()["state"] == "playing"
    playing.client.delete(playing.session)
    answer = playing.client.post(f"{second}/play", json={"device": DEVICE})
    assert answer.status_code == 202, answer.text
    assert playing.client.post("/v1/stop").json()["stopped"]["plays"] == 1


def test_a_play_whose_device_stalls_for_long_has_failed_and_another_can_begin(playing: OnDevice) -> None:
    """It does not play again by itself when the device comes back; asked again, the device plays."""
    with playing.listening.stalling():
        until(lambda: playing.play()["state"] == "failed")
        assert playing.play()["failure"] == f"{DEVICE} has stalled: it took no samples for 2 s."
        since = playing.other.frames
        answer = playing.begin(OTHER)
        assert answer.status_code == 202, answer.text
        until(lambda: playing.play()["frames"] >= RATE // 4)
    assert playing.client.delete(f"{playing.session}/play").json()["state"] == "finished"
    heard = playing.listening.frames
    assert playing.begin(DEVICE).status_code == 202
    until(lambda: playing.listening.frames >= heard + RATE // 4)
    assert playing.client.delete(f"{playing.session}/play").json()["failure"] is None
    until(lambda: playing.heard_on_the_other(since))


def test_a_device_that_vanishes_is_told_and_the_session_goes_on(playing: OnDevice) -> None:
    """Its stream goes on, a play on another device begins, and one on the lost device is refused in a sentence.

    The last of the module: the device that the tests share is gone.
    """
    with playing.client.stream("GET", f"{playing.session}/stream?format=f32le") as stream:
        listener = Listener(stream)
        listener.frames(RATE // 10)
        playing.listening.vanish()
        until(lambda: playing.play()["state"] == "failed")
        report = playing.play()
        assert report["failure"] == f"{DEVICE} stopped by itself: the device was removed, or its driver failed."
        since = playing.other.frames
        answer = playing.begin(OTHER)
        assert answer.status_code == 202, answer.text
        until(lambda: playing.play()["frames"] >= RATE // 4)
        assert listener.frames(RATE // 2).any()
        assert playing.client.delete(f"{playing.session}/play").json()["state"] == "finished"
        document = problem(playing.begin(DEVICE), 503, "cannot-render")
        assert DEVICE in document["detail"]
        assert playing.client.get(playing.session).json()["streaming"]
        until(lambda: playing.heard_on_the_other(since))
    log = playing.child.log.read_text()
    assert f"a play on {DEVICE} failed: {report['failure']}" in log
    assert "Traceback" not in log and playing.session.rpartition("/")[2] not in log
