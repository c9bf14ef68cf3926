"""A grey picture as a PNG file, for which no dependency has a writer.

Stage   ENCODE.
Source  PNG, third edition (W3C 2025): signature, then the chunks IHDR, IDAT and IEND, each with length and CRC-32. Each
        row begins with its filter: type 2 (Up) stores the difference from the row above, which is 0 for equal rows.
Limits  8 bits of grey, no metadata.
"""

from __future__ import annotations

import struct
import zlib

import numpy as np

from synth.surfaces.lit_picture import Picture

SIGNATURE = b"\x89PNG\r\n\x1a\n"
UP = 2


def png_of(picture: Picture) -> bytes:
    """Return the PNG file of `picture`, uint8 [rows, columns]: 0 is black, 255 is white."""
    rows, columns = picture.shape
    filtered = np.diff(picture, axis=0, prepend=np.zeros((1, columns), np.uint8))  # modulo 256, as PNG wants
    lines = np.insert(filtered, 0, UP, axis=1)
    header = struct.pack(">IIBBBBB", columns, rows, 8, 0, 0, 0, 0)
    chunks = ((b"IHDR", header), (b"IDAT", zlib.compress(lines.tobytes(), 9)), (b"IEND", b""))
    return SIGNATURE + b"".join(
        struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))
        for kind, content in chunks
    )
