"""A study that is interrupted, by hand, by a full disk, by a dead process or a dead worker, loses nothing."""

from __future__ import annotations

import errno
import multiprocessing
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import ridgewave as rw
from synth.study import chunks, running
from synth.study.chunks import chunks_of, read, solved
from synth.study.dataset import ENDINGS, checked_path, dataset_of, numbers_of, table_of, write_result
from synth.study.running import foreseen, run
from synth.study.spec import StudySpec, read_spec

SPEC: dict[str, Any] = {
    "axes": {"texture.period": {"from": "0.3 mm", "to": "3 mm", "count": 12}, "scan.load": [0.1, 0.4]},
    "phases": 64, "lines": 4,
}  # fmt: skip
MANY: dict[str, Any] = {
    "axes": {"texture.period": {"from": "0.3 mm", "to": "3 mm", "count": 800}},
    "phases": 64,
    "lines": 4,
}


def study(document: dict[str, Any] = SPEC) -> StudySpec:
    return read_spec(document)


def bytes_of(path: Path) -> dict[str, bytes]:
    """Return the bytes of a file, or of every file of a folder."""
    if path.is_dir():
        return {str(one.relative_to(path)): one.read_bytes() for one in sorted(path.rglob("*")) if one.is_file()}
    return {"": path.read_bytes()}


@pytest.fixture
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    """Chunks of five scenes."""
    monkeypatch.setattr(chunks, "CHUNK", 5)


def stopping(after: int, error: BaseException) -> Callable[..., Any]:
    """Return what a chunk's solver becomes: it raises after some chunks."""
    left = [after]

    def solve(chunk: Any) -> Any:
        left[0] -= 1
        if left[0] < 0:
            raise error
        return solved(chunk)

    return solve


@pytest.mark.usefixtures("small")
@pytest.mark.parametrize("error", [KeyboardInterrupt(), MemoryError()], ids=["interrupt", "memory"])
def test_an_interrupted_study_goes_on_and_equals_a_serial_one_byte_for_byte(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, error: BaseException
) -> None:
    spec, whole, parts, seen = study(), tmp_path / "whole", tmp_path / "parts", list[int]()
    run(spec, whole, workers=1)
    monkeypatch.setattr(running, "solved", stopping(2, error))
    with pytest.raises(type(error)):
        run(spec, parts, workers=1)
    monkeypatch.setattr(running, "solved", solved)
    run(spec, parts, workers=1, progress=lambda done, _all: seen.append(done))
    assert seen == [10, 15, 20, 24]
    for ending in ENDINGS:
        one, other = tmp_path / f"one{ending}", tmp_path / f"other{ending}"
        write_result(spec, numbers_of(spec, whole), one)
        write_result(spec, numbers_of(spec, parts), other)
        assert bytes_of(one) == bytes_of(other)


