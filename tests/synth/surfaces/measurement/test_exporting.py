"""Export: SurfaceTopography and the import itself read the X3P and NPY files back, bit for bit."""

from __future__ import annotations

import hashlib
import io
import zipfile
from pathlib import Path

import numpy as np
import pytest

from synth.errors import InvalidRequest
from synth.surfaces.measurement.exporting import exported, format_of_ending, npy_file, x3p_file
from synth.surfaces.measurement.import_options import ImportOptions, read_options
from synth.surfaces.measurement.importing import import_surface
from synth.surfaces.surface_data import SurfaceData

RNG = np.random.default_rng(9)
AREA = SurfaceData(RNG.normal(size=(11, 17)).astype(np.float32) * 1e-6, (5e-6, 7e-6))
LINE = SurfaceData(RNG.normal(size=23).astype(np.float32) * 1e-6, (5e-6,))


@pytest.mark.parametrize("surface", [AREA, LINE], ids=["area", "line"])
def test_the_package_reads_an_x3p_back(tmp_path: Path, surface: SurfaceData) -> None:
    io_of_package = pytest.importorskip("SurfaceTopography.IO", reason="needs the extra surfaces")
    path = tmp_path / "out.x3p"
    path.write_bytes(x3p_file(surface))
    found = io_of_package.read_topography(str(path))
    np.testing.assert_array_equal(found.heights().T, np.atleast_2d(surface.heights))
    rows, columns = np.atleast_2d(surface.heights).shape
    steps = surface.spacing[0], surface.spacing[-1]
    np.testing.assert_allclose(found.physical_sizes, (columns * steps[0], rows * steps[1]), rtol=1e-12)
    assert found.unit == "m" and not found.has_undefined_data


@pytest.mark.parametrize("surface", [AREA, LINE], ids=["area", "line"])
def test_an_export_is_imported_to_the_same_heights(tmp_path: Path, surface: SurfaceData) -> None:
    pytest.importorskip("SurfaceTopography", reason="needs the extra surfaces")
    path = tmp_path / "out.x3p"
    path.write_bytes(x3p_file(surface))
    found = import_surface(path, ImportOptions())
    np.testing.assert_allclose(found.spacing, surface.spacing, rtol=1e-12)
    np.testing.assert_allclose(found.heights, surface.heights - surface.heights.mean(dtype=float), atol=1e-13)


def test_an_npy_holds_the_heights_in_metres(tmp_path: Path) -> None:
    path = tmp_path / "out.npy"
    path.write_bytes(npy_file(AREA))
    np.testing.assert_array_equal(np.load(path), AREA.heights)
    found = import_surface(path, read_options({"unit": "m", "pixel": "5 um, 7 um"}))
    assert found.spacing == AREA.spacing


def test_the_sums_of_an_x3p_are_those_of_its_contents_and_its_bytes_do_not_change() -> None:
    content = x3p_file(AREA)
    assert content == x3p_file(AREA) == exported(AREA, "x3p")
    with zipfile.ZipFile(io.BytesIO(content)) as packed:
        main, heights = packed.read("main.xml"), packed.read("bindata/data.bin")
        assert packed.read("md5checksum.hex").decode() == f"{hashlib.md5(main).hexdigest()} *main.xml\n"
    assert hashlib.md5(heights).hexdigest().encode() in main


def test_other_endings_are_refused() -> None:
    with pytest.raises(InvalidRequest, match=r"ends in \.npy or \.x3p"):
        format_of_ending(Path("out.wav"))
