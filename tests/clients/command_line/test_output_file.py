"""`-o` and `--subtype` choose one format, or the message lists the formats."""

from __future__ import annotations

import io
from pathlib import Path

import pytest

from clients.command_line.output_file import read_target
from synth.encode.formats import ENDINGS, SoundFormat
from synth.errors import InvalidRequest


@pytest.mark.parametrize(
    ("output", "subtype", "sound_format"),
    [
        ("out.wav", None, SoundFormat.WAV),
        ("out.wav", "float", SoundFormat.WAV),
        ("out.wav", "pcm16", SoundFormat.WAV16),
        ("OUT.WAV", "pcm24", SoundFormat.WAV24),
        ("a.b/out.flac", None, SoundFormat.FLAC),
        ("out.flac", "pcm24", SoundFormat.FLAC),
        ("out.raw", None, SoundFormat.F32LE),
        ("out.f32", "float", SoundFormat.F32LE),
        ("out.pcm", None, SoundFormat.F32LE),
        ("out.l16", None, SoundFormat.L16),
    ],
)
def test_ending_and_subtype_pick_the_format(output: str, subtype: str | None, sound_format: SoundFormat) -> None:
    target = read_target(output, subtype)
    assert (target.path, target.sound_format) == (Path(output), sound_format)


def test_every_format_has_an_ending_and_a_subtype() -> None:
    assert {kind for kinds in ENDINGS.values() for kind in kinds.values()} == set(SoundFormat)


@pytest.mark.parametrize(
    ("output", "subtype", "told"),
    [
        ("out.mp3", None, ".wav, .flac"),
        ("out", None, ".wav, .flac"),
        (".wav", None, "ends in"),
        ("out.flac", "float", "Write float to a .f32 or .pcm or .raw or .wav file"),
        ("out.flac", "pcm16", "pcm24 in a .flac file"),
        ("out.raw", "pcm16", "Write pcm16 to a .l16 or .wav file"),
    ],
)
def test_an_ending_with_another_subtype_is_refused(output: str, subtype: str | None, told: str) -> None:
    with pytest.raises(InvalidRequest, match=told):
        read_target(output, subtype)


def test_a_folder_is_refused(tmp_path: Path) -> None:
    folder = tmp_path / "sound.wav"
    folder.mkdir()
    with pytest.raises(InvalidRequest, match="folder"):
        read_target(str(folder), None)


def test_standard_output_is_wav_of_any_subtype() -> None:
    target = read_target("-", "pcm16")
    assert (target.path, target.sound_format, target.name) == (None, SoundFormat.WAV16, "standard output")


def test_a_terminal_gets_no_sound(monkeypatch: pytest.MonkeyPatch) -> None:
    class Terminal(io.StringIO):
        def isatty(self) -> bool:
            return True

    monkeypatch.setattr("sys.stdout", Terminal())
    with pytest.raises(InvalidRequest, match="terminal"):
        read_target("-", None)
