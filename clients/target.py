"""`-o` and `--subtype`: where a render goes and as which kind of samples.

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

from clients.outcome import asked_wrong
from synth.encode import SoundFormat

STANDARD_OUTPUT = "-"

# For each ending: the sample types that it has, the default first.
FORMATS: dict[str, dict[str, SoundFormat]] = {
    ".wav": {"float": SoundFormat.WAV, "pcm16": SoundFormat.WAV16, "pcm24": SoundFormat.WAV24},
    ".flac": {"pcm24": SoundFormat.FLAC},
    ".raw": {"float": SoundFormat.F32LE},
    ".f32": {"float": SoundFormat.F32LE},
    ".pcm": {"float": SoundFormat.F32LE},
    ".l16": {"pcm16": SoundFormat.L16},
}


@dataclass(frozen=True, slots=True)
class Target:
    """Where a render goes: `path` (None: standard output), and the format of its samples."""

    path: Path | None
    sound_format: SoundFormat

    @property
    def name(self) -> str:
        """Return the name to show."""
        return "standard output" if self.path is None else str(self.path)


def read_target(output: str, subtype: str | None) -> Target:
    """Return the target that `-o output --subtype subtype` asks for; raises AskedWrong."""
    if output == STANDARD_OUTPUT:
        if sys.stdout.isatty():
            asked_wrong("--output", output, "a pipe or a file behind standard output", "Sound is not for a terminal.")
        return Target(None, _pick(".wav", subtype))
    path = Path(output)
    if path.suffix.lower() not in FORMATS:
        asked_wrong("--output", output, "a name that ends in " + ", ".join(FORMATS), "Write, for instance, out.wav.")
    if path.is_dir():
        asked_wrong("--output", output, "the name of a file", "This is a folder.")
    return Target(path, _pick(path.suffix.lower(), subtype))


def _pick(ending: str, subtype: str | None) -> SoundFormat:
    choices = FORMATS[ending]
    if subtype is None:
        return next(iter(choices.values()))
    if subtype not in choices:
        others = sorted(other for other, kinds in FORMATS.items() if subtype in kinds)
        hint = f"Write {subtype} to a {' or '.join(others)} file."
        asked_wrong("--subtype", subtype, f"{' or '.join(choices)} in a {ending} file", hint)
    return choices[subtype]
