"""The output compared with detection thresholds: `python -m tests.fidelity levels`.

Model   Each sinusoid of the catalogue, named by its size, is scanned at 80 mm/s and 0.3 N. Of the lines of the approach
        below 1 kHz, the table shows the one that exceeds the threshold at its frequency most, and by how much: its
        sensation level.
Source  The thresholds are those of `synth.perception.threshold`: of a fingertip, and of a small probe with a surround.
Limits  The two curves differ by 5 to 17 dB between 10 and 150 Hz. They hold for vibrators that stay in place. The
        model has one motion of the whole finger, and does not describe what is felt at a single ridge.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

from synth.scene.catalogue import catalogue
from tests.fidelity.facts import FINGERS
from tests.fidelity.measures import strongest_felt


def table() -> Iterator[str]:
    """Yield one row per texture."""
    yield "| texture | comb | fingertip |"
    yield "| --- | --- | --- |"
    for entry in catalogue():
        if not re.fullmatch(r"grating-\d+[a-z]+-\d+um", entry.name):
            continue
        cells = []
        for finger in FINGERS.values():
            frequency, amplitude, level = strongest_felt(finger, entry.document["texture"])
            of_probe = strongest_felt(finger, entry.document["texture"], "probe")[2]
            cells.append(f"{frequency:.0f} Hz, {1e6 * amplitude:.2g} um: {level:+.0f} dB ({of_probe:+.0f})")
        yield f"| {entry.name} | {' | '.join(cells)} |"
