"""The file sink and its one folder, the ring, and how sinks are chosen; `test_portaudio` plays on a device."""

from __future__ import annotations

import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest
import soundfile
from hypothesis import given
from hypothesis import strategies as st

from service.sinks import Claims, DeviceBusy, DeviceSink, FileSink, Sink, list_devices, open_sink
from service.sinks.device_access import within
from service.sinks.device_list import DeviceDescription, find_device
from service.sinks.ring_buffer import Ring
from synth.encode.formats import Block, Metadata, SoundFormat, encode_all
from synth.errors import CannotRender, InvalidRequest
from tests.file_metadata import read_metadata
from tests.service.harness import until

METADATA = Metadata((2.0,), ("velocity",), {"scan": {"load": 0.3}})


def sound(frames: int = 5000, channels: int = 1) -> Block:
    return np.random.default_rng(11).uniform(-1.0, 1.0, (frames, channels)).astype(np.float32)


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


@pytest.mark.parametrize(("name", "sound_format"), [("a.wav", SoundFormat.WAV), ("A-1_b.c.flac", SoundFormat.FLAC)])
def test_a_recording_appears_when_it_is_closed(tmp_path: Path, name: str, sound_format: SoundFormat) -> None:
    sink: Sink = FileSink(tmp_path, name)
    sink.start(48000, 1, METADATA)
    for start in range(0, 5000, 480):
        sink.write(sound()[start : start + 480])
    assert names(tmp_path) == [f"{name}.part"]
    sink.close()
    sink.close()
    assert names(tmp_path) == [name] and sink.failure is None
    assert (tmp_path / name).read_bytes() == encode_all(sound(), sound_format, 48000, METADATA)
    assert read_metadata(tmp_path / name) == METADATA


@pytest.mark.parametrize(
    "name",
    [
        *(
            "",
            ".wav",
            "a",
            "a.mp3",
            "a.WAV",
            "a.wav\n",
            "a.wav\0",
            "../a.wav",
            "/a.wav",
            "b/a.wav",
            "b\\a.wav",
            ".a.wav",
        ),
        *("-a.wav", "_a.wav", "..wav", "a b.wav", "ä.wav", "٣.wav", "a.wav/", "~.wav", "C:a.wav", "a" * 197 + ".wav"),
    ],
)
def test_other_names_are_refused(tmp_path: Path, name: str) -> None:
    with pytest.raises(InvalidRequest, match=r"ends in \.wav or \.flac") as refusal:
        FileSink(tmp_path, name)
    assert refusal.value.faults[0].pointer == "/device"
    assert names(tmp_path) == []


@given(st.text(max_size=12).map(lambda text: f"{text}.wav"))
def test_no_name_leaves_the_folder(name: str) -> None:
    folder = Path("/recordings")
    try:
        sink = FileSink(folder, name)
    except InvalidRequest:
        return
    assert sink.path.parent == folder and sink.path.resolve().parent == folder.resolve()


@pytest.mark.parametrize("what", ["file", "folder", "link", "dangling link", "link out"])
def test_a_name_that_exists_is_refused_and_left_alone(tmp_path: Path, what: str) -> None:
    folder, outside = tmp_path / "recordings", tmp_path / "outside"
    folder.mkdir()
    outside.write_bytes(b"precious")
    target = folder / "a.wav"
    if what == "file":
        target.write_bytes(b"old")
    elif what == "folder":
        target.mkdir()
    else:
        (folder / "other").write_bytes(b"")
        target.symlink_to({"link": folder / "other", "dangling link": tmp_path / "none", "link out": outside}[what])
    before = names(folder)
    with pytest.raises(CannotRender, match="already exists"):
        FileSink(folder, "a.wav").start(48000, 1)
    assert names(folder) == before and outside.read_bytes() == b"precious"
    assert names(tmp_path) == ["outside", "recordings"]


def test_a_link_in_place_of_the_unfinished_file_leads_nowhere(tmp_path: Path) -> None:
    (tmp_path / "recordings").mkdir()
    (tmp_path / "recordings" / "a.wav.part").symlink_to(tmp_path / "outside")
    with pytest.raises(CannotRender, match=r"left its \.part file"):
        FileSink(tmp_path / "recordings", "a.wav").start(48000, 1)
    assert names(tmp_path) == ["recordings"]


