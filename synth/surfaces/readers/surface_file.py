"""The result of a reader: heights as the file has them, missing points, distances, and what the file states.

Stage   SURFACES, from files. `measurement.importing` converts the numbers to metres.
Model   A reader never assumes a unit, a distance or a height. What the file does not state is None, and the user has
        to give it.
Limits  A file has at most LARGEST_FILE bytes and a surface at most MOST_POINTS points. A reader checks the size that a
        file declares before it allocates memory for it. The directory at the end of a ZIP file, whose
        size it states (APPNOTE.TXT of PKWARE, sections 4.3.14 and 4.3.16), is checked, too: reading an entry takes
        10 us and 500 bytes, and readers that are tried one after another read it again.
"""

from __future__ import annotations

import math
import unicodedata
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from synth.errors import Fault, InvalidRequest, shown

Heights = np.ndarray[Any, np.dtype[np.float64]]
Slopes = np.ndarray[Any, np.dtype[Any]]
Missing = np.ndarray[Any, np.dtype[np.bool_]]

MOST_POINTS = 2**24  # 4096 x 4096: 64 MB as float32; the import of a larger one would take gigabytes
LARGEST_FILE = 128 * 2**20  # bytes: MOST_POINTS points as 64-bit numbers
EVEN = 0.01  # of a step: x of points has equal ones
COORDINATES = 3  # of a point at most
FEWEST_POINTS = 2  # along each axis: one point has no spacing
LARGEST_NUMBER = 1e12  # in the file's unit: no measured height is larger

UNITS = {
    "km": 1e3,
    "m": 1.0,
    "cm": 1e-2,
    "mm": 1e-3,
    "um": 1e-6,
    "µm": 1e-6,
    "μm": 1e-6,
    "micron": 1e-6,
    "microns": 1e-6,
    "nm": 1e-9,
    "kÅ": 1e-7,
    "A": 1e-10,
    "Å": 1e-10,
    "pm": 1e-12,
    "inch": 0.0254,
    "mil": 25.4e-6,
    "uin": 25.4e-9,
}
"""Units of length that files state, in m."""

UNSTATED = "unstated"
"""The unit of a spacing that a file does not state, where it states another one for the heights."""

SPELLINGS = {
    "um": "micrometer micrometers micrometre micrometres mikrometer micromètre micromètres micrómetro "
    "micrómetros micrometro micrometri micrômetro micrômetros micra micras mícron mícrons mikron mikrony "
    "mikrometr mikrometry mikrometrů mikrometrów mikrometre mikrometri mikrometriä mikrométer микрометр "
    "микрометры микрометров микрон микроны микронов μικρόμετρα μικρά 微米 マイクロメートル マイクロメーター "
    "ミクロン 마이크로미터 마이크론 mkm mum мкм µ u",
    "mm": "millimeter millimeters millimetre millimetres millimètre millimètres milímetro milímetros millimetro "
    "millimetri millimetriä milimetr milimetry milimetrů milimetrów milimetre milliméter миллиметр "
    "миллиметры миллиметров мм χιλιοστά χιλ χλστ 毫米 ミリメートル ミリ 밀리미터",
    "nm": "nanometer nanometers nanometre nanometres nanomètre nanomètres nanómetro nanómetros nanometro "
    "nanometri nanômetro nanômetros nanometriä nanometr nanometry nanometrů nanometrów nanométer нанометр "
    "нанометры нанометров нм νανόμετρα 纳米 ナノメートル 나노미터",
    "cm": "centimeter centimeters centimetre centimetres см centimètre centimètres centímetro centímetros "
    "centimetro centimetri centymetr centymetry сантиметр сантиметры εκατοστά 厘米 センチメートル 센티미터",
    "m": "meter meters metre metres м",
    "Å": "angstrom angstroms ang ångström",
    "inch": 'in inches " inches pollice pollici pulgada pulgadas polegada polegadas cale дюйм дюймы ίντσες '
    "zoll pouce pouces 英寸 インチ 인치",
    "mil": "mils thou",
    "uin": 'µin µ" u" microinch microinches',
}
"""Other spellings of units, in small letters."""
SHORT = 2  # letters of km, cm, mm, um, nm and pm, and of no word
_BY_SPELLING = {word.replace("\u03bc", "\u00b5"): unit for unit, words in SPELLINGS.items() for word in words.split()}
_BY_SPELLING |= {name.lower(): name for name in UNITS if name not in ("A", "m")}
LARGEST_DIRECTORY = 2**20  # bytes: 10,000 entries and more; files of surfaces have a few
END, END_BYTES, SIZE = b"PK\x05\x06", 22, 12  # signature, length, and place of the size
END_64, END_64_BYTES, SIZE_64 = b"PK\x06\x06", 56, 40
LOCATOR_BYTES = 20  # between the two ends
LONGEST_COMMENT = 2**16  # bytes behind the end


def unit_named(text: str) -> str | None:
    """Return the unit of length that `text` is, a key of UNITS, or None.

    Capitals decide where they make another unit: mm and MM are millimetres, Mm, Nm and nM are not.
    """
    text = text.replace("\u2033", '"').replace("''", '"')
    text = unicodedata.normalize("NFKC", text.strip().rstrip(".").replace("\\u00B5", "\u00b5"))  # ㎛ is μm
    text = text.replace("\u03bc", "\u00b5").replace("\u00c2\u00b5", "\u00b5")  # UTF-8 that was read as Latin-1
    if text in UNITS:
        return text
    unit = _BY_SPELLING.get(text.lower().replace("\u03bc", "\u00b5"))
    is_short = unit is not None and len(text) == SHORT and text[-1] in "mM"
    return None if is_short and not (text.islower() or text.isupper()) else unit


