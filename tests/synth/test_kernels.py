"""Compiled kernels that are older than what they were made from are not used."""

from __future__ import annotations

import os
from pathlib import Path

from synth.kernels import forget_stale_kernels


def made(folder: Path, stamps: dict[str, float]) -> None:
    """Make empty files in `folder` with the given times of change (s)."""
    for name, stamp in stamps.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.touch()
        os.utime(path, (stamp, stamp))


def left(folder: Path) -> set[str]:
    forget_stale_kernels(folder, ("contact", "voice", "absent"))
    return {index.name for index in folder.rglob("*.nbi")}


def test_kernels_older_than_the_newest_source_that_they_may_call_are_forgotten(tmp_path: Path) -> None:
    indexes = {f"{folder}__pycache__/{age}-{folder[:-1]}.nbi": stamp
               for folder in ("", "contact/", "voice/") for age, stamp in (("old", 2000), ("new", 4000))}  # fmt: skip
    made(tmp_path, {"contact/one.py": 1000, "voice/two.py": 3000, **indexes})
    assert left(tmp_path) == {"new-.nbi", "new-contact.nbi", "new-voice.nbi"}


def test_sources_without_kernels_are_no_fault(tmp_path: Path) -> None:
    made(tmp_path, {"contact/one.py": 1000})
    assert left(tmp_path) == set()


def test_sources_from_the_future_say_nothing(tmp_path: Path) -> None:
    made(tmp_path, {"contact/one.py": 1e11, "contact/__pycache__/one.nbi": 1000})
    assert left(tmp_path) == {"one.nbi"}
