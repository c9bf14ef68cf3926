"""Formats of instruments, by the package SurfaceTopography: X3P, SUR, OPD, DI, SDF, Gwyddion, Zygo, Keyence and others.

Stage   SURFACES, from files.
Model   A reader of the package is tried if it recognises the first bytes, or if it regards them as possible and has the
        file's ending. It gives each channel with its sizes and units. The default channel is read if it has heights,
        else the first channel of heights; of arrays alone, that of `array_files`. The package is imported only for such
        a file.
Source  SurfaceTopography (MIT), https://contactengineering.github.io/SurfaceTopography/.
Limits  Needs the extra `surfaces`. A profile with unequal steps keeps its positions. The package reads the whole
        header, and for some formats the whole file, before the number of points is known. Therefore the unpacked size
        of a ZIP file is checked first, and on Linux the process can allocate at most MOST_MEMORY more while the package
        reads.
"""

from __future__ import annotations

import io
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from synth.errors import CannotRender, RidgewaveError, shown
from synth.surfaces.readers.array_files import ARRAYS, HDF5, array_of_heights, check_attributes
from synth.surfaces.readers.known_files import ALLOWED, TABLE, known, mesh_as_text, refuse_unknown
from synth.surfaces.readers.map_names import EXAMPLES as MAPS
from synth.surfaces.readers.surface_file import (
    SurfaceFile,
    check_array,
    check_shape,
    finite_heights,
    refuse_file,
    unit_named,
)

LARGEST_UNPACKED = 2**28  # bytes of all files in a ZIP file: twice MOST_POINTS heights as 64-bit numbers
MOST_MEMORY = 2**30  # bytes: MOST_POINTS heights eight times; a false size in a header could allocate any amount
HEAD_BYTES = 512  # from which the package recognises a format
STEPS_WITHIN = 1e-3  # permitted deviation of a profile's steps from their mean, relative to the mean
READERS_OF_TEXT = ((rb"\*File list", "DIReader"), (b"Wyko ASCII", "AscReader"))  # told by the beginning, not the name
OWN_TEXT = ("AscReader", "XYZReader")  # what `text` declines is no such text
FORMATS_OF_PACKAGE = ("HDF5", "MATLAB", "NetCDF", "ZIP", "Bruker", "XLSX", "NPZ", "XML")  # it reads some of these
INSTRUMENTS = (
    (0, b"DIGITAL SURF", "a SUR file of Digital Surf"),
    (0, b"DSCOMPRESSED", "a compressed SUR file of Digital Surf"),
    (0, b"GWYP", "a file of Gwyddion"),
    (0, b"aISO-1.0", "an SDF file (ISO 25178-71)"),
    (0, b"bISO-1.0", "an SDF file (ISO 25178-71)"),
    (0, b"aBCR-1.0", "an SDF file (BCR)"),
    (0, b"bBCR-1.0", "an SDF file (BCR)"),
    (2, b"Directory", "an OPD file of Wyko"),
    (0, b"VCA DATA", "an OPDx file of Dektak"),
    (0, b"\x88\x1b\x03", "a MetroPro file of Zygo"),
    (0, b"VK", "a file of Keyence"),
    (0, b"KPK", "a file of Keyence"),
    (0, b"AliconaImaging", "a file of Alicona"),
    (0, b"fileformat", "a BCR-STM file"),
    (0, b"WSxM", "a file of WSxM"),
    (0, b"\x01\xb0\x93\xff", "a file of NT-MDT"),
    (0, b"FRTM_GLIDERV", "a file of FRT"),
    (0, b"Binary TrueMap", "a file of TrueMap"),
    (0, b"Zeta-Instruments", "a file of Zeta Instruments"),
    (0, b"OmniSurf3D", "a file of OmniSurf3D"),
    (0, b"fileType", "a file of Molecular Imaging"),
    (0, b"[DataSet]", "a file of Nanosurf"),
)
BY_NAME = {
    ".x3p": "an X3P file (ISO 25178-72)",
    ".plu": "a file of Sensofar",
    ".plux": "a file of Sensofar",
    ".oir": "a file of Olympus",
    ".poir": "a file of Olympus",
    ".lext": "a file of Olympus",
    ".mnt": "a file of Mountains",
    ".qep": "a file of Mahr",
    ".nms": "a file of NanoFocus",
    ".datx": "a DATX file of Zygo",
    ".ibw": "a file of Igor",
    ".hgt": "a file of SRTM",
}
ZIP, EMPTY_ZIP, PACKED = b"PK\x03\x04", b"PK\x05\x06", "a packed file (ZIP)"
SHOWN = 3  # names in an error
IN_ZIP_ONLY = (".x3p", ".plux", ".qep", ".poir")  # of these names, any other contents are of another format
PARTS_IN_ZIP = ("main.xml", ".prf", ".oir", ".dsc")  # of X3P, Mahr, Olympus and a nanomeasuring machine
INSTALL = "pip install 'ridgewave[surfaces]'"


