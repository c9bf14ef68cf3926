"""The packages of package.json beside this file, from npm by the hashes of package-lock.json."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

from tests.clients.web.browser import missing

HERE = Path(__file__).parent
PATIENCE = 60.0  # s: a slow network


def node_modules(folder: Path) -> Path:
    """Return the folder of the packages that are no tools, fetched into `folder`.

    Skips the test where npm is missing or cannot fetch them; in CI it fails.
    """
    npm = shutil.which("npm")
    if npm is None:
        missing("npm is missing: install Node")
    for name in ("package.json", "package-lock.json"):
        shutil.copy(HERE / name, folder)
    command = [npm, "ci", "--ignore-scripts", "--no-audit", "--no-fund", "--silent", "--omit=dev"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=PATIENCE, check=False)
    if done.returncode != 0:
        missing(f"npm could not fetch the packages of the page's tests: {done.stderr.strip()}")
    return folder / "node_modules"
