"""Files appear complete or not at all, and every error names the file and the reason."""

from __future__ import annotations

import io
import json
import os
import subprocess
import sys
from collections.abc import Iterator
from itertools import product
from pathlib import Path

import numpy as np
import pytest

from synth.encode.formats import Block, Metadata, SoundFormat, block_bytes, encode_all, open_writer, stream_header
from synth.encode.part_file import write_whole
from synth.errors import CannotRender

ROOT = Path(__file__).resolve().parents[3]
METADATA = Metadata((1.0,), ("acceleration",), {"a": 1})
every_format = pytest.mark.parametrize("sound_format", list(SoundFormat))
wav_and_flac = pytest.mark.parametrize("sound_format", [SoundFormat.WAV, SoundFormat.FLAC])


def sound(frames: int = 100000, channels: int = 1) -> Block:
    return np.random.default_rng(5).uniform(-1.0, 1.0, (frames, channels)).astype(np.float32)


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


@every_format
@pytest.mark.parametrize("declared", [True, False])
def test_blocks_of_any_size_make_the_file_of_one_block(
    tmp_path: Path, sound_format: SoundFormat, declared: bool
) -> None:
    path, block = tmp_path / "sound", sound(150001, 3)
    metadata = Metadata((1.0, 2.0, 3.0), ("acceleration",) * 3, {})
    with open_writer(path, sound_format, 44100, 3, metadata, frames=len(block) if declared else None) as writer:
        start = 0
        for size in (0, 1, 480, 70000, 79520):
            writer.write(block[start : start + size])
            start += size
        assert names(tmp_path) != ["sound"] and not path.exists()
    assert writer.frames == len(block) and names(tmp_path) == ["sound"]
    assert path.read_bytes() == encode_all(block, sound_format, 44100, metadata)


def test_an_old_file_stays_until_the_new_one_is_complete(tmp_path: Path) -> None:
    path = tmp_path / "sound.wav"
    path.write_bytes(b"old")
    with open_writer(path, SoundFormat.WAV, 48000, 1) as writer:
        writer.write(sound())
        assert path.read_bytes() == b"old"
    assert path.read_bytes() == encode_all(sound(), SoundFormat.WAV, 48000)


@wav_and_flac
@pytest.mark.parametrize("error", [KeyboardInterrupt, CannotRender("no"), ZeroDivisionError])
def test_whatever_ends_the_render_leaves_nothing(
    tmp_path: Path, sound_format: SoundFormat, error: BaseException | type[BaseException]
) -> None:
    with (
        pytest.raises(type(error) if isinstance(error, BaseException) else error),
        open_writer(tmp_path / "sound", sound_format, 48000, 1, METADATA) as writer,
    ):
        writer.write(sound())
        raise error
    assert names(tmp_path) == []


def test_two_writers_of_one_file_do_not_meet(tmp_path: Path) -> None:
    path = tmp_path / "sound.wav"
    first, second = (open_writer(path, SoundFormat.WAV, 48000, 1) for _ in range(2))
    first.write(sound(10))
    second.write(sound(20))
    first.close()
    assert path.read_bytes() == encode_all(sound(10), SoundFormat.WAV, 48000)
    second.close()
    assert path.read_bytes() == encode_all(sound(20), SoundFormat.WAV, 48000)
    assert names(tmp_path) == ["sound.wav"]


def test_an_exclusive_writer_takes_no_name_that_exists_or_is_being_written(tmp_path: Path) -> None:
    path = tmp_path / "sound.wav"
    with open_writer(path, SoundFormat.WAV, 48000, 1, exclusive=True) as writer:
        with pytest.raises(CannotRender, match="being written"):
            open_writer(path, SoundFormat.WAV, 48000, 1, exclusive=True)
        writer.write(sound(10))
    with pytest.raises(CannotRender, match="already exists"):
        open_writer(path, SoundFormat.WAV, 48000, 1, exclusive=True)
    assert path.read_bytes() == encode_all(sound(10), SoundFormat.WAV, 48000) and names(tmp_path) == ["sound.wav"]


