"""The registry of file formats: finds the reader of a file by its contents.

Stage   SURFACES, from files.
Model   The first bytes decide: signatures of NPY, TIFF and other images come first, then text, unless it begins as the
        text of another program does. Every other file is read by the package SurfaceTopography (the extra
        `surfaces`), if it knows the file. A file that nothing reads is named (`known_files`). The ending of the name
        decides only where contents cannot: between TIFF and microscopes that write TIFF, for example.
Limits  The size of the file is checked before it is opened. A damaged file always raises InvalidRequest, whatever its
        reader raises: the parsers of NumPy, Pillow, tifffile, h5py, SciPy and zipfile each have errors of their own.
        The cause of the InvalidRequest is that error, for a log. A library that crashes ends the process (`service`
        reads files in one of their own).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import NoReturn

from synth.errors import InvalidRequest, RidgewaveError
from synth.surfaces.readers import npy, picture, surfer_grid, text, tiff, topography_package
from synth.surfaces.readers.map_names import PICTURES
from synth.surfaces.readers.normal_map import check_unit
from synth.surfaces.readers.surface_file import (
    LARGEST_FILE,
    SurfaceFile,
    check_directory,
    check_numbers,
    check_shape,
    refuse_file,
)

HEAD_BYTES = 4096  # read to recognise the format; the header of a text file can be longer than a signature


@dataclass(frozen=True, slots=True)
class FileFormat:
    """One format.

    name: for reports.
    fits: whether a file is of this format, given its first bytes and its ending in small letters.
    read: returns the contents of a file.
    """

    name: str
    fits: Callable[[bytes, str], bool]
    read: Callable[[Path, str], SurfaceFile]


FORMATS = (
    FileFormat("NPY", npy.fits, npy.read),
    FileFormat("image", picture.fits, picture.read),
    FileFormat("TIFF", tiff.fits, tiff.read),
    FileFormat("Surfer", surfer_grid.fits, surfer_grid.read),
    FileFormat("text", text.fits, text.read),
    FileFormat("SurfaceTopography", lambda _head, _ending: True, topography_package.read),
)
"""Every format, in the order in which they are tried; the last one fits every file."""


def read_surface_file(path: Path, ending: str | None = None, is_normal_map: bool = False) -> SurfaceFile:
    """Return the contents of the file at `path`.

    ending: of the file's original name, such as ".csv"; None for that of `path`.
    is_normal_map: its name says so. Its colours may then be farther from unit vectors.
    Raises InvalidRequest for a file that is too large, damaged, or of no known format; OSError if it cannot be opened.
    """
    ending = (path.suffix if ending is None else ending).lower()
    if not path.exists():
        refuse_file(f"no file {path.name!r}", "a file that exists", "Check the path.")
    if not path.is_file():
        refuse_file("a folder" if path.is_dir() else "a device or a pipe", "a file of heights", "Name a file.")
    size = path.stat().st_size
    if size > LARGEST_FILE:
        refuse_file(f"{size} bytes", f"at most {LARGEST_FILE} bytes", "Crop it, or keep every second point.")
    if not size:
        refuse_file("an empty file", "a file of heights", "Save the surface again.")
    check_directory(path)
    with path.open("rb") as file:
        head = file.read(HEAD_BYTES)
    found = next(one for one in FORMATS if one.fits(head, ending))
    try:
        contents = found.read(path, ending)
    except InvalidRequest as error:
        if found.read is text.read and ending in PICTURES:
            fault = error.faults[0]
            what = f"no {ending.removeprefix('.').upper()}, although its name ends so, but text: {fault.value}"
            refuse_file(what, "a picture", "Save or download it again.", error.__cause__)
        raise
    except RidgewaveError:
        raise
    except Exception as error:
        _refuse_damaged(found, head, ending, error)
    if not is_normal_map:
        check_unit(contents)
    check_shape(contents.heights.shape)
    check_numbers(contents.heights, "a height")
    if contents.positions is not None:
        check_numbers(contents.positions, "an x")
    return contents


def _refuse_damaged(found: FileFormat, head: bytes, ending: str, error: Exception) -> NoReturn:
    """Raise InvalidRequest for a file on which the reader of the format `found` raised `error`."""
    of_package = found is FORMATS[-1]
    what = f"{topography_package.what(head, ending)}, damaged" if of_package else f"a damaged {found.name} file"
    if isinstance(error, MemoryError):  # also of a parser of text that nests too deep
        hint = "Save or copy it again. If it is whole, crop the surface."
        refuse_file(f"{what}, or one that needs too much memory", "a whole file of a smaller surface", hint, error)
    refuse_file(what, "a whole file", "Save or copy it again.", error)
