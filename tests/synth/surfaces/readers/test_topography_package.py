"""Formats of instruments: what is imported equals what the package SurfaceTopography itself finds in the file."""

from __future__ import annotations

import struct
import sys
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from synth.errors import CannotRender, InvalidRequest
from synth.surfaces.measurement.import_options import ImportOptions, read_options
from synth.surfaces.measurement.importing import import_surface
from synth.surfaces.readers.file_formats import read_surface_file
from tests.synth.surfaces.readers.bad_files import zip_of
from tests.synth.surfaces.readers.package_comparison import values_of_import, values_of_package, worst_difference

GRID = np.random.default_rng(5).normal(size=(12, 17))  # rows along y


@pytest.mark.parametrize(
    ("name", "begin", "what"),
    [
        ("scan.dat", b"DIGITAL SURF", "a SUR file of Digital Surf"),
        ("scan.qep", zip_of("Kontur1.prf", b"1"), "a file of Mahr"),
        ("scan.zip", zip_of("main.xml", b"<a/>"), "a packed file"),
        ("scan.bin", b"\x01\0Directory", "an OPD file of Wyko"),
        ("scan.nc", b"CDF\x01", "NetCDF"),
        ("scan.000", b"\\*File list\r\n", "Bruker"),
        ("scan.h5", b"\x89HDF\r\n\x1a\n", "HDF5"),
    ],
)
def test_without_the_package_the_message_says_what_the_file_is_and_what_to_install(
    name: str, begin: bytes, what: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "SurfaceTopography.IO", None)
    path = tmp_path / name
    path.write_bytes(begin if begin.startswith(b"PK") else begin + bytes(600))
    with pytest.raises(CannotRender, match=r"pip install 'ridgewave\[surfaces\]'") as refused:
        read_surface_file(path)
    assert what in refused.value.reason


@pytest.mark.parametrize(
    ("name", "content", "what"),
    [
        ("scan.any", b"\x76\x2f\x31\x01" + bytes(600), "OpenEXR"),
        ("scan.any", bytes(range(256)) * 3, "no known format"),
        ("scan", bytes(600), "no known format"),
        ("scan.x3p", bytes(range(256)) * 3, "no known format"),
        ("maps.zip", zip_of("map.png", b"1"), "a ZIP file without maps"),
        ("scan.x3p", zip_of("main.xml", b"<a/>")[:-30], "an X3P file .*, damaged"),
    ],
)
def test_without_the_package_a_file_that_nothing_reads_is_named(
    name: str, content: bytes, what: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "SurfaceTopography.IO", None)
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(InvalidRequest, match=what):
        read_surface_file(path)


def _netcdf(path: Path, package: Any) -> None:
    package.Topography(GRID.T.copy(), (34.0, 24.0), unit="µm").to_netcdf(str(path))


def _netcdf_line(path: Path, package: Any) -> None:
    package.UniformLineScan(GRID[0].copy(), 34.0, unit="nm").to_netcdf(str(path))


def _matlab(path: Path, _package: Any) -> None:
    from scipy.io import savemat

    savemat(path, {"heights": GRID})


def _hdf5(path: Path, _package: Any) -> None:
    import h5py

    with h5py.File(path, "w") as file:
        file["heights"] = GRID


def _text(path: Path, _package: Any) -> None:
    header = "# Channel: Topo\n# Width: 34 µm\n# Height: 24 µm\n# Value units: nm\n"
    path.write_text(header + "\n".join(" ".join(map(repr, row)) for row in GRID.tolist()))


def _triples(path: Path, _package: Any) -> None:
    y, x = np.mgrid[:12, :17]
    np.savetxt(path, np.column_stack([x.ravel() * 0.5, y.ravel() * 0.25, GRID.ravel()]))


def _npy(path: Path, _package: Any) -> None:
    np.save(path, GRID)


def _sdf(path: Path, _package: Any) -> None:
    """ISO 25178-71, as text; heights are whole numbers times Zscale, in m."""
    fields = "NumPoints = 17\nNumProfiles = 12\nXscale = 2e-6\nYscale = 3e-6\nZscale = 1e-9\nZresolution = -1\n"
    head = f"aISO-1.0\nManufacID = made here\nCreateDate = 251120261000\nModDate = 251120261000\n{fields}"
    rows = "\n".join(" ".join(map(str, row)) for row in np.rint(1000.0 * GRID).astype(int).tolist())
    path.write_text(f"{head}Compression = 0\nDataType = 5\nCheckType = 0\n*\n{rows}\n*\n")


