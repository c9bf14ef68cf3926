"""Text in the forms that spreadsheets and styluses write: the same profile, in m, from each of them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from synth.errors import InvalidRequest
from synth.surfaces.measurement.import_options import read_options
from synth.surfaces.measurement.importing import import_surface

X = [0.0, 0.125, 0.25, 0.375, 0.5]  # mm
Z = [1.5, -2.25, 0.5, 3.75, -1.0]  # um
ROWS = list(zip(X, Z, strict=True))


def table(header: str, separator: str, comma: bool = False, line: str = "\n") -> str:
    rows = [f"{x}{separator}{z}".replace(".", "," if comma else ".") for x, z in ROWS]
    return line.join([header, *rows]) + line


FORMS = {
    "brackets": table("X [mm]\tZ [um]", "\t"),
    "parentheses": table("x (mm), z (µm)", ", "),
    "stroke": table("Length/mm;Height/nm", ";").replace("/nm", "/µm"),
    "row of units": table("Lateral;Total Profile\nmm;µm", ";", comma=True),
    "keys": table("# x_unit: mm\n# z_unit: um", " "),
    "sep": table("sep=;\nX [mm];Z [um]", ";", comma=True),
    "quoted": "X [mm],Z [um]\n" + "".join(f'"{x}","{z}"\n'.replace(".", ",") for x, z in ROWS),
    "carriage returns": table("X [mm]\tZ [um]", "\t", line="\r"),
    "empty columns": table("X [mm],Z [um],,", ",").replace("\n", ",,\n").replace(",,,,", ",,"),
    "decreasing": table("X [mm]\tZ [um]", "\t").splitlines()[0] + "\n" + "".join(f"{x}\t{z}\n" for x, z in ROWS[::-1]),
    "index": "No.;X [mm];Z [um]\n" + "".join(f"{n};{x};{z}\n" for n, (x, z) in enumerate(ROWS)),
    "exponents": "X [mm]\tZ [um]\n" + "".join(f"{x:+.6E}\t{z:+.6E}\n".replace("E", "D") for x, z in ROWS),
    "footer": table("X [mm]\tZ [um]", "\t") + "EOF\n",
}


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "utf-16-le", "utf-16-be", "cp1252"])
@pytest.mark.parametrize("form", FORMS)
def test_x_in_mm_and_heights_in_um(tmp_path: Path, form: str, encoding: str) -> None:
    path = tmp_path / "scan.any"
    path.write_bytes(FORMS[form].encode(encoding))
    found = import_surface(path, read_options({}))
    np.testing.assert_allclose(found.spacing, [125e-6], rtol=1e-9)
    np.testing.assert_allclose(found.heights, (np.array(Z) - np.mean(Z)) * 1e-6, rtol=1e-9)
    assert (found.report["unit_of_x"], found.report["unit"] in ("um", "µm")) == ("mm", True)


def test_two_units_are_given_apart_and_do_not_contradict_the_file(tmp_path: Path) -> None:
    path = tmp_path / "scan.txt"
    path.write_text("".join(f"{x} {z}\n" for x, z in ROWS))
    found = import_surface(path, read_options({"unit": "mm, um"}))
    assert found.report["size"] == pytest.approx([5 * 125e-6]) and found.report["peak_to_valley"] == pytest.approx(6e-6)
    path.write_text(FORMS["brackets"])
    with pytest.raises(InvalidRequest, match="the file states it"):
        import_surface(path, read_options({"unit": "um, um"}))


def test_one_map_is_the_same_surface_from_each_form_that_states_y(tmp_path: Path) -> None:
    rows = ((1.0, 4.0, 2.0, 7.0), (3.0, 0.0, 5.0, 6.0), (8.0, 2.5, 9.0, 1.5))  # um; the first has the least y
    x, y = (0, 10, 20, 30), (0, 20, 40)
    up = [" ".join(map(str, row)) for row in rows]
    down = up[::-1]
    beside = [f"{place} {row}" for place, row in zip(y, up, strict=True)]
    forms = {
        "xyz": "x (um) y (um) z (um)\n" + "\n".join(f"{x[c]} {y[r]} {rows[r][c]}" for c in range(4) for r in (2, 0, 1)),
        "surfer": "DSAA\n4 3\n0 30\n0 40\n0 9\n" + "\n".join(up),
        "esri": "ncols 4\nnrows 3\nxllcorner 0\nyllcorner 0\ndx 10\ndy 20\n" + "\n".join(down),
        "y rises": "y/x 0 10 20 30\n" + "\n".join(beside),
        "y falls": "y/x 0 10 20 30\n" + "\n".join(beside[::-1]),
    }
    for form, text in forms.items():
        path = tmp_path / "map.asc"
        path.write_text(text + "\n")
        found = import_surface(path, read_options({} if form == "xyz" else {"unit": "um"}))
        np.testing.assert_allclose(found.heights, 1e-6 * (np.array(rows) - np.mean(rows)), atol=1e-15, err_msg=form)
        np.testing.assert_allclose(found.spacing, (10e-6, 20e-6), err_msg=form)


def test_unequal_steps_are_refused_until_a_step_is_given(tmp_path: Path) -> None:
    path = tmp_path / "scan.txt"
    path.write_text("X [um] Z [um]\n0 0\n1 2\n2.3 4.6\n4.1 8.2\n6 12\n")
    with pytest.raises(InvalidRequest, match="resample"):
        import_surface(path, read_options({}))
    found = import_surface(path, read_options({"resample": "0.5 um"}))
    np.testing.assert_allclose(np.diff(found.heights), 1e-6, rtol=1e-9)
    assert any("Resampled linearly" in note for note in found.report["notes"])


def test_steps_that_are_printed_with_few_decimals_are_equal(tmp_path: Path) -> None:
    path = tmp_path / "scan.txt"
    path.write_text("".join(f"{9.957126e-5 * n:.6f} {n % 7}\n" for n in range(101)))
    found = import_surface(path, read_options({"unit": "mm, nm"}))
    np.testing.assert_allclose(found.spacing, [9.957126e-8], rtol=1e-4)


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (b"solid part\nfacet normal 0 0 1\n", "STL"),
        (b"v 0 0 0\nv 1 0 0\nf 1 2 3\n", "OBJ"),
        (b"ply\nformat ascii 1.0\n", "PLY"),
        (b"\x76\x2f\x31\x01" + bytes(60), "OpenEXR"),
        (b"RIFF\x24\0\0\0WAVEfmt " + bytes(40), "WAV"),
        (b"%PDF-1.7\n", "PDF"),
        (b"\x1f\x8b\x08" + bytes(60), "gzip"),
    ],
)
def test_a_file_that_is_not_read_is_named(tmp_path: Path, content: bytes, says: str) -> None:
    path = tmp_path / "scan.dat"
    path.write_bytes(content)
    with pytest.raises(InvalidRequest, match=says):
        import_surface(path, read_options({}))
