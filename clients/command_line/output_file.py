"""`-o` and `--subtype`: the output of a render and its sample format.

.wav              float (default), pcm16, pcm24
.flac             pcm24
.raw .f32 .pcm    float: float32, little-endian, no header
.l16              pcm16: 16 bit, big-endian, no header
-                 WAV to standard output, with any of its sample types
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path

from clients.command_line.exit_codes import invalid_request
from synth.encode.formats import SoundFormat, choose_format

STANDARD_OUTPUT = "-"


@dataclass(frozen=True, slots=True)
class Target:
    """The output of a render. path: None is standard output."""

    path: Path | None
    sound_format: SoundFormat

    @property
    def name(self) -> str:
        """The name for messages."""
        return "standard output" if self.path is None else str(self.path)


def read_target(output: str, subtype: str | None) -> Target:
    """Return the target of `-o output --subtype subtype`; raises InvalidRequest."""
    if output == STANDARD_OUTPUT:
        if sys.stdout.isatty():
            invalid_request("--output", output, "standard output to a pipe or a file", "A terminal cannot play sound.")
        return Target(None, choose_format("-.wav", subtype))
    path = Path(output)
    sound_format = choose_format(path, subtype)
    if path.is_dir():
        invalid_request("--output", output, "the name of a file", "This is a folder.")
    return Target(path, sound_format)


def replaces(path: Path, no_clobber: bool) -> bool:
    """Return whether `path` is an existing file; if it is, and must be kept, raise InvalidRequest."""
    if not path.is_file():  # a pipe or a device is written to, not replaced
        return False
    if no_clobber:
        invalid_request(
            "--no-clobber", str(path), "the name of a new file", "Name another file, or leave out --no-clobber."
        )
    return True
