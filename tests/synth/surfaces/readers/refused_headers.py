"""Text, pictures and arrays whose header changes or contradicts what the numbers mean: what the refusal has to say."""

from __future__ import annotations

from tests.synth.surfaces.readers.refused_files import refused, tiff
from tests.synth.surfaces.readers.usual_files import GRID, UsualFile, Z
from tests.synth.surfaces.readers.usual_grids import TOP_ROWS, joined
from tests.synth.surfaces.readers.usual_headers import LEVELS, with_axes
from tests.synth.surfaces.readers.usual_pictures import chunk, packed, png
from tests.synth.surfaces.readers.usual_profiles import lines, rows

UM = {"unit": "um", "pixel": "125 um"}
FACTORS = (
    "Heights multiplied by 1000", "Z-scaling: 0.25", "Kalibrierfaktor;2,5", "Facteur d'\u00e9chelle : 0,01",
    "Verst\u00e4rkung = 2000", "Vertical gain x100", "1 digit = 5 nm", "Resolution: 0.02 um/bit", "nm per LSB: 4",
    "Values in 0.1 um", "height unit = 1e-8 m", "z = 0.1 * counts", "Scale: X 1, Y 1, Z = 20", "Scale 1:200",
    "adc2nm = 0.3", "Multiplier,0.001", "Umrechnung: 0.5 um/Digit", "Conversion factor of 12",
)  # fmt: skip
INVERTED = (
    "Orientation: upside down", "Z is positive downwards", "Heights are inverted", "z-axis: points down",
    "Invert = true", "Depth positive", "Polarity: negative",
)  # fmt: skip
NAMES = (
    "X [mm];Z*10 [um]", "X [mm];Z/50 [um]", "X [mm];Z [um] x 200", "X [mm];Z (1e-8 m)", "X [mm];Z [um] [mm]",
    "X [mm];-Z [um]", "X [mm];Z [um] (flipped)", "X [mm];Z [um^3]", "X [mm];Drehmoment [Nm]", "X [mm];Force (mN)",
    "X [mm];I / A", "X [mm];c [nM]", "X [Mm];Z [um]", "phi_rad;z_um", "longitude;z_um", "X [mm];Slope um/mm",
    "X [mm];U (mV)", "X [mm];Height (A)", "X [mm];Height um smoothed", "X [mm];Z (5 um)",
)  # fmt: skip


def names(place: int, header: str) -> UsualFile:
    table = lines(header, rows=rows(";"))
    first, second = header.split(";")
    says = second if first == "X [mm]" else first
    return refused(f"name-{place}.csv", f"names of columns: {header}", table, says, options={"unit": "mm"})


def contradicting(name: str, says: str, *header: str, **more: object) -> UsualFile:
    return refused(name, f"a header that contradicts: {header[0]}", lines(*header, rows=rows(";")), says, **more)


GREYS = bytes(17 * level for level in range(16) for _ in range(3))
PLACES = [f"{row};{z}" for row in range(3) for z in GRID[row]]

