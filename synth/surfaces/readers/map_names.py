"""The names of maps in sets of materials: what each file is, by the end of its name.

Stage   SURFACES, from files.
Model   Capitals, a resolution at the end ("_2k", "_4K-PNG", "_2048") and the separators of words do not matter. Poly
        Haven writes wall_disp_2k.png, wall_nor_gl_2k.png, wall_rough_2k.png and wall_arm_2k.png; ambientCG
        Wall012_4K-PNG_Displacement.png, _NormalGL and _Roughness; Poliigon Wall_Displacement.tif, _Normal and
        _Roughness. "gl" says that green points up in a normal map, "dx" that it points down. Older sets of Poliigon
        have _GLOSS, which is 1 - roughness, and _DISP16 and _NRM16, of 16 bits, beside _DISP and _NRM.
Source  The file names in the public documentation of the three libraries.
Limits  A name says what a map should be. Its pixels are checked by its reader.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import PurePath

LOSSLESS, LOSSY, UNREAD = (".png", ".tif", ".tiff"), (".jpg", ".jpeg", ".webp", ".bmp"), (".exr",)
PICTURES = (*LOSSLESS, *LOSSY, *UNREAD)
"""Endings of maps, the best first. Of EXR the reader says what to write instead."""
SIZE = re.compile(r"_(?:\d{1,2}k|\d{3,5}|(?:8|16|32)bits?|jpe?g|png|tiff?|exr)$")
DISPLACEMENT, NORMAL, ROUGHNESS, PACKED = ROLES = ("displacement", "normal", "roughness", "packed")
ENDS = (
    (DISPLACEMENT, re.compile(r"(?:^|_)(?:disp|displacement|height)(?:16)?$")),
    (NORMAL, re.compile(r"(?:^|_)(?:nor|norm|normal|nrm)(?:16)?_?(?P<green>gl|dx|opengl|directx)?$")),
    (ROUGHNESS, re.compile(r"(?:^|_)(?:rough|roughness|(?P<gloss>gloss|glossiness))$")),
    (PACKED, re.compile(r"(?:^|_)(?:arm|orm)$")),
)
DEEP = re.compile(r"[a-z]16(?:_|$)|_16bits?(?:_|$)")
EXAMPLES = "wall_disp_2k.png and wall_nor_gl_2k.png, Wall_Displacement.png and Wall_NormalGL.png, or wall_Normal.png"


@dataclass(frozen=True, slots=True)
class MapName:
    """What a file is.

    role: "displacement", "normal", "roughness", or "packed" (occlusion, roughness and metal in red, green and blue).
    green: of a normal map, "up", "down", or "" where its name does not say.
    gloss: whether its numbers are 1 - roughness. deep: whether its name says that it has 16 bits.
    """

    role: str
    green: str = ""
    gloss: bool = False
    deep: bool = False


def named(file: str) -> MapName | None:
    """Return what the map with the name `file` is; None: no map that is read."""
    path = PurePath(file.replace("\\", "/"))
    if path.suffix.lower() not in PICTURES:
        return None
    words = re.sub(r"[^a-z0-9]+", "_", path.stem.lower()).strip("_")
    deep = bool(DEEP.search(words))
    while (shorter := SIZE.sub("", words)) != words:
        words = shorter
    for role, end in ENDS:
        if found := end.search(words):
            said = found.groupdict()
            green = {"gl": "up", "opengl": "up", "dx": "down", "directx": "down"}.get(said.get("green") or "", "")
            return MapName(role, green, said.get("gloss") is not None, deep)
    return None


def rank(file: str) -> tuple[int, ...]:
    """Return how good a map with this name is among several of one role: the least is read."""
    ending, found = PurePath(file).suffix.lower(), named(file) or MapName("")
    kind = next(number for number, endings in enumerate((LOSSLESS, LOSSY, UNREAD)) if ending in endings)
    return kind, found.gloss, not found.deep, ("up", "down", "").index(found.green)
