"""ZIP files that attack: each is refused in words, and leaves nothing on the disk."""

from __future__ import annotations

import io
import struct
import zipfile
from collections.abc import Callable
from pathlib import Path

import pytest

from synth.errors import InvalidRequest
from synth.surfaces.measurement.import_options import read_options
from synth.surfaces.measurement.importing import import_surface
from synth.surfaces.readers.map_set import MOST_FILES
from synth.surfaces.readers.surface_file import LARGEST_FILE
from tests.synth.surfaces.maps.map_sets import PIXEL, displacement, file_of, normals, surface

HEIGHTS = surface(0, side=32)
DEPTH = file_of(displacement(HEIGHTS, 16), "png")
NORMALS = file_of(normals(HEIGHTS, PIXEL, "up", 8), "png")


def packed(*files: tuple[str | zipfile.ZipInfo, bytes], method: int = zipfile.ZIP_DEFLATED) -> bytes:
    written = io.BytesIO()
    with zipfile.ZipFile(written, "w", method) as archive:
        for name, content in files:
            archive.writestr(name, content)
    return written.getvalue()


def whole(*more: tuple[str | zipfile.ZipInfo, bytes]) -> bytes:
    return packed(("a_disp.png", DEPTH), ("a_nor_gl.png", NORMALS), *more)


def link() -> bytes:
    entry = zipfile.ZipInfo("a_disp.png")
    entry.create_system, entry.external_attr = 3, 0o120777 << 16
    return packed((entry, b"/etc/passwd"), ("a_nor_gl.png", NORMALS))


def bomb() -> bytes:
    """A map of 200 MB of zeros in 200 kB."""
    return packed(("a_disp.png", bytes(LARGEST_FILE + 1)), ("a_nor_gl.png", NORMALS))


def lying_bomb() -> bytes:
    """The same, with a directory that states 100 bytes."""
    content = bytearray(packed(("a_disp.png", bytes(LARGEST_FILE)), ("a_nor_gl.png", NORMALS)))
    place = content.index(b"PK\x01\x02")
    content[place + 24 : place + 28] = struct.pack("<I", 100)
    return bytes(content)


def picture_bomb() -> bytes:
    """A PNG whose header states 60,000 x 60,000 pixels."""
    content = bytearray(DEPTH)
    content[16:24] = struct.pack(">II", 60_000, 60_000)
    return packed(("a_disp.png", bytes(content)), ("a_nor_gl.png", NORMALS))


def encrypted() -> bytes:
    content = bytearray(whole())
    for signature, flags in ((b"PK\x03\x04", 6), (b"PK\x01\x02", 8)):
        place = content.index(signature)
        content[place + flags] |= 1
    return bytes(content)


def twice() -> bytes:
    with pytest.warns(UserWarning, match="Duplicate name"):
        return whole(("a_disp.png", DEPTH))


def cut() -> bytes:
    """A byte in the middle of a map is another: its sum is wrong."""
    content = bytearray(packed(("a_disp.png", DEPTH), ("a_nor_gl.png", NORMALS), method=zipfile.ZIP_STORED))
    content[content.index(b"IDAT") + 200] ^= 0xFF
    return bytes(content)


def large_directory() -> bytes:
    return whole(*((f"{number}{'x' * 4000}", b"") for number in range(300)))


ATTACKS: dict[str, tuple[Callable[[], bytes], str]] = {
    "a name above its folder": (lambda: whole(("../../evil_rough.png", DEPTH)), "names within it"),
    "an absolute name": (lambda: whole(("/tmp/evil_rough.png", DEPTH)), "names within it"),
    "a name of Windows": (lambda: whole(("C:\\evil_rough.png", DEPTH)), "names within it"),
    "a name with backslashes": (lambda: whole(("..\\evil_rough.png", DEPTH)), "names within it"),
    "a link": (link, "maps, not links"),
    "a bomb": (bomb, f"maps of at most {LARGEST_FILE} bytes"),
    "a bomb that lies": (lying_bomb, "a whole file"),
    "a picture that is a bomb": (picture_bomb, "at most 16777216 points"),
    "a password": (encrypted, "files without a password"),
    "another method": (
        lambda: packed(("a_disp.png", DEPTH), ("a_nor_gl.png", NORMALS), method=zipfile.ZIP_LZMA),
        "files that are stored or deflated",
    ),
    "one name twice": (twice, "each name once"),
    "many names": (lambda: whole(*((f"{number}.txt", b"") for number in range(MOST_FILES))), "at most 500 files"),
    "a large directory": (large_directory, "at most 1048576 bytes"),
    "a changed byte": (cut, "a whole file"),
    "half of it": (lambda: whole()[:-400], "file: got"),
}


@pytest.mark.parametrize("attack", list(ATTACKS))
def test_a_zip_file_that_attacks_is_refused_and_leaves_nothing(
    attack: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    make, words = ATTACKS[attack]
    path, folder = tmp_path / "in" / "wall.zip", tmp_path / "temporary"
    path.parent.mkdir()
    folder.mkdir()
    path.write_bytes(make())
    monkeypatch.setattr("tempfile.tempdir", str(folder))
    with pytest.raises(InvalidRequest) as refused:
        import_surface(path, read_options({"width": "80 mm"}))
    assert words in str(refused.value) and str(tmp_path) not in str(refused.value)
    assert not list(folder.iterdir()) and [one.name for one in path.parent.iterdir()] == ["wall.zip"]


def test_the_same_zip_file_without_an_attack_is_imported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path, folder = tmp_path / "wall.zip", tmp_path / "temporary"
    folder.mkdir()
    path.write_bytes(whole(("readme.txt", b"-")))
    monkeypatch.setattr("tempfile.tempdir", str(folder))
    assert import_surface(path, read_options({"width": "80 mm"})).report["points"] == [32, 32]
    assert not list(folder.iterdir())
