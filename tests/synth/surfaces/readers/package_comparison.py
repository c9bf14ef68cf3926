"""Compares an import with what the package SurfaceTopography itself makes of a file: points, sizes, Rq, Ra, slope.

    python -m tests.synth.surfaces.readers.package_comparison FILE-OR-FOLDER ...

prints a row for each file: its format, the worst relative difference of sizes, Rq and Ra, or why it was left out. The
package's example files are in its repository, in test/file_format_examples; its source distribution has none.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from synth.errors import RidgewaveError
from synth.surfaces.measurement.import_options import ImportOptions
from synth.surfaces.measurement.importing import import_surface
from synth.surfaces.readers.surface_file import UNITS

Values = dict[str, tuple[float, ...]]


def values_of_package(path: Path, options: ImportOptions) -> Values:
    """Return what the package finds, in m; a given unit or distance stands for what the file does not state."""
    from SurfaceTopography.IO import open_topography

    with open_topography(str(path)) as reader:
        default = reader.default_channel
        channel = default if default.is_height_channel else reader.height_channels[0]
        given = {}
        if channel.physical_sizes is None:
            assert options.pixel is not None
            metres = UNITS[channel.unit or (options.unit or ("m",))[-1]]
            pixels = (options.pixel * len(channel.nb_grid_pts))[: len(channel.nb_grid_pts)]
            given["physical_sizes"] = tuple(n * p / metres for n, p in zip(channel.nb_grid_pts, pixels, strict=True))
        surface = channel.topography(**given)
        metres = UNITS[surface.unit or (options.unit or ("m",))[-1]]
        area = surface.dim == 2
        if not surface.is_uniform:
            surface = surface.to_uniform(nb_grid_pts=len(surface.positions()))
        heights = np.ma.compressed(surface.heights())
        return {
            "points": tuple(float(count) for count in surface.nb_grid_pts),
            "size": tuple(float(size) * metres for size in surface.physical_sizes),
            "rq": (float(surface.rms_height_from_area() if area else surface.rms_height_from_profile()) * metres,),
            "ra": (float(np.mean(np.abs(heights - np.mean(heights)))) * metres,),
        }


def values_of_import(path: Path, options: ImportOptions) -> Values:
    """Return what the import reports of the same file."""
    report = import_surface(path, options).report
    return {name: tuple(np.atleast_1d(report[name]).tolist()) for name in ("points", "size", "rq", "ra")}


def worst_difference(one: Values, other: Values) -> float:
    """Return the largest relative difference of any value."""
    assert all(len(one[name]) == len(other[name]) for name in one), (one, other)
    return max(abs(a - b) / abs(b) for name in one for a, b in zip(one[name], other[name], strict=True))


def _files(places: list[str]) -> Iterator[Path]:
    for place in map(Path, places):
        yield from sorted(path for path in place.rglob("*") if path.is_file()) if place.is_dir() else [place]


def main() -> None:
    """Print a row for each file."""
    for path in _files(sys.argv[1:]):
        options: dict[str, Any] = {}
        for attempt in ({}, {"unit": "um"}, {"pixel": (1e-6,)}, {"unit": "um", "pixel": (1e-6,)}):
            options = attempt
            try:
                found = values_of_import(path, ImportOptions(**options))
            except (RidgewaveError, OSError) as error:
                said = " ".join(str(error).split())[:150]
                continue
            try:
                said = f"{worst_difference(found, values_of_package(path, ImportOptions(**options))):.1e}"
            except Exception as error:  # the package's own readers
                said = f"not read by the package: {' '.join(str(error).split())[:100]}"
            break
        print(f"{path.name:40} {said} {options or ''}")


if __name__ == "__main__":
    main()
