"""Numbers and missing points as programs write them, in profiles of the same eight points."""

from __future__ import annotations

from tests.synth.surfaces.readers.usual_files import UsualFile, X, Z
from tests.synth.surfaces.readers.usual_profiles import ROWS, bare, comma, lines, profile, rows


def grouped(mark: str, decimal: str) -> list[str]:
    """Return rows with heights in nm, with `mark` between their thousands."""
    numbers = [f"{1000 * z:_.1f}".replace(".", decimal).replace("_", mark) for z in Z]
    return [f"{str(x).replace('.', decimal)};{number}" for x, number in zip(X, numbers, strict=True)]


NUMBERS: tuple[UsualFile, ...] = (
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
    profile(
        "groups-no-break-space.csv",
        "Excel with Polish settings, Windows 1250: no-break spaces between thousands",
        lines("X [mm];Z [nm]", rows=grouped("\u00a0", ",")),
        "cp1250",
    ),
    profile(
        "groups-space.csv",
        "reports by DIN 1333: spaces between thousands",
        lines("X [mm];Z [nm]", rows=grouped(" ", ",")),
    ),
    profile(
        "groups-swiss-ansi.csv",
        "Excel with Swiss settings, Windows 1252: a right quotation mark between thousands",
        lines("X [mm];Z [nm]", rows=grouped("\u2019", ".")),
        "cp1252",
    ),
    profile(
        "minus-en-dash.txt",
        "word processors, Windows 1252: an en dash as the minus sign",
        lines("X [mm]\tZ [um]", rows=[row.replace("-", "\u2013") for row in rows()]),
        "cp1252",
    ),
    profile(
        "numbers-as-texts.csv",
        'web tables that keep numbers as texts of Excel: ="1.5"',
        lines("X [mm];Z [um]", rows=[f'="{x}";="{z}"' for x, z in ROWS]),
    ),
    profile(
        "one-column-comma.csv",
        "Excel with German settings, one column: decimal commas below one name",
        lines("Höhe [µm]", rows=[comma(z) for z in Z]),
        "cp1252",
        options={"pixel": "125 um"},
        shows=("decimal commas",),
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
    profile(
        "missing-unstated.txt",
        "a program that writes -9999 and does not say so: read, with a note",
        lines("X [m];Z [m]", rows=[f"{x};{-9999 if place == 3 else z}" for place, (x, z) in enumerate(ROWS)]),
        heights=[1e6 * value for value in (*Z[:3], -9999.0, *Z[4:])],
        spacing=(0.125,),
        shows=("far from all others",),
    ),
)