def read(path: Path, ending: str) -> SurfaceFile:
    """Return the contents. Raises InvalidRequest, and CannotRender if the package is not installed but may read it."""
    with path.open("rb") as file:
        head = file.read(HEAD_BYTES)
    if mesh_as_text(head):
        refuse_unknown(head, ending, path)
    if head.startswith((ZIP, EMPTY_ZIP)) and _instrument(head, ending) is None:
        _check_packed(path, known(head, ending, path))
    try:
        from SurfaceTopography.IO import MagicMatch, readers
    except ImportError as error:
        if not _needs_package(head, ending, path):
            refuse_unknown(head, ending, path)
        raise CannotRender(
            f"This is {what(head, ending)}, which the package SurfaceTopography may read. It is not installed: "
            f"{INSTALL}. Without it, text, NPY and images can be read."
        ) from error
    _check_unpacked(path)
    source = _source(path, head)
    head = head.replace(b"BCR-1.0", b"ISO-1.0") if isinstance(source, io.BytesIO) else head
    matches = {reader: reader.can_read(head) for reader in readers}
    fitting = [reader for reader, match in matches.items() if match is MagicMatch.YES]
    found = known(head, ending, path)
    if not fitting and found and not may_be_read(found[0]):
        refuse_unknown(head, ending, path)
    name = next((name for begin, name in READERS_OF_TEXT if head.startswith(begin)), None)
    fitting += [reader for reader, match in matches.items() if match is MagicMatch.MAYBE and reader.__name__ == name]
    fitting += [
        reader
        for reader, match in matches.items()
        if match is MagicMatch.MAYBE
        and ending.removeprefix(".") in (reader.file_extensions() or ())
        and reader not in fitting
        and reader.__name__ not in OWN_TEXT
    ]
    if not fitting:
        refuse_unknown(head, ending, path)
    cause: BaseException | None = None
    for reader in fitting:
        try:
            with bounded_memory(), reader(source) as opened:
                return _contents(opened, path)
        except RidgewaveError:
            raise
        except Exception as error:  # a third-party parser can raise anything for a damaged file
            cause = cause or error
    _refuse_unread(found, cause)


def _refuse_unread(found: tuple[str, str] | None, cause: BaseException | None) -> NoReturn:
    """Raise InvalidRequest for a file that its reader does not take; found: what is known of it."""
    allowed = "a whole file, with contents that SurfaceTopography reads"
    hint = "Copy it again. If it is whole, export it as text: of X3P, for example, areas are read and profiles are not."
    if found and found[1] == TABLE:
        allowed, hint = ALLOWED, TABLE
    value = "a file that its reader cannot read" + (f": {found[0]}" if found else "")
    refuse_file(value, allowed, hint, cause)


