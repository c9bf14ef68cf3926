"""Other programs read our files: soundfile, SciPy, wave, sox and ffmpeg give exactly the same samples."""

from __future__ import annotations

import itertools
import shutil
import subprocess
import sys
import warnings
import wave
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
import soundfile
from scipy.io import wavfile

from synth.encode import riff
from synth.encode.formats import (
    Block,
    Metadata,
    SoundFormat,
    block_bytes,
    encode_all,
    open_writer,
    quantise,
    stream_header,
)
from synth.encode.riff import wav_header
from tests.few import paired
from tests.file_metadata import read_metadata

WAVS = [SoundFormat.WAV, SoundFormat.WAV16, SoundFormat.WAV24]
FILES = [*itertools.product(WAVS, (False, True)), (SoundFormat.FLAC, False)]
every_file = pytest.mark.parametrize(("channels", "file"), paired([1, 2, 3], FILES))
every_count = pytest.mark.parametrize("channels", [1, 2, 3])


def test_every_container_is_read_by_others() -> None:
    assert {kind for kind, _endless in FILES} == {kind for kind in SoundFormat if kind.container != "raw"}


def sound(channels: int) -> Block:
    return np.random.default_rng(channels).uniform(-1.0, 1.0, (4801, channels)).astype(np.float32)


def heard(channels: int, sound_format: SoundFormat) -> npt.NDArray[np.float64]:
    """Return the samples that a reader should find in the file, in units of full scale."""
    block = sound(channels)
    if sound_format.is_float:
        return block.astype(np.float64)
    return quantise(block, sound_format.bits) / 2.0 ** (sound_format.bits - 1)


def written(folder: Path, channels: int, sound_format: SoundFormat, endless: bool) -> Path:
    metadata = Metadata((1.5e-6,) * channels, ("displacement",) * channels, {"texture": {"period": 8e-4}})
    block = sound(channels)
    path = folder / f"sound.{sound_format.container}"
    if endless:
        header = stream_header(sound_format, 48000, channels, metadata)
        path.write_bytes(header + block_bytes(block, sound_format))
    else:
        path.write_bytes(encode_all(block, sound_format, 48000, metadata))
    return path


@every_file
def test_soundfile_reads_samples_and_scene(tmp_path: Path, channels: int, file: tuple[SoundFormat, bool]) -> None:
    kind, path = file[0], written(tmp_path, channels, *file)
    with soundfile.SoundFile(path) as read:
        assert (read.samplerate, read.channels, read.frames) == (48000, channels, 4801)
        assert '"texture":{"period":0.0008}' in read.comment and "ridgewave" in read.software
        np.testing.assert_array_equal(read.read(always_2d=True), heard(channels, kind))
    assert read_metadata(path) is not None


@pytest.mark.parametrize("endless", [False, True])
@pytest.mark.parametrize("sound_format", WAVS)
@every_count
def test_scipy_reads_them(tmp_path: Path, channels: int, sound_format: SoundFormat, endless: bool) -> None:
    path = written(tmp_path, channels, sound_format, endless)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore" if endless else "error")  # an endless file ends before its header says
        rate, samples = wavfile.read(path)
    assert rate == 48000
    scale = 1.0 if sound_format.is_float else {16: 2.0**15, 24: 2.0**31}[sound_format.bits]  # 24 bit: upper of 32
    np.testing.assert_array_equal(samples.reshape(-1, channels) / scale, heard(channels, sound_format))


@pytest.mark.parametrize("endless", [False, True])
@pytest.mark.parametrize("sound_format", [SoundFormat.WAV16, SoundFormat.WAV24])
@pytest.mark.parametrize("channels", [1, 2, 3] if sys.version_info >= (3, 12) else [1, 2])
def test_wave_reads_integers(tmp_path: Path, channels: int, sound_format: SoundFormat, endless: bool) -> None:
    """Files of more than two channels are WAVE_FORMAT_EXTENSIBLE, which `wave` reads from Python 3.12 on."""
    with wave.open(str(written(tmp_path, channels, sound_format, endless))) as file:
        assert (file.getframerate(), file.getnchannels(), file.getsampwidth() * 8) == (
            48000,
            channels,
            sound_format.bits,
        )
        assert endless or file.getnframes() == 4801
        assert file.readframes(10000) == block_bytes(sound(channels), sound_format)


@every_file
def test_sox_reads_them(tmp_path: Path, channels: int, file: tuple[SoundFormat, bool]) -> None:
    sox, kind, path = require("sox"), file[0], written(tmp_path, channels, *file)
    command = [sox, str(path), "-t", "raw", "-e", "floating-point", "-b", "64", "-"]
    samples = np.frombuffer(run(command), "<f8").reshape(-1, channels)
    assert samples.shape == (4801, channels)  # sox computes in 32 bit integers: a float sample is rounded to those
    np.testing.assert_allclose(samples, heard(channels, kind), rtol=0, atol=2.0**-31 if kind.is_float else 0)


