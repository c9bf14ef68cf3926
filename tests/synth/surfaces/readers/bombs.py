"""Small files that would take a great deal of memory or time if their headers were believed."""

from __future__ import annotations

import gzip
import io
import struct
import tempfile
import zipfile
import zlib
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from PIL import Image

from tests.synth.surfaces.readers.bad_files import npy_that_lies, png_of, tiff_that_lies, zip_of

MEGABYTE = bytes(2**20)


def bombs() -> Iterator[tuple[str, bytes]]:
    """Yield names with contents."""
    yield "zeros.zip", zip_of("zeros.bin", MEGABYTE, 300)
    yield "zeros.npz", zip_of("zeros.npy", MEGABYTE, 300)
    yield "zeros.x3p", zip_of("main.xml", MEGABYTE, 250)
    yield "zeros.xlsx", zip_of("xl/workbook.xml", MEGABYTE, 300)
    yield "entries.zip", entries(300_000)
    yield "entries.npz", entries(300_000, "a.npy")
    yield "overlap.x3p", overlapping(2000)
    yield "nested.npz", zip_of("a.npy", zip_of("a.npy", MEGABYTE, 256))
    yield "zeros.csv.gz", gzip.compress(MEGABYTE * 64, 1)
    yield "zeros.gwy", gzip.compress(MEGABYTE * 64, 1)
    yield "laughs.x3p", xml(laughs())
    yield "quadratic.x3p", xml(quadratic())
    yield "outside.x3p", xml(b'<!DOCTYPE a [<!ENTITY b SYSTEM "file:///etc/passwd">]><ISO5436_2>&b;</ISO5436_2>')
    yield "deep.x3p", xml(b"<a>" * 100_000)
    yield "sizes.x3p", x3p_that_lies(2**40, 2**40)
    yield "square.png", png_of(40_000, 40_000, content=bytes(4_000_000))
    yield "longest.png", png_of(2**31 - 1, 2**31 - 1)
    yield "inflating.png", png_of(512, 512, content=MEGABYTE * 64)
    yield "text.png", png_with(b"zTXt", b"a\0\0" + zlib.compress(MEGABYTE * 128, 6))
    yield "profile.png", png_with(b"iCCP", b"a\0\0" + zlib.compress(MEGABYTE * 128, 6))
    yield "terabytes.tif", tiff_that_lies(2**31, 2**31)
    yield "terabytes-big.tif", big_tiff()
    yield "cycle.tif", b"II*\0" + struct.pack("<IH", 8, 0) + struct.pack("<I", 8)
    yield "tags.tif", b"II*\0" + struct.pack("<IH", 8, 65535) + struct.pack("<HHII", 256, 4, 2**31, 8) * 65535
    yield "terabytes.npy", npy_that_lies((2**40,))
    yield "square.npy", npy_that_lies((2**32, 2**32))
    yield "negative.npy", npy_that_lies((-1, -(2**40)))
    yield "item.npy", npy_that_lies((2, 2), "<f8000000000")
    yield "words.npy", npy_that_lies((2, 2), "<U1000000000")
    yield "digits.npy", npy_that_lies_in_text(b"9" * 60_000)
    yield "terabytes.pgm", b"P5 1000000 1000000 255\n" + bytes(64)
    yield "digits.pgm", b"P5 " + b"9" * 5000 + b" 4 255\n"
    yield (
        "terabytes.bmp",
        b"BM" + struct.pack("<IIIIiiHHIIIIII", 54, 0, 54, 40, 2**31 - 1, 2**31 - 1, 1, 24, 0, 0, 0, 0, 0, 0),
    )
    yield "scans.jpg", scans(400)
    yield "sizes.jpg", of_image("JPEG").replace(struct.pack(">HH", 16, 16), b"\xff\xff\xff\xff", 1)
    yield "sizes.webp", of_image("WEBP")[:26] + b"\xff\x3f\xff\x3f" + of_image("WEBP")[30:]
    yield "terabytes.h5", hdf5()
    yield "terabytes.mat", matlab(2**31 - 1, 2**31 - 1)
    yield "zeros.mat", matlab_packed(160)
    yield "terabytes.nc", b"CDF\x01" + struct.pack(">III", 0, 10, 1) + struct.pack(">I4sI", 1, b"x\0\0\0", 2**31 - 1)
    yield "terabytes.sur", b"DIGITAL SURF".ljust(98, b"\0") + b"\xff\x7f" * 207
    yield "columns.csv", b"1;" * 20_000
    yield "digits.csv", b"9" * 1_000_000 + b"\n1\n"
    yield "lines.csv", b"\n" * 1_000_000
    yield "header.csv", b"# word = 1\n" * 100_000
    yield "numbers-only-names.csv", b"Z" * 1_000_000 + b"\n1\n2\n"
    yield "quotes.csv", b'"' * 2_000_000
    yield "grid.grd", b"DSAA\n1000000 1000000\n0 1\n0 1\n0 1\n1 2 3\n"
    yield "triangles.stl", bytes(80) + struct.pack("<I", 2**32 - 1) + bytes(50)
    yield "vertices.obj", b"v 0 0 0\n" * 100_000


def xml(text: bytes) -> bytes:
    """Return an X3P with this document."""
    written = io.BytesIO()
    with zipfile.ZipFile(written, "w", zipfile.ZIP_DEFLATED) as packed:
        packed.writestr("main.xml", text)
        packed.writestr("data.bin", bytes(64))
    return written.getvalue()


