"""A folder of small files as programs write them: each with its heights and sizes, or refused with what it is."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

from synth.errors import CannotRender, InvalidRequest
from synth.surfaces.measurement.import_options import read_options
from synth.surfaces.measurement.import_report import ImportedSurface
from synth.surfaces.measurement.importing import import_surface
from tests.synth.surfaces.readers.usual_files import UsualFile, usual_files

FILES = usual_files()
READ = [one for one in FILES if not one.refusal]
REFUSED = [one for one in FILES if one.refusal]


def written(one: UsualFile, folder: Path) -> Path:
    path = folder / one.name
    path.write_bytes(one.content)
    return path


def printed(found: ImportedSurface) -> str:
    """Return the report as the command line prints it."""
    rows = import_module("clients.commands.import").report_rows(found.report)
    return "\n".join([*(f"{name} {value}" for name, value in rows), *found.report["notes"]])


def test_the_folder_has_many_distinct_files() -> None:
    assert len({one.name for one in FILES}) == len({one.content for one in FILES}) == len(FILES) >= 80


@pytest.mark.parametrize("one", READ, ids=[one.name for one in READ])
def test_heights_and_sizes_are_those_of_the_file(one: UsualFile, tmp_path: Path) -> None:
    found = import_surface(written(one, tmp_path), read_options(one.options))
    assert found.heights.shape == one.wanted.shape
    np.testing.assert_allclose(found.heights, one.wanted, rtol=0.0, atol=one.within * np.ptp(one.wanted))
    np.testing.assert_allclose(found.spacing, one.spacing, rtol=one.step_within)
    told = printed(found)
    for words in one.shows:
        assert words in told


@pytest.mark.parametrize("ending", ["", ".dat", ".sdf", ".png", ".stl"])
def test_contents_decide_and_not_the_name(ending: str, tmp_path: Path) -> None:
    for one in READ[:: 1 if not ending else 7]:
        path = tmp_path / f"scan{ending}"
        path.write_bytes(one.content)
        found = import_surface(path, read_options(one.options))
        np.testing.assert_allclose(found.heights, one.wanted, rtol=0.0, atol=one.within * np.ptp(one.wanted))


@pytest.mark.parametrize("one", REFUSED, ids=[one.name for one in REFUSED])
def test_a_refusal_says_what_the_file_is(one: UsualFile, tmp_path: Path) -> None:
    try:
        found = import_surface(written(one, tmp_path), read_options(one.options))
    except InvalidRequest as error:
        fault = error.faults[0]
        assert one.refusal in f"{fault.value} {fault.allowed} {fault.hint}" and fault.hint
    except CannotRender as error:  # without the extra `surfaces`
        assert one.refusal in error.reason or "SurfaceTopography" in error.reason
    else:
        pytest.fail(f"it was read:\n{printed(found)}")