def _check_packed(path: Path, found: tuple[str, str] | None) -> None:
    """Raise InvalidRequest for a ZIP file that is cut off, and for one without a file of an instrument.

    A set of maps is no file for this reader, and documents are named by another. found: what is known of it.
    """
    if found is not None and found[0] != PACKED:
        return
    if not zipfile.is_zipfile(path):
        refuse_file("a damaged ZIP file, or a part of one", "a whole file", "Download or copy it again.")
    if _holds_surface(path):
        return
    with zipfile.ZipFile(path) as packed:
        names = packed.namelist()
    held = ", ".join(map(shown, names[:SHOWN])) + (f" and {len(names) - SHOWN} more" if len(names) > SHOWN else "")
    if any(name.lower().endswith(".zip") for name in names):
        hint = "Unpack it, and import the ZIP file or the folder with the maps."
    else:
        hint = "Unpack it, and import the file of heights that is in it."
    refuse_file(
        f"a ZIP file without maps: {held or 'it is empty'}", f"a ZIP file with maps, such as {MAPS}, or one file", hint
    )


def _source(path: Path, head: bytes) -> Any:
    """Return what the package reads: the path, or the bytes of an older SDF file (BCR) with the newer name."""
    if not head.startswith((b"aBCR-1.0", b"bBCR-1.0")):
        return str(path)
    return io.BytesIO(head[:1] + b"ISO" + path.read_bytes()[4:])


def what(head: bytes, ending: str) -> str:
    """Return what a file is that the package may read, by its first bytes, else by its name."""
    found = known(head, ending, None)
    return _instrument(head, ending) or (found[0] if found else "a file of no known format")


def _instrument(head: bytes, ending: str) -> str | None:
    """Return the format of an instrument, by the first bytes of the file, else by its name; None for any other."""
    signed = next((what for place, begin, what in INSTRUMENTS if head[place : place + len(begin)] == begin), None)
    return signed or (None if ending in IN_ZIP_ONLY and not head.startswith(ZIP) else BY_NAME.get(ending))


def _needs_package(head: bytes, ending: str, path: Path) -> bool:
    """Return whether the package may read the file, by all that is known without it. Raises BadZipFile."""
    found = known(head, ending, path)
    if found is not None and found[0] != PACKED:
        return may_be_read(found[0])
    holds = found is not None and _holds_surface(path)
    return holds or _instrument(head, ending) is not None


def _holds_surface(path: Path) -> bool:
    """Return whether a ZIP file has a part of a surface, whatever its own name is. Raises BadZipFile."""
    with zipfile.ZipFile(path) as packed:
        return any(name.endswith(PARTS_IN_ZIP) for name in packed.namelist())


def may_be_read(what: str) -> bool:
    """Return whether the package reads some files of the kind `what`."""
    return any(name in what for name in FORMATS_OF_PACKAGE)


