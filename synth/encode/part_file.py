"""A file that appears under its name only when it is complete.

Stage: part of STAGE 4 (encode), the part that touches the file system.
Model: the bytes go to NAME.TOKEN.part beside the target (a fresh token each time, so two writers do not meet), which
    `os.replace` renames at the end: readers see the old file or the new one, never half of one. A symbolic link is
    followed, and its target replaced. What is not a regular file (a pipe, /dev/null) is written directly.
    `exclusive` serves the file sink: the name must be free, no link is followed, and NAME.part itself, created only
    where it does not exist, reserves the name among all processes.
Limits: a process that is killed outright leaves its .part file behind. The rename is atomic, but does not wait for the
    disk, so that a power cut may undo it.
"""

from __future__ import annotations

import contextlib
import errno
import os
import secrets
from pathlib import Path
from typing import BinaryIO

from synth.errors import CannotRender, NameTaken

NAME_BYTES = 200  # of the target's name kept in the part file's, so that its own stays below the usual 255

REASONS = {
    errno.ENOSPC: "the disk is full",
    errno.EDQUOT: "the disk quota is used up",
    errno.EFBIG: "the file grew past the largest size allowed here",
    errno.EROFS: "the file system is read-only",
    errno.ENAMETOOLONG: "the name is too long",
    errno.EPIPE: "whoever read it has gone away",
}


class PartFile:
    """The bytes on their way to `target`: `stream` while open, then `commit` or `discard`.

    shown: what refusals call the target, where whoever reads them must not learn its path; None: its path.
    """

    def __init__(self, target: Path, *, exclusive: bool = False, shown: str | None = None) -> None:
        """Open it; raise CannotRender with its name and the reason where the target could not be written later."""
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
                raise NameTaken(f"cannot write {self.shown or self.target}: it exists already. Choose another name.")
            self._part = self.target.with_name(f"{self.target.name}.part")
        else:
            if self.target.is_dir():
                raise IsADirectoryError(errno.EISDIR, "is a folder")
            if self.target.exists() and not self.target.is_file():
                return open(self.target, "wb")
            self.target = Path(os.path.realpath(self.target))
            name = self.target.name.encode()[:NAME_BYTES].decode(errors="ignore")
            self._part = self.target.with_name(f"{name}.{secrets.token_hex(4)}.part")
        flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_CLOEXEC", 0) | getattr(os, "O_BINARY", 0)
        return os.fdopen(os.open(self._part, flags, 0o666), "wb")

    def commit(self) -> None:
        """Give the file its name; on failure nothing is left and the OSError comes out."""
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
        with contextlib.suppress(OSError):  # what cannot be flushed is thrown away anyway
            self.stream.close()
        if self._part is not None:
            self._part.unlink(missing_ok=True)


def cannot_write(target: Path | None, error: OSError, shown: str | None = None) -> CannotRender:
    """Return the sentence that names the target and the reason.

    target: None for a stream, which has a name alone. shown: what it is called in place of its path, which is not told
    then.
    """
    code = error.errno or 0
    if code in REASONS:
        reason = REASONS[code]
    elif target and code == errno.EISDIR:
        reason = "it is a folder. Name a file in it"
    elif target and code in (errno.ENOENT, errno.ENOTDIR):
        folder = "its folder" if shown else f"the folder {target.parent}"
        reason = f"{folder} does not exist. Make it first"
    elif target and code == errno.EEXIST:
        reason = "it is being written, or a recording was cut off and left its .part file. Choose another name"
    elif target and code in (errno.EACCES, errno.EPERM):
        place = target if os.path.exists(target) else target.parent
        reason = f"{'it' if shown else place} is not writable for this user"
    else:
        reason = error.strerror or "the system refuses it"
    kind = NameTaken if code == errno.EEXIST else CannotRender
    return kind(f"cannot write {shown or target}: {reason}.")
