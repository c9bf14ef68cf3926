"""Compiled kernels that are older than what they were made from are not used."""

from __future__ import annotations

import os
from pathlib import Path

from synth.contact.kernels import forget_stale_kernels


def test_kernels_older_than_the_newest_source_are_forgotten(tmp_path: Path) -> None:
    kept = tmp_path / "__pycache__"
    kept.mkdir()
    for name, stamp in (
        ("one.py", 1000),
        ("two.py", 3000),
        ("__pycache__/old.nbi", 2000),
        ("__pycache__/new.nbi", 4000),
    ):
        (tmp_path / name).touch()
        os.utime(tmp_path / name, (stamp, stamp))
    forget_stale_kernels(tmp_path)
    assert [index.name for index in kept.iterdir()] == ["new.nbi"]


def test_a_folder_that_holds_no_kernels_is_no_fault(tmp_path: Path) -> None:
    (tmp_path / "one.py").touch()
    forget_stale_kernels(tmp_path)


def test_sources_from_the_future_say_nothing(tmp_path: Path) -> None:
    kept = tmp_path / "__pycache__"
    kept.mkdir()
    (tmp_path / "one.py").touch()
    os.utime(tmp_path / "one.py", (1e11, 1e11))
    (kept / "one.nbi").touch()
    forget_stale_kernels(tmp_path)
    assert (kept / "one.nbi").exists()


def test_kernels_beside_the_folder_are_forgotten_with_what_they_call(tmp_path: Path) -> None:
    called = tmp_path / "contact"
    (tmp_path / "__pycache__").mkdir()
    called.mkdir()
    old, new = tmp_path / "__pycache__" / "old.nbi", tmp_path / "__pycache__" / "new.nbi"
    source = called / "kernels.py"
    for number, path in enumerate((old, source, new)):
        path.touch()
        os.utime(path, (1e9 + number, 1e9 + number))
    forget_stale_kernels(tmp_path, called)
    assert not old.exists() and new.exists()
