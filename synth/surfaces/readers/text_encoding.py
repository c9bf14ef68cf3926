"""The encoding of a text file, told from its bytes.

Stage   SURFACES, from files.
Model   A byte order mark decides. Without one, zero bytes at every second place are UTF-16. Else the file is UTF-8 if
        all of it is. Else it is in a code page: the one in whose bytes most of the words are found that a header of a
        profile has, such as units and "height". Everything else is read as Windows 1252, which has µ, ² and ° at the
        places where 1250, 1254, Latin-1 and Mac Roman have µ.
Limits  Other letters of a code page may be read as the wrong ones. No number and no unit depends on them.
"""

from __future__ import annotations

import codecs
import re
from pathlib import Path

HEAD = 65536  # bytes that decide between code pages: the header and the first numbers
MARKS = (
    (codecs.BOM_UTF32_LE, "utf-32", "UTF-32"),
    (codecs.BOM_UTF32_BE, "utf-32", "UTF-32"),
    (codecs.BOM_UTF8, "utf-8-sig", "UTF-8 with a mark"),
    (codecs.BOM_UTF16_LE, "utf-16", "UTF-16"),
    (codecs.BOM_UTF16_BE, "utf-16", "UTF-16"),
)
CODE_PAGES = (
    ("cp932", "Shift JIS", "距離 位置 高さ 深さ μm"),
    ("euc_jp", "EUC-JP", "距離 位置 高さ 深さ μm"),
    ("gb18030", "GB 18030", "距离 位置 长度 高度 深度 μm"),
    ("big5", "Big5", "距離 位置 長度 高度 深度 μm"),
    ("cp949", "code page 949", "거리 위치 길이 높이 깊이 μm ㎛"),
    ("cp1251", "Windows 1251", "мкм мм нм ысот лин рофил асст"),
    ("koi8-r", "KOI8-R", "мкм мм нм ысот лин рофил асст"),
    ("cp866", "code page 866", "мкм мм нм ысот лин рофил асст"),
    ("cp1253", "Windows 1253", "ψος έση πόστ ήκος άθος αχύτ ροφίλ"),
    ("cp1250", "Windows 1250", "ysokość ługość dległość łębokość ýška"),
    ("iso8859_2", "ISO 8859-2", "ysokość ługość dległość łębokość ýška ířka ávolság"),
)
"""Python's name, the name for people, and words. The first letter, which may be a capital, is left out of most."""
OF_DOS = re.compile(rb"(?<![A-Za-z\x80-\xff])\xe6m\b")  # µm in the code pages 437 and 850
OTHER = "latin-1", "Windows 1252"  # Latin-1 has the same signs, and decodes every byte


def is_text(head: bytes) -> bool:
    """Return whether the first bytes of a file are text in one of the encodings."""
    if head.startswith(tuple(mark for mark, _, _ in MARKS)) or _utf16(head):
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
            return _code_page(head)
    return "utf-8", "ASCII" if is_ascii else "UTF-8"


def _code_page(head: bytes) -> tuple[str, str]:
    """Return the code page in which most words are found."""
    if OF_DOS.search(head):
        return "cp850", "code page 850"
    found = [(sum(word.encode(codec) in head for word in words.split()), codec) for codec, _, words in CODE_PAGES]
    most, chosen = max(found, key=lambda one: one[0])
    return next(((codec, name) for codec, name, _ in CODE_PAGES if most and codec == chosen), OTHER)


def _utf16(head: bytes) -> str | None:
    """Return the encoding of text in UTF-16 without a mark: digits and separators have zero as their other byte."""
    head = head[: len(head) // 2 * 2]
    even, odd = head[::2], head[1::2]
    for zeros, others, codec in ((odd, even, "utf-16-le"), (even, odd, "utf-16-be")):
        if 2 * zeros.count(0) > len(zeros) > 0 and not others.count(0):
            return codec
    return None
