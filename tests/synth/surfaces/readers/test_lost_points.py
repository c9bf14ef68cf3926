"""Text and arrays in which a point would be lost, or a number taken for another one, without a word."""

from __future__ import annotations

import io
import zipfile
from pathlib import Path

import numpy as np
import pytest

from synth.errors import InvalidRequest
from synth.surfaces.measurement.import_options import read_options
from synth.surfaces.measurement.import_report import ImportedSurface
from synth.surfaces.measurement.importing import import_surface

HEIGHTS = [5.25, -7.667, 1.254, -0.647, -6.06, -0.696, 2.1, 4.4]


def imported(tmp_path: Path, content: str | bytes, name: str = "a.txt", **options: str) -> ImportedSurface:
    path = tmp_path / name
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return import_surface(path, read_options(options))


def column(*cells: object) -> str:
    return "".join(f"{cell}\n" for cell in cells)


def stored(array: object) -> bytes:
    file = io.BytesIO()
    np.save(file, np.asarray(array))
    return file.getvalue()


@pytest.mark.parametrize("mark", ["***", "---", "?", "nan"])
def test_a_mark_above_the_first_height_hides_no_later_one(tmp_path: Path, mark: str) -> None:
    text = column(mark, *HEIGHTS[:3], mark, mark, *HEIGHTS[3:])
    with pytest.raises(InvalidRequest, match="missing"):
        imported(tmp_path, text, unit="um", pixel="125um")
    names = column("Z [um]", *HEIGHTS[:4], "Z [um]", *HEIGHTS[:4], "Z [um]", *HEIGHTS[:3])
    assert len(imported(tmp_path, names, pixel="125um").heights) == 11, "the names again on each page"
    with pytest.raises(InvalidRequest, match="Overrange"):
        imported(tmp_path, column("Overrange", *HEIGHTS, "Overrange", 1), unit="um", pixel="125um")


@pytest.mark.parametrize(
    "text",
    [
        column("Z [um]", *HEIGHTS[:5], "", *HEIGHTS[5:]),  # a cell of a spreadsheet that is empty
        column("Z [um]", HEIGHTS[0], "", *HEIGHTS[1:]),
        column("Z [um]", *HEIGHTS[:5], "Z [um]", *HEIGHTS[:3]),
        column("Z [um]", *("1 2 3 4",) * 5, "", *("1 2 3 4",) * 3),
        column("# Profile 1", *HEIGHTS[:4], "# Profile 2", *HEIGHTS[:4]),
    ],
)
def test_two_blocks_of_any_lengths_are_not_joined(tmp_path: Path, text: str) -> None:
    with pytest.raises(InvalidRequest, match="2 blocks of numbers"):
        imported(tmp_path, text, unit="um", pixel="125um")


def test_empty_lines_after_every_height_and_rows_of_separators_divide_nothing(tmp_path: Path) -> None:
    assert len(imported(tmp_path, "".join(f"{one}\n\n" for one in HEIGHTS), unit="um", pixel="1um").heights) == 8
    grid = column(*("1,2,4,3",) * 3, ",,,", *("1,2,4,3",) * 2)
    assert imported(tmp_path, grid, unit="um", pixel="1um", missing="fill").heights.shape == (6, 4)
    quoted = column("Z [um]", *HEIGHTS[:4], '""', *HEIGHTS[4:])
    assert len(imported(tmp_path, quoted, pixel="1um", missing="fill").heights) == 9


@pytest.mark.parametrize("sizes", ["dx = 0.01\ndy = 0.01", "Pixel size: 0.05", "Width: 0.07\nHeight: 0.1"])
def test_a_distance_without_a_unit_has_not_that_of_the_heights(tmp_path: Path, sizes: str) -> None:
    text = f"{sizes}\nz unit: um\n" + column(*("1\t2\t4\t3\t5",) * 6)
    with pytest.raises(InvalidRequest, match="not that of x"):
        imported(tmp_path, text)
    spacing = imported(tmp_path, text, unit="mm, um").spacing
    assert all(1e-5 <= one <= 1e-4 for one in spacing)


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("columns", [2, 3])
def test_an_array_of_points_is_no_map(tmp_path: Path, columns: int, turned: bool) -> None:
    across, along = (one.ravel() for one in np.meshgrid(np.arange(5.0), np.arange(6.0), indexing="ij"))
    rows = [*[across, along][: columns - 1], np.sin(3.0 * along + across)]
    array = np.stack(rows) if turned else np.stack(rows, axis=1)
    with pytest.raises(InvalidRequest, match="of which one of each is x or y"):
        imported(tmp_path, stored(array), "a.npy", unit="um", pixel="1um")
    for shape in ((20, 2), (3, 50), (2, 10), (5, 3)):
        tilted = np.add.outer(*(0.1 * np.arange(float(count)) for count in shape)) + np.random.default_rng(3).random(
            shape
        )
        assert imported(tmp_path, stored(tilted), "b.npy", unit="um", pixel="1um").heights.shape == shape


