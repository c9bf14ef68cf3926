"""The directory at the end of a ZIP file: its size is checked before anything reads it.

Stage   SURFACES, from files.
Model   Reading an entry of the directory takes 10 us and 500 bytes of memory, and readers that are tried one after
        another read it again. So the directory of a small file could take minutes.
Source  APPNOTE.TXT of PKWARE, sections 4.3.14 (ZIP64) and 4.3.16: the end of the directory has its size.
Limits  It looks for the end where Python's `zipfile` does, and says nothing about the entries.
"""

from __future__ import annotations

from pathlib import Path

from synth.surfaces.readers.surface_file import refuse_file

LARGEST_DIRECTORY = 2**20  # bytes: 10,000 entries and more; files of surfaces have a few
END, END_BYTES, SIZE = b"PK\x05\x06", 22, 12  # signature, length, and place of the size
END_64, END_64_BYTES, SIZE_64 = b"PK\x06\x06", 56, 40
LOCATOR_BYTES = 20  # between the two ends
LONGEST_COMMENT = 2**16  # bytes behind the end


def check_directory(path: Path) -> None:
    """Raise InvalidRequest for a ZIP file with a larger directory than LARGEST_DIRECTORY."""
    with path.open("rb") as file:
        before = END_64_BYTES + LOCATOR_BYTES
        file.seek(max(0, path.stat().st_size - before - END_BYTES - LONGEST_COMMENT))
        tail = file.read()
    place = tail.rfind(END)
    if place < 0:
        return
    size = int.from_bytes(tail[place + SIZE : place + SIZE + 4], "little")
    wide = tail[max(0, place - before) : place]
    if wide.startswith(END_64):
        size = int.from_bytes(wide[SIZE_64 : SIZE_64 + 8], "little")
    if size > LARGEST_DIRECTORY:
        value = f"a packed file (ZIP) whose directory has {size} bytes"
        refuse_file(value, f"at most {LARGEST_DIRECTORY} bytes", "Save or copy it again, or unpack it.")
