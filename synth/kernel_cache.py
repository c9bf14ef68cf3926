"""Compiled kernels on disk: read from any folder that has them, kept in the first that can be written.

Stage   None: a tool of all stages.
Model   Numba's own cache demands a folder that it can write, also to read, and fails without one. Here each folder of
        `kernel_folders` is a cache of Numba. A kernel is read from the first folder that has it, so that a filled
        cache also serves where it is read-only. What cannot be read counts as absent. A kernel that cannot be kept
        anywhere is compiled again by each process; this is logged once.
        A kernel also contains the code that it calls in other files. It is therefore kept with a hash of all sources
        of kernels, and is compiled again when one of them changes.
Limits  Uses classes of Numba that its documentation describes for developers, and two private methods of one
        (tried with numba 0.68).
"""

from __future__ import annotations

import inspect
import os
import sys
from collections.abc import Callable
from contextlib import suppress
from functools import cache, partial
from hashlib import sha256
from pathlib import Path
from typing import Any

from numba.core.caching import CompileResultCacheImpl, FunctionCache, InTreeCacheLocator, NullCache
from numba.core.runtime.nrt import rtsys

from synth.kernel_folders import kernel_folders, tell_unkept

HERE = Path(__file__).resolve().parent
FOLDERS = (
    "", "contact", "response", "motion", "sampling", "effects/simulation", "voice", "surfaces", "surfaces/measurement",
)  # fmt: skip
"""Folders with kernels, and with what they read."""


@cache
def kernel_source_hash(root: Path = HERE) -> str:
    """Return a hash of all sources that a kernel may contain. 2 ms."""
    digest = sha256()
    for path in (path for name in FOLDERS for path in sorted((root / name).glob("*.py"))):
        digest.update(path.read_bytes())
    return digest.hexdigest()


class KernelCache(NullCache):
    """The cache of one kernel, in all its folders."""

    def __init__(self, function: Callable[..., Any]) -> None:
        folders = kernel_folders(Path(inspect.getfile(function)).absolute())
        self._caches = [_FolderCache(function, folder) for folder in folders]

    @property
    def cache_path(self) -> str:
        """Return the first folder."""
        return str(self._caches[0].cache_path)

    def load_overload(self, signature: Any, target: Any) -> Any:
        """Return the kernel compiled for `signature`, or None."""
        for one in self._caches:
            try:
                found = one.load_overload(signature, target)
            except Exception:  # pickle raises many kinds for damaged bytes
                one.forget()
                continue
            if found is not None:
                return found
        return None

    def save_overload(self, signature: Any, compiled: Any) -> None:
        """Keep a compiled kernel in the first folder that can be written, or say that there is none."""
        for one in self._caches:
            try:
                one.save_overload(signature, compiled)
            except Exception:  # also of a damaged index that could not be removed
                one.forget()
                continue
            return
        tell_unkept()


class _FolderCache(FunctionCache):
    """The cache of one kernel in one folder."""

    def __init__(self, function: Callable[..., Any], folder: Path) -> None:
        self._impl_class = partial(_CompiledKernels, folder=folder)  # type: ignore[assignment]  # called as a class
        super().__init__(function)

    def load_overload(self, signature: Any, target: Any) -> Any:
        """Return the kernel compiled for `signature`, or None.

        Numba's own also imports all that a compiler needs, a third of a second. A kernel that is ready needs the memory
        functions of Numba only; what is compiled later imports the rest.
        """
        rtsys.initialize(target)
        with self._guard_against_spurious_io_errors():
            return self._load_overload(signature, target)

    def forget(self) -> None:
        """Remove the index after a failure: it is damaged, or may name a file that is older than the index."""
        with suppress(OSError):
            os.unlink(self._cache_file._index_path)


class _CompiledKernels(CompileResultCacheImpl):
    """How kernels become files. Numba's own constructor looks for a folder that can be written."""

    def __init__(self, function: Callable[..., Any], folder: Path) -> None:
        source = inspect.getfile(function)
        self._lineno = function.__code__.co_firstlineno
        self._locator = _KernelFolder(function, source, folder)
        self._filename_base = self.get_filename_base(f"{Path(source).stem}.{function.__qualname__}", sys.abiflags)


class _KernelFolder(InTreeCacheLocator):
    def __init__(self, function: Callable[..., Any], source: str, folder: Path) -> None:
        super().__init__(function, source)
        self._cache_path = str(folder)

    def ensure_cache_path(self) -> None:
        """Make the folder. Whether it can be written shows when a file is."""
        os.makedirs(self._cache_path, exist_ok=True)

    def get_source_stamp(self) -> str:
        return kernel_source_hash()
