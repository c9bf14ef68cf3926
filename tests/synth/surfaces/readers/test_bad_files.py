"""Bad files: each gets one clear fault, quickly, and none takes more memory than a surface may."""

from __future__ import annotations

import multiprocessing
import resource
import struct
import time
import tracemalloc
from concurrent.futures import ProcessPoolExecutor
from contextlib import suppress
from pathlib import Path

import pytest

from synth.errors import CannotRender, InvalidRequest
from synth.surfaces.measurement.import_options import read_options
from synth.surfaces.measurement.importing import import_surface
from synth.surfaces.readers.surface_file import LARGEST_FILE
from tests.synth.surfaces.readers.bad_files import bad_files

MEMORY = 64 * 2**20  # bytes: none of the files holds a surface of more than a few thousand points
SECONDS = 10.0
OPTIONS = read_options({"unit": "um"})  # and no distance between points


def _import_bad_files(folder: Path) -> list[tuple[str, int, int, float]]:
    """Import each bad file; return its name, peak memory and growth of the process in bytes, and seconds."""
    found = []
    with suppress(ImportError):  # before memory is measured
        import SurfaceTopography.IO  # noqa: F401
    for name, content in bad_files():
        path = folder / name
        path.write_bytes(content)
        del content
        began = time.perf_counter()
        tracemalloc.start()
        before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        try:
            import_surface(path, OPTIONS)
        except InvalidRequest as error:
            fault = error.faults[0]
            assert fault.value and fault.allowed and fault.hint and str(folder) not in str(error), name
        except CannotRender as error:  # the extra `surfaces` is not installed
            assert "pip install" in error.reason, name
        else:
            raise AssertionError(f"{name} was imported")
        finally:
            peak = tracemalloc.get_traced_memory()[1]
            tracemalloc.stop()
        grown = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) * 1024
        found.append((name, peak, grown, time.perf_counter() - began))
        path.unlink()
    return found


def test_two_hundred_bad_files_get_a_clear_fault_and_little_memory(tmp_path: Path) -> None:
    # A process of its own: threads of other tests would count as memory of an import.
    with ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn")) as pool:
        found = pool.submit(_import_bad_files, tmp_path).result()
    for name, peak, grown, took in found:
        assert peak < MEMORY, f"{name}: {peak} bytes"
        assert grown < MEMORY, f"{name}: {grown} bytes"
        assert took < SECONDS, name
    assert len(found) == 200


@pytest.mark.parametrize("header", [b"{'descr\0", b"{'descr", b"(" * 90, b"-" * 9000 + b"1"])
def test_a_header_of_npy_that_is_no_python_gets_a_clear_fault(tmp_path: Path, header: bytes) -> None:
    path = tmp_path / "a.npy"
    path.write_bytes(b"\x93NUMPY\x01\0" + struct.pack("<H", len(header) + 1) + header + b"\n" + bytes(64))
    with pytest.raises(InvalidRequest, match="a damaged NPY file"):
        import_surface(path, OPTIONS)


def test_a_file_is_refused_by_its_size_before_it_is_read(tmp_path: Path) -> None:
    path = tmp_path / "large.csv"
    with path.open("wb") as file:
        file.truncate(LARGEST_FILE + 1)  # a hole: no disk is used
    with pytest.raises(InvalidRequest, match=f"at most {LARGEST_FILE} bytes"):
        import_surface(path, OPTIONS)


def test_a_path_in_the_name_is_left_out_of_the_report(tmp_path: Path) -> None:
    path = tmp_path / "part"
    path.write_text("1\n2\n3\n")
    found = import_surface(path, read_options({"unit": "um", "pixel": "5 um"}), "../../etc/scan.csv")
    assert found.report["file"] == "scan.csv"


def test_folders_and_missing_files_are_told(tmp_path: Path) -> None:
    with pytest.raises(InvalidRequest, match="got a folder"):
        import_surface(tmp_path, OPTIONS)
    with pytest.raises(InvalidRequest, match=r"no file 'none.csv'; .* Check the path"):
        import_surface(tmp_path / "none.csv", OPTIONS)
