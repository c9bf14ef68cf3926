"""Profiles as spreadsheets and editors write them: encodings, separators, line ends, groups of thousands."""

from __future__ import annotations

from tests.synth.surfaces.readers.usual_files import UsualFile
from tests.synth.surfaces.readers.usual_profiles import ROWS, comma, lines, nanometres, profile, rows

SPREADSHEETS: tuple[UsualFile, ...] = (
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
        "excel-polish.csv",
        "Excel with Polish settings: Windows 1250, whose letters are signs of Windows 1252",
        lines("Długość (mm);Wysokość (µm)", rows=rows(";", comma), end="\r\n"),
        "cp1250",
        shows=("Windows 1250", "Długość: x in mm; Wysokość: height in µm"),
    ),
    profile(
        "excel-greek.csv",
        "Excel with Greek settings: Windows 1253",
        lines("Θέση (mm);Ύψος (µm)", rows=rows(";", comma), end="\r\n"),
        "cp1253",
        shows=("Windows 1253", "Θέση: x in mm; Ύψος: height in µm"),
    ),
    profile(
        "excel-italian-words.csv",
        "Excel with Italian settings: units as words",
        lines("Posizione (millimetri);Quota (micrometri)", rows=rows(";", comma), end="\r\n"),
        "utf-8",
        shows=("Posizione: x in mm; Quota: height in um",),
    ),
    profile(
        "excel-russian-words.csv",
        "Excel with Russian settings: units as words after a comma",
        lines("Расстояние, миллиметры;Высота, микроны", rows=rows(";", comma), end="\r\n"),
        "cp1251",
        shows=("Windows 1251", "Расстояние: x in mm; Высота: height in um"),
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
)
