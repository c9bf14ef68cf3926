"""Files that hold no heights that can be read, known by their first bytes: what each is, and what to export instead.

Stage   SURFACES, from files.
Model   A signature is bytes at a place. A format without one is known by the ending of its name, if its contents are
        not text. It is consulted after every reader has declined.
Limits  It names a file, and never reads it.
"""

from __future__ import annotations

import re
import zipfile
from pathlib import Path
from typing import NoReturn

from synth.surfaces.readers.surface_file import refuse_file

MESH = "Export a height map of it: a 16-bit PNG or a grid of heights as text, seen along one axis."
GREY = "Save the displacement map as grey: PNG of 16 bits, or TIFF."
ARRAY = "Save the array of heights as NPY, or as text."
TABLE = "Save the sheet with the heights as CSV or as text with tabs."
SOUND = "A sound has no heights. Import a profile as text or NPY."
PRINTED = "Export the numbers as text, or the map as a grey PNG."
LINES = "Write the heights as text, with one line for each point, or as NPY."
UNPACK = "Unpack it, and import the file of heights that is in it."
OWN = "Export the surface as X3P, SUR or text."
POINTS = "Save x, y and height of a lattice as text: x [mm]; y [mm]; z [um]."
PROFILE_RECORD = re.compile(rb"[ \t0-9.]*[\r\n]+PRF\b")
POINT_CLOUD = re.compile(rb"(?m)^FIELDS x y z\b")