@pytest.mark.parametrize("units", ["deg\tum", "mm\tV", "[deg]\t[um]", "mm\t10 nm", "ft\tum"])
def test_a_row_of_units_that_are_no_lengths_is_refused(tmp_path: Path, units: str) -> None:
    rows = "".join(f"{0.1 * n:.1f}\t{z}\n" for n, z in enumerate(HEIGHTS))
    with pytest.raises(InvalidRequest, match="allowed: columns in a unit of length"):
        imported(tmp_path, f"Position\tHeight\n{units}\n{rows}", unit="mm, um")
    timed = imported(tmp_path, f"Time\tHeight\ns\tum\n{rows}", pixel="1um")
    assert timed.heights[0] - timed.heights[1] == pytest.approx(12.917e-6)


def test_a_count_beside_the_distance_of_the_header_is_told(tmp_path: Path) -> None:
    text = "# Pixel size 125 um\n# z unit um\n" + "".join(f"{n}\t{z}\n" for n, z in enumerate(HEIGHTS))
    found = imported(tmp_path, text, unit="um, um")
    assert found.spacing == pytest.approx((1e-6,))
    assert any("the header states steps of 125 um" in note for note in found.report["notes"])


@pytest.mark.parametrize("units", ["mm\tnm", "[mm]\t[nm]", "µm\tpm"])
def test_a_row_of_units_of_length_gives_the_columns_theirs(tmp_path: Path, units: str) -> None:
    rows = "".join(f"{0.5 * n:.1f}\t{z}\n" for n, z in enumerate(HEIGHTS))
    found = imported(tmp_path, f"X\tZ\n{units}\n{rows}")
    assert found.heights[0] - found.heights[1] == pytest.approx(12.917e-12 if "pm" in units else 12.917e-9)


def test_a_count_with_a_gap_is_refused_and_one_that_falls_is_turned(tmp_path: Path) -> None:
    counted = list(enumerate(HEIGHTS, 1))
    for name, kept in (("No.", [*counted[:3], *counted[5:]]), ("Time [s]", [*counted[:4], (12, 1.0)])):
        text = f"{name},z [um]\n" + "".join(f"{n},{z}\n" for n, z in kept)
        with pytest.raises(InvalidRequest, match="unequal steps"):
            imported(tmp_path, text, pixel="1um")
    falls = "No.,z [um]\n" + "".join(f"{n},{z}\n" for n, z in reversed(counted))
    found = imported(tmp_path, falls, pixel="1um").heights
    assert found[0] - found[1] == pytest.approx(1e-6 * (HEIGHTS[0] - HEIGHTS[1]))


@pytest.mark.parametrize(
    "names", ["x [mm],scan1,scan2,scan3", "Position,Trace A,Trace B,Trace C", "x [mm],scan1,scan2"]
)
def test_a_named_x_beside_several_traces_is_no_grid(tmp_path: Path, names: str) -> None:
    others = names.count(",") - 1
    text = f"{names}\n" + "".join(f"{0.1 * n:.1f},{z}{',0.5' * others}\n" for n, z in enumerate(HEIGHTS))
    found = imported(tmp_path, text, unit="mm, um")
    assert found.heights.shape == (8,) and found.spacing == pytest.approx((1e-4,))
    assert any("were not read" in note for note in found.report["notes"])


@pytest.mark.parametrize("line", ["Sample: grating, Pitch: 800 um", "Nominal pitch of the standard: 800 um"])
def test_the_pitch_of_a_specimen_is_not_the_distance_between_points(tmp_path: Path, line: str) -> None:
    with pytest.raises(InvalidRequest, match="pixel"):
        imported(tmp_path, f"{line}\nz [um]\n" + column(*HEIGHTS))


@pytest.mark.parametrize("clock", ["", "Time\t10:11:12.1234567890\t10:11:12.1234567890\n"])
@pytest.mark.parametrize("has_x", [True, False])
def test_a_file_of_labview(tmp_path: Path, clock: str, has_x: bool) -> None:
    head = "LabVIEW Measurement\t\nSeparator\tTab\nDecimal_Separator\t.\n***End_of_Header***\t\t\n\t\n"
    head += f"Channels\t1\t\nSamples\t8\t\nDate\t2026/11/02\t\n{clock}Y_Unit_Label\tum\t\nX_Dimension\tLength\t\n"
    head += "X0\t0.0000000000000000E+0\t\nDelta_X\t0.125000\t\n***End_of_Header***\t\t\nX_Value\tUntitled\tComment\n"
    rows = "".join(f"{0.125 * n if has_x else ''}\t{z}\t\n" for n, z in enumerate(HEIGHTS))
    found = imported(tmp_path, head + rows, unit="mm, um")
    assert found.spacing == pytest.approx((125e-6,))
    assert found.heights[0] - found.heights[1] == pytest.approx(12.917e-6)