def test_a_link_is_followed(tmp_path: Path) -> None:
    (tmp_path / "link.wav").symlink_to("real.wav")
    with open_writer(tmp_path / "link.wav", SoundFormat.WAV, 48000, 1) as writer:
        writer.write(sound(10))
    assert (tmp_path / "link.wav").is_symlink() and (tmp_path / "real.wav").stat().st_size > 40


def test_the_file_gets_the_usual_permissions(tmp_path: Path) -> None:
    (tmp_path / "usual").write_bytes(b"")
    with open_writer(tmp_path / "sound.wav", SoundFormat.WAV, 48000, 1) as writer:
        writer.write(sound(10))
    assert (tmp_path / "sound.wav").stat().st_mode == (tmp_path / "usual").stat().st_mode


def test_a_name_of_255_bytes_is_fine_and_a_longer_one_is_refused(tmp_path: Path) -> None:
    with open_writer(tmp_path / ("ä" * 125 + "b.wav"), SoundFormat.WAV, 48000, 1) as writer:
        writer.write(sound(10))
    with pytest.raises(CannotRender, match="the name is too long"):
        open_writer(tmp_path / ("x" * 252 + ".wav"), SoundFormat.WAV, 48000, 1)


def test_a_missing_folder_is_told_before_anything_is_written(tmp_path: Path) -> None:
    with pytest.raises(CannotRender, match=r"cannot write .*none/sound\.wav: the folder .*none does not exist"):
        open_writer(tmp_path / "none" / "sound.wav", SoundFormat.WAV, 48000, 1)
    (tmp_path / "file").write_bytes(b"")
    with pytest.raises(CannotRender, match=r"the folder .*file does not exist"):
        open_writer(tmp_path / "file" / "sound.wav", SoundFormat.WAV, 48000, 1)
    (tmp_path / "link.wav").symlink_to(tmp_path / "none" / "sound.wav")
    with pytest.raises(CannotRender, match=r"cannot write .*link\.wav: the folder .*none does not exist"):
        open_writer(tmp_path / "link.wav", SoundFormat.WAV, 48000, 1)


def test_a_folder_is_not_a_target(tmp_path: Path) -> None:
    with pytest.raises(CannotRender, match="it is a folder"):
        open_writer(tmp_path, SoundFormat.WAV, 48000, 1)
    assert names(tmp_path) == []


@pytest.fixture
def plain_user() -> Iterator[None]:
    """Run as a user to whom permissions apply, which root is not."""
    root = os.geteuid() == 0
    if root:
        os.seteuid(65534)
    yield
    if root:
        os.seteuid(0)


def test_a_folder_that_is_not_writable_is_told(tmp_path: Path, plain_user: None) -> None:
    folder = tmp_path if os.getuid() == 0 else tmp_path / "locked"  # root made tmp_path, and only root may use it
    if folder != tmp_path:
        folder.mkdir(mode=0o500)
    with pytest.raises(CannotRender, match=r"cannot write .*sound\.wav: .* is not writable"):
        open_writer(folder / "sound.wav", SoundFormat.WAV, 48000, 1)


FULL_DISK = """
import json, resource, signal, sys
import numpy as np
from synth.encode.formats import SoundFormat, open_writer
from synth.errors import CannotRender
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (200000, 200000))
block, said = np.random.default_rng(1).uniform(-1, 1, (480, 1)).astype(np.float32), {}
for name in SoundFormat:
    for blocks in (1000, 105):
        path = f"{sys.argv[1]}/{name}-{blocks}"
        try:
            with open_writer(path, SoundFormat(name), 48000, 1) as writer:
                for _ in range(blocks):
                    writer.write(block)
        except CannotRender as error:
            said[path] = error.reason
print(json.dumps(said))
"""


