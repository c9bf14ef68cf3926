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
    # Spreadsheets: encodings, separators, line ends
    profile(
        "excel-german.csv",
        "Excel with German settings, CSV: semicolons, decimal commas, Windows 1252",
        lines("X [mm];Z [µm]", rows=rows(";", comma), end="\r\n"),
        "cp1252",
        shows=("Windows 1252, separated by semicolons, decimal commas", "X: x in mm; Z: height in µm"),
    ),
    profile(
        "excel-us.csv",
        "Excel with US settings, CSV",
        lines("X (mm),Z (um)", rows=rows(","), end="\r\n"),
        shows=("ASCII, separated by commas, decimal points", "X: x in mm; Z: height in um"),
    ),
    profile(
        "excel-unicode.txt",
        "Excel, Unicode text: UTF-16 with a mark, tabs",
        "\ufeff" + lines("X [mm]\tZ [µm]", rows=rows("\t", comma), end="\r\n"),
        "utf-16-le",
        shows=("UTF-16, separated by tabs, decimal commas",),
    ),
    profile(
        "excel-utf8.csv",
        "Excel, CSV UTF-8 (with a mark)",
        lines("X [mm];Z [µm]", rows=rows(";", comma), end="\r\n"),
        "utf-8-sig",
        shows=("UTF-8 with a mark, separated by semicolons",),
    ),
    profile(
        "excel-ms-dos.csv",
        "Excel, CSV (MS-DOS): code page 850",
        lines("Länge [mm];Höhe [µm]", rows=rows(";", comma), end="\r\n"),
        "cp850",
        shows=("code page 850",),
    ),
    profile(
        "excel-ms-dos-us.csv",
        "Excel with US settings, CSV (MS-DOS): code page 437",
        lines("Position [mm],Height [µm]", rows=rows(","), end="\r\n"),
        "cp437",
        shows=("code page 850",),
    ),
    profile(
        "excel-macintosh.csv",
        "Excel, CSV (Macintosh): lines end with CR alone, Mac Roman",
        lines("X [mm],Z [µm]", rows=rows(","), end="\r"),
        "mac-roman",
    ),
    profile(
        "excel-sep.csv",
        "Excel, a first line that declares the separator",
        lines("sep=;", "X [mm];Z [um]", rows=rows(";"), end="\r\n"),
        shows=("separated by semicolons, decimal points",),
    ),
    profile(
        "libreoffice-quoted.csv",
        "LibreOffice Calc, CSV with every text cell quoted",
        lines('"X [mm]","Z [µm]"', rows=[f'"{comma(x)}","{comma(z)}"' for x, z in ROWS]),
        "utf-8",
        shows=("separated by commas, decimal commas",),
    ),
    profile(
        "libreoffice-doubled-quotes.csv",
        "LibreOffice Calc, a quoted header that holds doubled quotes",
        lines('"part ""A"", left";', '"X [mm]";"Z [um]"', rows=rows(";")),
    ),
    profile(
        "excel-japanese.csv",
        "Excel with Japanese settings: Shift JIS",
        lines("距離 [mm],高さ [μm]", rows=rows(","), end="\r\n"),
        "cp932",
        shows=("Shift JIS", "距離: x in mm; 高さ: height in µm"),
    ),
    profile(
        "excel-chinese.txt",
        "Excel with Chinese settings: GB 18030",
        lines("位置[mm]\t高度[μm]", rows=rows("\t"), end="\r\n"),
        "gb18030",
        shows=("GB 18030", "位置: x in mm; 高度: height in µm"),
    ),
    profile(
        "excel-chinese-nm.csv",
        "Excel with Chinese settings, heights in nm: GB 18030 without a sign for micro",
        lines("位置(mm),高度(nm)", rows=[f"{x},{nanometres(z)}" for x, z in ROWS], end="\r\n"),
        "gb18030",
    ),
    profile(
        "excel-japanese-nm.csv",
        "Excel with Japanese settings, heights in nm: Shift JIS without a sign for micro",
        lines("距離(mm),高さ(nm)", rows=[f"{x},{nanometres(z)}" for x, z in ROWS], end="\r\n"),
        "cp932",
    ),
    profile(
        "excel-russian.csv",
        "Excel with Russian settings: Windows 1251, units after a comma",
        lines("Расстояние, мм;Высота, мкм", rows=rows(";", comma), end="\r\n"),
        "cp1251",
        shows=("Windows 1251", "Расстояние: x in mm; Высота: height in um"),
    ),
    profile(
        "excel-czech.csv",
        "Excel with Czech settings: Windows 1250",
        lines("Délka [mm];Výška [µm]", rows=rows(";", comma), end="\r\n"),
        "cp1250",
    ),
    profile(
        "excel-french-groups.csv",
        "Excel with French settings: no-break spaces between thousands, decimal commas",
        lines(
            "Position (mm);Hauteur (nm)",
            rows=[f"{comma(x)};{1000 * z:_.1f}".replace(".", ",").replace("_", "\u202f") for x, z in ROWS],
        ),
        "utf-8",
    ),
    profile(
        "excel-swiss-groups.csv",
        "Excel with Swiss settings: apostrophes between thousands",
        lines("Position [mm];Höhe [nm]", rows=[f"{x};{1000 * z:_.1f}".replace("_", "\u2019") for x, z in ROWS]),
        "utf-8",
    ),
    profile(
        "excel-german-groups.csv",
        "Excel with German settings: points between thousands, decimal commas",
        lines(
            "X [mm];Z [nm]", rows=[f"{comma(x)};{1000 * z:_.1f}".replace(".", ",").replace("_", ".") for x, z in ROWS]
        ),
        shows=("decimal commas",),
    ),
    profile(
        "excel-us-groups.csv",
        "Excel with US settings: quoted numbers with commas between thousands",
        lines("X [mm],Z [nm]", rows=[f'{x},"{1000 * z:,.1f}"' for x, z in ROWS]),
        shows=("decimal points",),
    ),
    profile(
        "excel-minus-sign.txt",
        "numbers copied from a web page or a report: U+2212 as the minus sign",
        lines("X [mm]\tZ [µm]", rows=[row.replace("-", "\u2212") for row in rows("\t")]),
        "utf-8",
    ),
    profile(
        "excel-empty-columns.csv",
        "Excel, CSV with empty columns at the end of each line",
        lines("X [mm];Z [um];;", rows=rows(";", after=";;"), end="\r\n"),
    ),
    profile(
        "numbers-one-line-without-end.txt",
        "an editor: no line end after the last line",
        lines("x (mm) z (um)", rows=rows(" ")).rstrip(),
    ),
    profile(
        "two-editors.txt",
        "a file joined from two systems: LF and CRLF mixed, blank lines",
        "X [mm]\tZ [um]\r\n" + "".join(row + ("\r\n\n" if place % 2 else "\n") for place, row in enumerate(rows("\t"))),
    ),
    profile(
        "dos-end-of-file.txt",
        "programs of MS-DOS: Ctrl-Z after the last line",
        lines("X [mm]\tZ [um]", rows=rows("\t"), end="\r\n", last="\x1a"),
    ),
    # Ways to write numbers
    profile(
        "c-exponents.txt",
        "C, printf with %+.6e",
        lines("X [mm]\tZ [um]", rows=rows("\t", lambda value: f"{value:+.6e}")),
    ),
    profile(
        "fortran-exponents.dat",
        "Fortran, double precision with D",
        lines("! x/mm z/um", rows=rows("  ", lambda value: f"{value:.8E}".replace("E", "D"))),
    ),
    profile(
        "bare-points.txt",
        "BASIC and Fortran: .5 and 5. without the other digits",
        lines("X [mm]\tZ [um]", rows=rows("\t", bare)),
    ),
    profile(
        "aligned-columns.prn",
        "Excel, formatted text (PRN): columns aligned by spaces",
        lines("   X [mm]    Z [um]", rows=[f"{x:9.3f}{z:10.3f}" for x, z in ROWS], end="\r\n"),
    ),
    profile(
        "bars.txt",
        "databases, psql: columns divided by bars",
        lines(" x (mm) | z (um) ", "--------+--------", rows=rows(" | ", before=" ", after=" ")),
        shows=("separated by bars",),
    ),
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
    # Missing points
    *(
        profile(
            f"missing-{name}.txt",
            f"a stylus that lost the surface: {what}",
            lines(*header, rows=[f"{x};{text if place == 3 else z}" for place, (x, z) in enumerate(ROWS)]),
            heights=(*Z[:3], (Z[2] + Z[4]) / 2.0, *Z[4:]),
            options={"missing": "fill"},
            shows=("missing points", "1, filled"),
        )
        for name, what, text, header in (
            ("nan", "NaN", "NaN", ("X [mm];Z [um]",)),
            ("na", "#N/A of Excel", "#N/A", ("X [mm];Z [um]",)),
            ("empty", "an empty cell", "", ("X [mm];Z [um]",)),
            ("bad", "BAD, as in SDF", "BAD", ("X [mm];Z [um]",)),
            ("stars", "stars of Fortran and Zygo", "***", ("X [mm];Z [um]",)),
            ("number", "a number that the header states", "-9999", ("No data: -9999", "X [mm];Z [um]")),
        )
    ),
)
