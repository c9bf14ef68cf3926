"""Sounds for people to listen to: the examples of docs/ and hard cases, as WAV files with a report of their numbers.

python -m tests.listen FOLDER [NAME ...]
"""

from __future__ import annotations

import argparse
import json
import textwrap
from pathlib import Path

from synth import open_voice, parse_scene
from synth.encode.formats import Metadata, SoundFormat, encode_all
from synth.scene.effects_section import unit_of
from synth.scene.scene import scene_document
from synth.voice.voice import blocks
from tests.listen.cases import CASES, Sound, rendered
from tests.listen.report import HEADER, line, numbers

EXAMPLES = Path(__file__).resolve().parents[2] / "docs" / "examples"


def main(words: list[str] | None = None) -> None:
    """Write the sounds and report.txt into the folder that `words` name."""
    parser = argparse.ArgumentParser(prog="python -m tests.listen", description="Render sounds to listen to.")
    parser.add_argument("folder", type=Path, metavar="FOLDER", help="where the sounds go; made if it is not there")
    examples = {path.stem: path for path in sorted(EXAMPLES.glob("*.json"))}
    cases = {case.name: case for case in CASES}
    names, what = (*examples, *cases), "of a sound; all, where none is named"
    parser.add_argument("names", nargs="*", metavar="NAME", help=what)
    arguments = parser.parse_args(words)
    for name in arguments.names:  # `choices` of argparse refuses that none is named
        if name not in names:
            parser.error(f"{name!r} is no sound; there are {', '.join(names)}")
    folder: Path = arguments.folder
    folder.mkdir(parents=True, exist_ok=True)
    report = []
    for name in arguments.names or names:
        if name in examples:
            report.append(written(folder, name, f"docs/examples/{name}.json", example(examples[name])))
        else:
            report.append(written(folder, name, cases[name].listen_for, rendered(cases[name])))
    (folder / "report.txt").write_text("\n".join(report), "utf-8")
    print(f"{len(report)} sounds and report.txt in {folder}")


def example(path: Path) -> Sound:
    """Return the sound of an example scene."""
    scene = parse_scene(json.loads(path.read_text("utf-8")))
    voice = open_voice(scene)
    (samples,) = blocks(voice, round(scene.output.duration * voice.sample_rate))
    return Sound(scene, samples, voice.full_scale, voice.quantities)


def written(folder: Path, name: str, about: str, sound: Sound) -> str:
    """Write one sound as float WAV and return its part of the report."""
    rate = sound.scene.output.sample_rate
    metadata = Metadata(sound.full_scale, sound.quantities, scene_document(sound.scene))
    (folder / f"{name}.wav").write_bytes(encode_all(sound.samples, SoundFormat.WAV, rate, metadata))
    lines = [f"{name}.wav  {len(sound.samples) / rate:g} s at {rate} Hz", *textwrap.wrap(about, 100), HEADER]
    for channel, (quantity, full_scale) in enumerate(zip(sound.quantities, sound.full_scale, strict=True)):
        lines.append(line(quantity, full_scale, unit_of(quantity), numbers(sound.samples[:, channel], rate)))
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    main()