@every_file
def test_ffmpeg_reads_samples_and_scene(tmp_path: Path, channels: int, file: tuple[SoundFormat, bool]) -> None:
    ffmpeg, ffprobe = require("ffmpeg"), require("ffprobe")
    kind, path = file[0], written(tmp_path, channels, *file)
    samples = np.frombuffer(run([ffmpeg, "-v", "error", "-i", str(path), "-f", "f64le", "-"]), "<f8")
    np.testing.assert_array_equal(samples.reshape(-1, channels), heard(channels, kind))
    tags = run([ffprobe, "-v", "error", "-show_entries", "format_tags", str(path)]).decode()
    assert '"quantity":"displacement","full_scale":1.5e-06,"unit":"m"' in tags and '"period":0.0008' in tags


def test_flac_holds_the_integers_of_the_24_bit_wav(tmp_path: Path) -> None:
    flac, _ = soundfile.read(written(tmp_path, 2, SoundFormat.FLAC, False), dtype="int32")
    wav, _ = soundfile.read(written(tmp_path, 2, SoundFormat.WAV24, False), dtype="int32")
    np.testing.assert_array_equal(flac, wav)


def test_a_scene_of_a_megabyte_hides_no_samples(tmp_path: Path) -> None:
    block = sound(1)
    scene = {"scan": {"trajectory": [[step / 1000, step * 8e-5, 0.3] for step in range(30000)]}}
    metadata = Metadata((1.0,), ("acceleration",), scene)
    for sound_format in (SoundFormat.WAV, SoundFormat.FLAC):
        path = tmp_path / f"long.{sound_format.container}"
        path.write_bytes(encode_all(block, sound_format, 48000, metadata))
        assert read_metadata(path) == metadata
        samples, _ = soundfile.read(path, always_2d=True)
        np.testing.assert_array_equal(samples, heard(1, sound_format))


@pytest.mark.parametrize("declared", [True, False])
def test_rf64_is_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, declared: bool) -> None:
    """The limit is lowered, so that a small file is written like a large one."""
    monkeypatch.setattr(riff, "RF64_ABOVE", 1000)
    metadata = Metadata((1.0, 2.0), ("acceleration", "velocity"), {"finger": {}})
    path = tmp_path / "large.wav"
    with open_writer(path, SoundFormat.WAV24, 48000, 2, metadata, frames=4801 if declared else None) as writer:
        for start in range(0, 4801, 1000):
            writer.write(sound(2)[start : start + 1000])
    assert path.read_bytes()[:16] == b"RF64\xff\xff\xff\xffWAVEds64"
    samples, _ = soundfile.read(path)
    np.testing.assert_array_equal(samples, heard(2, SoundFormat.WAV24))
    _, samples = wavfile.read(path)
    np.testing.assert_array_equal(samples / 2.0**31, heard(2, SoundFormat.WAV24))
    assert read_metadata(path) == metadata


@pytest.mark.parametrize("frames", [2**30, 86400 * 48000])
def test_a_file_beyond_4_gib_tells_its_length(tmp_path: Path, frames: int) -> None:
    """The samples are a hole in the file, so that a day of float32 takes no space on the disk."""
    header = wav_header(SoundFormat.WAV, 48000, 1, None, frames)
    path = tmp_path / "day.wav"
    with open(path, "wb") as file:
        file.write(header)
        file.truncate(len(header) + 4 * frames)
    assert int.from_bytes(header[20:28], "little") == path.stat().st_size - 8
    assert soundfile.info(path).frames == frames
    assert len(wavfile.read(path, mmap=True)[1]) == frames
    if shutil.which("ffprobe"):
        command = ["ffprobe", "-v", "error", "-show_entries", "stream=duration", "-of", "csv=p=0", str(path)]
        assert float(run(command)) == pytest.approx(frames / 48000, abs=1e-3)


def test_riff_goes_to_the_last_byte_of_its_size_field() -> None:
    header_bytes = len(wav_header(SoundFormat.WAV16, 48000, 1, None, 0))
    most = (0xFFFFFFFE - (header_bytes - 8)) // 2
    assert wav_header(SoundFormat.WAV16, 48000, 1, None, most)[:8] == b"RIFF\xfe\xff\xff\xff"
    beyond = wav_header(SoundFormat.WAV16, 48000, 1, None, most + 1)
    assert beyond[:4] == b"RF64" and len(beyond) == header_bytes


def require(program: str) -> str:
    found = shutil.which(program)
    if found is None:
        pytest.skip(f"{program} is not installed")
    return found


def run(command: list[str]) -> bytes:
    return subprocess.run(command, capture_output=True, check=True, timeout=60).stdout
