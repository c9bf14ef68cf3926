"""`-o DIR`: a folder whose files are written all together, when everything that they hold is there.

Model: the folder is made, and each file opened beside its name (`synth.encode.part_file`), before the work begins: what
    cannot be written is told at once. At the end each file gets its name; a failure leaves what was there before.
Limits: each file is whole, but a process that is killed outright between two renames leaves some new and some old.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from clients.outcome import invalid_request
from synth.encode.part_file import PartFile, cannot_write


class OutputFolder:
    """The files of a folder on their way; use `opened_folder`."""

    def __init__(self, path: Path, parts: Mapping[str, PartFile]) -> None:
        self.path = path
        self._parts = parts

    def write(self, files: Mapping[str, bytes]) -> None:
        """Give the folder its files, each of those it was opened for; raises CannotRender."""
        assert files.keys() == self._parts.keys()
        for name, part in self._parts.items():
            with _told(part):
                part.stream.write(files[name])
                part.stream.flush()
        for part in self._parts.values():
            with _told(part):
                part.commit()


@contextlib.contextmanager
def opened_folder(path: Path, names: Sequence[str]) -> Iterator[OutputFolder]:
    """Yield the folder `path`, ready for files of those names; unless they are written, it is left as it was.

    Raises InvalidRequest where something else has the name, CannotRender where it cannot be written.
    """
    if path.exists() and not path.is_dir():
        invalid_request("--output", str(path), "a folder, there or not", "This is a file; name a folder.")
    with contextlib.ExitStack() as undo:
        for missing in reversed([place for place in (path, *path.parents) if not place.exists()]):
            try:
                missing.mkdir()
            except OSError as error:
                raise cannot_write(path, error) from error
            undo.callback(_remove_if_empty, missing)
        parts: dict[str, PartFile] = {}
        for name in names:
            parts[name] = PartFile(path / name)
            undo.callback(parts[name].discard)
        yield OutputFolder(path, parts)


def _remove_if_empty(folder: Path) -> None:
    with contextlib.suppress(OSError):
        folder.rmdir()


@contextlib.contextmanager
def _told(part: PartFile) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise cannot_write(part.target, error) from error