def _gwyddion(path: Path, _package: Any) -> None:
    """A container with one data field: a component is its name, the letter of its type, and its value."""

    def item(name: str, kind: str, value: bytes) -> bytes:
        return name.encode() + b"\0" + kind.encode() + value

    def named(name: str, parts: bytes) -> bytes:
        return name.encode() + b"\0" + struct.pack("<I", len(parts)) + parts

    sizes = {"xres": ("i", 17), "yres": ("i", 12), "xreal": ("d", 34e-6), "yreal": ("d", 24e-6)}
    field = b"".join(item(name, kind, struct.pack(f"<{kind}", value)) for name, (kind, value) in sizes.items())
    for name in ("si_unit_xy", "si_unit_z"):
        field += item(name, "o", named("GwySIUnit", item("unitstr", "s", b"m\0")))
    field += item("data", "D", struct.pack("<I", GRID.size) + (1e-9 * GRID).tobytes())
    parts = item("/0/data", "o", named("GwyDataField", field)) + item("/0/data/title", "s", b"Height\0")
    path.write_bytes(b"GWYP" + named("GwyContainer", parts))


def _bcr(path: Path, _package: Any) -> None:
    """A header of text, 2048 bytes long, and whole numbers of 16 bits times bit2nm."""
    sizes = "xpixels = 17\nypixels = 12\nxlength = 34000\nylength = 24000\n"
    head = f"fileformat = bcrstm\nheadersize = 2048\n{sizes}intelmode = 1\nbit2nm = 0.25\n"
    path.write_bytes(head.encode().ljust(2048) + np.rint(1000.0 * GRID).astype("<i2").tobytes())


def _sur(path: Path, _package: Any, unit: str = "nm") -> None:
    """A header of 512 bytes, and whole numbers of 32 bits times a scale."""
    head = bytearray(512)
    for place, form, values in (
        (0, "12s", [b"DIGITAL SURF"]),
        (98, "H", [32]),  # bits of a number
        (108, "2iI3f", [17, 12, GRID.size, 2000.0, 2000.0, 1e-3]),  # points, steps of x and y, scale of the numbers
        (180, "16s" * 6, [unit.encode()] * 6),
        (276, "3f", [1.0] * 3),
        (312, "3H", [25, 11, 2026]),
    ):
        struct.pack_into(f"<{form}", head, place, *values)
    path.write_bytes(bytes(head) + np.rint(1000.0 * GRID).astype("<i4").tobytes())


CASES: dict[str, tuple[Any, dict[str, Any]]] = {
    "scan.nc": (_netcdf, {}),
    "line.nc": (_netcdf_line, {}),
    "scan.mat": (_matlab, {"unit": "um", "pixel": "5 um"}),
    "scan.h5": (_hdf5, {"unit": "um", "pixel": "7 um"}),
    "scan.asc": (_text, {}),
    "scan.xyz": (_triples, {"unit": "um"}),
    "scan.npy": (_npy, {"unit": "nm", "pixel": "1 um"}),
    "scan.sdf": (_sdf, {}),
    "scan.gwy": (_gwyddion, {}),
    "scan.bcr": (_bcr, {}),
    "scan.sur": (_sur, {}),
}


@pytest.mark.filterwarnings("ignore::DeprecationWarning")  # inside the package
@pytest.mark.parametrize("name", CASES)
def test_sizes_and_roughness_are_those_of_the_package(tmp_path: Path, name: str) -> None:
    package = pytest.importorskip("SurfaceTopography", reason="needs the extra surfaces")
    write, given = CASES[name]
    path = tmp_path / name
    write(path, package)
    options = read_options(given)
    ours, theirs = values_of_import(path, options), values_of_package(path, options)
    # the package takes the first index of an array for x, and an image or a table has rows
    if name in ("scan.npy", "scan.mat", "scan.h5"):
        theirs["points"], theirs["size"] = theirs["points"][::-1], theirs["size"][::-1]
    assert worst_difference(ours, theirs) < 1e-9


@pytest.mark.parametrize("name", ["scan.mat", "scan.h5"])
def test_matrices_have_rows_along_y_as_in_npy(tmp_path: Path, name: str) -> None:
    pytest.importorskip("SurfaceTopography", reason="needs the extra surfaces")
    CASES[name][0](tmp_path / name, None)
    found = import_surface(tmp_path / name, read_options({"unit": "um", "pixel": "3 um, 8 um"}))
    np.testing.assert_allclose(found.heights, 1e-6 * (GRID - GRID.mean()), atol=1e-15)


@pytest.mark.parametrize("attribute", [{"units": "nm"}, {"scale_factor": 0.25}, {"_FillValue": 1.0}])
def test_attributes_that_change_the_numbers_of_hdf5_are_refused(tmp_path: Path, attribute: dict[str, Any]) -> None:
    pytest.importorskip("SurfaceTopography", reason="needs the extra surfaces")
    import h5py

    with h5py.File(tmp_path / "scan.h5", "w") as file:
        file.create_dataset("z", data=GRID).attrs.update(attribute)
    with pytest.raises(InvalidRequest, match=next(iter(attribute))):
        import_surface(tmp_path / "scan.h5", read_options({"unit": "um", "pixel": "3 um"}))


