"""MATLAB, HDF5 and Octave: the array of heights is the only one that can be, or the file is refused with the names."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from synth.errors import InvalidRequest
from synth.surfaces.measurement.import_options import read_options
from synth.surfaces.measurement.import_report import ImportedSurface
from synth.surfaces.measurement.importing import import_surface

pytest.importorskip("SurfaceTopography", reason="needs the extra surfaces")

Z = np.random.default_rng(5).normal(size=(16, 24))  # rows along y
X, Y = np.meshgrid(0.5 * np.arange(24.0), 0.5 * np.arange(16.0))
ENDINGS = ["mat", "h5"]


def written(folder: Path, ending: str, arrays: dict[str, Any]) -> Path:
    path = folder / f"scan.{ending}"
    if ending == "mat":
        from scipy.io import savemat

        savemat(path, arrays)
        return path
    import h5py

    with h5py.File(path, "w") as file:
        for name, values in arrays.items():
            file[name] = values
    return path


def imported(path: Path) -> ImportedSurface:
    return import_surface(path, read_options({"unit": "um", "pixel": "5 um"}))


@pytest.mark.parametrize("ending", ENDINGS)
@pytest.mark.parametrize(
    "arrays",
    [
        {"X": X, "Y": Y, "Z": Z},
        {"y": Y, "data": Z, "x": X},
        {"a": X[:1], "b": Y[:, :1], "Z": Z},
        {"count": np.array([[3.0]]), "scan": Z},
    ],
    ids=["grids before", "grids around", "vectors before", "a number before"],
)
def test_the_only_matrix_that_can_be_heights_is_read(tmp_path: Path, ending: str, arrays: dict[str, Any]) -> None:
    found = imported(written(tmp_path, ending, arrays))
    np.testing.assert_allclose(found.heights, 1e-6 * (Z - Z.mean()), atol=1e-15)
    (note,) = (note for note in found.report["notes"] if "which were not read" in note)
    assert all(name in note for name, values in arrays.items() if values is not Z)


@pytest.mark.parametrize("ending", ENDINGS)
@pytest.mark.parametrize(
    "arrays",
    [
        {"A": X, "B": Z},
        {"X": X, "Y": Y, "Z": Z, "mask": Z > 0.0},
        {"X": X, "Y": Y},
        {"x": X[0, :, None], "z": Z[:, :1]},
    ],
)
def test_several_arrays_that_can_be_heights_are_refused_with_their_names(
    tmp_path: Path, ending: str, arrays: dict[str, Any]
) -> None:
    arrays = {name: values.astype(float) for name, values in arrays.items()}
    with pytest.raises(InvalidRequest) as refused:
        imported(written(tmp_path, ending, arrays))
    for name, values in arrays.items():
        assert f"{name} ({values.shape[0]} x {values.shape[1]})" in str(refused.value)


@pytest.mark.parametrize("ending", ENDINGS)
def test_a_profile_is_a_column_and_a_row_is_refused_with_its_name(tmp_path: Path, ending: str) -> None:
    found = imported(written(tmp_path, ending, {"profile": Z[:, :1]}))
    np.testing.assert_allclose(found.heights, 1e-6 * (Z[:, 0] - Z[:, 0].mean()), atol=1e-15)
    with pytest.raises(InvalidRequest, match="the array profile of 1 x 24 points"):
        imported(written(tmp_path, ending, {"profile": Z[:1]}))


@pytest.mark.parametrize("place", ["/", "scans", "scans/z"])
def test_attributes_of_the_groups_of_an_array_are_refused(tmp_path: Path, place: str) -> None:
    import h5py

    path = written(tmp_path, "h5", {"scans/z": Z})
    with h5py.File(path, "a") as file:
        file[place].attrs["units"] = "nm"
    with pytest.raises(InvalidRequest, match=re.escape(f"units (of {place})")):
        imported(path)


def octave(*variables: tuple[str, Any]) -> str:
    """Return what `save -text` of Octave writes."""
    text = "# Created by Octave 8.4.0, Tue Dec 01 10:00:00 2026 CET <lab@bench>\n"
    for name, matrix in variables:
        text += f"# name: {name}\n# type: matrix\n# rows: {len(matrix)}\n# columns: {matrix.shape[1]}\n"
        text += "".join(" " + " ".join(f"{one:.15g}" for one in row) + "\n" for row in matrix) + "\n\n"
    return text


def test_a_matrix_of_octave_is_read_by_the_number_of_its_columns(tmp_path: Path) -> None:
    heights = 0.01 * np.sin(np.arange(60) / 7.0)
    path = tmp_path / "scan.txt"
    path.write_text(octave(("scan", np.stack([0.005 * np.arange(60), heights], axis=1))))
    found = import_surface(path, read_options({"unit": "mm"}))
    assert found.surface.heights.shape == (60,) and found.surface.spacing == pytest.approx((5e-6,))
    path.write_text(octave(("z", heights.reshape(6, 10))))
    found = import_surface(path, read_options({"unit": "mm", "pixel": "5 um"}))
    assert found.surface.heights.shape == (6, 10)
    path.write_text(octave(("dx", np.array([[0.005]])), ("z", heights[:, np.newaxis])))
    with pytest.raises(InvalidRequest, match="2 variables of Octave: dx, z"):
        import_surface(path, read_options({"unit": "mm", "pixel": "5 um"}))
