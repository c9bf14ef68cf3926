"""The files of the web page, read from one folder.

Model: a name consists of letters, digits, `.`, `_` and `-`, in parts between slashes that do not begin with a dot. Its
    ending has a media type in `MEDIA_TYPES`. No link leads out of the folder.
Limits: a file is read whole at each request; the whole page has half a megabyte.
"""

from __future__ import annotations

import hashlib
import os
import re
from dataclasses import dataclass
from pathlib import Path

from service.operations.settings import variable

NAME = re.compile(r"[A-Za-z0-9_-][A-Za-z0-9._-]*(/[A-Za-z0-9_-][A-Za-z0-9._-]*)*")
SHIPPED = Path(__file__).resolve().parents[2] / "clients" / "web"
TEXT = "; charset=utf-8"
MEDIA_TYPES = {
    ".html": "text/html" + TEXT,
    ".css": "text/css" + TEXT,
    ".js": "text/javascript" + TEXT,
    ".json": "application/json",
    ".txt": "text/plain" + TEXT,
    ".svg": "image/svg+xml",
    ".png": "image/png",
    ".ico": "image/vnd.microsoft.icon",
    ".webmanifest": "application/manifest+json",
    ".wasm": "application/wasm",
    ".glb": "model/gltf-binary",
}
LICENCE = "LICENSE"  # the only name without an ending: the licences in vendor


def shipped_page() -> str | None:
    """Return the folder of the page that comes with ridgewave; None if RIDGEWAVE_WEB is set or there is no page."""
    named = os.environ.get(variable("web"), "").strip()
    return None if named or not (SHIPPED / "index.html").is_file() else str(SHIPPED)


@dataclass(frozen=True, slots=True)
class PageFile:
    """A file as it is sent; tag: a hash of the content, for ETag."""

    content: bytes
    media_type: str
    tag: str


def find_page_file(folder: Path, name: str) -> PageFile | None:
    """Return the file `name` of the page, such as `sight/scale.js`; None where there is none. Call it from a thread."""
    path = folder / name
    media_type = MEDIA_TYPES[".txt"] if path.name == LICENCE else MEDIA_TYPES.get(path.suffix)
    if media_type is None or not NAME.fullmatch(name):
        return None
    try:
        if not path.resolve(strict=True).is_relative_to(folder.resolve()) or not path.is_file():
            return None
        content = path.read_bytes()
    except OSError:
        return None
    return PageFile(content, media_type, hashlib.sha256(content).hexdigest()[:32])
