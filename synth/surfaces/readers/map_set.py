"""A set of maps of a material, in a folder or in a ZIP file: which of its files are read.

Stage   SURFACES, from files.
Model   Of each role (`map_names`) one file is chosen: without loss before JPEG, roughness before gloss, 16 bits before
        8, and green up before green down. The others are told. Of a ZIP file only the chosen maps are unpacked, under
        names of our own.
Limits  MOST_FILES names; LARGEST_FILE bytes of each chosen map, also unpacked. A ZIP file with a name that leaves its
        folder, twice the same name, or a chosen map that is a link, encrypted, or packed with another method than
        Deflate is refused as a whole. Folders within a folder are read DEEPEST levels down.
"""

from __future__ import annotations

import os
import shutil
import stat
import zipfile
import zlib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from tempfile import TemporaryDirectory
from typing import NoReturn

from synth.errors import CannotRender, shown
from synth.surfaces.readers.map_names import DISPLACEMENT, EXAMPLES, NORMAL, PICTURES, ROLES, named, rank
from synth.surfaces.readers.surface_file import LARGEST_FILE, check_directory, refuse_file

MOST_FILES = 500  # names in a set; those of the libraries have 3 to 20
DEEPEST = 2  # folders within the folder: Poly Haven's models have their maps in "textures"
SHOWN = 5  # names in an error
ZIP = b"PK\x03\x04"
OTHERS = ("[Content_Types].xml", "content.xml", "main.xml")
"""Names in ZIP files of other programs that may hold pictures: documents, and X3P."""
METHODS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
ALLOWED = "a set with a displacement map or a normal map"


@dataclass(frozen=True, slots=True)
class MapFile:
    """A map. name: as in the set. path: on this machine. green: see `map_names.MapName`."""

    name: str
    path: Path
    green: str


@dataclass(frozen=True, slots=True)
class MapSet:
    """The files of a set. maps: by their role. left_out: names of the others."""

    maps: dict[str, MapFile]
    left_out: tuple[str, ...]


def is_set(path: Path) -> bool:
    """Return whether `path` is a folder, or a ZIP file with pictures.

    Raises InvalidRequest for a ZIP file whose directory is too large.
    """
    if path.is_dir():
        return True
    if not path.is_file() or path.stat().st_size > LARGEST_FILE:
        return False
    with path.open("rb") as file:
        if file.read(len(ZIP)) != ZIP:
            return False
    check_directory(path)
    try:
        with zipfile.ZipFile(path) as packed:
            names = packed.namelist()
        return not set(OTHERS) & set(names) and any(name.lower().endswith(PICTURES) for name in names)
    except (zipfile.BadZipFile, ValueError, NotImplementedError):
        return False  # the readers of files name it


@contextmanager
def opened_set(path: Path, folder: Path | None) -> Iterator[MapSet]:
    """Yield the set at `path`.

    folder: for unpacked maps, deleted by the caller; None: a temporary one, deleted here.
    Raises InvalidRequest for a set without a map that is read, and CannotRender where maps cannot be unpacked.
    """
    if path.is_dir():
        files = {str(one.relative_to(path)): one for one in _files_in(path, DEEPEST)}
        chosen, left_out = _chosen("a folder", list(files))
        maps = {role: MapFile(name, files[name], _green(name)) for role, name in chosen.items()}
        for one in maps.values():
            _check_size(one.name, one.path.stat().st_size)
        yield MapSet(maps, left_out)
    elif folder is not None:
        yield _unpacked(path, folder)
    else:
        with TemporaryDirectory(prefix="ridgewave-") as made:
            yield _unpacked(path, Path(made))


def _files_in(folder: Path, deeper: int) -> list[Path]:
    found: list[Path] = []
    with os.scandir(folder) as entries:
        for entry in sorted(entries, key=lambda one: one.name):
            if Path(entry.path).is_file():
                found.append(Path(entry.path))
            elif entry.is_symlink() and named(entry.name):
                hint = "Remove the link, or copy the file into its place."
                refuse_file(f"the link {shown(entry.name)}, which leads to no file", "maps, or links to maps", hint)
            elif deeper and entry.is_dir(follow_symlinks=False):
                found += _files_in(Path(entry.path), deeper - 1)
            if len(found) > MOST_FILES:
                refuse_file("a folder of many files", f"a set of at most {MOST_FILES} files", "Name its own folder.")
    return found