def test_no_room_leaves_nothing_and_says_so(tmp_path: Path) -> None:
    """The kernel refuses a file above 200 kB. With 105 float blocks that fails only when the file is completed."""
    command = [sys.executable, "-c", FULL_DISK, str(tmp_path)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=60, check=True)
    fit, said = [], {}
    for sound_format, blocks in product(SoundFormat, (1000, 105)):
        path = tmp_path / f"{sound_format}-{blocks}"
        if blocks * 480 * sound_format.bytes_per_sample < 199000:
            fit.append(path.name)
        else:
            said[str(path)] = f"cannot write {path}: the file grew past the largest size allowed here."
    assert json.loads(done.stdout) == said
    assert names(tmp_path) == sorted(fit) != []


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="no /dev/full on this system")
def test_a_full_disk_is_named() -> None:
    with pytest.raises(CannotRender, match="cannot write /dev/full: the disk is full"):
        open_writer("/dev/full", SoundFormat.WAV, 48000, 1).write(sound())
    with pytest.raises(CannotRender, match="cannot write /dev/full: the disk is full"):
        write_whole(Path("/dev/full"), bytes(100_000))
    assert os.path.exists("/dev/full")


def test_a_pipe_gets_exact_sizes_where_the_length_is_known_and_an_endless_header_where_not() -> None:
    for frames in (1000, None):
        reading, writing = os.pipe()
        with open(reading, "rb") as pipe, open(writing, "wb") as target:
            with open_writer(target, SoundFormat.WAV16, 48000, 1, METADATA, frames=frames) as writer:
                writer.write(sound(1000))
            target.close()
            body = pipe.read()
        if frames is None:
            expected = stream_header(SoundFormat.WAV16, 48000, 1, METADATA)
            assert body == expected + block_bytes(sound(1000), SoundFormat.WAV16)
        else:
            assert body == encode_all(sound(1000), SoundFormat.WAV16, 48000, METADATA)


def test_a_pipe_takes_no_flac() -> None:
    reading, writing = os.pipe()
    with open(reading, "rb"), open(writing, "wb") as target, pytest.raises(CannotRender, match="cannot seek"):
        open_writer(target, SoundFormat.FLAC, 48000, 1)


def test_a_reader_that_goes_away_is_told() -> None:
    reading, writing = os.pipe()
    with open(writing, "wb", buffering=0) as target:
        writer = open_writer(target, SoundFormat.WAV, 48000, 1)
        os.close(reading)
        with pytest.raises(CannotRender, match="reader has closed it"):
            writer.write(sound())


@wav_and_flac
def test_a_stream_keeps_what_stood_before(sound_format: SoundFormat) -> None:
    stream = io.BytesIO(b"before")
    stream.seek(6)
    with open_writer(stream, sound_format, 48000, 1) as writer:
        writer.write(sound(1000))
    assert stream.getvalue().startswith(b"before") and not stream.closed
    if sound_format is SoundFormat.WAV:
        assert stream.getvalue()[6:] == encode_all(sound(1000), sound_format, 48000)


def test_a_closed_writer_takes_no_blocks(tmp_path: Path) -> None:
    writer = open_writer(tmp_path / "sound.wav", SoundFormat.WAV, 48000, 1)
    writer.close()
    writer.close()
    writer.abort()
    assert names(tmp_path) == ["sound.wav"]
    with pytest.raises(AssertionError, match="closed"):
        writer.write(sound(1))


LONG = """
import resource, sys
import numpy as np
from synth.encode.formats import SoundFormat, open_writer
block = np.random.default_rng(1).uniform(-1, 1, (48000, 1)).astype(np.float32)
with open_writer(sys.argv[1], SoundFormat(sys.argv[2]), 48000, 1) as writer:
    writer.write(block)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    for _ in range(300):
        writer.write(block)
print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before)
"""


@wav_and_flac
def test_memory_is_flat_however_long_the_sound(tmp_path: Path, sound_format: SoundFormat) -> None:
    """Five minutes are 58 MB of float32. The peak memory grows by less than a tenth of that."""
    command = [sys.executable, "-c", LONG, str(tmp_path / "sound"), sound_format]
    grown_kib = int(subprocess.run(command, cwd=ROOT, capture_output=True, check=True, timeout=300).stdout)
    assert grown_kib < 5600