@dataclass(frozen=True, eq=False)
class SurfaceFile:
    """The contents of a file.

    format: name of the format.
    layout: how the file was read, as a sentence without its full stop.
    heights: float64 [n] along a line, or [rows, columns] over an area with x along the columns; in `unit`.
    missing: bool, of the same shape: points without a height.
    unit: unit of the heights that the file states (a key of UNITS), or None.
    spacing: distance between neighbouring columns, then rows, in `spacing_unit`; None if the file does not state it.
    spacing_unit: unit of the spacing that the file states. None with a spacing: the numbers have the heights' unit.
        UNSTATED: they may have another one.
    full_scale: of a displacement map, the number that represents its greatest height; None for real heights.
    tagged: whether the spacing is from a tag that image programs also write without a meaning. An option replaces it.
    channel: name of the channel, or "".
    notes: sentences for the user.
    reading: of text, how it was read, as JSON values: encoding, separator, decimal sign, columns with their units.
    positions: of a profile with unequal steps, the x of each point, increasing, in `spacing_unit`; else None.
    measured_x: of a profile with equal steps, x of each point as the file has it, in `spacing_unit`, or None.
    doubt: words beside the heights that are not understood, as the beginning of a sentence, or "". The user has to
        confirm the unit.
    no_unit: why the numbers of a displacement map cannot be heights in a unit, or "".
    slopes: of a normal map, its slopes along x and down the rows, with green pointing up; else None.
    not_unit: of a normal map, the share of its pixels that are no unit vectors.
    """

    format: str
    layout: str
    heights: Heights
    missing: Missing
    unit: str | None = None
    spacing: tuple[float, ...] | None = None
    spacing_unit: str | None = None
    full_scale: float | None = None
    tagged: bool = False
    channel: str = ""
    notes: tuple[str, ...] = ()
    reading: dict[str, Any] | None = None
    positions: Heights | None = None
    measured_x: Heights | None = None
    doubt: str = ""
    no_unit: str = ""
    slopes: tuple[Slopes, Slopes] | None = None
    not_unit: float = 0.0


def refuse_file(value: object, allowed: str, hint: str, cause: BaseException | None = None) -> NoReturn:
    """Raise InvalidRequest for the file.

    value: what was found in it.
    cause: what a reader raised. Its text may contain paths and is therefore not shown.
    """
    fault = Fault("/file", value if isinstance(value, str) else shown(value), allowed, hint)
    raise InvalidRequest([fault]) from cause


def check_array(stored: np.ndarray[Any, Any]) -> None:
    """Refuse an array of points: of two or three columns or rows, one is x or y in equal steps."""
    for points in (stored, stored.T):
        if stored.ndim != 2 or not FEWEST_POINTS <= points.shape[1] <= COORDINATES < points.shape[0] - 1:
            continue
        for place in range(2):
            steps = np.diff(np.asarray(points[:, place], float))
            whole = steps[steps != 0.0]
            if len(whole) and np.all(np.abs(whole - whole[0]) <= EVEN * abs(whole[0])):
                found = f"an array of {stored.shape[0]} x {stored.shape[1]} numbers, of which one of each is x or y"
                hint = "If they are x and heights, save the heights alone, or x and heights as text in two columns."
                refuse_file(found, "an array of heights", hint)


def check_shape(shape: tuple[int, ...]) -> None:
    """Raise InvalidRequest for a shape that no surface may have. Call it before memory is allocated."""
    points = math.prod(shape)
    size = " x ".join(str(count) for count in shape) + " points"
    if len(shape) not in (1, 2):
        refuse_file(f"an array of {len(shape)} dimensions", "heights along a line or over an area", "Keep one array.")
    if points > MOST_POINTS:
        refuse_file(size, f"at most {MOST_POINTS} points", "Crop it, or keep every second point.")
    if len(shape) == 2 and min(shape) == 1 and max(shape) >= FEWEST_POINTS:
        refuse_file(size, f"at least {FEWEST_POINTS} points along each axis", "Save a profile as one dimension.")
    if min(shape) < FEWEST_POINTS:
        refuse_file(size, f"at least {FEWEST_POINTS} points along each axis", "Is this the file of the surface?")


def check_numbers(values: np.ndarray[Any, Any], name: str) -> None:
    """Raise InvalidRequest if one of `values` is too large to be a height or a coordinate.

    name: of the values, for the fault.
    """
    largest = float(np.max(np.abs(values)))
    if not largest <= LARGEST_NUMBER:
        allowed = f"numbers up to {LARGEST_NUMBER:g}"
        refuse_file(f"{name} of {largest:.3g}", allowed, "Correct the number, or mark the missing point by nan.")


def finite_heights(values: np.ndarray[Any, Any]) -> tuple[Heights, Missing]:
    """Return `values` as float64, with 0 at missing points, and the mask of these points: masked, NaN or infinite."""
    masked = np.ma.getmaskarray(values) if isinstance(values, np.ma.MaskedArray) else False
    heights = np.array(np.ma.getdata(values), np.float64)
    missing = ~np.isfinite(heights) | masked
    heights[missing] = 0.0
    return heights, missing


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
