"""The folders that may hold compiled kernels, and what is said where none of them can be written.

Stage   None: a tool of all stages. It does not import Numba, so that a process without kernels may ask.
Model   The folders are those of Numba, in its order: NUMBA_CACHE_DIR, `__pycache__` beside the source file, and the
        user's folder of caches. The user's folder is left out where the user has no home.
Limits  Whoever may write into one of these folders decides what this program runs.
"""

from __future__ import annotations

import logging
import os
import tempfile
from hashlib import sha256
from pathlib import Path

log = logging.getLogger("ridgewave.kernels")

SETTING = "NUMBA_CACHE_DIR"
TOLD = "_RIDGEWAVE_KERNELS_UNKEPT"  # set for the processes of a service that has said so; not a setting
UNKEPT = (
    "ridgewave cannot keep its compiled kernels: no folder for them can be written, so each process compiles those "
    f"that it needs, for some seconds. Set {SETTING} to a folder that can be written."
)

_told = False


def kernel_folders(source: Path) -> list[Path]:
    """Return the folders that may hold the kernels of the file `source`, in the order in which they are tried."""
    folder = source.parent
    name = f"{folder.name}_{sha256(os.fsencode(folder)).hexdigest()[:16]}"
    found = [folder / "__pycache__"]
    setting = os.environ.get(SETTING)
    if setting:
        found.insert(0, Path(setting) / name)
    user = Path(os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache"))
    if user.is_absolute():  # "~" where the user has no home: this would be a folder in the working directory
        found.append(user / "ridgewave" / "kernels" / name)
    return found


def tell_unkept() -> None:
    """Log once that kernels cannot be kept."""
    global _told
    if not _told and TOLD not in os.environ:
        _told = True
        log.warning(UNKEPT)


def tell_for_all_processes() -> None:
    """Log here, where no folder can be written, that kernels cannot be kept; no process started later says it again."""
    if not any(_can_be_written(folder) for folder in kernel_folders(Path(__file__))):
        tell_unkept()
        os.environ[TOLD] = "1"


def _can_be_written(folder: Path) -> bool:
    try:
        folder.mkdir(parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=folder).close()
    except OSError:
        return False
    return True
