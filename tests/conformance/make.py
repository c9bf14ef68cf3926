"""Makes the vectors of this folder: `python -m tests.conformance.make`.

table.safetensors   the table of a grating of 0.8 mm, of 9 harmonics, below 200 kB
hand.json           a motion and the samples that every reader makes of it
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from synth.plan.scene_table import table_of_scene
from synth.response.table_file import table_bytes
from synth.response.table_making import TableBounds
from synth.response.table_reader import TableReader
from synth.scene.scene import parse_scene

HERE = Path(__file__).parent
RATE, FRAMES = 48000, 960
PEAK = 0.8  # of full scale
QUANTITIES = ("displacement", "velocity", "acceleration", "approach")


def main() -> None:
    """Write both files."""
    table = table_of_scene(parse_scene({}), TableBounds(harmonics=9, nbytes=150_000))
    (HERE / "table.safetensors").write_bytes(table_bytes(table))
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
    document = {
        "table": "table.safetensors",
        "rate": RATE,
        "places": places.tolist(),
        "speeds": speeds.tolist(),
        "loads": loads.tolist(),
        "expected": samples,
    }
    (HERE / "hand.json").write_text(json.dumps(document, separators=(",", ":")) + "\n", "utf-8")


if __name__ == "__main__":
    main()
