"""Makes the samples of this folder again: `python -m tests.conformance.make`.

table.safetensors   a table of the default scene, of 9 harmonics, below 200 kB. It is kept as it was first made
hand.json           a motion and the samples that every reader makes of it and of that table

The samples are the same bytes as long as the reading is the same. The table is not made again: which rows of load it
has follows from how tables are made, and that may change while the format stays. docs/table.md says how far from it a
table of the present engine is.
`python -m tests.conformance.make --table` makes both files, for a new version of the format.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np

from synth.plan.scene_table import table_of_scene
from synth.response.table import ResponseTable
from synth.response.table_file import read_table, table_bytes
from synth.response.table_making import TableBounds
from synth.response.table_reader import TableReader
from synth.scene.scene import parse_scene

HERE = Path(__file__).parent
TABLE = "table.safetensors"
BOUNDS = TableBounds(harmonics=9, nbytes=150_000)
RATE, FRAMES = 48000, 960
PEAK = 0.8  # of full scale
QUANTITIES = ("displacement", "velocity", "acceleration", "approach")


def hand_on(table: ResponseTable) -> dict[str, Any]:
    """Return the motion and its samples, the document of hand.json."""
    t = np.arange(FRAMES) / RATE
    speeds = np.round(0.15 + 0.9 * np.sin(2 * np.pi * 75 * t), 9)
    places = np.round(np.cumsum(speeds) / RATE, 12)
    presses = 1.8 - 2.2 * np.cos(2 * np.pi * 100 * t) + 2.0 * t / t[-1]
    touches = 1.5e-3 * np.sin(2 * np.pi * 600 * t)  # where the finger is lifted: loads within the gate
    loads = np.maximum(np.round(np.maximum(presses, touches), 9), 0.0)
    motion = np.zeros((5, FRAMES))
    motion[0], motion[2] = speeds, loads
    samples = {}
    for quantity in QUANTITIES:
        reader = TableReader.of(table, quantity, RATE)
        out = np.empty((FRAMES, 1), np.float32)
        reader.read(reader.start(), motion, places, 0, out, 0)
        full_scale = float(np.max(np.abs(out))) / PEAK
        samples[quantity] = {"full_scale": full_scale, "samples": [float(f"{one:.9g}") for one in out[:, 0]]}
    return {
        "table": TABLE,
        "rate": RATE,
        "places": places.tolist(),
        "speeds": speeds.tolist(),
        "loads": loads.tolist(),
        "expected": samples,
    }


def main(*, new_table: bool) -> None:
    """Write hand.json, and the table before it if `new_table`."""
    if new_table:
        (HERE / TABLE).write_bytes(table_bytes(table_of_scene(parse_scene({}), BOUNDS)))
    document = hand_on(read_table(HERE / TABLE))
    (HERE / "hand.json").write_text(json.dumps(document, separators=(",", ":")) + "\n", "utf-8")


if __name__ == "__main__":
    main(new_table="--table" in sys.argv)