def _chosen(what: str, names: Sequence[str]) -> tuple[dict[str, str], tuple[str, ...]]:
    """Return the name of the map of each role, and the names of all other files. what: that holds the names."""
    chosen: dict[str, str] = {}
    for role in ROLES:
        of_role = [name for name in names if (found := named(name)) is not None and found.role == role]
        best = [name for name in of_role if rank(name) == min(map(rank, of_role))]
        if len(best) > 1:
            several = ", ".join(map(shown, best[:SHOWN]))
            hint = "Keep one set, of one resolution, in a folder or a ZIP file of its own."
            refuse_file(f"{len(best)} {role} maps: {several}", "one map of each kind", hint)
        chosen |= {role: best[0]} if best else {}
    if not {DISPLACEMENT, NORMAL} & set(chosen):
        some = ", ".join(shown(name) for name in names[:SHOWN]) or "nothing"
        refuse_file(f"{what} with {some}", ALLOWED, f"Name the maps as {EXAMPLES}.")
    return chosen, tuple(sorted(set(names) - set(chosen.values())))


def _green(name: str) -> str:
    found = named(name)
    return "" if found is None else found.green


def _check_size(name: str, size: int) -> None:
    if size > LARGEST_FILE:
        hint = "Download the set with fewer pixels, such as 2K."
        refuse_file(f"{shown(name)} of {size} bytes", f"maps of at most {LARGEST_FILE} bytes", hint)


def _unpacked(path: Path, folder: Path) -> MapSet:
    """Return the set in a ZIP file, with its chosen maps unpacked into `folder`."""
    try:
        with zipfile.ZipFile(path) as packed:
            entries = {one.filename: one for one in packed.infolist() if not one.is_dir()}
            _check_names(packed.namelist())
            chosen, left_out = _chosen("a ZIP file", list(entries))
            for name in chosen.values():
                _check_entry(entries[name])
            maps = {}
            for role, name in chosen.items():
                copy = folder / f"{role}{PurePosixPath(name).suffix.lower()}"
                _unpack(packed, entries[name], copy)
                maps[role] = MapFile(name, copy, _green(name))
            return MapSet(maps, left_out)
    except (zipfile.BadZipFile, EOFError, NotImplementedError, ValueError, zlib.error) as error:
        refuse_file("a damaged set of maps (ZIP)", "a whole file", "Download it again.", error)


def _check_names(names: Sequence[str]) -> None:
    """Raise InvalidRequest for names that no library writes: too many, outside of the ZIP file, or twice the same."""
    if len(names) > MOST_FILES:
        _refuse_packed(f"{len(names)} files", f"at most {MOST_FILES} files")
    for name in names:
        parts = name.replace("\\", "/").split("/")
        if ".." in parts or not parts[0] or ":" in parts[0]:
            _refuse_packed(f"the file {shown(name)}", "names within it")
    if len({name.lower() for name in names}) < len(names):
        _refuse_packed("two files of one name", "each name once")


def _check_entry(entry: zipfile.ZipInfo) -> None:
    """Raise InvalidRequest for a map that is not unpacked."""
    name = shown(entry.filename)
    if entry.flag_bits & 1:
        _refuse_packed(f"the encrypted file {name}", "files without a password")
    if stat.S_ISLNK(entry.external_attr >> 16):
        _refuse_packed(f"the link {name}", "maps, not links")
    if entry.compress_type not in METHODS:
        _refuse_packed(f"{name}, packed with method {entry.compress_type}", "files that are stored or deflated")
    _check_size(entry.filename, entry.file_size)


def _refuse_packed(value: str, allowed: str) -> NoReturn:
    refuse_file(f"a ZIP file with {value}", allowed, "Unpack it, look into it, and import the folder.")


def _unpack(packed: zipfile.ZipFile, entry: zipfile.ZipInfo, copy: Path) -> None:
    """Write a map to `copy`. `zipfile` never reads more bytes than the entry declares, and checks their sum."""
    try:
        with packed.open(entry) as source, copy.open("xb") as written:
            shutil.copyfileobj(source, written, 1 << 20)
    except OSError as error:
        raise CannotRender("the maps cannot be unpacked: free space, or set TMPDIR to another folder.") from error
