"""What RIDGEWAVE_ROOT_PATH may be: the path under which a proxy offers the service.

Limits: letters, digits and -._~@+ only, so that a prefix reads the same in an address, a header and a log.
"""

from __future__ import annotations

import re
from urllib.parse import urlsplit

OWN_PARTS = ("v1", "web", "vr", "docs", "openapi.json", "healthz", "readyz", "metrics")
"""First parts of the service's own paths. A prefix that began with one could not be told from them."""
NAME = re.compile(r"(?!\.\.?(/|$))[A-Za-z0-9._~@+-]+")
ROOT_PATH = re.compile(rf"(?!/({'|'.join(map(re.escape, OWN_PARTS))})(/|$))(/{NAME.pattern})+")


class WithHint(ValueError):
    """Raised by the reader of a setting that can say what to write instead."""


def read_root_path(text: str) -> str:
    """Return a prefix of paths. Raises ValueError, with a prefix that works as its hint where one was meant."""
    if ROOT_PATH.fullmatch(text):
        return text
    parts = [part for part in urlsplit(text).path.split("/") if part not in ("", ".", "..")]
    if not all(map(NAME.fullmatch, parts)):
        raise WithHint("Write names of letters, digits and -._~@+, each after a /, such as /lab/touch.")
    meant = "/" + "/".join(parts)
    if ROOT_PATH.fullmatch(meant):
        raise WithHint(f"Write {meant}.")
    if ROOT_PATH.fullmatch("/touch" + meant):
        raise WithHint(f"Write /touch{meant}: the service has a path /{parts[0]} itself.")
    raise ValueError
