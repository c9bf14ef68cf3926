"""Grids and lists of points as text: the same three rows of four heights from each."""

from __future__ import annotations

from typing import Any

from tests.synth.surfaces.readers.usual_files import GRID, STEP, UsualFile
from tests.synth.surfaces.readers.usual_profiles import lines

DOWN = 250e-6  # m, between rows
AREA = {"unit": "um", "pixel": "125 um, 250 um"}
TOP_ROWS = [[str(value) for value in row] for row in GRID]
POINTS = [(125.0 * column, 250.0 * row, GRID[row][column]) for row in range(3) for column in range(4)]  # um


def grid(name: str, writer: str, text: str, encoding: str = "ascii", **more: Any) -> UsualFile:
    """Return a file whose heights are GRID, about their mean."""
    heights = more.pop("heights", GRID)
    return UsualFile(name, writer, text.encode(encoding), heights, more.pop("spacing", (STEP, DOWN)), **more)


def joined(separator: str, rows: Any = TOP_ROWS) -> list[str]:
    return [separator.join(row) for row in rows]


GRIDS: tuple[UsualFile, ...] = (
    grid("matrix.txt", "NumPy, savetxt of a matrix", lines(rows=joined(" ")), options=AREA, shows=("3 rows and 4",)),
    grid("matrix.csv", "MATLAB, writematrix", lines(rows=joined(",")), options=AREA, shows=("separated by commas",)),
    grid(
        "matrix-tabs-comma.txt",
        "ImageJ with German settings, save as text image: tabs and decimal commas",
        lines(rows=[row.replace(".", ",") for row in joined("\t")]),
        options=AREA,
        shows=("decimal commas",),
    ),
    grid(
        "esri.asc",
        "ESRI ASCII grid of a DEM: the number of missing points is stated",
        lines(
            "ncols 4",
            "nrows 3",
            "xllcorner 0.0",
            "yllcorner 0.0",
            "cellsize 0.125",
            "NODATA_value -9999",
            rows=joined(" ", TOP_ROWS[::-1]),
        ),
        options={"unit": "mm, um"},
        spacing=(STEP, STEP),
    ),
    grid(
        "esri-missing.asc",
        "ESRI ASCII grid with a missing cell",
        lines(
            "ncols 4",
            "nrows 3",
            "xllcorner 0.0",
            "yllcorner 0.0",
            "cellsize 0.125",
            "NODATA_value -9999",
            rows=joined(" ", [TOP_ROWS[2], ["-1.0", "-9999", *TOP_ROWS[1][2:]], TOP_ROWS[0]]),
        ),
        heights=(GRID[0], (-1.0, (-1.0 + 2.5 - 2.25 + 1.25) / 4.0, 2.5, -0.25), GRID[2]),
        options={"unit": "mm, um", "missing": "fill"},
        spacing=(STEP, STEP),
    ),
    grid(
        "surfer.grd",
        "Golden Software Surfer, text grid (DSAA): the first row has the smallest y",
        lines("DSAA", "4 3", "0 0.375", "0 0.5", "-3.5 4.0", rows=[" ".join(row) + "\n" for row in TOP_ROWS]),
        options={"unit": "mm, um"},
        shows=("Surfer grid", "the row of the least y first"),
    ),
    grid(
        "gwyddion.txt",
        "Gwyddion, ASCII data matrix with a comment header",
        lines(
            "# Channel: Height",
            "# Width: 500 µm",
            "# Height: 750 µm",
            "# Value units: m",
            rows=["\t".join(f"{1e-6 * value:.10e}" for value in row) for row in GRID],
        ),
        "utf-8",
        shows=("0.5 mm x 0.75 mm", "m, stated by the file"),
    ),
    grid(
        "gwyddion-three-columns.txt",
        "Gwyddion, ASCII data matrix of three columns: a grid, and no list of points",
        lines(
            "# Channel: Height",
            "# Width: 375 µm",
            "# Height: 750 µm",
            "# Value units: µm",
            rows=[" ".join(row[:3]) for row in TOP_ROWS],
        ),
        "utf-8",
        heights=[row[:3] for row in GRID],
        shows=("a grid of 3 rows and 3 columns",),
    ),
    grid(
        "spip.asc",
        "SPIP and ImageMet, ASCII",
        lines(
            "# File Format = ASCII",
            "# x-pixels = 4",
            "# y-pixels = 3",
            "# x-length = 500",
            "# y-length = 750",
            "# z-unit = um",
            "# Start of Data:",
            rows=joined("\t"),
        ),
        options={"unit": "um, um"},
    ),
    grid(
        "confocal.xyz",
        "a confocal microscope: x, y and height of each point",
        lines("X [um]\tY [um]\tZ [um]", rows=[f"{x}\t{y}\t{z}" for x, y, z in POINTS]),
        shows=("X: x in um; Y: y in um; Z: height in um",),
    ),
    grid(
        "zygo.xyz",
        "Zygo, XYZ of pixels: some points have no data",
        lines(rows=[f"{x:g},{y:g},{'No Data' if place == 5 else z}" for place, (x, y, z) in enumerate(POINTS)]),
        heights=(GRID[0], (-1.0, (2 * 0.75 - 0.5) / 3.0, 2.5, -0.25), GRID[2]),  # the nearer neighbours count twice
        options={"unit": "um", "missing": "fill"},
    ),
    grid(
        "column-major.xyz",
        "MATLAB, meshgrid written column by column",
        lines("x (um),y (um),z (um)", rows=[f"{x},{y},{z}" for x, y, z in sorted(POINTS)]),
    ),
    grid(
        "axes.csv",
        "Keyence and Excel: x in the first row, y in the first column",
        lines(rows=[";0;125;250;375", *(f"{250 * row};" + ";".join(TOP_ROWS[row]) for row in range(3))]),
        options={"unit": "um"},
        shows=("x in the first row and y in the first column",),
    ),
    grid(
        "keyence.csv",
        "Keyence VK, height CSV: settings, then a quoted matrix",
        lines(
            '"Measured date","2026/08/27"',
            '"XY calibration","125","um"',
            '"Unit","um"',
            '"Horizontal","4"',
            '"Vertical","3"',
            '""',
            '"Height"',
            rows=['"' + '","'.join(row) + '"' for row in TOP_ROWS],
        ),
        spacing=(STEP, STEP),
        shows=("um, stated by the file",),
    ),
    grid(
        "axes-named.csv",
        "Excel, a pivot table: a word in the corner, x beside it and y below",
        lines(rows=["y/x;0;125;250;375", *(f"{250 * row};" + ";".join(TOP_ROWS[row]) for row in range(3))]),
        options={"unit": "um"},
        shows=("x in the first row and y in the first column",),
    ),
    grid(
        "y-in-um.xyz",
        "a stage with two units: x in mm, y in um",
        lines("X [mm]\tY [um]\tZ [um]", rows=[f"{x / 1000}\t{y}\t{z}" for x, y, z in POINTS]),
        shows=("X: x in mm; Y: y in um; Z: height in um",),
    ),
    grid(
        "with-intensity.csv",
        "a confocal microscope: x, y, height and intensity",
        lines(
            "x [um],y [um],z [um],Intensity", rows=[f"{x},{y},{z},{place}" for place, (x, y, z) in enumerate(POINTS)]
        ),
        shows=("not read: Intensity",),
    ),
    grid(
        "empty-rows-below.csv",
        "Excel, CSV with rows of separators below the table",
        lines(rows=[*joined(";"), ";;;", ";;;"]),
        options=AREA,
    ),
    grid(
        "pandas-matrix.csv",
        "pandas, to_csv of a matrix: numbers of columns above, numbers of rows beside it",
        lines(",0,1,2,3", rows=[f"{place}," + ",".join(row) for place, row in enumerate(TOP_ROWS)]),
        options=AREA,
        shows=("count the points, and were not read",),
    ),
    grid(
        "trailing-tabs.txt",
        "LabVIEW: a tab after each number",
        lines(rows=[row + "\t" for row in joined("\t")], end="\r\n"),
        options=AREA,
    ),
)
