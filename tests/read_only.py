"""Runs ridgewave as a hardened container does: an unprivileged user, nothing that can be written, no home.

Model: a mount namespace of its own, in which every file system is mounted read-only, and a user without privileges in
    it. Both need root, and a system that allows mounts: elsewhere the tests are skipped with that reason. The program
    is a copy of the tree without compiled kernels, and runs in an interpreter that every user may use.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = ("ridgewave", "synth", "service", "clients")
NOBODY, STRANGER = 65534, 54321  # the second is in no list of users: it has no home even by name
PROBE = "import numba, pydantic, fastapi, subprocess, sys; subprocess.run([sys.executable, '-c', ''], check=True)"
MOUNTS = r"""
cut -d' ' -f2 /proc/mounts | grep -v -e '^/proc' -e '^/sys' | while read -r place; do
    mount -o remount,bind,ro "$place" 2>/dev/null
done
if touch "$1/probe" 2>/dev/null; then echo "$1 can still be written" >&2; exit 99; fi
user=$2; shift 2
cd / && exec setpriv --reuid "$user" --regid "$user" --clear-groups "$@"
"""


def command(words: Sequence[str], folder: Path, user: int = NOBODY) -> list[str]:
    """Return the command that runs `words` hardened; folder: one that must not be writable."""
    return ["unshare", "-m", "--propagation", "private", "sh", "-c", MOUNTS, "sh", str(folder), str(user), *words]


def environment(tree: Path, **variables: str) -> dict[str, str]:
    """Return the environment of a program of the copy `tree`, without a home."""
    paths = [str(tree), *(path for path in sys.path if path.endswith("-packages"))]
    quickly = {"NUMBA_OPT": "1"}  # kernels that are compiled here need not be fast
    return {"PATH": os.environ["PATH"], "PYTHONPATH": os.pathsep.join(paths), "LANG": "C.UTF-8", **quickly, **variables}


@cache
def interpreter() -> str:
    """Return a Python that every user may run with our packages; skip the test where there is none."""
    if sys.platform != "linux" or os.geteuid() != 0:
        pytest.skip("only root can mount file systems read-only and become another user, on Linux")
    if shutil.which("unshare") is None or shutil.which("setpriv") is None:
        pytest.skip("unshare or setpriv is not installed (Debian package util-linux)")
    name = f"python{sys.version_info.major}.{sys.version_info.minor}"
    told = ""
    for one in dict.fromkeys([sys.executable, f"/usr/local/bin/{name}", f"/usr/bin/{name}"]):
        words = command([one, "-c", PROBE], ROOT)
        tried = subprocess.run(words, env=environment(ROOT), capture_output=True, text=True)
        if tried.returncode == 0:
            return one
        told = tried.stderr.strip().rpartition("\n")[2]
    pytest.skip(f"mounts are not allowed here, or no Python that every user may run has our packages: {told}")


@contextmanager
def copied_tree() -> Iterator[Path]:
    """Yield a copy of the packages without compiled kernels, in a folder that every user may read."""
    folder = Path("/tmp") / f"rw-read-only-{os.getpid()}"
    folder.mkdir(mode=0o755)
    try:
        for package in PACKAGES:
            left_out = shutil.ignore_patterns("__pycache__", "vendor", "node_modules")
            shutil.copytree(ROOT / package, folder / package, ignore=left_out)
        subprocess.run(["chmod", "-R", "a+rX", str(folder)], check=True)
        yield folder
    finally:
        shutil.rmtree(folder)
