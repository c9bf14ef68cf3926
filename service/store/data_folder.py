"""The data folder, in which imported textures are kept, and the tables of textures (`synth.kept_files`).

Model: RIDGEWAVE_DATA_FOLDER names it, for the service and the command line alike. Unset, it is the folder that the
    platform gives a user's programs: ~/.local/share/ridgewave on Linux (XDG_DATA_HOME), ~/Library/Application
    Support/ridgewave on macOS, %LOCALAPPDATA%\\ridgewave on Windows. It is made when it is first written to.
    A user without a home has no such folder: it is then NOWHERE, and what would be kept is refused.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path

VARIABLE = "RIDGEWAVE_DATA_FOLDER"
NOWHERE = Path("/nonexistent/ridgewave")  # Debian gives users without a home the home /nonexistent


def data_folder(given: str = "") -> Path:
    """Return the folder `given`, or that of the platform if it is empty."""
    if given:
        return Path(given)
    import platformdirs

    with suppress(RuntimeError):  # newer versions, where the user has no home; older ones leave "~"
        found = Path(platformdirs.user_data_dir("ridgewave", appauthor=False))
        if found.is_absolute():
            return found
    return NOWHERE


def tables_folder(folder: Path) -> Path:
    """Return the folder of tables in the data folder. It may be deleted at any time."""
    return folder / "tables"


def folder_of_environment(environment: Mapping[str, str] | None = None) -> Path:
    """Return the folder that the environment names, by default that of this process."""
    source = os.environ if environment is None else environment
    return data_folder(source.get(VARIABLE, "").strip())
