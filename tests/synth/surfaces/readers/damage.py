"""Whole files of every format that an import reads or names, and random damage to them, from a seed."""

from __future__ import annotations

import io
import struct
import tempfile
import zipfile
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from tests.synth.surfaces.readers.refused_files import REFUSED, zipped
from tests.synth.surfaces.readers.usual_files import UsualFile, usual_files

HUGE = (b"\xff" * 8, b"\xff\xff\xff\x7f", b"\xff\xff\xff\xff", b"\0\0\0\x80", b"\xff\x7f", bytes(4), b"\x7f" * 8)
HUGE_TEXT = (b"9" * 30, b"1e308", b"-1", b"nan", b"0", b"1e-300", b"\xc3", b"\0", b"\n", b'"', b";" * 50)
PLACES_OF_HEADERS = 256  # bytes at the beginning, where sizes stand
PNG_BEGIN = 8  # bytes before the first chunk
SPREADSHEET = {
    "[Content_Types].xml": b'<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types"/>',
    "xl/workbook.xml": b'<workbook xmlns="http://schemas.openxmlformats.org/spreadsheetml/2006/main"><sheets/></workbook>',
    "xl/worksheets/sheet1.xml": b"<worksheet><sheetData><row><c><v>1.5</v></c></row></sheetData></worksheet>",
}
MESH = struct.pack("<80sI", b"mesh", 4) + bytes(range(200))
VERTICES = "".join(f"v {x} {y} {x * y}\n" for x in range(8) for y in range(8)) + "f 1 2 3\nf 2 3 4\n"


def whole_files() -> dict[str, list[UsualFile]]:
    """Return the formats, each with its whole files."""
    usual = [one for one in usual_files() if one not in REFUSED and not one.refusal]
    endings = {
        **{"PNG": (".png",), "JPEG": (".jpg",), "BMP": (".bmp",), "WebP": (".webp",), "TIFF": (".tif",)},
        **{"PNM": (".pgm", ".pfm"), "NPY": (".npy",), "NPZ": (".npz",), "Surfer": (".grd",)},
    }
    binary = tuple(ending for several in endings.values() for ending in several)
    text = [one for one in usual if not one.name.endswith(binary)]
    groups: dict[str, list[UsualFile]] = {
        "text: profiles": [one for one in text if len(one.spacing) == 1 and not one.name.endswith(".csv")],
        "text: spreadsheets": [one for one in text if len(one.spacing) == 1 and one.name.endswith(".csv")],
        "text: grids": [one for one in text if len(one.spacing) == 2],
        "text: refused": [one for one in REFUSED if one.name.endswith((".txt", ".csv", ".xyz")) and one.content],
    }
    groups |= {name: [one for one in usual if one.name.endswith(several)] for name, several in endings.items()}
    groups["NPZ"].append(
        UsualFile("stored.npz", "NumPy", zipped(heights_npy=_npy()), options={"unit": "um", "pixel": "5 um"})
    )
    groups["XLSX"] = [UsualFile("sheet.xlsx", "Excel", _zip(SPREADSHEET))]
    groups["STL"] = [_named("mesh.stl", MESH), next(one for one in REFUSED if one.name == "mesh-text.stl")]
    groups["OBJ"] = [_named("mesh.obj", VERTICES.encode())]
    groups["others"] = [one for one in REFUSED if one.content and not one.name.endswith((".txt", ".csv", ".xyz"))]
    return {name: several for name, several in (groups | _of_package()).items() if several}


def damaged(content: bytes, rng: np.random.Generator) -> bytes:
    """Return `content` with one damage, or with up to four.

    A third of ZIP and PNG files is damaged within valid checksums.
    """
    if rng.random() < 1 / 3:
        if content.startswith(b"PK\x03\x04"):
            return _damaged_part(content, rng)
        if content.startswith(b"\x89PNG"):
            return _damaged_chunk(content, rng)
    for _ in range(1 if rng.random() < 0.6 else int(rng.integers(2, 5))):
        content = DAMAGES[int(rng.integers(len(DAMAGES)))](content, rng)
    return content


def _flipped(content: bytes, rng: np.random.Generator) -> bytes:
    changed = bytearray(content)
    for place in rng.integers(max(1, len(content)), size=int(rng.integers(1, 17))):
        changed[place : place + 1] = bytes([int(rng.integers(256))])
    return bytes(changed)


def _bit(content: bytes, rng: np.random.Generator) -> bytes:
    place = int(rng.integers(max(1, len(content))))
    return (
        content[:place]
        + bytes(byte ^ 1 << int(rng.integers(8)) for byte in content[place : place + 1])
        + content[place + 1 :]
    )


def _inserted(content: bytes, rng: np.random.Generator) -> bytes:
    place = int(rng.integers(len(content) + 1))
    return content[:place] + rng.bytes(int(rng.integers(1, 64))) + content[place:]


def _removed(content: bytes, rng: np.random.Generator) -> bytes:
    place = int(rng.integers(len(content) + 1))
    return content[:place] + content[place + int(rng.integers(1, 64)) :]


def _cut(content: bytes, rng: np.random.Generator) -> bytes:
    return content[: int(rng.integers(len(content) + 1))]


def _repeated(content: bytes, rng: np.random.Generator) -> bytes:
    begin, end = sorted(rng.integers(len(content) + 1, size=2).tolist())
    return content[:end] + content[begin:]


def _zeroed(content: bytes, rng: np.random.Generator) -> bytes:
    place, size = int(rng.integers(len(content) + 1)), int(rng.integers(1, 64))
    return content[:place] + bytes(min(size, len(content) - place)) + content[place + size :]


