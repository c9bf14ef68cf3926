"""The ready studies: specs in the folder `specs` beside this file, by name (docs/study.md).

Stage   STUDY.
"""

from __future__ import annotations

from pathlib import Path

FOLDER = Path(__file__).with_name("specs")


def ready_names() -> list[str]:
    """Return the names of the ready studies, sorted."""
    return sorted(path.stem for path in FOLDER.glob("*.json"))


def ready_text(name: str) -> str:
    """Return the spec `name`, one of `ready_names`, as JSON text."""
    return (FOLDER / f"{name}.json").read_text("utf-8")