def laughs() -> bytes:
    lines = b"".join(b'<!ENTITY a%d "%s">' % (level, b"&a%d;" % (level - 1) * 10) for level in range(1, 30))
    return b'<!DOCTYPE a [<!ENTITY a0 "ha">' + lines + b"]><ISO5436_2>&a29;</ISO5436_2>"


def quadratic() -> bytes:
    return b'<!DOCTYPE a [<!ENTITY a "' + b"a" * 200_000 + b'">]><ISO5436_2>' + b"&a;" * 50_000 + b"</ISO5436_2>"


def x3p_that_lies(columns: int, rows: int) -> bytes:
    step = "<AxisType>I</AxisType><DataType>D</DataType><Increment>1e-6</Increment>"
    axes = f"<CX>{step}</CX><CY>{step}</CY><CZ><AxisType>A</AxisType><DataType>D</DataType></CZ>"
    sizes = f"<SizeX>{columns}</SizeX><SizeY>{rows}</SizeY><SizeZ>1</SizeZ>"
    first = f"<Revision>ISO5436 - 2000</Revision><FeatureType>SUR</FeatureType><Axes>{axes}</Axes>"
    third = f"<MatrixDimension>{sizes}</MatrixDimension><DataLink><PointDataLink>data.bin</PointDataLink></DataLink>"
    return xml(f"<ISO5436_2><Record1>{first}</Record1><Record3>{third}</Record3></ISO5436_2>".encode())


def entries(count: int, name: str = "a") -> bytes:
    """Return a ZIP file whose directory has `count` entries for one part."""
    whole = zip_of(name, b"1")
    place, end = whole.rfind(b"PK\x01\x02"), whole.rfind(b"PK\x05\x06")
    directory = whole[place:end] * count
    size = struct.pack("<IHHHHIIH", 0x06054B50, 0, 0, count & 0xFFFF, count & 0xFFFF, len(directory), place, 0)
    return whole[:place] + directory + size


def overlapping(count: int) -> bytes:
    """Return a ZIP file with `count` names for one part of a megabyte."""
    return entries_of(zip_of("main.xml", MEGABYTE), count)


def entries_of(whole: bytes, count: int) -> bytes:
    place, end = whole.rfind(b"PK\x01\x02"), whole.rfind(b"PK\x05\x06")
    directory = whole[place:end] * count
    return (
        whole[:place] + directory + struct.pack("<IHHHHIIH", 0x06054B50, 0, 0, count, count, len(directory), place, 0)
    )


def png_with(kind: bytes, body: bytes) -> bytes:
    whole = png_of(16, 16, content=bytes(16 * 33))
    chunk = struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))
    return whole[:33] + chunk + whole[33:]


def big_tiff() -> bytes:
    tags = [(256, 2**62), (257, 2**62), (258, 16), (273, 150), (278, 2**62), (279, 2**62)]
    body = b"".join(struct.pack("<HHQQ", tag, 16, 1, value) for tag, value in tags)
    return b"II+\0" + struct.pack("<HHQQ", 8, 0, 16, len(tags)) + body + bytes(64)


def npy_that_lies_in_text(number: bytes) -> bytes:
    header = b"{'descr': '<f8', 'fortran_order': False, 'shape': (" + number + b",)}\n"
    return b"\x93NUMPY\x01\0" + struct.pack("<H", len(header)) + header + bytes(64)


def of_image(kind: str) -> bytes:
    written = io.BytesIO()
    Image.fromarray(np.zeros((16, 16), np.uint8)).save(written, kind)
    return written.getvalue()


def scans(count: int) -> bytes:
    """Return a progressive JPEG that repeats its last scan."""
    written = io.BytesIO()
    Image.fromarray(np.zeros((512, 512), np.uint8)).save(written, "JPEG", progressive=True)
    whole = written.getvalue()
    place = whole.rfind(b"\xff\xda")
    return whole[:-2] + whole[place:-2] * count + whole[-2:]


def hdf5() -> bytes:
    """Return an HDF5 file with an array of 2^40 x 2^20 numbers, none of which is stored; empty without h5py."""
    try:
        import h5py
    except ImportError:
        return b"\x89HDF\r\n\x1a\n" + bytes(64)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.h5"
        with h5py.File(path, "w") as file:
            file.create_dataset("heights", (2**40, 2**20), "f8", chunks=(1024, 1024), compression="gzip")
        return path.read_bytes()


def matlab(rows: int, columns: int) -> bytes:
    """Return a MAT file of level 5 that declares a matrix of so many rows and columns."""
    flags, sizes = struct.pack("<IIII", 6, 8, 6, 0), struct.pack("<IIii", 5, 8, rows, columns)
    body = flags + sizes + struct.pack("<HH4s", 1, 1, b"a") + struct.pack("<II", 9, 0xFFFFFFF8)
    return b"MATLAB 5.0 MAT-file".ljust(124) + b"\0\1IM" + struct.pack("<II", 14, len(body)) + body


def matlab_packed(megabytes: int) -> bytes:
    size = megabytes * 2**20
    flags, sizes = struct.pack("<IIII", 6, 8, 6, 0), struct.pack("<IIii", 5, 8, 2, size // 16)
    body = flags + sizes + struct.pack("<HH4s", 1, 1, b"a") + struct.pack("<II", 9, size)
    packing = zlib.compressobj(1)
    parts = [packing.compress(struct.pack("<II", 14, len(body) + size) + body)]
    parts += [packing.compress(MEGABYTE) for _ in range(megabytes)]
    packed = b"".join([*parts, packing.flush()])
    return b"MATLAB 5.0 MAT-file".ljust(124) + b"\0\1IM" + struct.pack("<II", 15, len(packed)) + packed
