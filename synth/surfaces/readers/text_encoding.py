"""The encoding of a text file, told from its bytes.

Stage   SURFACES, from files.
Model   A byte order mark decides. Without one, zero bytes at every second place are UTF-16. Else the file is UTF-8 if
        all of it is. Else it is in a code page, which is told by how it writes µm: the only sign that matters here.
        Two letters of Cyrillic in a row are Windows 1251. Everything else is read as Windows 1252, which has µ, ² and °
        at the places where 1250 and Latin-1 have µ and °.
Limits  Other letters of a code page may be read as the wrong ones. No number and no unit depends on them.
"""

from __future__ import annotations

import codecs
import re
from pathlib import Path

HEAD = 65536  # bytes that decide between code pages: the header and the first numbers
MARKS = (
    (codecs.BOM_UTF8, "utf-8-sig", "UTF-8 with a mark"),
    (codecs.BOM_UTF16_LE, "utf-16", "UTF-16"),
    (codecs.BOM_UTF16_BE, "utf-16", "UTF-16"),
)
CODE_PAGES = (
    (rb"\x83\xcam", "cp932", "Shift JIS"),
    (rb"\xa6\xccm", "gb18030", "GB 18030"),
    (rb"(?<![\x80-\xff])\xe6m\b", "cp850", "code page 850"),
    (rb"[\xc0-\xff]{2}", "cp1251", "Windows 1251"),
)
OTHER = "latin-1", "Windows 1252"  # Latin-1 has the same signs, and decodes every byte


def is_text(head: bytes) -> bool:
    """Return whether the first bytes of a file are text in one of the encodings."""
    if head.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)) or _utf16(head):
        return True
    return not re.search(rb"[\x00-\x08\x0e-\x19\x1b-\x1f\x7f]", head)


def encoding_of(path: Path) -> tuple[str, str]:
    """Return Python's name of the encoding of a text file, and the name for people."""
    with path.open("rb") as file:
        head = file.read(HEAD)
        for mark, codec, name in MARKS:
            if head.startswith(mark):
                return codec, name
        if wide := _utf16(head):
            return wide, "UTF-16 without a mark"
        decoder = codecs.getincrementaldecoder("utf-8")()
        part, is_ascii = head, True
        try:
            while part:
                decoder.decode(part)
                is_ascii = is_ascii and part.isascii()
                part = file.read(1 << 20)
            decoder.decode(b"", final=True)
        except UnicodeDecodeError:
            return next(((codec, name) for sign, codec, name in CODE_PAGES if re.search(sign, head)), OTHER)
    return "utf-8", "ASCII" if is_ascii else "UTF-8"


def _utf16(head: bytes) -> str | None:
    """Return the encoding of text in UTF-16 without a mark: digits and separators have zero as their other byte."""
    head = head[: len(head) // 2 * 2]
    even, odd = head[::2], head[1::2]
    for zeros, others, codec in ((odd, even, "utf-16-le"), (even, odd, "utf-16-be")):
        if 2 * zeros.count(0) > len(zeros) > 0 and not others.count(0):
            return codec
    return None
