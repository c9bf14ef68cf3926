"""Heights of a measured profile, and the files that hold them.

Stage   SURFACES, called for by the command line and by Python; a service reads no paths.
Model   `.npy`: one array of one dimension, any real numbers. `.csv`, `.txt`: one number a line. Heights in m.
Limits  1,000,000 heights. A scene's document holds up to 65,536 of them itself; of more it holds the file's path, so
        such a scene is read back only where the file is.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from synth.errors import Fault, SceneError, shown
from synth.scene.rules import Rule, refused
from synth.surfaces.profile import Array

LARGEST_HEIGHT = 0.01  # m either way of where an instrument has its zero; the profile itself is 2 mm high at most
MOST_INLINE = 65_536  # heights in a scene: 1.4 MB of text; more is no longer a document that one sends around
MOST_HEIGHTS = 1_000_000  # in a file: 1 m at 1 um; a solver's work grows with them
LARGEST_FILE = 64 * 2**20  # bytes: a million heights as text are 25 MB
FORMS = "a file of this machine: .npy of one dimension, or .csv or .txt with one number a line, in m"


class Heights(tuple[float, ...]):
    """Heights in m, hashed once. path: of the file that they were read from, or ""."""

    path: str = ""

    def __hash__(self) -> int:
        """Return the hash of the values."""
        known = self.__dict__.get("_hash")
        if known is None:
            known = self.__dict__["_hash"] = super().__hash__()
        return int(known)


class HeightFile(Rule):
    """The path of a file of heights."""

    allowed = FORMS

    def read(self, value: object) -> str:
        """Return the path."""
        if isinstance(value, str) and 0 < len(value) <= 4096:
            return value
        raise refused(self.allowed, 'Write a path, such as "heights.csv".')

    def schema(self) -> dict[str, Any]:
        """Return nothing but null: whoever reads the schema talks to a service, which refuses every path."""
        return {"anyOf": []}


def heights_of_file(fields: Mapping[str, Any]) -> dict[str, Any]:
    """Return the `fields` of a texture with the heights in place of `file`; raises SceneError, OSError."""
    path = fields.get("file")
    if not isinstance(path, str) or not path:
        return dict(fields)
    if fields.get("heights") is not None:
        _refuse(Path(path), "heights or file, not both", "Leave one out.")
    heights = Heights(read_heights(Path(path)).tolist())
    heights.path = str(Path(path).absolute())
    return {name: value for name, value in fields.items() if name != "file"} | {"heights": heights}


def written(fields: Mapping[str, Any], values: Mapping[str, Any]) -> dict[str, Any]:
    """Return the document `fields` of a texture of these `values`, with the path of their file for long heights."""
    heights = values["heights"]
    if isinstance(heights, Heights) and len(heights) > MOST_INLINE:
        return {**fields, "heights": None, "file": heights.path}
    return dict(fields)


def read_heights(path: Path) -> Array:
    """Return the heights (m), float64 [n], of a file; raises SceneError, OSError."""
    if path.suffix not in (".npy", ".csv", ".txt"):
        _refuse(path, FORMS, "Save the heights as one of these.")
    if not path.is_file():
        _refuse(path, "a file that exists", "Check the path; it is relative to the folder you are in.")
    if path.stat().st_size > LARGEST_FILE:
        _refuse(path, f"a file of at most {LARGEST_FILE} bytes", f"At most {MOST_HEIGHTS} heights.")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # an empty file
            if path.suffix == ".npy":
                found: np.ndarray[Any, Any] = np.lib.format.open_memmap(
                    path, mode="r"
                )  # takes no memory for what a header only claims
            else:
                found = np.loadtxt(path, ndmin=1, max_rows=MOST_HEIGHTS + 1)
    except (ValueError, EOFError) as error:
        _refuse(path, FORMS, f"It cannot be read so ({str(error)[:120]}).")
    if found.ndim != 1 or found.dtype.kind not in "fiu":
        _refuse(path, FORMS, f"It holds {found.dtype} of {found.ndim} dimensions. Keep the heights alone.")
    if not 2 <= len(found) <= MOST_HEIGHTS:
        held = f"{len(found)}" if len(found) <= MOST_HEIGHTS else "more"
        _refuse(path, f"2 to {MOST_HEIGHTS} heights", f"It holds {held}.")
    heights = np.asarray(found, np.float64)
    wrong = np.flatnonzero(~(np.abs(heights) <= LARGEST_HEIGHT))
    if len(wrong):
        hint = f"Height {wrong[0]} is {heights[wrong[0]]:g} m. Fill gaps, and write metres."
        _refuse(path, f"heights of {-LARGEST_HEIGHT:g} m to {LARGEST_HEIGHT:g} m", hint)
    return heights


def _refuse(path: Path, allowed: str, hint: str) -> NoReturn:
    raise SceneError([Fault("/texture/file", shown(str(path)), allowed, hint)])
