"""Compiled kernels on disk: found where they are, kept where they can be, and compiled where they are neither."""

from __future__ import annotations

import importlib.util
import shutil
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from synth import kernel_folders
from synth.kernel_cache import FOLDERS, HERE, kernel_source_hash
from synth.kernel_folders import SETTING, UNKEPT, tell_for_all_processes
from synth.kernel_folders import kernel_folders as folders_of
from synth.kernels import kernel

SOURCE = "def doubled(x):\n    return x + x\n"
Found = tuple[int, int]


@pytest.fixture(autouse=True)
def alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Keep nothing outside of the test's folder, and be told as if for the first time."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "user"))
    monkeypatch.delenv(SETTING, raising=False)
    monkeypatch.delenv(kernel_folders.TOLD, raising=False)
    monkeypatch.setattr(kernel_folders, "_told", False)


@pytest.fixture
def called(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[], Found]:
    """Return a function that loads a kernel, as a new process does, and returns how often it was found and not."""
    source = tmp_path / "package" / "one.py"
    source.parent.mkdir()
    source.write_text(SOURCE)

    def call() -> Found:
        spec = importlib.util.spec_from_file_location("one", source)
        assert spec is not None and spec.loader is not None
        module = importlib.util.module_from_spec(spec)
        monkeypatch.setitem(sys.modules, "one", module)  # a kernel on disk names its module
        spec.loader.exec_module(module)
        compiled: Any = kernel(module.doubled)
        assert compiled(2.0) == 4.0
        return sum(compiled.stats.cache_hits.values()), sum(compiled.stats.cache_misses.values())

    return call


def blocked(folder: Path) -> None:
    """Put a file in the place of a folder, which root cannot write either."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.parent.mkdir(parents=True, exist_ok=True)
    folder.write_text("")


def test_a_kernel_is_compiled_once(called: Callable[[], Found]) -> None:
    assert [called(), called()] == [(0, 1), (1, 0)]


def test_the_folder_of_the_setting_is_first(
    called: Callable[[], Found], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(SETTING, str(tmp_path / "set"))
    called()
    assert list((tmp_path / "set").rglob("*.nbi")) and not list((tmp_path / "package").rglob("*.nbi"))


def test_a_kernel_is_read_from_any_folder_and_kept_in_the_first_that_can_be_written(
    called: Callable[[], Found], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    blocked(tmp_path / "set")
    blocked(tmp_path / "package" / "__pycache__")
    monkeypatch.setenv(SETTING, str(tmp_path / "set"))
    assert [called(), called()] == [(0, 1), (1, 0)]
    assert list((tmp_path / "user").rglob("*.nbi"))


def test_without_a_folder_it_is_compiled_and_told_once(
    called: Callable[[], Found], tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    blocked(tmp_path / "user")
    blocked(tmp_path / "package" / "__pycache__")
    assert [called(), called()] == [(0, 1), (0, 1)]
    assert [record.message for record in caplog.records] == [UNKEPT]


def test_a_kernel_is_compiled_again_when_a_source_has_changed(
    called: Callable[[], Found], monkeypatch: pytest.MonkeyPatch
) -> None:
    called()
    monkeypatch.setattr("synth.kernel_cache.kernel_source_hash", lambda: "another")
    assert [called(), called()] == [(0, 1), (1, 0)]


@pytest.mark.parametrize("ending", ["nbi", "nbc"])
@pytest.mark.parametrize("content", [b"", b"\x80", b"words"])
def test_a_damaged_file_counts_as_absent(
    called: Callable[[], Found], tmp_path: Path, ending: str, content: bytes
) -> None:
    called()
    for path in tmp_path.rglob(f"*.{ending}"):
        path.write_bytes(content)
    assert called() == (0, 1)


def test_a_failure_while_a_kernel_is_kept_leaves_no_index_of_an_older_one(
    called: Callable[[], Found], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The index is written first: without room for the kernel it would name the file of an older source."""

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    called()
    with monkeypatch.context() as meanwhile:
        meanwhile.setattr("synth.kernel_cache.kernel_source_hash", lambda: "another")
        meanwhile.setattr("numba.core.caching.IndexDataCacheFile._save_data", full)
        assert called() == (0, 1)
    monkeypatch.setattr("synth.kernel_cache.kernel_source_hash", lambda: "another")
    assert called() == (0, 1)


def test_every_folder_with_kernels_is_in_the_hash(tmp_path: Path) -> None:
    using = {path.parent for path in HERE.rglob("*.py") if "from synth.kernels import" in path.read_text("utf-8")}
    assert using <= {HERE / name for name in FOLDERS}
    (tmp_path / "contact").mkdir()
    before = kernel_source_hash(tmp_path)
    (tmp_path / "contact" / "one.py").write_text(SOURCE)
    assert len({before, kernel_source_hash.__wrapped__(tmp_path), kernel_source_hash.__wrapped__(HERE)}) == 3


def test_a_user_without_a_home_has_no_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("XDG_CACHE_HOME")
    monkeypatch.setattr("os.path.expanduser", lambda path: path)
    assert folders_of(tmp_path / "one.py") == [tmp_path / "__pycache__"]


def test_a_service_tells_it_for_its_processes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(kernel_folders, "kernel_folders", lambda _: [tmp_path / "none" / "kernels"])
    tell_for_all_processes()
    assert not caplog.records
    blocked(tmp_path / "none")
    tell_for_all_processes()
    monkeypatch.setattr(kernel_folders, "_told", False)  # as in a process that is started then
    kernel_folders.tell_unkept()
    assert [record.message for record in caplog.records] == [UNKEPT]