REFUSED_HEADERS: tuple[UsualFile, ...] = (
    *(
        refused(f"factor-{place}.txt", line, lines(line, rows=[str(z) for z in Z]), "states a factor", options=UM)
        for place, line in enumerate(FACTORS)
    ),
    *(
        refused(f"inverted-{place}.txt", line, lines(line, rows=[str(z) for z in Z]), "count downwards", options=UM)
        for place, line in enumerate(INVERTED)
    ),
    *(names(place, header) for place, header in enumerate(NAMES)),
    # A unit that the file states, and another one that is given
    contradicting("unit-twice.txt", "the file states it", "X [mm];Z [um], Lc 0.25 mm", options={"unit": "mm"}),
    contradicting("label-below.txt", "the file states it", "X [mm];Z [nm]", "", "Line 4;Run 2", options={"unit": "mm"}),
    contradicting(
        "labview-volts.lvm", "a unit of length", "Y_Unit_Label\tVolts", "X_Value;Height", options={"unit": "mm"}
    ),
    contradicting(
        "label-above.txt", "heights in nm", "Curve: Height (nm)", "Axis: X (mm)", "a;b", options={"unit": "mm"}
    ),
    contradicting("names-of-four.txt", "heights in nm", "X [mm];Z [nm];Comment;User", options={"unit": "mm"}),
    contradicting(
        "key-of-units.txt", "heights in nm", "Height unit [nm]", "X unit [mm]", "a;b", options={"unit": "mm"}
    ),
    contradicting("labels-of-axes.txt", "heights in nm", "x-axis: mm", "z-axis: nm", options={"unit": "mm"}),
    refused(
        "column-of-words.csv",
        "a status beside each height",
        lines("X [mm];Z [um];Status", rows=rows(";", after=";valid")),
        "a column of words or dates",
    ),
    refused(
        "column-of-dates.txt",
        "a date before each height",
        lines(rows=[f"2026-08-{day + 10}\t{z}" for day, z in enumerate(Z)]),
        "a column of words",
    ),
    contradicting("unit-of-header.txt", "and a column in nm", "Unit: mm", "x (mm);z (nm)"),
    contradicting("row-of-other-units.txt", "row of units", "X [mm];Z [nm]", "mm;um"),
    contradicting("two-spacings.txt", "states step twice", "Spacing: 125 um", "Spacing: 0.25 mm", "X [mm];Z [um]"),
    refused(
        "rows-and-columns.txt",
        "rows and columns changed over",
        lines("rows: 4, columns: 3", rows=joined(" ")),
        "where the header states",
        options=UM,
    ),
    # Corners, places and blocks
    refused("corner-alone.csv", "a unit alone in the corner", with_axes("[mm]"), "corner", options={"unit": "um"}),
    refused("corner-volts.csv", "volts in the corner", with_axes("U [mV]"), "corner", options={"unit": "um"}),
    refused("corner-given.csv", "the corner states nm", with_axes("z [nm]"), "states it", options={"unit": "um"}),
    refused(
        "axis-unequal.csv",
        "x in unequal steps",
        with_axes("y/x", (0, 125, 260, 375)),
        "unequal",
        options={"unit": "um"},
    ),
    refused(
        "rows-that-repeat.csv", "numbers of rows that repeat", lines("line;z_um", rows=PLACES), "repeat", options=UM
    ),
    refused(
        "x-above-heights.txt",
        "NumPy, savetxt of [x, z]",
        lines(rows=[" ".join(f"{0.5 * place:.6e}" for place in range(8)), " ".join(map(str, Z))]),
        "transpose",
        options=UM,
    ),
    refused(
        "two-grids.txt",
        "two grids in one file",
        lines(rows=[*joined(" "), "", *joined(" ", TOP_ROWS)]),
        "2 blocks",
        options=UM,
    ),
    refused("cloud.pcd", "Point Cloud Library", "# .PCD v.7\nFIELDS x y z\nDATA ascii\n0 0 1\n0 1 2\n", "PCD"),
    refused("cloud.txt", "PCD without its first line", "VERSION .7\nFIELDS x y z rgb\nDATA ascii\n0 0 1 9\n", "PCD"),
    refused(
        "steps-of-3-and-4.txt",
        "steps of 3 and 4 um",
        lines("x [um];z [um]", rows=[f"{x};{x}" for x in (0, 3, 7, 10, 13, 17, 20, 23, 27)]),
        "resample",
    ),
    # Pictures
    refused(
        "palette-with-unit.png",
        "places of a palette are no heights",
        png(packed(LEVELS, 4), 4, 4, 3, chunk(b"PLTE", GREYS)),
        "palette",
        options=UM,
    ),
    refused("bits.pbm", "PBM, where 1 is black", "P1\n4 2\n0 1 1 0\n1 0 0 1\n", "1 is black", options=UM),
    *(
        refused(
            f"print-{dpi}.tif",
            f"a resolution of {dpi} dots per inch",
            tiff(LEVELS, photometric="minisblack", metadata=None, resolution=(dpi, dpi), resolutionunit="INCH"),
            "was not used",
            options={"height": "10 um"},
        )
        for dpi in (100, 144, 180, 240, 360, 1000, 2400)
    ),
    refused(
        "ratio.tif",
        "a resolution without a unit",
        tiff(LEVELS, photometric="minisblack", metadata=None, resolution=(8000, 8000), resolutionunit="NONE"),
        "does not state it",
        options={"height": "10 um"},
    ),
)
