"""Solved responses and tables as files, so that a later process does not solve them again.

Stage   None: a tool of all stages, as is the cache in memory (`response_cache`).
Model   An entry is a file whose name is the SHA-256 of everything that decides its content: the text of its scene and
        of its demand, and the source of `synth`. A file is written under another name and renamed when it is complete.
        A file that cannot be read counts as absent. Failures to write are ignored. Above the limit in bytes, the least
        recently used files are deleted.
Limits  The folder is trusted as much as the program. The hash of a table is checked; of a series only the form is.
"""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from hashlib import sha256
from pathlib import Path
from typing import Any, Generic, TypeVar

MOST_BYTES = 512 << 20  # the catalogue with one finger has 70 MB
SOURCE = Path(__file__).resolve().parent

T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class FileForm(Generic[T]):
    """How entries of one type become files.

    ending: of the name, with its dot.
    write: returns the bytes of an entry.
    read: returns the entry; raises an exception for bytes that are not an entry.
    """

    ending: str
    write: Callable[[T], bytes]
    read: Callable[[bytes], T]


@dataclass(frozen=True, slots=True)
class FileEntry(Generic[T]):
    """The key of an entry. text: everything that decides it, apart from the program."""

    text: str
    form: FileForm[T]


class KeptFiles:
    """The entries in `folder`, at most `most_bytes`. Every thread and process may use them."""

    def __init__(self, folder: Path, most_bytes: int = MOST_BYTES) -> None:
        self.folder, self.most_bytes = folder, most_bytes

    def get(self, entry: FileEntry[T], build: Callable[[], T]) -> T:
        """Return the entry, from its file if there is one. Errors of `build` are raised and not kept."""
        path = self._path(entry)
        with suppress(Exception):  # libraries raise many kinds for damaged bytes
            found = entry.form.read(path.read_bytes())
            os.utime(path)  # marks the file as used now
            return found
        made = build()
        with suppress(OSError):
            self._write(path, entry.form.write(made))
            self._prune()
        return made

    def has(self, entry: FileEntry[Any]) -> bool:
        """Return whether the entry has a file. This does not count as a use."""
        return self._path(entry).exists()

    def _path(self, entry: FileEntry[Any]) -> Path:
        return self.folder / f"{sha256(f'{source_hash()} {entry.text}'.encode()).hexdigest()}{entry.form.ending}"

    def _write(self, path: Path, content: bytes) -> None:
        self.folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        descriptor, part = tempfile.mkstemp(dir=self.folder, suffix=".part")
        try:
            with os.fdopen(descriptor, "wb") as file:
                file.write(content)
            os.replace(part, path)
        except BaseException:
            os.unlink(part)
            raise

    def _prune(self) -> None:
        """Delete the least recently used files until the rest is within the limit."""
        used = sorted((path.stat().st_mtime, path.stat().st_size, path) for path in self.folder.iterdir())
        excess = sum(size for _, size, _ in used) - self.most_bytes
        for _, size, path in used:
            if excess <= 0:
                return
            path.unlink(missing_ok=True)
            excess -= size


@cache
def source_hash() -> str:
    """Return a hash of the source of `synth`, because another version may give other solutions."""
    digest = sha256()
    for path in sorted(SOURCE.rglob("*.py")):
        digest.update(path.read_bytes())
    return digest.hexdigest()


def json_form(to_document: Callable[[T], object], of_document: Callable[..., T]) -> FileForm[T]:
    """Return the form of entries that are small JSON documents."""
    return FileForm(
        ".json",
        lambda entry: json.dumps(to_document(entry)).encode(),
        lambda content: of_document(json.loads(content)),
    )