def test_one_name_is_recorded_once_at_a_time(tmp_path: Path) -> None:
    first, second = FileSink(tmp_path, "a.wav"), FileSink(tmp_path, "a.wav")
    first.start(48000, 1)
    with pytest.raises(CannotRender, match="being written"):
        second.start(48000, 1)
    second.close()
    first.write(sound(10))
    first.close()
    assert (tmp_path / "a.wav").read_bytes() == encode_all(sound(10), SoundFormat.WAV, 48000)


def test_a_missing_folder_is_told_at_the_start(tmp_path: Path) -> None:
    with pytest.raises(CannotRender, match="does not exist"):
        FileSink(tmp_path / "none", "a.wav").start(48000, 1)


def test_stop_completes_a_recording(tmp_path: Path) -> None:
    sink = FileSink(tmp_path, "stopped.wav")
    sink.start(48000, 1)
    sink.write(sound(100))
    sink.stop()
    with pytest.raises(CannotRender, match="is closed"):
        sink.write(sound(100))
    assert names(tmp_path) == ["stopped.wav"]
    assert soundfile.info(tmp_path / "stopped.wav").frames == 100


def test_a_disk_that_fills_up_ends_the_recording_and_leaves_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    sink = FileSink(tmp_path, "a.wav")
    sink.start(48000, 1)
    sink.write(sound(10))
    assert sink._writer is not None
    with open("/dev/full", "wb", buffering=0) as full:
        monkeypatch.setattr(sink._writer._encoder, "_stream", full)
        with pytest.raises(CannotRender, match=r"a\.wav: the disk is full"):
            sink.write(sound(10))
    assert sink.failure is not None and "the disk is full" in sink.failure
    with pytest.raises(CannotRender, match="the disk is full"):
        sink.write(sound(10))
    sink.close()
    assert names(tmp_path) == []


def test_a_real_time_recording_takes_its_time(tmp_path: Path) -> None:
    sink = open_sink("file:a.wav", tmp_path)
    sink.start(8000, 1)
    began = time.perf_counter()
    for _ in range(10):
        sink.write(sound(240))
    assert time.perf_counter() - began >= 0.3
    sink.close()
    assert soundfile.info(tmp_path / "a.wav").frames == 2400


def test_close_from_another_thread_ends_a_waiting_write(tmp_path: Path) -> None:
    sink = FileSink(tmp_path, "a.wav", realtime=True)
    sink.start(8000, 1)
    writer = threading.Thread(target=sink.write, args=(sound(8000 * 100),))  # would wait for 100 s
    writer.start()
    while sink._began is None:
        time.sleep(0.001)
    sink.close()
    writer.join(timeout=60.0)
    assert not writer.is_alive()
    assert soundfile.info(tmp_path / "a.wav").frames == 800000


def test_a_device_is_claimed_once_at_a_time() -> None:
    claims = Claims()
    claims.take(3, "the coil")
    claims.take(4, "another coil")
    with pytest.raises(DeviceBusy, match="the coil plays already"):
        claims.take(3, "the coil", patience=0.01)
    threading.Timer(0.05, claims.give_back, [3]).start()
    claims.take(3, "the coil", patience=60.0)
    with pytest.raises(DeviceBusy):
        claims.take(3, "the coil", patience=0.0)


@pytest.mark.parametrize("fault", [CannotRender("it does not open."), KeyboardInterrupt()])
def test_a_device_that_does_not_open_is_free_again(monkeypatch: pytest.MonkeyPatch, fault: BaseException) -> None:
    device = DeviceDescription(name="coil", index=3, channels=1, default_sample_rate=48000.0, default=True)

    def fail(*_: object) -> None:
        raise fault

    monkeypatch.setattr("service.sinks.audio_device.portaudio", lambda: None)
    monkeypatch.setattr("service.sinks.audio_device.find_device", lambda _: device)
    monkeypatch.setattr(DeviceSink, "_open", fail)
    claims = Claims()
    with pytest.raises(type(fault)):
        DeviceSink("coil", claims=claims).start(48000, 1)
    claims.take(3, "coil", patience=0.0)


def test_sinks_are_chosen_by_the_device_of_the_request(tmp_path: Path) -> None:
    assert isinstance(open_sink("file:a.wav", tmp_path), FileSink)
    assert isinstance(open_sink(None, tmp_path), DeviceSink)
    assert isinstance(open_sink("voice coil", tmp_path), DeviceSink)
    with pytest.raises(CannotRender, match="no folder for recordings"):
        open_sink("file:a.wav", None)
    with pytest.raises(InvalidRequest):
        open_sink("file:../a.wav", tmp_path)


