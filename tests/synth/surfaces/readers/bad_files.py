"""Two hundred files that no surface can be read from, or not without being told more: cut, false, bombs, empty.

Each is made from a seed, so that a failure can be repeated: `python -m tests.synth.surfaces.readers.bad_files FOLDER`.
"""

from __future__ import annotations

import io
import struct
import sys
import zipfile
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image


def png_of(width: int, height: int, bits: int = 16, colour: int = 0, content: bytes = b"") -> bytes:
    """Return a PNG with a header that may lie about its contents."""

    def chunk(kind: bytes, body: bytes) -> bytes:
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))

    header = struct.pack(">IIBBBBB", width, height, bits, colour, 0, 0, 0)
    return (
        b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(content, 9)) + chunk(b"IEND", b"")
    )


def npy_of(values: Any) -> bytes:
    written = io.BytesIO()
    np.save(written, values, allow_pickle=True)
    return written.getvalue()


def npy_that_lies(shape: tuple[int, ...], kind: str = "<f8") -> bytes:
    """Return an NPY file whose header declares `shape`, with 64 bytes of numbers."""
    header = repr({"descr": kind, "fortran_order": False, "shape": shape}).encode().ljust(117) + b"\n"
    return b"\x93NUMPY\x01\0" + struct.pack("<H", len(header)) + header + bytes(64)


def image_of(pixels: np.ndarray[Any, Any], kind: str) -> bytes:
    written = io.BytesIO()
    Image.fromarray(pixels).save(written, kind)
    return written.getvalue()


def tiff_that_lies(width: int, height: int) -> bytes:
    """Return a TIFF header of `width` x `height` pixels of 16 bits, with 8 bytes of pixels."""
    tags = [(256, width), (257, height), (258, 16), (259, 1), (262, 1), (273, 150), (277, 1), (278, height), (279, 8)]
    entries = b"".join(struct.pack("<HHII", tag, 4, 1, value) for tag, value in tags)
    return b"II*\0" + struct.pack("<IH", 8, len(tags)) + entries + bytes(4 + 32)


def zip_of(name: str, content: bytes, times: int = 1) -> bytes:
    written = io.BytesIO()
    with (
        zipfile.ZipFile(written, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as packed,
        packed.open(name, "w", force_zip64=True) as file,
    ):
        for _ in range(times):
            file.write(content)
    return written.getvalue()


def bad_files() -> Iterator[tuple[str, bytes]]:
    """Yield 200 names with contents."""
    rng = np.random.default_rng(11)
    grid = rng.random((40, 50))
    whole = {
        "npy": npy_of(grid),
        "png": image_of((grid * 65535).astype(np.uint16), "PNG"),
        "tif": image_of((grid * 65535).astype(np.uint16), "TIFF"),
        "x3p": zip_of("main.xml", b"<p:ISO5436_2 xmlns:p='x'><Record1></Record1></p:ISO5436_2>"),
    }
    for ending, content in whole.items():  # 60: cut at every stage
        for place in range(15):
            yield f"cut-{place}.{ending}", content[: len(content) * place // 15]
    for index in range(40):  # 40: noise with and without the right beginning
        beginning = (b"", b"\x93NUMPY\x01\0", b"\x89PNG\r\n\x1a\n", b"II*\0", b"PK\x03\x04")[index % 5]
        ending = ("npy", "png", "tif", "csv", "sur", "opd", "x3p", "gwy")[index % 8]
        yield f"noise-{index}.{ending}", beginning + rng.bytes(300)
    for index, (width, height) in enumerate(((40_000, 40_000), (2**31 - 1, 2), (1, 1), (0, 5), (60_000, 60_000))):
        yield f"bomb-{index}.png", png_of(width, height, content=bytes(1_000_000))
        yield f"bomb-{index}.tif", tiff_that_lies(width, height)
        yield f"bomb-{index}.npy", npy_that_lies((height, width))
        yield f"colour-{index}.png", png_of(width, height, 8, 2, bytes(1000))  # 20
    yield "zeros.zip", zip_of("zeros.bin", bytes(2**20), 260)
    yield "zeros.x3p", zip_of("main.xml", bytes(2**20), 40)
    yield "objects.npy", npy_of(np.array([{"a": 1}, None], dtype=object))
    yield "words.npy", npy_of(np.array(["a", "b"]))
    yield "cube.npy", npy_of(np.zeros((3, 3, 3)))
    yield "one.npy", npy_of(np.zeros((1, 1)))
    yield "scalar.npy", npy_of(np.float64(3.0))
    yield "nan.npy", npy_of(np.full((8, 8), np.nan))
    yield "nan.csv", b"nan\nnan\nnan\n"
    yield "empty.csv", b""  # 10
    yield from _bad_texts(rng)


def _bad_texts(rng: np.random.Generator) -> Iterator[tuple[str, bytes]]:
    """Yield 70 text files."""
    for index in range(20):
        rows = [" ".join(f"{value:.3f}" for value in rng.random(6)) for _ in range(10)]
        row = int(rng.integers(1, 10))
        rows[row] = rows[row].rsplit(" ", 1)[0] if index % 2 else rows[row].replace(".", "x", 1)
        yield f"row-{index}.txt", "\n".join(rows).encode()
    for index in range(20):
        points = rng.random((12, 3))
        yield f"scattered-{index}.xyz", "\n".join(" ".join(map(str, point)) for point in points).encode()
    for index in range(10):
        yield f"words-{index}.csv", ("height;of;what\n" * (index + 1)).encode()
    for index in range(10):
        yield f"unequal-{index}.csv", "\n".join(f"{index + x**1.3};1" for x in range(9)).encode()
    for index in range(5):
        yield f"comma-{index}.csv", f"1,{index}\n2,{index}\n".encode()
    yield "far.xyz", b"0 0 1\n1e9 1e9 1\n1 1 1\n0 1 1\n"
    yield "twice.xyz", b"0 0 1\n0 0 2\n1 0 1\n1 1 1\n0 1 1\n"
    yield "zero.bin", bytes(100_000)
    yield "utf16.txt", b"\xff\xfe" + b"1\0\n"
    yield "many-columns.csv", b";".join([b"1"] * 10) + b"\n" + b";".join([b"1"] * 9)


if __name__ == "__main__":
    for file_name, file_content in bad_files():
        (Path(sys.argv[1]) / file_name).write_bytes(file_content)
