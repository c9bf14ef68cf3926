"""The files of the web page: found in one folder, read when they are asked for, told apart by their content.

Model: a name is words of letters, digits, `.`, `_` and `-` between slashes, none of which begins with a dot, with an
    ending that has a media type here; anything else, and whatever leads out of the folder, is not there. A file is read
    again when its time or size has changed; what was read is kept, beside what gzip makes of it where that is smaller.
Limits: files are kept whole, some 2 MB for the whole page.
"""

from __future__ import annotations

import gzip
import hashlib
import os
import re
import threading
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType

from service.operations.settings import variable

NAME = re.compile(r"[A-Za-z0-9_-][A-Za-z0-9._-]*(/[A-Za-z0-9_-][A-Za-z0-9._-]*)*")
SHIPPED = Path(__file__).resolve().parents[2] / "clients" / "web"
LARGEST = 16 << 20  # bytes: a larger file is none of a page
LEVEL = 6  # of gzip: 9 gains 1 % and takes twice as long
TEXT = "; charset=utf-8"
MEDIA_TYPES: Mapping[str, str] = MappingProxyType(
    {
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
)
"""By the ending. A file without one is no part of a page, but for the licence of what is in vendor."""
LICENCE = "LICENSE"


def shipped_page() -> str | None:
    """Return the folder of the page that comes with ridgewave; None where RIDGEWAVE_WEB names one, or none came."""
    named = os.environ.get(variable("web"), "").strip()
    return None if named or not (SHIPPED / "index.html").is_file() else str(SHIPPED)


@dataclass(frozen=True, slots=True)
class PageFile:
    """A file as it is sent. tag: of its content, for ETag; packed: by gzip, None where that is not smaller."""

    content: bytes
    packed: bytes | None
    media_type: str
    tag: str


class PageFiles:
    """The files of one folder; thread-safe."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder.resolve()
        self._kept: dict[Path, tuple[tuple[int, int], PageFile]] = {}
        self._lock = threading.Lock()

    def find(self, name: str) -> PageFile | None:
        """Return the file called `name`, such as `sight/scale.js`; None where there is none. For a thread."""
        path = self._path(name)
        if path is None:
            return None
        try:
            if not (path := path.resolve(strict=True)).is_relative_to(self._folder) or not path.is_file():
                return None
            status = path.stat()
            version = status.st_mtime_ns, status.st_size
            with self._lock:
                kept = self._kept.get(path)
            if kept is not None and kept[0] == version:
                return kept[1]
            made = None if status.st_size > LARGEST else _made(path.read_bytes(), _media_type(path))
        except OSError:
            return None
        if made is not None:
            with self._lock:
                self._kept[path] = version, made
        return made

    def _path(self, name: str) -> Path | None:
        if not NAME.fullmatch(name):
            return None
        path = self._folder / name
        return path if path.suffix in MEDIA_TYPES or path.name == LICENCE else None


def _media_type(path: Path) -> str:
    return MEDIA_TYPES.get(path.suffix, MEDIA_TYPES[".txt"])


def _made(content: bytes, media_type: str) -> PageFile:
    packed = gzip.compress(content, LEVEL, mtime=0)
    tag = hashlib.sha256(content).hexdigest()[:32]
    return PageFile(content, packed if len(packed) < len(content) else None, media_type, tag)