@given(st.integers(1, 50), st.lists(st.tuples(st.booleans(), st.integers(0, 60)), max_size=60))
def test_the_ring_gives_back_what_it_took_in_order(capacity: int, steps: list[tuple[bool, int]]) -> None:
    ring = Ring(capacity, 2)
    given_frames = taken_frames = 0
    received: list[Block] = []
    numbers = np.arange(8000, dtype=np.float32).reshape(-1, 2)
    for writing, frames in steps:
        if writing:
            count = ring.write(numbers[given_frames : given_frames + frames])
            assert count == min(frames, capacity - (given_frames - taken_frames))
            given_frames += count
        else:
            out = np.full((frames, 2), -1.0, dtype=np.float32)
            count = ring.read_into(out)
            assert (out[count:] == -1.0).all()
            received.append(out[:count])
            taken_frames += count
        assert ring.filled == given_frames - taken_frames
    np.testing.assert_array_equal(np.concatenate([numbers[:0], *received]), numbers[:taken_frames])


def test_a_ring_lets_go_of_what_waits() -> None:
    ring, out = Ring(10, 1), np.zeros((10, 1), dtype=np.float32)
    assert ring.drop() == 0
    ring.write(sound(7))
    assert (ring.drop(), ring.filled, ring.read_into(out)) == (7, 0, 0)
    ring.write(sound(9))
    assert ring.read_into(out) == 9
    np.testing.assert_array_equal(out[:9], sound(9))


def test_what_a_driver_does_in_time_is_returned_or_raised() -> None:
    assert within(20.0, lambda: 7) == 7
    with pytest.raises(ZeroDivisionError):
        within(20.0, lambda: 1 // 0)


def test_a_driver_that_hangs_is_left_behind_and_what_it_does_too_late_undone() -> None:
    gate, undone = threading.Event(), list[str]()
    with pytest.raises(TimeoutError):
        within(0.01, lambda: "opened" if gate.wait(60.0) else "never", too_late=undone.append)
    assert undone == []
    gate.set()
    until(lambda: undone == ["opened"])


def test_a_missing_library_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "sounddevice", None)
    for attempt in (list_devices, lambda: DeviceSink().start(48000, 1)):
        with pytest.raises(CannotRender, match="pip install sounddevice"):
            attempt()


def test_a_missing_portaudio_says_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "sounddevice.py").write_text('raise OSError("PortAudio library not found")\n')
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "sounddevice", raising=False)
    with pytest.raises(CannotRender, match=r"apt-get install libportaudio2 .*PortAudio library not found"):
        list_devices()


def devices(*names_of_devices: str) -> list[DeviceDescription]:
    return [
        DeviceDescription(name=name, index=4 + at, channels=2, default_sample_rate=48000.0, default=at == 1)
        for at, name in enumerate(names_of_devices)
    ]


@pytest.mark.parametrize(
    ("wanted", "index"), [(None, 5), (4, 4), ("6", 6), ("USB", 4), ("usb audio 2", 5), ("haptu", 6), (" Haptuator ", 6)]
)
def test_a_device_is_found_by_index_name_or_part(
    monkeypatch: pytest.MonkeyPatch, wanted: str | int | None, index: int
) -> None:
    found = devices("USB", "USB Audio 2", "Haptuator")
    monkeypatch.setattr("service.sinks.device_list.list_devices", lambda: found)
    assert find_device(wanted)["index"] == index


@pytest.mark.parametrize("wanted", ["piano", "", "a", 7, -1])
def test_a_device_that_is_not_one_of_them_is_refused(monkeypatch: pytest.MonkeyPatch, wanted: str | int) -> None:
    found = devices("USB Audio", "USB Audio 2", "Haptuator")
    monkeypatch.setattr("service.sinks.device_list.list_devices", lambda: found)
    with pytest.raises(InvalidRequest, match=r"4 'USB Audio', 5 'USB Audio 2', 6 'Haptuator'"):
        find_device(wanted)


def test_a_machine_without_devices_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("service.sinks.device_list.list_devices", lambda: [])
    with pytest.raises(CannotRender, match="no audio output device"):
        find_device(None)
