"""Text whose header has traps: units beside other lengths, corners of grids, row order, words for missing points."""

from __future__ import annotations

import io

import numpy as np
import tifffile

from tests.synth.surfaces.readers.usual_files import GRID, UsualFile, Z
from tests.synth.surfaces.readers.usual_grids import AREA, TOP_ROWS, grid, joined
from tests.synth.surfaces.readers.usual_pictures import MAP, packed, picture, png
from tests.synth.surfaces.readers.usual_profiles import lines, profile, rows

COLUMNS_X, ROWS_Y = (0, 125, 250, 375), (0, 250, 500)  # um
LEVELS = np.array([[0, 5, 9, 15], [3, 1, 7, 2], [12, 0, 4, 8]], np.uint8)
UPSIDE_DOWN = [TOP_ROWS[row] for row in (2, 1, 0)]
BESIDE = ("X [mm];Z [um]", ";")


def with_axes(
    corner: str, across: tuple[int, ...] = COLUMNS_X, rows_of: object = TOP_ROWS, down: object = ROWS_Y
) -> str:
    """Return a grid with x in its first row and y in its first column, divided by semicolons."""
    below = [f"{y};" + ";".join(row) for y, row in zip(down, rows_of, strict=True)]  # type: ignore[call-overload]
    return lines(";".join([corner, *map(str, across)]), rows=below)


def named(name: str, header: str, **more: object) -> UsualFile:
    """Return a profile below a line of names in UTF-8, divided by semicolons."""
    return profile(name, f"names of columns: {header}", lines(header, rows=rows(";")), "utf-8", **more)


def eight_bits_of(maximum: int) -> bytes:
    return b"P5\n4 3\n# made by hand\n%d\n" % maximum + LEVELS.tobytes()


def twelve_bits() -> bytes:
    written = io.BytesIO()
    tifffile.imwrite(written, LEVELS.astype(np.uint16) * 273, photometric="minisblack", metadata=None)
    return written.getvalue()


