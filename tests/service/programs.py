"""Programs of the system that tests run: where they are, and what happens where one is missing."""

from __future__ import annotations

import os
import shutil

import pytest


def program(name: str, package: str) -> str:
    """Return where a program is; where it is missing, skip the test, but fail in continuous integration."""
    found = shutil.which(name, path=os.environ.get("PATH", "") + ":/usr/sbin:/sbin")
    if found is None:
        assert not os.environ.get("CI"), f"{name} is missing: apt-get install {package}"
        pytest.skip(f"{name} is not installed (Debian package {package})")
    return found