SIGNATURES: tuple[tuple[int, bytes, str, str], ...] = (
    (0, b"solid ", "a mesh (STL, as text)", MESH),
    (0, b"ply\n", "a mesh (PLY)", MESH),
    (0, b"ply\r", "a mesh (PLY)", MESH),
    (0, b"# .PCD", "a cloud of points (PCD)", POINTS),
    (0, b"Kaydara FBX Binary", "a 3D scene (FBX)", MESH),
    (0, b"; FBX", "a 3D scene (FBX, as text)", MESH),
    (0, b"glTF", "a 3D scene (glTF)", MESH),
    (0, b"BLENDER", "a 3D scene (Blender)", MESH),
    (0, b"PXR-USDC", "a 3D scene (USD)", MESH),
    (0, b"#usda", "a 3D scene (USD, as text)", MESH),
    (0, b"ISO-10303-21", "a CAD model (STEP)", MESH),
    (0, b"DSRB", "a grid of Surfer 7", "Save it as a text grid (DSAA) or XYZ."),
    (0, b"DSBB", "a binary grid of Surfer 6", "Save it as a text grid (DSAA) or XYZ."),
    (0, b"ISO5436", "a profile of ISO 5436-2 (SMD)", OWN),
    (0, b"ISO 5436", "a profile of ISO 5436-2 (SMD)", OWN),
    (128, b"DICM", "a medical picture (DICOM)", GREY),
    (0, b"\x76\x2f\x31\x01", "a picture (OpenEXR)", "Save the map as TIFF of 32-bit real numbers, or PNG of 16 bits."),
    (0, b"#?RADIANCE", "a picture (Radiance HDR)", GREY),
    (0, b"#?RGBE", "a picture (Radiance HDR)", GREY),
    (0, b"DDS ", "a texture of a game (DDS)", GREY),
    (0, b"\xabKTX", "a texture of a game (KTX)", GREY),
    (0, b"GIF8", "a picture (GIF)", GREY),
    (0, b"P7\n", "a picture (PAM)", GREY),
    (0, b"PF\n", "a picture in colour (PFM)", GREY),
    (0, b"\0\0\x01\0", "an icon (ICO)", GREY),
    (0, b"\x0a\x05\x01", "a picture (PCX)", GREY),
    (0, b"\x01\xda", "a picture (SGI)", GREY),
    (0, b"8BPS", "a picture (Photoshop)", GREY),
    (0, b"gimp xcf", "a picture (GIMP)", GREY),
    (0, b"\0\0\0\x0cjP  ", "a picture (JPEG 2000)", GREY),
    (0, b"\xff\x0a", "a picture (JPEG XL)", GREY),
    (4, b"ftypavif", "a picture (AVIF)", GREY),
    (4, b"ftypheic", "a picture (HEIC)", GREY),
    (4, b"ftypmif1", "a picture (HEIC)", GREY),
    (4, b"ftyp", "a video or a sound (MP4)", SOUND),
    (0, b"\x1aE\xdf\xa3", "a video (Matroska, WebM)", SOUND),
    (8, b"WAVE", "a sound (WAV)", SOUND),
    (8, b"AVI ", "a video (AVI)", SOUND),
    (0, b"fLaC", "a sound (FLAC)", SOUND),
    (0, b"OggS", "a sound (Ogg)", SOUND),
    (0, b"ID3", "a sound (MP3)", SOUND),
    (0, b"\xff\xfb", "a sound (MP3)", SOUND),
    (0, b"\xff\xf3", "a sound (MP3)", SOUND),
    (8, b"AIFF", "a sound (AIFF)", SOUND),
    (0, b"%PDF", "a document (PDF)", PRINTED),
    (0, b"%!PS", "a document (PostScript)", PRINTED),
    (0, b"{\\rtf", "a document (RTF)", PRINTED),
    (0, b"\xd0\xcf\x11\xe0", "a document of an older Office, such as XLS or DOC", TABLE),
    (0, b"\x89HDF", "a file of arrays (HDF5)", ARRAY),
    (0, b"MATLAB 5.0", "a file of arrays (MATLAB)", ARRAY),
    (0, b"CDF\x01", "a file of arrays (NetCDF)", ARRAY),
    (0, b"CDF\x02", "a file of arrays (NetCDF)", ARRAY),
    (0, b"SIMPLE  =", "a file of arrays (FITS)", ARRAY),
    (0, b"PAR1", "a table (Parquet)", TABLE),
    (0, b"ARROW1", "a table (Arrow)", TABLE),
    (0, b"SQLite format 3", "a database (SQLite)", TABLE),
    (0, b"\x1f\x8b", "a packed file (gzip)", UNPACK),
    (0, b"BZh", "a packed file (bzip2)", UNPACK),
    (0, b"\xfd7zXZ", "a packed file (xz)", UNPACK),
    (0, b"7z\xbc\xaf", "a packed file (7-Zip)", UNPACK),
    (0, b"Rar!", "a packed file (RAR)", UNPACK),
    (0, b"\x28\xb5\x2f\xfd", "a packed file (Zstandard)", UNPACK),
    (257, b"ustar", "a packed file (TAR)", UNPACK),
    (0, b"MZ", "a program", "Import the file of heights."),
    (0, b"\x7fELF", "a program", "Import the file of heights."),
    (0, b"\x93NUMPY", "a damaged NPY file", "Save it again."),
    (0, b"Gwyddion Simple Field", "a field of Gwyddion (GSF)", "Save it as GWY, or as text."),
    (0, b"Gwyddion XYZ Field", "points of Gwyddion (GXYZF)", "Save them as text."),
    (0, b"\\*File list", "a file of Bruker, Veeco or Digital Instruments", OWN),
    (0, b"\\*Force file list", "a force curve of Bruker", "Import the file of the topography."),
    (0, b"PK\x03\x04", "a packed file (ZIP)", UNPACK),
)
MARKUP = (
    (b"<!doctype html", "a web page (HTML)", "Save the numbers as text."),
    (b"<html", "a web page (HTML)", "Save the numbers as text."),
    (b"<table", "a table of a web page (HTML)", "Save the numbers as text."),
    (b"<svg", "a drawing (SVG)", GREY),
    (b"<", "XML", LINES),
)
"""Beginnings of text in small letters, after spaces."""
IN_ZIP = (
    ("word/", "a document (DOCX)", PRINTED),
    ("ppt/", "a presentation (PPTX)", PRINTED),
    ("xl/", "a spreadsheet (XLSX)", TABLE),
    ("3D/", "a mesh (3MF)", MESH),
    ("content.xml", "a document or a spreadsheet of LibreOffice (ODT, ODS)", TABLE),
)
TRIANGLES = 84  # place of the first of the triangles of an STL file, of 50 bytes each
BY_ENDING = {
    ".stl": ("a mesh (STL)", MESH),
    ".obj": ("a mesh (OBJ)", MESH),
    ".mtl": ("the materials of a mesh (MTL)", "Import the displacement map that it names."),
    ".3ds": ("a mesh (3DS)", MESH),
    ".raw": ("numbers without a header (RAW)", "Save them as PNG of 16 bits, TIFF or NPY."),
    ".r16": ("numbers without a header (RAW)", "Save them as PNG of 16 bits, TIFF or NPY."),
    ".tga": ("a picture (TGA)", GREY),
    ".mat": ("a file of arrays (MATLAB)", ARRAY),
    ".pkl": ("a file of Python (pickle)", ARRAY),
}
ALLOWED = "text, NPY, an image of heights, or a format of an instrument (docs/import.md)"
OF_TEXT = ("v ", "vn ", "vt ", "mtllib ", "o ", "g ")  # beginnings of lines of an OBJ


