"""`-o DIR`: a folder whose files are written together, at the end.

The folder is made, and each file is opened under a temporary name, before the work begins, so that a folder that cannot
be written is reported at once. At the end each file gets its name. A failure leaves the folder as it was.

Limits: each file is complete, but a process that is killed between two renames leaves some new files and some old ones.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path

from clients.command_line.exit_codes import invalid_request
from synth.encode.part_file import PartFile, cannot_write


@contextlib.contextmanager
def opened_folder(path: Path, names: Sequence[str]) -> Iterator[Callable[[Mapping[str, bytes]], None]]:
    """Yield a function that writes the files `names` into the folder `path`, given the content of each.

    Raises InvalidRequest if `path` is a file, CannotRender if the folder or a file cannot be written.
    """
    if path.exists() and not path.is_dir():
        invalid_request("--output", str(path), "a folder, existing or new", "This is a file; name a folder.")
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

        def write(files: Mapping[str, bytes]) -> None:
            """Write every file, then make all of them appear."""
            for name, part in parts.items():
                with _reported(part):
                    part.stream.write(files[name])
                    part.stream.flush()
            for part in parts.values():
                with _reported(part):
                    part.commit()

        yield write


def _remove_if_empty(folder: Path) -> None:
    with contextlib.suppress(OSError):
        folder.rmdir()


@contextlib.contextmanager
def _reported(part: PartFile) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise cannot_write(part.target, error) from error
