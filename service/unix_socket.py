"""A Unix socket as the place where the service listens.

Model: the socket has the mode 0660 from its first moment, so that only the service's user and group can connect. A
    socket that refuses connections was left by a process that has gone, and is removed. The service removes its own
    socket when it ends, unless another process has put one in its place.
Limits: SIGKILL leaves the socket, which the next start removes. A path has 100 bytes at most.
"""

from __future__ import annotations

import errno
import os
import socket
import stat
from contextlib import suppress

from synth.errors import CannotRender

LONGEST_PATH = 100  # bytes; Linux permits 107, macOS 103
NO_OTHERS = 0o117  # umask of the socket: read and write for the user and the group


def listen_on_path(path: str, backlog: int) -> socket.socket:
    """Return a socket that listens at `path`; raises CannotRender where it cannot, or where another process does."""
    _remove_stale(path)
    listener = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    before = os.umask(NO_OTHERS)
    try:
        listener.bind(path)
        listener.listen(backlog)
    except OSError as error:
        listener.close()
        raise _cannot(path, os.strerror(error.errno or 0).lower()) from error
    finally:
        os.umask(before)
    return listener


def identity(path: str) -> tuple[int, int] | None:
    """Return what tells the socket at `path` from another one; None where there is none."""
    with suppress(OSError):
        found = os.lstat(path)
        return (found.st_dev, found.st_ino) if stat.S_ISSOCK(found.st_mode) else None
    return None


def remove_own(path: str, own: tuple[int, int] | None) -> None:
    """Remove the socket at `path` if it is still the one with the identity `own`."""
    if own is not None and identity(path) == own:
        with suppress(OSError):
            os.unlink(path)


def _remove_stale(path: str) -> None:
    if not os.path.lexists(path):
        return
    stale = identity(path)
    if stale is None:
        raise _cannot(path, "it is a file that is no socket. Name another path")
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as probe:
        probe.settimeout(1.0)
        try:
            code = probe.connect_ex(path)
        except OSError:  # a full queue: somebody listens
            code = errno.EAGAIN
    if code != errno.ECONNREFUSED:
        raise _cannot(path, "another process listens there" if code != errno.EACCES else "it is not yours")
    remove_own(path, stale)


def _cannot(path: str, reason: str) -> CannotRender:
    return CannotRender(f"cannot listen on the Unix socket {path}: {reason}.")