def test_a_factor_of_one_between_steps_and_nanometres_is_none(tmp_path: Path) -> None:
    text = "# Bit2nm = {}\n# z-unit = nm\n" + column(*HEIGHTS)
    assert len(imported(tmp_path, text.format("1.0"), pixel="1um").heights) == 8
    with pytest.raises(InvalidRequest, match="a factor"):
        imported(tmp_path, text.format("0.5"), pixel="1um")


def test_a_record_of_a_profile_and_a_spreadsheet_are_named(tmp_path: Path) -> None:
    with pytest.raises(InvalidRequest, match=r"\(PRF\)"):
        imported(tmp_path, "1 2\r\nPRF   0  profile\r\nEOR\r\n" + column(*HEIGHTS), "a.prf", unit="um")
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w") as file:
        file.writestr("[Content_Types].xml", "<Types/>")
        file.writestr("xl/workbook.xml", "<workbook/>")
    with pytest.raises(InvalidRequest, match="Save the sheet with the heights as CSV"):
        imported(tmp_path, packed.getvalue(), "a.xlsx", unit="um")


@pytest.mark.parametrize("has_x", [True, False])
def test_a_file_of_labview_over_time_asks_for_the_distance(tmp_path: Path, has_x: bool) -> None:
    head = "LabVIEW Measurement\t\n***End_of_Header***\t\t\nX_Dimension\tTime\tTime\t\nX0\t0.0000000000000000E+0\t\n"
    head += "Delta_X\t0.005\t\n***End_of_Header***\t\t\nX_Value\tHeight\tComment\n"
    text = head + "".join(f"{0.005 * n if has_x else ''}\t{z}\t\n" for n, z in enumerate(HEIGHTS))
    with pytest.raises(InvalidRequest, match="pixel"):
        imported(tmp_path, text, unit="um")
    assert imported(tmp_path, text, unit="um", pixel="5um").spacing == pytest.approx((5e-6,))


def test_the_first_of_several_channels_without_x_is_read(tmp_path: Path) -> None:
    rows = "".join(f"\t{n}\t{z}\n" for n, z in enumerate(HEIGHTS))
    found = imported(tmp_path, f"X_Value\tUntitled\tUntitled 1\n{rows}", unit="um", pixel="5um")
    assert np.ptp(found.heights) == pytest.approx(7e-6)
    assert any("Untitled 1" in note for note in found.report["notes"])


def test_a_column_of_a_grid_that_is_all_missing_is_filled(tmp_path: Path) -> None:
    text = "c1,c2,c3,c4,c5,c6\n" + ",0.5,3.5,1.5,2.5,4\n,1.5,2.5,0.5,3.5,2\n" * 3
    assert imported(tmp_path, text, unit="um", pixel="5um", missing="fill").heights.shape == (6, 6)


@pytest.mark.parametrize("names", ["x [mm];Force;Deviation", "Distance;Distance 2;Signal"])
def test_columns_of_different_things_beside_x_are_not_told_apart(tmp_path: Path, names: str) -> None:
    text = f"{names}\n" + "".join(f"{0.1 * n:.1f};{z};{0.3 * z * z:.3f}\n" for n, z in enumerate(HEIGHTS))
    with pytest.raises(InvalidRequest):
        imported(tmp_path, text, unit="mm, um")


@pytest.mark.parametrize(
    "line", ["Nominal pitch: 5 um", "// Pitch: 5 um", "Range 8 mm, Pitch 5 um", "The pitch is 5 um"]
)
def test_a_pitch_is_the_distance_between_points(tmp_path: Path, line: str) -> None:
    assert imported(tmp_path, f"{line}\nZ [um]\n{column(*HEIGHTS)}").spacing == pytest.approx((5e-6,))


def test_rows_that_an_empty_line_or_a_comment_divides(tmp_path: Path) -> None:
    axes = ";0;5;10;15\n\n" + "".join(f"{5 * n};1;{n};4;2\n" for n in range(6))
    assert imported(tmp_path, axes, unit="um").heights.shape == (6, 4)
    for text in (column(*("1,2,4,3",) * 6, "", ",,,"), column(*("1,2,4,3",) * 3, "# half", *("1,2,4,3",) * 3)):
        assert imported(tmp_path, text, unit="um", pixel="5um").heights.shape == (6, 4)


@pytest.mark.timeout(20)
@pytest.mark.parametrize("line", ["#" * 1000 + "\n", f"40\n{'-' * 100_000} z\n", f"40\n{'scale ' * 20_000}z\n"])
def test_a_long_line_above_the_numbers_is_read_within_seconds(tmp_path: Path, line: str) -> None:
    text = line * (100 if line[0] == "#" else 1) + "".join(f"{0.1 * n:.1f} {z}\n" for n, z in enumerate(HEIGHTS * 8))
    try:
        imported(tmp_path, text, unit="mm, um")
    except InvalidRequest:
        return
