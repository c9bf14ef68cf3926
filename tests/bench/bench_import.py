"""Text of a million numbers: the time to read it, relative to NumPy's reading of the plain one."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np

from synth.surfaces.readers.file_formats import read_surface_file
from tests.bench.timing import Figure, alternated, figure


def figures(quick: bool) -> list[Figure]:
    """Return a line for each form of text, on one core."""
    size = 100 if quick else 1000  # rows and columns
    repeats = 3 if quick else 9
    with tempfile.TemporaryDirectory() as folder:
        paths: dict[str, Path] = {}
        for name, text in forms(size).items():
            paths[name] = Path(folder, f"{len(paths)}.txt")
            paths[name].write_text(text)
        plain = partial(np.loadtxt, paths["a grid"], delimiter="\t")
        return [reading(name, path, plain, size, repeats) for name, path in paths.items()]


def forms(size: int) -> dict[str, str]:
    """Return the texts by their names, each of about size x size numbers."""
    heights = np.random.default_rng(1).normal(0.0, 5.0, (size, size))
    rows = [[f"{height:.4f}" for height in row] for row in heights]
    flat = [cell for row in rows for cell in row]
    grid = "\n".join(map("\t".join, rows))
    wide = "\n".join("\t".join(flat[at : at + 10 * size]) for at in range(0, len(flat), 10 * size))
    places = [f"{n % size};{n // size};{flat[n]}" for n in range(len(flat) // 3 // size * size)]
    return {
        "a grid": grid,
        "a grid with ten times longer rows": wide,
        "a grid with --- in each row": "\n".join("---" + line[line.index("\t") :] for line in grid.splitlines()),
        "x, y and z, decimal commas": "\n".join(["x [um];y [um];z [um]", *places]).replace(".", ","),
        "x, y and z, EOF at the end": "\n".join(["x [um];y [um];z [um]", *places, "EOF"]),
        "a grid with marks of thousands": "\n".join("\t".join(f"{1e4 + z:,.2f}" for z in row) for row in heights),
    }


def reading(name: str, path: Path, plain: Callable[[], object], size: int, repeats: int) -> Figure:
    """Return the time to read the file at `path` in times of `plain`."""
    ours, numpys = alternated([partial(read_surface_file, path)], [plain], repeats)
    ratios = [one / other for one, other in zip(ours, numpys, strict=True)]
    how = f"{size * size} numbers, {min(ours):.2f} s against {min(numpys):.2f}, median of {repeats} in turn"
    return figure(f"import of text, {name}", ratios, "x loadtxt", None, how)
