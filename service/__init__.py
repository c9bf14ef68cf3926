"""The service: receives scenes over HTTP and sends blocks of vibration to readers, files and devices.

    settings -> app (security, routes) -> sessions and renders -> engine (synth) -> encode -> peer or sink

Imports from `synth` only, and contains no physics. `service.server.run` starts it, `service.app.create_app`
builds the ASGI application.
"""

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