def _size_in_header(content: bytes, rng: np.random.Generator) -> bytes:
    """Overwrite a number, more often near the beginning, with a huge one, a negative one or 0."""
    last = min(PLACES_OF_HEADERS, len(content)) if rng.random() < 2 / 3 else len(content)
    place, value = int(rng.integers(last + 1)), HUGE[int(rng.integers(len(HUGE)))]
    return content[:place] + value + content[place + len(value) :]


def _word(content: bytes, rng: np.random.Generator) -> bytes:
    """Write a word of text that is no number, or a huge one, over a few bytes."""
    place, value = int(rng.integers(len(content) + 1)), HUGE_TEXT[int(rng.integers(len(HUGE_TEXT)))]
    return content[:place] + value + content[place + int(rng.integers(4)) :]


def _entry_of_zip(content: bytes, rng: np.random.Generator) -> bytes:
    """Change a byte of a directory, of a local head or of the end of a ZIP file; else, flip bytes."""
    signature = (b"PK\x01\x02", b"PK\x03\x04", b"PK\x05\x06")[int(rng.integers(3))]
    place = content.rfind(signature)
    if place < 0:
        return _flipped(content, rng)
    place += int(rng.integers(46))
    value = HUGE[int(rng.integers(len(HUGE)))] if rng.random() < 0.5 else rng.bytes(1)
    return content[:place] + value + content[place + len(value) :]


DAMAGES: tuple[Callable[[bytes, np.random.Generator], bytes], ...] = (
    *(_flipped, _bit, _inserted, _removed, _cut, _repeated, _zeroed, _size_in_header, _word, _entry_of_zip),
)


def _damaged_part(content: bytes, rng: np.random.Generator) -> bytes:
    """Damage a part of a ZIP file, and pack it again."""
    with zipfile.ZipFile(io.BytesIO(content)) as packed:
        parts = {name: packed.read(name) for name in packed.namelist()}
    name = list(parts)[int(rng.integers(len(parts)))]
    parts[name] = damaged(parts[name], rng)
    return _zip(parts)


def _damaged_chunk(content: bytes, rng: np.random.Generator) -> bytes:
    """Damage one chunk of a PNG, and correct its length and its checksum."""
    chunks, place = [], PNG_BEGIN
    while place < len(content):
        (length,) = struct.unpack_from(">I", content, place)
        chunks.append((content[place + 4 : place + 8], content[place + 8 : place + 8 + length]))
        place += 12 + length
    number = int(rng.integers(len(chunks)))
    kind, body = chunks[number]
    unpacked = kind == b"IDAT" and rng.random() < 0.5
    body = zlib.compress(damaged(zlib.decompress(body), rng)) if unpacked else damaged(body, rng)
    chunks[number] = kind, body
    written = [
        struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body)) for kind, body in chunks
    ]
    return content[:PNG_BEGIN] + b"".join(written)


def _zip(parts: dict[str, bytes]) -> bytes:
    written = io.BytesIO()
    with zipfile.ZipFile(written, "w", zipfile.ZIP_DEFLATED) as file:
        for name, content in parts.items():
            file.writestr(name, content)
    return written.getvalue()


def _npy() -> bytes:
    written = io.BytesIO()
    np.save(written, np.arange(12.0).reshape(3, 4))
    return written.getvalue()


def _named(name: str, content: bytes, **options: str) -> UsualFile:
    return UsualFile(name, "", content, options=options)


def _of_package() -> dict[str, list[UsualFile]]:
    """Return files of the formats that the extra `surfaces` reads; none where it is not installed."""
    try:
        import SurfaceTopography as package
    except ImportError:
        return {}
    from tests.synth.surfaces.readers.test_topography_package import CASES, _x3p

    def made(name: str, write: Callable[[Path, Any], None], **options: str) -> UsualFile:
        with tempfile.TemporaryDirectory() as folder:
            write(Path(folder) / name, package)
            return _named(name, (Path(folder) / name).read_bytes(), **options)

    def case(name: str) -> UsualFile:
        write, options = CASES[name]
        return made(name, write, **options)

    return {
        "X3P": [made("scan.x3p", lambda path, _: _x3p(path, "SUR"))],
        "HDF5": [case("scan.h5"), made("packed.h5", _packed_hdf5, unit="um", pixel="5 um")],
        "MAT": [case("scan.mat"), made("packed.mat", _packed_matlab, unit="um", pixel="5 um")],
        "NetCDF": [case("scan.nc"), case("line.nc")],
        "SDF": [case("scan.sdf")],
        "Gwyddion": [case("scan.gwy")],
        "BCR": [case("scan.bcr")],
        "SUR": [case("scan.sur")],
        "signatures of instruments": _signatures(),
    }


def _signatures() -> list[UsualFile]:
    """Return bytes behind the beginning that each further format of the package has."""
    from synth.surfaces.readers.topography_package import BY_NAME, INSTRUMENTS

    noise = np.random.default_rng(3).bytes(2000)
    signed = [
        _named(f"scan{number}.any", bytes(place) + begin + noise)
        for number, (place, begin, _) in enumerate(INSTRUMENTS)
    ]
    return [*signed, *(_named(f"scan{ending}", noise) for ending in BY_NAME)]


def _packed_hdf5(path: Path, _package: Any) -> None:
    import h5py

    with h5py.File(path, "w") as file:
        heights = np.arange(600.0).reshape(20, 30)
        file.create_dataset("group/heights", data=heights, chunks=(5, 6), compression="gzip", shuffle=True)
        file["heights"] = heights.astype(">f4")


def _packed_matlab(path: Path, _package: Any) -> None:
    from scipy.io import savemat

    savemat(path, {"heights": np.arange(600.0).reshape(20, 30), "words": "a word"}, do_compression=True)