HEADERS: tuple[UsualFile, ...] = (
    # A unit in brackets or behind the name, beside another length
    named("names-tip.csv", "Weg (mm);Profil (\u00b5m) Tastspitze 5 mm"),
    named("names-filter.csv", "Distance [mm];Height [um], filter 2.5 mm"),
    named("names-equals.csv", "Distance(mm);Height(um) Ls=0.008mm"),
    named("names-comma.csv", "Travel mm, length 12 nm;Raw um, gauge 6 mm"),
    named("names-comment.csv", "X in mm;Z in um (levelled)"),
    named("names-equal-sign.csv", "Lateral=mm;Height=um"),
    profile(
        "two-heights.csv",
        "two traces without x: no trace is x",
        lines("Z1 (um);Z2 (um)", rows=[f"{z};{-z}" for z in Z]),
        options={"pixel": "125 um"},
        shows=("Z1: height in um; Z2: not read",),
    ),
    named("names-words.csv", "X (mm, relative);Z (um, levelled)"),
    named("names-full-width.csv", "\u4f4d\u7f6e\uff08mm\uff09;\u9ad8\u3055\uff08um\uff09"),
    profile(
        "one-name-and-length.txt",
        "one column, with the length of the profile behind its name",
        lines("Profile um, length 1 mm", rows=[str(z) for z in Z]),
        options={"pixel": "125 um"},
    ),
    profile(
        "place-is-no-unit.txt",
        "a place in the name is no unit",
        lines("Section 3.5 cm", rows=[str(z) for z in Z]),
        options={"unit": "um", "pixel": "125 um"},
    ),
    profile(
        "names-above-a-label.txt",
        "names with units, an empty line, and a label of two cells",
        lines("Lateral [mm]\tRaw height [um]", "", "Sample A\tProfile 7", rows=rows()),
        shows=("Lateral: x in mm; Raw height: height in um",),
    ),
    profile(
        "names-far-above.txt",
        "names with units, and twenty lines of notes",
        lines("X [mm]\tRaw height [um]", *(f"# note {place}" for place in range(20)), rows=rows()),
        shows=("x in mm", "height in um"),
    ),
    profile(
        "height-is-a-size.txt",
        "a size in the header is no unit of the column",
        lines("Step height [mm]: 5", "Length [mm] 0.875", "X [mm]\tZ [um]", rows=rows()),
    ),
    profile(
        "one-name-too-many.txt",
        "LabVIEW: a name for comments, which have no column",
        lines("Pos [mm]\tHeight [um]\tComment", rows=rows()),
        shows=("Pos: x in mm; Height: height in um",),
    ),
    *(
        profile(f"no-factor-{place}.txt", f"a line that is no factor: {line}", lines(line, *BESIDE[:1], rows=rows(";")))
        for place, line in enumerate(
            (
                "Height factor: 1.000",
                "Scaling: none",
                "Zoom objective 20x",
                "Vertical scale = 100 %",
                "Inverted: false",
                "Integral gain: 0.3",
                "Quality factor: 210",
                "Digitised with 24 bits",
            )
        )
    ),
    # Corners, and where the axes go
    grid(
        "corner-unit.csv",
        "Excel: y [um] and x [um] in the corner",
        with_axes("y [um] \\ x [um]"),
        options={"unit": "um"},
    ),
    grid(
        "corner-of-heights.csv",
        "Excel: the name of the heights in the corner",
        with_axes("Height [um]"),
        options={"unit": "um"},
    ),
    grid(
        "corner-turned.csv",
        "Excel: x goes down",
        with_axes("X (um) \\ Y (um)", ROWS_Y, [list(row) for row in zip(*TOP_ROWS, strict=True)], COLUMNS_X),
        options={"unit": "um"},
    ),
    grid(
        "y-falls.csv",
        "maps: y falls down the first column",
        with_axes("y/x", rows_of=UPSIDE_DOWN, down=ROWS_Y[::-1]),
        options={"unit": "um"},
    ),
    grid(
        "x-falls.csv",
        "scans from the right: x falls along the first row",
        with_axes("", COLUMNS_X[::-1], [row[::-1] for row in TOP_ROWS]),
        options={"unit": "um"},
    ),
    grid(
        "numbered-places.csv",
        "image programs: row and column of each point",
        lines("row;column;height [um]", rows=[f"{r};{c};{GRID[r][c]}" for r in range(3) for c in range(4)]),
        options={"pixel": "125 um, 250 um"},
        shows=("row: y", "column: x"),
    ),
    grid(
        "numbered-places-ij.txt",
        "loops: j and i of each point",
        lines("j i z_um", rows=[f"{c} {r} {GRID[r][c]}" for c in range(4) for r in range(3)]),
        options={"pixel": "125 um, 250 um"},
    ),
    grid(
        "counts-as-sizes.txt",
        "Width and Height that count the points",
        lines("Width: 4", "Height: 3", rows=joined(" ")),
        options=AREA,
    ),
    grid(
        "double-spaced.txt",
        "word processors: an empty line below each row",
        lines(rows=[row + "\n" for row in joined("\t")]),
        options=AREA,
    ),
    # Words for missing points
    *(
        profile(
            f"missing-{place}.txt",
            f"a number for missing points: {line}",
            lines(line, "X [mm];Z [um]", rows=rows(";", z=(*Z[:3], mark, *Z[4:]))),
            "utf-8",
            heights=(*Z[:3], (Z[2] + Z[4]) / 2.0, *Z[4:]),
            options={"missing": "fill"},
        )
        for place, (line, mark) in enumerate(
            (
                ("Invalid value: 777", "777"),
                ("NaN value = -7", "-7"),
                ("Lost points are 9999", "9999"),
                ("Fehlwert: -99,5", "-99.5"),
                ("Dropouts: -32768", "-32768"),
                ("Undefined value is 1e9", "1000000000"),
            )
        )
    ),
    profile(
        "missing-counted.txt",
        "a number of missing points is no height",
        lines("Missing points: 0", "X [mm];Z [um]", rows=rows(";")),
    ),
    profile(
        "saturated.txt",
        "a sensor at its end: equal numbers far from the others get a note",
        lines("X [mm];Z [um]", rows=rows(";", z=(*Z[:6], 250.5, 250.5))),
        heights=(*Z[:6], 250.5, 250.5),
        shows=("The height of 2 points is 250.5",),
    ),
    # Steps
    profile(
        "unequal-resampled.txt",
        "unequal steps on whole numbers: x is that of the file",
        lines("x [um];z [um]", rows=[f"{x};{x / 10}" for x in (0, 7, 10, 17, 20)]),
        heights=[place / 10 for place in range(21)],
        spacing=(1e-6,),
        options={"resample": "1 um"},
    ),
    profile(
        "resampled-from-true-x.txt",
        "steps equal within 1 %: x is that of the file",
        lines("x [um];z [um]", rows=[f"{x};{x}" for x in (0.0, 10.0, 20.08, 30.0, 40.0)]),
        heights=[5.0 * place for place in range(9)],
        spacing=(5e-6,),
        options={"resample": "5 um"},
    ),
    # The numbers of a picture
    picture(
        "own-4.png",
        "PNG of 4 bits whose numbers are heights",
        png(packed(LEVELS, 4), 4, 4, 0),
        heights=1e-3 * LEVELS,
        options={"unit": "nm", "pixel": "50 um"},
    ),
    picture(
        "own-maximum.pgm",
        "PGM with its own greatest number",
        eight_bits_of(20),
        heights=LEVELS,
        options={"unit": "um", "pixel": "50 um"},
    ),
    picture(
        "own-scale.pgm", "PGM: its greatest number is full scale", eight_bits_of(30), heights=4.0 * LEVELS, options=MAP
    ),
    picture(
        "whole-16.tif",
        "cameras of 12 bits in TIFF of 16",
        twelve_bits(),
        heights=120.0 * 273 * LEVELS / 65535.0,
        options=MAP,
    ),
)