@contextmanager
def bounded_memory() -> Iterator[None]:
    """Let the process allocate at most MOST_MEMORY more. Beyond it, an allocation raises MemoryError."""
    import resource

    soft, hard = resource.getrlimit(resource.RLIMIT_AS)
    statm = Path("/proc/self/statm")
    if not statm.exists():
        yield
        return
    bound = int(statm.read_text().split()[0]) * resource.getpagesize() + MOST_MEMORY
    resource.setrlimit(resource.RLIMIT_AS, (bound if soft == resource.RLIM_INFINITY else min(soft, bound), hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_AS, (soft, hard))


def _check_unpacked(path: Path) -> None:
    """Refuse a ZIP file whose unpacked size is too large. Python never unpacks more bytes than the file declares."""
    if not zipfile.is_zipfile(path):
        return
    with zipfile.ZipFile(path) as packed:
        size = sum(entry.file_size for entry in packed.infolist())
    if size > LARGEST_UNPACKED:
        refuse_file(f"{size} bytes when unpacked", f"at most {LARGEST_UNPACKED} bytes", "Crop the surface.")


def _contents(reader: Any, path: Path) -> SurfaceFile:
    channels = reader.height_channels
    if not channels:
        found = ", ".join(str(channel.name) for channel in reader.channels)[:80]
        refuse_file(f"the channels {found}" if found else "no channel", "a channel of heights", "Export the heights.")
    default = reader.default_channel
    if reader.format() in ARRAYS:
        channel = array_of_heights(channels)
    else:
        channel = default if default.is_height_channel else channels[0]
    points = tuple(channel.nb_grid_pts or (2,))
    check_shape(points[:1] if points[1:] == (1,) else points)
    sizes = {} if channel.physical_sizes is not None else {"physical_sizes": _counts(channel)}
    surface = channel.topography(**sizes)
    stored = np.ma.asarray(surface.heights())
    one_row = stored.ndim == 2 and stored.shape[1] == 1
    is_array = reader.format() in ARRAYS and bool(sizes)
    if is_array and path.read_bytes()[: len(HDF5)] == HDF5:
        check_attributes(path, str(channel.name))
    if is_array:
        check_array(stored)
    by_rows = stored if is_array else stored.T  # the package has x down an array, and programs have it across
    heights, missing = finite_heights(stored.ravel() if one_row else by_rows)
    notes: tuple[str, ...] = ()
    if len(channels) > 1:
        others = ", ".join(str(other.name) for other in channels if other is not channel)
        what_else = "arrays" if is_array else "channels of heights"
        notes = (f"It has other {what_else}, which were not read: {others[:120]}",)
    unit = _unit(surface.unit)
    if reader.format() == "nc" and unit is None:
        _check_attributes_of_netcdf(path)
    positions = None if surface.is_uniform or _spacing(surface) else np.asarray(surface.positions(), np.float64)
    if positions is not None and not np.all(np.diff(positions) > 0.0):
        refuse_file("a profile whose x does not increase", "x that increases", "Export it as text, and sort it by x.")
    return SurfaceFile(
        reader.format(),
        f"{reader.name()}, read by SurfaceTopography",
        heights,
        missing,
        unit,
        None if sizes or positions is not None else _spacing(surface)[: heights.ndim],
        unit,
        channel=str(channel.name),
        notes=notes,
        positions=positions,
    )


def _check_attributes_of_netcdf(path: Path) -> None:
    """Refuse a NetCDF whose heights have units in an attribute that the package leaves out."""
    if path.read_bytes()[: len(HDF5)] == HDF5:
        import h5py

        with h5py.File(path) as file:
            units = [found.attrs.get("units") for found in file.values() if len(getattr(found, "shape", ())) > 1]
    else:
        from scipy.io import netcdf_file

        with netcdf_file(path, mmap=False) as file:
            units = [getattr(one, "units", None) for one in file.variables.values() if len(one.dimensions) > 1]
    if stated := next(filter(None, units), None):
        shown = stated.decode("utf-8", "replace") if isinstance(stated, bytes) else str(stated)
        allowed, hint = "heights whose unit is known", "Save the heights as NPY, and give the unit."
        refuse_file(f"a NetCDF with units {shown[:40]!r}", allowed, hint)


def _unit(stated: str | None) -> str | None:
    """Return a stated unit as a key of UNITS. Some programs write UTF-8 in a format that requires Latin-1."""
    if stated is None or (unit := unit_named(stated)):
        return unit if stated else None
    with suppress(UnicodeError):
        if unit := unit_named(stated.encode("latin-1").decode("utf-8")):
            return unit
    refuse_file(f"heights in {stated}", "heights in a unit of length", "Export them in um.")


def _counts(channel: Any) -> tuple[float, ...]:
    """Return sizes that give a spacing of 1, for a file that states none."""
    return tuple(float(count) for count in channel.nb_grid_pts)


def _spacing(surface: Any) -> tuple[float, ...]:
    """Return the distances between points; none for a profile with unequal steps."""
    if surface.is_uniform:
        return tuple(float(value) for value in surface.pixel_size)
    steps = np.diff(surface.positions())
    mean = float(np.mean(steps))
    return (mean,) if np.all(np.abs(steps - mean) <= STEPS_WITHIN * abs(mean)) else ()