def known(head: bytes, ending: str, path: Path | None) -> tuple[str, str] | None:
    """Return what the file is, and what to export instead; None if it is not known.

    head: its first bytes.
    ending: of its name, in small letters.
    path: None for text alone.
    """
    start = head.removeprefix(b"\xef\xbb\xbf")
    if path and start.startswith(b"PK\x03\x04") and zipfile.is_zipfile(path):
        with zipfile.ZipFile(path) as packed:
            names = packed.namelist()
        for begin, what, hint in IN_ZIP:
            if any(name.startswith(begin) for name in names):
                return what, hint
    for place, signature, what, hint in SIGNATURES:
        if start[place : place + len(signature)] == signature:
            return what, hint
    triangles = int.from_bytes(head[TRIANGLES - 4 : TRIANGLES], "little")
    if path and triangles and path.stat().st_size == TRIANGLES + 50 * triangles:
        return "a mesh (STL)", MESH
    if POINT_CLOUD.search(start):
        return "a cloud of points (PCD)", POINTS
    if PROFILE_RECORD.match(start):
        return "a record of a profile (PRF)", LINES
    if is_json(start):
        return "JSON, or lists in brackets", LINES
    markup = start.lstrip().lower()
    found = next(((what, hint) for begin, what, hint in MARKUP if markup.startswith(begin)), None)
    return found or BY_ENDING.get(ending)


def is_json(head: bytes) -> bool:
    """Return whether text begins as JSON does: an object, or a list of lists, objects, texts or numbers."""
    return bool(re.match(rb"\s*(?:\{|\[\s*(?:[\[{\"]|-?[0-9.eE+-]+\s*,))", head))


def mesh_as_text(head: bytes) -> bool:
    """Return whether text is an OBJ: lines of vertices."""
    lines = [line for line in head.decode("latin-1").splitlines()[:-1] if line.strip() and line[0] != "#"]
    return bool(lines) and all(line.startswith((*OF_TEXT, "s ", "f ", "usemtl ")) for line in lines)


def refuse_unknown(head: bytes, ending: str, path: Path) -> NoReturn:
    """Raise InvalidRequest for a file that no reader takes."""
    refuse_known(head, ending, path)
    refuse_file("a file of no known format", ALLOWED, "Export the surface as X3P or as text.")


def refuse_known(head: bytes, ending: str, path: Path | None) -> None:
    """Raise InvalidRequest for a file that is known; return for any other."""
    if found := ("a mesh (OBJ)", MESH) if mesh_as_text(head) else known(head, ending, path):
        refuse_file(found[0], ALLOWED, found[1])
