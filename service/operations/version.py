"""Which build answers: the versions that `/healthz` and `/metrics` tell."""

from __future__ import annotations

import platform
from importlib.metadata import PackageNotFoundError, version

PYTHON = platform.python_version()


def _version() -> str:
    try:
        return version("ridgewave")
    except PackageNotFoundError:
        return "not installed"


VERSION = _version()
