"""A file that appears under its name only when it is complete.

Stage: part of STAGE 4 (encode), the part that uses the file system.
Model: the bytes are written to NAME.TOKEN.part in the folder of the target. Each writer has its own token. At the end
    `os.replace` renames the file, so readers see the old file or the new file, never a part of one. A symbolic link is
    followed, and its target is replaced. A target that is not a regular file (a pipe, /dev/null) is written directly.
    With `exclusive`, which the file sink uses, the name must be free and no link is followed. The bytes are then
    written to NAME.part, which must not exist. It reserves the name among all processes.
Limits: a process that is killed leaves its .part file behind. The rename is atomic, but does not wait for the disk, so
    a power cut can undo it.
"""

from __future__ import annotations

import contextlib
import errno
import os
import secrets
from pathlib import Path
from typing import BinaryIO

from synth.errors import CannotRender, Fault, InvalidRequest, NameTaken

NAME_BYTES = 200  # bytes of the target's name that the part file's name keeps, to stay below the usual limit of 255

REASONS = {
    errno.ENOSPC: "the disk is full",
    errno.EDQUOT: "the disk quota is used up",
    errno.EFBIG: "the file grew past the largest size allowed here",
    errno.EROFS: "the file system is read-only",
    errno.ENAMETOOLONG: "the name is too long",
    errno.EPIPE: "its reader has closed it",
}


class PartFile:
    """A file on its way to `target`. Write to `stream`, then call `commit` or `discard`.

    shown: name of the target in errors, for readers who must not learn its path; None for its path.
    """

    def __init__(self, target: Path, *, exclusive: bool = False, shown: str | None = None) -> None:
        """Open the file. Raises CannotRender, with the name and the reason, if the target cannot be written."""
        self.target = target
        self.shown = shown
        self._part: Path | None = None
        try:
            self.stream = self._opened(exclusive)
        except OSError as error:
            raise cannot_write(target, error, shown) from error

    def _opened(self, exclusive: bool) -> BinaryIO:
        if exclusive:
            if os.path.lexists(self.target):
                raise NameTaken(f"cannot write {self.shown or self.target}: it already exists. Choose another name.")
            self._part = self.target.with_name(f"{self.target.name}.part")
        else:
            if self.target.is_dir():
                raise IsADirectoryError(errno.EISDIR, "is a folder")
            if self.target.exists() and not self.target.is_file():
                return open(self.target, "wb")
            self.target = Path(os.path.realpath(self.target))
            name = self.target.name.encode(errors="surrogateescape")[:NAME_BYTES].decode(errors="ignore")
            self._part = self.target.with_name(f"{name}.{secrets.token_hex(4)}.part")
        flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_CLOEXEC", 0) | getattr(os, "O_BINARY", 0)
        return os.fdopen(os.open(self._part, flags, 0o666), "wb")

    def commit(self) -> None:
        """Give the file its name. On failure, remove it and raise the OSError."""
        try:
            self.stream.flush()
            self.stream.close()
            if self._part is not None:
                os.replace(self._part, self.target)
        except BaseException:
            self.discard()
            raise

    def discard(self) -> None:
        """Remove what was written."""
        with contextlib.suppress(OSError):  # the file is deleted anyway
            self.stream.close()
        if self._part is not None:
            self._part.unlink(missing_ok=True)


def check_folder(path: Path, pointer: str) -> None:
    """Raise InvalidRequest if the folder of `path` does not exist; pointer: of the fault."""
    if not path.parent.is_dir():
        hint = f"Make {path.parent} first."
        raise InvalidRequest([Fault(pointer, str(path), "a name in a folder that exists", hint)])


def write_whole(path: Path, content: bytes) -> None:
    """Write `content` to the file `path`, which appears complete. Raises CannotRender."""
    part = PartFile(path)
    try:
        part.stream.write(content)
        part.commit()
    except OSError as error:
        part.discard()
        raise cannot_write(path, error) from error
    except BaseException:
        part.discard()
        raise


def cannot_write(target: Path | None, error: OSError, shown: str | None = None) -> CannotRender:
    """Return the error with the target and the reason.

    target: path, or None for a stream.
    shown: name of the target in the message, instead of its path.
    """
    code = error.errno or 0
    folder = None if target is None else (Path(os.path.realpath(target)) if os.path.islink(target) else target).parent
    if code in REASONS:
        reason = REASONS[code]
    elif target and code == errno.EISDIR:
        reason = "it is a folder. Name a file in it"
    elif folder and code in (errno.ENOENT, errno.ENOTDIR) and not folder.is_dir():
        reason = f"{'its folder' if shown else f'the folder {folder}'} does not exist. Make it first"
    elif target and code == errno.EEXIST:
        reason = "it is being written, or an interrupted recording left its .part file. Choose another name"
    elif target and code in (errno.EACCES, errno.EPERM):
        place = target if os.path.exists(target) else target.parent
        reason = f"{'it' if shown else place} is not writable for this user"
    else:
        reason = error.strerror or "the operating system refused it"
    kind = NameTaken if code == errno.EEXIST else CannotRender
    return kind(f"cannot write {shown or target}: {reason}.")
