"""Profiles as text: x in mm and heights in um, unless the file states otherwise. The same eight points from each."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

from tests.synth.surfaces.readers.usual_files import UsualFile, X, Z

ROWS = tuple(zip(X, Z, strict=True))
MM_UM = {"unit": "mm, um"}


def lines(*header: str, rows: Iterable[str], end: str = "\n", last: str = "") -> str:
    """Return a text of header, rows and last line."""
    return end.join([*header, *rows]) + end + last


def rows(
    separator: str = "\t", form: Callable[[float], str] = str, after: str = "", before: str = "", z: Any = Z
) -> list[str]:
    """Return the points, one row each."""
    return [f"{before}{form(x)}{separator}{form(height)}{after}" for x, height in zip(X, z, strict=True)]


def comma(value: float) -> str:
    return str(value).replace(".", ",")


def fixed(decimals: int) -> Callable[[float], str]:
    return lambda value: f"{value:.{decimals}f}"


def profile(name: str, writer: str, text: str, encoding: str = "ascii", **more: Any) -> UsualFile:
    """Return a file whose heights are Z, about their mean."""
    return UsualFile(name, writer, text.encode(encoding), more.pop("heights", Z), **more)


def bare(value: float) -> str:
    """Return a number without the zeros that stand alone beside its point."""
    text = str(value)
    return text[:-1] if text.endswith(".0") else text.replace("0.", ".", 1)


def nanometres(value: float) -> str:
    return f"{1000 * value:.0f}"


PROFILES: tuple[UsualFile, ...] = (
    # Ways to write units
    profile("units-brackets.txt", "many styluses: X [mm]", lines("X [mm]\tZ [um]", rows=rows())),
    profile("units-stroke.txt", "DIN 461, Origin: Length/mm", lines("Length/mm\tHeight/um", rows=rows())),
    profile("units-after-comma.txt", "papers: x, mm", lines("x, mm;z, um", rows=rows(";"))),
    profile("units-after-underscore.csv", "pandas: x_mm,z_um", lines("x_mm,z_um", rows=rows(","))),
    profile(
        "units-greek-mu.txt",
        "programs that write mu as the Greek letter U+03BC",
        lines("x (mm)\tz (\u03bcm)", rows=rows()),
        "utf-8",
        shows=("height in µm",),
    ),
    profile(
        "units-in-words.txt",
        "German reports: Millimeter, Mikrometer",
        lines("Position [Millimeter]\tHöhe [Mikrometer]", rows=rows()),
        "utf-8",
        shows=("height in um",),
    ),
    profile(
        "row-of-units.txt",
        "Origin and Veusz: names, then a row of units",
        lines("Distance\tHeight", "mm\tµm", rows=rows()),
        "utf-8",
    ),
    profile(
        "units-angstrom.txt",
        "KLA Tencor: heights in angstroms",
        lines("Scan (um)\tHeight (Å)", rows=[f"{1000 * x:g}\t{10000 * z:g}" for x, z in ROWS]),
        "cp1252",
        shows=("height in Å",),
    ),
    profile(
        "units-inch-mil.csv",
        "shops in inches: x in inch, heights in mil",
        lines("X (in),Z (mil)", rows=[f"{0.005 * place!r},{0.125 * place % 0.5!r}" for place in range(8)]),
        heights=[25.4 * (0.125 * place % 0.5) for place in range(8)],
        spacing=(0.005 * 0.0254,),
    ),
    # Instruments and programs
    profile(
        "dektak.csv",
        "Bruker Dektak, CSV: a block of settings, then names with units",
        lines(
            "Dektak Data File",
            "Scan Type,Standard Scan",
            "Stylus Force(mg),3.00",
            "Meas Time,27.08.26 10:11:12",
            "Horz Res,0.125",
            "",
            "Lateral(mm),Total Profile(um),",
            rows=rows(",", after=","),
            end="\r\n",
        ),
        shows=("Lateral: x in mm; Total Profile: height in um",),
    ),
    profile(
        "alpha-step.txt",
        "KLA Alpha-Step, text: um and a time, tabs",
        lines(
            "Alpha-Step D-600",
            "Recipe: denim",
            "Speed: 0.10 mm/s",
            "X(mm)\tZ(um)\tTime(s)",
            rows=[f"{x:.4f}\t{z:.4f}\t{place / 50:.3f}" for place, (x, z) in enumerate(ROWS)],
        ),
        shows=("X: x in mm; Z: height in um",),
    ),
    profile(
        "mitutoyo.csv",
        "Mitutoyo Surftest, CSV: settings, then index, x and height",
        lines(
            "Surftest SJ-410",
            "Standard,ISO1997",
            "Range,800um",
            "Pitch,125um",
            "No.,X[mm],Z[um]",
            rows=[f"{place},{x:.4f},{z:+.4f}" for place, (x, z) in enumerate(ROWS, 1)],
            end="\r\n",
        ),
        shows=("X: x in mm; Z: height in um",),
    ),
    profile(
        "taylor-hobson.txt",
        "Taylor Hobson: heights alone, with the spacing in the header",
        lines("Talysurf", "Data spacing: 0.125 mm", "Height unit: um", rows=[f"{z:.6f}" for z in Z]),
        shows=("heights along a line",),
    ),
    profile(
        "gwyddion-graph.txt",
        "Gwyddion, Export Text of a graph curve: a label, a row of units in brackets",
        lines("         Profile 1", "x y", "[m] [m]", rows=[f"{1e-3 * x:.8e} {1e-6 * z:.8e}" for x, z in ROWS]),
        shows=("x in m", "height in m"),
    ),
    profile(
        "numpy-savetxt.txt",
        "NumPy, savetxt with a header",
        lines("# x [mm] z [um]", rows=[f"{x:.18e} {z:.18e}" for x, z in ROWS]),
    ),
    profile(
        "matlab-ascii.txt",
        "MATLAB, save -ascii: no header, spaces before each line",
        lines(rows=[f"   {x:.7e}  {z:.7e}".replace("  -", " -") for x, z in ROWS]),
        options=MM_UM,
    ),
    profile(
        "jasco.txt",
        "JASCO and JCAMP-like text: keys, XYDATA, the numbers",
        lines("TITLE\tscan 1", "XUNITS\tmm", "YUNITS\tum", "NPOINTS\t8", "XYDATA", rows=rows()),
        shows=("x in mm", "height in um"),
    ),
    profile(
        "index-column.csv",
        "pandas, to_csv with its index: a first name that is empty",
        lines(",x [mm],z [um]", rows=[f"{place},{x},{z}" for place, (x, z) in enumerate(ROWS)]),
        shows=("x: x in mm; z: height in um",),
    ),
    profile(
        "descending.txt",
        "a stylus that pulls back: x falls",
        lines("X [mm]\tZ [um]", rows=rows()[::-1]),
    ),
    profile(
        "rounded-steps.txt",
        "a stylus that prints x with three decimals: steps of 1/3 um",
        lines("X [um]\tZ [um]", rows=[f"{place / 3:.3f}\t{z}" for place, z in enumerate(Z)]),
        spacing=(1e-6 / 3,),
        step_within=1e-4,
    ),
    profile(
        "one-column.txt",
        "LabVIEW, write to spreadsheet file: one column of heights",
        lines(rows=[f"{z:.3f}" for z in Z], end="\r\n"),
        options={"unit": "um", "pixel": "125 um"},
        shows=("heights along a line",),
    ),
    profile(
        "two-traces.csv",
        "two profiles beside each other: the first is read, and the other named",
        lines("X [mm];Z1 [um];Z2 [um]", rows=[f"{x};{z};{2 * z}" for x, z in ROWS]),
        shows=("Z1: height in um", "not read: Z2"),
    ),
    profile(
        "comment-lines.dat",
        "gnuplot: comments between the numbers",
        lines("# X [mm]\tZ [um]", rows=["# first half", *rows()[:4], "# second half", *rows()[4:]]),
    ),
    profile(
        "count-and-step-first.txt",
        "old programs: the number of points and the step, and then the names",
        lines("8", "0.125", "X [mm]\tZ [um]", rows=rows()),
    ),
    profile(
        "page-headers.txt",
        "print-outs: the names of the columns again on each page",
        lines("X [mm]\tZ [um]", rows=[*rows()[:4], "X [mm]\tZ [um]", *rows()[4:]]),
    ),
    profile(
        "empty-first-column.csv",
        "Excel, a table that begins in column B, with an empty row below",
        lines(";X [mm];Z [um]", rows=rows(";", before=";"), last=";;\n"),
    ),
    profile(
        "time-column.csv",
        "LabVIEW: a time and a height: the distance between points is given",
        lines("Time [s];Z [um]", rows=[f"{place / 50};{z}" for place, z in enumerate(Z)]),
        options={"pixel": "125 um"},
        shows=("Time: not read; Z: height in um",),
    ),
    profile(
        "counted-points.txt",
        "styluses: number, x and height without names",
        lines(rows=[f"{place} {x} {z}" for place, (x, z) in enumerate(ROWS)]),
        options=MM_UM,
        shows=("column 1: not read; column 2: x in mm; column 3: height in um",),
    ),
    profile(
        "heights-with-pitch.txt",
        "Mitutoyo: results and the pitch above one column of heights",
        lines("Ra\t0.45\tum", "Rz\t2.10\tum", "Data pitch\t125.000\tum", rows=[str(z) for z in Z]),
        options={"unit": "um"},
        shows=("spacing 125 um", "column 1: height in um"),
    ),
    profile(
        "kilo-angstrom.txt",
        "KLA Tencor: heights in kÅ",
        lines("Scan (um)\tHeight (kÅ)", rows=[f"{1000 * x:g}\t{10 * z:g}" for x, z in ROWS]),
        "cp1252",
    ),
    profile(
        "units-french.csv",
        "French reports: millimètre, micromètre",
        lines("Position (millimètre);Hauteur (micromètre)", rows=rows(";", comma)),
        "cp1252",
    ),
    profile(
        "units-squared.txt",
        "Japanese programs: ㎜ and ㎛ as one sign each",
        lines("位置 [㎜]\t高さ [㎛]", rows=rows()),
        "utf-8",
    ),
    profile(
        "korean.txt",
        "Excel with Korean settings: code page 949",
        lines("거리 [mm]\t높이 [㎛]", rows=rows()),
        "cp949",
        shows=("code page 949", "높이: height in µm"),
    ),
    profile(
        "taiwanese.txt",
        "Excel with settings of Taiwan: Big5",
        lines("距離 [mm]\t高度 [μm]", rows=rows()),
        "big5",
        shows=("Big5", "高度: height in µm"),
    ),
    profile(
        "unix-japanese.txt",
        "programs on Unix in Japan: EUC-JP",
        lines("距離 [mm]\t高さ [μm]", rows=rows()),
        "euc_jp",
        shows=("EUC-JP",),
    ),
    profile(
        "russian-koi8.txt",
        "programs on Unix in Russia: KOI8-R",
        lines("Длина [мм];Высота [мкм]", rows=rows(";")),
        "koi8-r",
        shows=("KOI8-R",),
    ),
    profile(
        "russian-dos.txt",
        "programs of MS-DOS in Russia: code page 866",
        lines("Длина [мм];Высота [мкм]", rows=rows(";")),
        "cp866",
        shows=("code page 866",),
    ),
    profile(
        "utf-16-big-endian.txt",
        "Java and Macintosh: UTF-16, big-endian, without a mark",
        lines("X [mm]\tZ [um]", rows=rows()),
        "utf-16-be",
        shows=("UTF-16 without a mark",),
    ),
    profile(
        "names-of-two-lines.csv",
        "Excel, names with a line break inside the cell",
        '"Position\n[mm]";"Height\n[um]"\n' + lines(rows=rows(";")),
        shows=("Position: x in mm; Height: height in um",),
    ),
    profile(
        "units-twice-encoded.txt",
        "UTF-8 that a program read as Latin-1 and wrote as UTF-8",
        lines("X [mm]\tZ [\u00c2\u00b5m]", rows=rows()),
        "utf-8",
    ),
    profile(
        "origin-rows.txt",
        "Origin, ASCII export with long names, a row of units and labels before them",
        lines("Long Name\tDistance\tHeight", "Units\tmm\tum", rows=rows(before="\t")),
        shows=("Distance: x in mm; Height: height in um",),
    ),
    profile(
        "r-table.txt",
        "R, write.table: row numbers without a name",
        lines('"x_mm" "z_um"', rows=[f'"{place}" {x} {z}' for place, (x, z) in enumerate(ROWS, 1)]),
        shows=("number: not read; x: x in mm; z: height in um",),
    ),
    profile(
        "p-w-r.csv",
        "ISO 4287 software: primary, waviness and roughness profiles beside each other",
        lines("X(mm),P(um),W(um),R(um)", rows=[f"{x},{z},0,{z}" for x, z in ROWS]),
        shows=("P: height in um; W: not read; R: not read",),
    ),
    profile(
        "units-of-both.txt",
        "reports: Units: mm, um",
        lines("Units: mm, um", rows=rows(" ")),
        shows=("column 1: x in mm; column 2: height in um",),
    ),
    profile(
        "axis-units.txt",
        "oscilloscope-like exports: one line for the unit of each axis",
        lines("X Axis Unit: mm", "Y Axis Unit: um", "Data:", rows=rows(" ")),
        shows=("column 1: x in mm; column 2: height in um",),
    ),
    profile(
        "all-in-microns.txt",
        "notes above a table: all values in microns",
        lines("All values in microns", rows=[f"{1000 * x} {z}" for x, z in ROWS]),
        shows=("column 1: x in microns; column 2: height in microns",),
    ),
    profile(
        "rounded-to-two-decimals.csv",
        "Excel, x shown with two decimals: 0.12, 0.25, 0.38",
        lines("X [mm];Z [um]", rows=[f"{x:.2f};{z}" for x, z in ROWS]),
        step_within=0.01,
    ),
)
