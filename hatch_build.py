"""Puts three.js into the page when ridgewave is built: the three files that the VR page imports.

Model: `npm pack` fetches the package three in the version below into a folder for temporary files. Its SHA-512 is
    compared with the one below before anything is taken out of it, and the three files go to clients/web/vendor, which
    git does not hold. Where they are already there in that version nothing is fetched. The scripts lose their
    comments and spaces (2.13 to 1.08 MB); the licence at their beginning stays.
Limits: without npm, without a network, or with an archive that is not the expected one the build goes on without
    three.js, with one sentence of warning, and the VR page then says that it is missing. Nothing else needs it.
"""

from __future__ import annotations

import base64
import hashlib
import json
import re
import shutil
import subprocess
import tarfile
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import rjsmin
from hatchling.builders.hooks.plugin.interface import BuildHookInterface

VERSION = "0.187.0"
INTEGRITY = "sha512-Qiu7R+Cmh8CstZsY1uJOSWnVlfo7ZtNLV7mF8Jltk3LB3AtDu9cRZlcnRKkAk8Y4z6KKw35z7Y7Urd7jWY8etA=="
FILES: Mapping[str, str] = {
    "package/build/three.module.js": "three.module.js",
    "package/build/three.core.js": "three.core.js",
    "package/LICENSE": "LICENSE",
}
"""What is taken out of the archive, and what it is called beside the page."""
LICENCE = re.compile(r"/\*\*(?:(?!\*/).)*@license.*?\*/\n?", re.DOTALL)
STAMP = "version.json"  # written last: a folder with it is complete
PATIENCE = 60.0  # seconds for npm; a build without a network must not hang
WARNING = "ridgewave is built without three.js, so its VR page will say that it is missing: {reason}."


class Unavailable(Exception):
    """three.js cannot be had here; the text says why."""


class VendorHook(BuildHookInterface[Any]):
    """Runs before each build of a wheel or a source distribution."""

    PLUGIN_NAME = "custom"

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Fill clients/web/vendor where that is possible."""
        page = Path(self.root) / "clients" / "web"
        if not page.is_dir():
            return
        reason = vendored(page / "vendor")
        if reason:
            self.app.display_warning(WARNING.format(reason=reason))


def vendored(folder: Path) -> str:
    """Put three.js into `folder` unless it is there; return "", or why it is not, in words."""
    try:
        if not is_complete(folder):
            with tempfile.TemporaryDirectory() as place:
                _unpack(_fetched(Path(place)), folder)
        for script in folder.glob("*.js"):
            _minify(script)
    except (Unavailable, OSError, tarfile.TarError) as error:
        return " ".join(str(error).split()).rstrip(".") or type(error).__name__
    return ""


def is_complete(folder: Path) -> bool:
    """Return whether `folder` holds every file of this version."""
    try:
        stamp = json.loads((folder / STAMP).read_text("utf-8"))
    except (OSError, ValueError):
        return False
    return stamp == _stamp() and all((folder / name).is_file() for name in FILES.values())


def _minify(script: Path) -> None:
    """Rewrite `script` without comments and spaces, but for the licence before its code."""
    text = script.read_text("utf-8")
    licence = LICENCE.match(text)
    small = (licence[0] if licence else "") + rjsmin.jsmin(text)
    if small != text:
        script.write_text(small, "utf-8")


def _stamp() -> dict[str, str]:
    return {"three": VERSION, "integrity": INTEGRITY}


def _fetched(place: Path) -> Path:
    """Return the archive of the package, fetched into `place` and checked; raises Unavailable."""
    npm = shutil.which("npm")
    if npm is None:
        raise Unavailable("npm is not installed")
    command = [npm, "pack", f"three@{VERSION}", "--ignore-scripts", "--silent", "--pack-destination", str(place)]
    try:
        done = subprocess.run(command, cwd=place, capture_output=True, text=True, timeout=PATIENCE, check=False)
    except subprocess.TimeoutExpired as error:
        raise Unavailable(f"npm did not answer within {PATIENCE:.0f} s") from error
    archive = place / f"three-{VERSION}.tgz"
    if done.returncode != 0 or not archive.is_file():
        raise Unavailable(f"npm could not fetch three {VERSION}")
    digest = base64.b64encode(hashlib.sha512(archive.read_bytes()).digest()).decode("ascii")
    if f"sha512-{digest}" != INTEGRITY:
        raise Unavailable(f"what npm fetched is not three {VERSION} as it was published")
    return archive


def _unpack(archive: Path, folder: Path) -> None:
    """Write the files of `archive` to `folder`, the stamp last; raises Unavailable where one is missing."""
    with tarfile.open(archive) as packed:
        contents = {}
        for member, name in FILES.items():
            try:
                content = packed.extractfile(member)
            except KeyError as error:
                raise Unavailable(f"three {VERSION} has no {member}") from error
            assert content is not None, f"{member} is a file"
            contents[name] = content.read()
    folder.mkdir(exist_ok=True)
    for name, written in contents.items():
        (folder / name).write_bytes(written)
    (folder / STAMP).write_text(json.dumps(_stamp()) + "\n", "utf-8")