@pytest.mark.usefixtures("small")
def test_a_full_disk_keeps_what_is_finished(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    spec, replace, left = study(), os.replace, [3]

    def full(*paths: Any) -> None:
        left[0] -= 1
        if left[0] < 0:
            raise OSError(errno.ENOSPC, "No space left on device")
        replace(*paths)

    monkeypatch.setattr(os, "replace", full)
    with pytest.raises(OSError, match="No space"):
        run(spec, tmp_path, workers=1)
    assert len(list(tmp_path.iterdir())) == 3, "no half file"
    left[0] = 100
    run(spec, tmp_path, workers=1)
    assert len(numbers_of(spec, tmp_path)["rms"]) == spec.count


@pytest.mark.usefixtures("small")
def test_a_damaged_part_is_solved_again(tmp_path: Path) -> None:
    spec = study()
    run(spec, tmp_path, workers=1)
    before, first = numbers_of(spec, tmp_path), next(iter(chunks_of(spec)))
    for damaged in (b"", b"PK", (tmp_path / first.name).read_bytes()[:700]):
        (tmp_path / first.name).write_bytes(damaged)
        assert read(first, tmp_path) is None
        run(spec, tmp_path, workers=1)
        np.testing.assert_array_equal(numbers_of(spec, tmp_path)["rms"], before["rms"])


def test_a_scene_that_cannot_be_solved_is_recorded_with_its_reason(tmp_path: Path) -> None:
    spec = study({"axes": {"groups.ridges": [20.0, 300.0], "finger.ridge_period": [2e-4, 5e-4]}, "phases": 64})
    run(spec, tmp_path, workers=1)
    found = dataset_of(spec, numbers_of(spec, tmp_path))
    assert found.reason.values.tolist() == [[0, 0], [0, 1]]
    assert "length" in found.reason.attrs["reasons"] and np.isnan(found.rms.values[1, 1]).all()
    assert found.rms.values[0].all()


@pytest.mark.slow
def test_a_process_that_dies_costs_its_chunk_only(tmp_path: Path) -> None:
    spec, killed = study(MANY), list[int]()

    def progress(done: int, _all: int) -> None:
        if done and not killed:
            child = multiprocessing.active_children()[0]
            killed.append(int(child.pid or 0))
            child.kill()

    run(spec, tmp_path / "two", workers=2, progress=progress)
    run(spec, tmp_path / "one", workers=1)
    assert killed
    one, two = (numbers_of(spec, tmp_path / name) for name in ("one", "two"))
    assert all(np.array_equal(one[name], two[name], equal_nan=name != "reason") for name in one)


PARENT = """
import sys
from pathlib import Path
from synth.study.running import run
from synth.study.spec import read_spec
if __name__ == "__main__":
    axes = {"texture.period": {"from": "0.3 mm", "to": "3 mm", "count": 20000}}
    told = lambda done, _: done and print(done, flush=True)
    run(read_spec({"axes": axes}), Path(sys.argv[1]), workers=2, progress=told)
"""


@pytest.mark.slow
def test_processes_end_with_the_one_that_started_them(tmp_path: Path) -> None:
    psutil = pytest.importorskip("psutil")
    (tmp_path / "parent.py").write_text(PARENT)
    words = [sys.executable, str(tmp_path / "parent.py"), str(tmp_path / "parts")]
    with subprocess.Popen(words, cwd=Path(running.__file__).parents[2], stdout=subprocess.PIPE) as parent:
        assert parent.stdout is not None and parent.stdout.readline()
        children = psutil.Process(parent.pid).children()
        parent.kill()
    assert len(children) >= 2
    gone, alive = psutil.wait_procs(children, timeout=30.0)
    for one in alive:
        one.kill()
    assert not alive and len(gone) == len(children)


@pytest.mark.slow
def test_a_cluster_gives_the_same_bytes_also_when_a_worker_dies(tmp_path: Path) -> None:
    distributed = pytest.importorskip("distributed")
    spec, killed = study(MANY), list[int]()
    options = {"processes": True, "threads_per_worker": 1, "dashboard_address": None, "host": "127.0.0.1"}
    with distributed.LocalCluster(n_workers=2, **options) as cluster:

        def progress(done: int, _all: int) -> None:
            if done and not killed:
                killed.append(next(iter(cluster.workers.values())).process.process.pid)
                os.kill(killed[0], signal.SIGKILL)

        run(spec, tmp_path / "cluster", scheduler=cluster.scheduler_address, progress=progress)
    run(spec, tmp_path / "here", workers=1)
    assert killed
    for name in ("cluster", "here"):
        write_result(spec, numbers_of(spec, tmp_path / name), tmp_path / f"{name}.nc")
    assert (tmp_path / "cluster.nc").read_bytes() == (tmp_path / "here.nc").read_bytes()


def test_a_scheduler_that_does_not_answer_is_told_in_words(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    class Silent:
        @staticmethod
        def Client(*_: Any, **__: Any) -> None:
            raise OSError("Timed out")

    monkeypatch.setattr(running, "import_module", lambda _name: Silent)
    with pytest.raises(rw.CannotRender, match=r"tcp://127.0.0.1:9 does not answer"):
        run(study(), tmp_path, scheduler="tcp://127.0.0.1:9")


def test_the_dataset_is_labelled_and_reads_back(tmp_path: Path) -> None:
    xarray = pytest.importorskip("xarray")
    spec = study()
    run(spec, tmp_path / "parts", workers=1)
    numbers = numbers_of(spec, tmp_path / "parts")
    made = dataset_of(spec, numbers)
    assert made.rms.dims == ("texture.period", "scan.load", "quantity")
    assert made["texture.period"].attrs["units"] == "m" and made.line_amplitude.attrs["units"] == "m"
    for ending, reader in ((".nc", xarray.open_dataset), (".zarr", xarray.open_zarr)):
        path = tmp_path / f"map{ending}"
        write_result(spec, numbers, path)
        with reader(path) as read_back:
            assert read_back.rms.dims == made.rms.dims and read_back.attrs["spec"] == made.attrs["spec"]
            np.testing.assert_array_equal(read_back.rms.values, made.rms.values)
            assert read_back.sel(quantity="velocity").rms.shape == (12, 2)
    table = table_of(spec, numbers)
    assert len(table) == 24 and table["rms_velocity"][3] == made.rms.values[1, 1, 1]
    assert [*table.columns[:2]] == ["texture.period", "scan.load"] and "line_amplitude_4" in table


def test_a_result_is_not_replaced_unless_asked(tmp_path: Path) -> None:
    path = tmp_path / "map.csv"
    path.write_text("mine")
    with pytest.raises(rw.InvalidRequest, match="does not exist"):
        checked_path(path, overwrite=False)
    with pytest.raises(rw.InvalidRequest, match=r"\.zarr"):
        checked_path(tmp_path / "map.xlsx", overwrite=False)
    checked_path(path, overwrite=True)


def test_a_missing_library_is_told_before_anything_is_solved(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "xarray", None)
    monkeypatch.setattr(running, "solved", lambda _chunk: pytest.fail("solved"))
    for missing in (lambda: checked_path(tmp_path / "map.nc", overwrite=False), lambda: rw.sweep({}, SPEC["axes"])):
        with pytest.raises(rw.CannotRender, match=r"ridgewave\[study\]"):
            missing()


def test_time_is_foreseen() -> None:
    spec = study(MANY)
    began = time.perf_counter()
    told = foreseen(spec, 1)
    spent = time.perf_counter() - began
    assert 0.0 < told < 600.0 and spent < 30.0


def test_sweep_returns_the_dataset() -> None:
    found = rw.sweep("grating-1mm-31um", {"scan.load": [0.1, 0.4]}, phases=128, lines=3)
    assert found.rms.shape == (2, 3) and found.rms.values.all()
    sample = {"kind": "sobol", "count": 4}
    drawn = rw.sweep({}, {"groups.load": {"from": 0.1, "to": 2.0}}, sample=sample, phases=64, lines=2)
    assert drawn.group_load.values == pytest.approx(drawn["groups.load"].values)


@pytest.mark.parametrize(
    ("axes", "textures", "word"),
    [
        ([1], None, "at least one field"),
        ({"texture.kind": None}, None, "a list of values"),
        ({"texture.kind": [1, "nope"]}, None, r"axes.texture.kind.1.*'nope'"),
        ({"texture.kind": ["mine"]}, "x", "an object with a texture for each name"),
    ],
)
def test_sweep_refuses_axes_and_textures_in_words(axes: Any, textures: Any, word: str) -> None:
    with pytest.raises(rw.SceneError, match=word):
        rw.sweep({}, axes, textures=textures)


def test_sweep_knows_the_textures_that_it_names() -> None:
    own = {"mine": {"kind": "grating", "period": "2 mm"}}
    found = rw.sweep({}, {"texture.kind": ["sinusoid", "mine"]}, textures=own, phases=16)
    assert found["texture.kind"].values.tolist() == ["sinusoid", "mine"]
    assert found.rms.sel(quantity="displacement").values[1] > 0.0
