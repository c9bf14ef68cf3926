"""The table of docs/effects.md of which effect works with what: `python -m docs.figures.effect_pairs`.

An effect is asked for with its default settings, with every finger, texture and scan. The page has the table between
two marks; a test makes it again and compares. What a scene refuses has the sentences of the refusal.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from synth.errors import SceneError
from synth.scene.effects_section import effect_names
from synth.scene.scene import parse_scene

PAGE = Path(__file__).resolve().parent.parent / "effects.md"
BEGIN = "<!-- made by: python -m docs.figures.effect_pairs -->\n"
END = "<!-- end of what it makes -->\n"

WAVE = [0.0, 4e-6, 9e-6, 5e-6, -2e-6, -8e-6, -6e-6, -2e-6]
HEIGHTS = [[4e-6 * ((3 * row + 5 * column) % 7 - 3) for column in range(8)] for row in range(8)]
FINGERS: dict[str, dict[str, Any]] = {
    "comb": {"kind": "comb", "contact_length": "3 mm"},
    "fingertip": {"kind": "fingertip", "contact_length": "3 mm"},
    "probe": {"kind": "probe"},
}
TEXTURES: dict[str, dict[str, Any]] = {
    "sinusoid": {"kind": "sinusoid"},
    "of the catalogue": {"kind": "grating-1mm-31um"},
    "rough": {"kind": "moulded-plastic"},
    "long profile": {"kind": "profile", "heights": WAVE * 75, "spacing": "50 um"},
    "dots": {"kind": "dots"},
    "height map": {"kind": "heightmap", "rows": HEIGHTS, "spacing": "0.2 mm"},
}
SCANS: dict[str, dict[str, Any]] = {
    "constant": {"speed": "80 mm/s", "load": "0.3 N"},
    "stroke": {"stroke": {"length": "20 mm", "speed": "80 mm/s"}},
    "recording": {"trajectory": [[0, 0, 0.3], [0.1, 0.008, 0.5], [0.2, 0.016, 0.3]]},
    "path": {"trajectory": [[0, 0, 0, 0, 0.3], [0.1, 0.008, 0.002, 0.1, 0.5], [0.2, 0.016, 0.003, 0.2, 0.3]]},
}
QUICK: dict[str, Any] = {
    "output": {"quantity": "displacement", "sample_rate": 8000, "duration": 0.05},
    "accuracy": {"tolerance": 0.02},
}
"""Sections that make a scene quick to render."""


@dataclass(frozen=True, slots=True)
class Pair:
    """An effect with a finger, a texture and a scan. refusal: the sentences of it, or ""."""

    effect: str
    finger: str
    texture: str
    scan: str
    refusal: str


def scene_of(effects: tuple[str, ...], finger: str, texture: str, scan: str) -> dict[str, Any]:
    """Return a scene with `effects` at their default settings."""
    sections = {"finger": FINGERS[finger], "texture": TEXTURES[texture], "scan": SCANS[scan]}
    return {**QUICK, **sections, "effects": {name: {} for name in effects}}


def pairs() -> Iterator[Pair]:
    """Yield every pair."""
    for names in itertools.product(effect_names(), FINGERS, TEXTURES, SCANS):
        effect, *scene = names
        refusal = ""
        try:
            parse_scene(scene_of((effect,), *scene))
        except SceneError as error:
            refusal = " ".join(fault.hint for fault in error.faults)
        yield Pair(*names, refusal)


def table() -> str:
    """Return the table, and below it the sentences of what is refused."""
    every = list(pairs())
    lines = [f"| effect | {' | '.join(FINGERS)} |\n", "| --- |" + " --- |" * len(FINGERS) + "\n"]
    refused: dict[str, list[str]] = {}
    for effect in effect_names():
        cells = []
        for finger in FINGERS:
            some = [pair for pair in every if (pair.effect, pair.finger) == (effect, finger)]
            cells.append(cell_of(some))
            for pair in some:
                if pair.refusal and f"`{effect}` with a {finger}" not in refused.setdefault(pair.refusal, []):
                    refused[pair.refusal].append(f"`{effect}` with a {finger}")
        lines.append(f"| `{effect}` | {' | '.join(cells)} |\n")
    accepted = sum(not pair.refusal for pair in every)
    count = f"\n{accepted} of {len(every)} pairs of an effect with a finger, a texture and a scan are accepted.\n"
    return "".join(lines) + count + "".join(f"- {', '.join(names)}: {why}\n" for why, names in refused.items())


def cell_of(some: list[Pair]) -> str:
    """Return what of the pairs of an effect and a finger is accepted, in words."""
    accepted = [pair for pair in some if not pair.refusal]
    if len(accepted) == len(some):
        return "every texture and scan"
    if not accepted:
        return "refused"
    scans: dict[str, list[str]] = {}
    for pair in accepted:
        scans.setdefault(pair.texture, []).append(pair.scan)
    return "; ".join(
        texture if len(these) == len(SCANS) else f"{texture}: {', '.join(these)}" for texture, these in scans.items()
    )


def main() -> None:
    """Write the table into the page."""
    before, _mark, rest = PAGE.read_text("utf-8").partition(BEGIN)
    PAGE.write_text(before + BEGIN + table() + END + rest.partition(END)[2], "utf-8")


if __name__ == "__main__":
    main()