def test_netcdf_of_other_programs_with_units_is_refused(tmp_path: Path) -> None:
    pytest.importorskip("SurfaceTopography", reason="needs the extra surfaces")
    from scipy.io import netcdf_file

    with netcdf_file(tmp_path / "dem.nc", "w") as file:
        file.createDimension("x", 17)
        file.createDimension("y", 12)
        heights = file.createVariable("heights", "f8", ("y", "x"))
        heights[:] = GRID
        heights.units = "metre"
    with pytest.raises(InvalidRequest, match="metre"):
        import_surface(tmp_path / "dem.nc", read_options({"unit": "um", "pixel": "3 um"}))


def test_the_older_sdf_is_read_with_its_factor(tmp_path: Path) -> None:
    pytest.importorskip("SurfaceTopography", reason="needs the extra surfaces")
    _sdf(tmp_path / "new.sdf", None)
    text = (tmp_path / "new.sdf").read_text()
    (tmp_path / "old.sdf").write_text(text.replace("aISO-1.0", "aBCR-1.0"))
    new, old = (import_surface(tmp_path / name, ImportOptions()) for name in ("new.sdf", "old.sdf"))
    assert np.array_equal(new.heights, old.heights) and new.spacing == old.spacing


def test_units_of_the_file_are_kept_and_not_replaced(tmp_path: Path) -> None:
    package = pytest.importorskip("SurfaceTopography", reason="needs the extra surfaces")
    path = tmp_path / "scan.nc"
    _netcdf(path, package)
    report = import_surface(path, ImportOptions()).report
    assert report["unit"] == "µm" and report["unit_stated_by_file"]
    with pytest.raises(InvalidRequest) as refused:
        import_surface(path, read_options({"unit": "nm", "pixel": "1 um"}))
    assert {fault.pointer for fault in refused.value.faults} == {"/unit", "/pixel"}


@pytest.mark.parametrize(("stated", "read"), [("µm", "µm"), ("V", None)])
def test_a_unit_in_the_wrong_encoding_is_read_and_another_one_refused(
    tmp_path: Path, stated: str, read: str | None
) -> None:
    package = pytest.importorskip("SurfaceTopography", reason="needs the extra surfaces")
    path = tmp_path / "scan.sur"
    _sur(path, package, stated)
    if read:
        assert import_surface(path, ImportOptions()).report["unit"] == read
        return
    with pytest.raises(InvalidRequest, match="heights in V"):
        import_surface(path, ImportOptions())


def test_a_file_without_a_channel_says_so(tmp_path: Path) -> None:
    pytest.importorskip("SurfaceTopography", reason="needs the extra surfaces")
    path = tmp_path / "empty.gwy"
    path.write_bytes(b"GWYPGwyContainer\0" + bytes(4))
    with pytest.raises(InvalidRequest, match="got no channel"):
        import_surface(path, ImportOptions())


def _x3p(path: Path, feature: str) -> None:
    """A whole file of ISO 25178-72: the features are SUR, an area, and PRF, a profile."""
    step = "<AxisType>I</AxisType><DataType>D</DataType><Increment>1e-6</Increment>"
    axes = f"<CX>{step}</CX><CY>{step}</CY><CZ><AxisType>A</AxisType><DataType>D</DataType></CZ>"
    sizes = "<SizeX>17</SizeX><SizeY>12</SizeY><SizeZ>1</SizeZ>"
    first = f"<Revision>ISO5436 - 2000</Revision><FeatureType>{feature}</FeatureType><Axes>{axes}</Axes>"
    third = f"<MatrixDimension>{sizes}</MatrixDimension><DataLink><PointDataLink>data.bin</PointDataLink></DataLink>"
    with zipfile.ZipFile(path, "w") as packed:
        packed.writestr("main.xml", f"<ISO5436_2><Record1>{first}</Record1><Record3>{third}</Record3></ISO5436_2>")
        packed.writestr("data.bin", (1e-6 * GRID).tobytes())


def test_a_whole_file_of_a_kind_that_is_not_read_says_what_to_export(tmp_path: Path) -> None:
    pytest.importorskip("SurfaceTopography", reason="needs the extra surfaces")
    path = tmp_path / "scan.x3p"
    _x3p(path, "SUR")
    heights = import_surface(path, ImportOptions()).heights
    np.testing.assert_allclose(heights, 1e-6 * (GRID - GRID.mean()), atol=1e-18)
    _x3p(path, "PRF")
    with pytest.raises(InvalidRequest, match="If it is whole, export it as text"):
        import_surface(path, ImportOptions())


def test_an_ending_that_the_package_does_not_know_is_refused(tmp_path: Path) -> None:
    pytest.importorskip("SurfaceTopography", reason="needs the extra surfaces")
    path = tmp_path / "scan.docx"
    path.write_bytes(b"\0some words" * 100)
    with pytest.raises(InvalidRequest, match="no known format"):
        read_surface_file(path)
