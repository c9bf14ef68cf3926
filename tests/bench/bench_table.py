"""The cost of a response table: making it, its memory, and reading a frame, compared with `numpy.sin` of as many
    numbers.

Model: blocks of 480 frames of float64 sines in turn with blocks of a reader: a steady scan, a hand whose speed and load
    change at every frame, and a speed at which two levels sound. Making is measured in processor time.
Limits: the default scene's table, with 64 harmonics and 0 to 5 N.
"""

from __future__ import annotations

from collections.abc import Callable
from time import process_time

import numpy as np

from synth.contact.geometry import Geometry
from synth.contact.load_balance import Contact
from synth.contact.stiffness import Stiffness
from synth.response.table import ResponseTable
from synth.response.table_making import make_table
from synth.response.table_reader import TableReader
from synth.scene.scene import parse_scene
from tests.bench.timing import Figure, alternated, figure

RATE, BLOCK, BAND = 48000, 480, 1000.0
LIMIT = 1.2  # x sin
SECONDS, MEGABYTES = 0.3, 4.0


def figures(quick: bool) -> list[Figure]:
    """Return the lines of making a table and of reading it; quick: few repeats."""
    scene = parse_scene({})
    contact = Contact(Geometry.of_scene(scene), Stiffness.of_scene(scene))

    def made() -> ResponseTable:
        return make_table(contact, period=scene.texture.period, band=BAND, lift_load=scene.scan.lift_load)

    table = made()
    how = f"default scene, {len(table.loads)} rows, {len(table.levels.highest)} levels"
    lines = [
        figure("table, made", [processor_seconds(made) for _ in range(1 if quick else 15)], "s", SECONDS, how),
        figure("table, size", [table.memory_bytes / 1e6], "MB", MEGABYTES, how),
    ]
    for name, quantity, speed, load in motions():
        lines += reading(table, name, quantity, speed, load, 5 if quick else 401)
    return lines


def processor_seconds(work: Callable[[], object]) -> float:
    """Return the processor time that `work` takes."""
    began = process_time()
    work()
    return process_time() - began


def motions() -> list[tuple[str, str, np.ndarray, np.ndarray]]:
    """Return name, quantity, speed (m/s) and load (N) [frames] of each motion."""
    t = np.arange(BLOCK) / RATE
    steady, still = np.full(BLOCK, 0.08), np.full(BLOCK, 0.3)
    moving, pressing = 0.1 + 0.09 * np.sin(200 * np.pi * t), 0.5 + 0.4 * np.sin(160 * np.pi * t)
    fading = np.full(BLOCK, 0.8 * 0.5 * (1 / 10 + 1.4 / 13))  # between the levels of 13 and of 9 harmonics
    found = [(f"steady, {one}", one, steady, still) for one in ("displacement", "velocity", "acceleration", "approach")]
    return [*found, ("hand", "acceleration", moving, pressing), ("fade", "acceleration", fading, still)]


def reading(
    table: ResponseTable, name: str, quantity: str, speed: np.ndarray, load: np.ndarray, repeats: int
) -> list[Figure]:
    """Return the lines of reading blocks of one motion."""
    reader = TableReader.of(table, quantity, RATE)
    state, out = reader.start(), np.empty((BLOCK, 1), np.float32)
    motion = np.zeros((5, BLOCK))
    motion[0], motion[2] = speed, load
    places = np.cumsum(speed) / RATE
    angles, sines = np.random.default_rng(1).uniform(0.0, 6.3, BLOCK), np.empty(BLOCK)
    blocks = 20

    def read() -> None:
        reader.read(state, motion, places, 0, out, 0)

    def sine() -> None:
        np.sin(angles, out=sines)

    ours, theirs = alternated([read] * blocks, [sine] * blocks, repeats)
    ratios = [one / other for one, other in zip(ours, theirs, strict=True)]
    how = f"{BLOCK} frames, {repeats} passes of {blocks} blocks, each beside as many sines"
    scale = 1e9 / blocks / BLOCK
    return [
        figure(f"table, {name}", ratios, "x sin", LIMIT, how),
        figure(f"table, {name}, a frame", ours, "ns/frame", None, how, scale=scale),
    ]
