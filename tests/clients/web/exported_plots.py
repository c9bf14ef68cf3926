"""Reading of the files that the toolbars of plots export: header and numbers of CSV, lines of SVG, text of PNG."""

from __future__ import annotations

import base64
import csv
import hashlib
import io
import json
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree

import numpy as np
import numpy.typing as npt
from PIL import Image

if TYPE_CHECKING:
    from playwright.sync_api import Page

SVG = "{http://www.w3.org/2000/svg}"


@dataclass
class Table:
    """A CSV file: its header, and its columns as numbers, an empty cell as NaN."""

    header: dict[str, Any]
    names: list[str]
    columns: dict[str, npt.NDArray[np.float64]]


def exported(page: Page, plot: str, kind: str) -> bytes:
    """Press the button `kind` ("SVG", "PNG", "CSV") of the toolbar of `plot`; return the file."""
    with page.expect_download() as download:
        page.click(f".plot-toolbar[data-plot={plot}] [data-action={kind.lower()}]")
    assert download.value.suggested_filename.endswith(f".{kind.lower()}")
    return download.value.path().read_bytes()


def read_csv(content: bytes) -> Table:
    """Return the table of a CSV file whose columns are numbers."""
    lines = content.decode().splitlines()
    notes = [line.removeprefix("# ").partition(": ") for line in lines if line.startswith("#")]
    names, *rows = csv.reader(line for line in lines if not line.startswith("#"))
    cells = np.array([[float(cell) if cell else np.nan for cell in row] for row in rows])
    header = {name: json.loads(value) for name, _, value in notes}
    return Table(header, names, {name: cells[:, place] for place, name in enumerate(names)})


def read_svg(content: bytes) -> tuple[dict[str, Any], list[npt.NDArray[np.float64]]]:
    """Return the header of an SVG file and its lines as rows [x, y] in SI, the longest first."""
    root = ElementTree.fromstring(content)
    header: dict[str, Any] = json.loads(root.findtext(f"{SVG}metadata") or "")
    axes = header["axes"]
    paths = [path.get("d", "") for path in root.iter(f"{SVG}path") if path.get("fill") == "none"]
    lines = []
    for path in paths:
        points = np.reshape(
            [[float(one) for one in pair] for pair in re.findall(r"[ML](\S+?) (-?[\d.]+)", path)], (-1, 2)
        )
        lines.append(np.stack([value_of(axes["across"], points[:, 0]), value_of(axes["up"], points[:, 1])], axis=1))
    return header, sorted(lines, key=len, reverse=True)


def read_image(content: bytes) -> npt.NDArray[np.uint8]:
    """Return the pixels [row, column, colour] of the picture in an SVG file."""
    (image,) = ElementTree.fromstring(content).iter(f"{SVG}image")
    encoded = image.get("href", "").removeprefix("data:image/png;base64,")
    with Image.open(io.BytesIO(base64.b64decode(encoded))) as picture:
        return np.asarray(picture.convert("RGB"))


def value_of(axis: Mapping[str, Any], place: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Return the values of an axis at places in CSS pixels."""
    part = (place - axis["from"]) / (axis["to"] - axis["from"])
    low, high = axis["low"], axis["high"]
    return np.asarray(low * (high / low) ** part if axis["log"] else low + part * (high - low))


def read_png(content: bytes) -> tuple[dict[str, Any], tuple[int, int]]:
    """Return the header of a PNG file and its size in pixels."""
    with Image.open(io.BytesIO(content)) as picture:
        picture.load()
        return json.loads(picture.info["ridgewave"]), picture.size


def scene_hash(scene: Mapping[str, Any]) -> str:
    """Return SHA-256 of a scene in canonical JSON (RFC 8785), written anew from the RFC."""
    return hashlib.sha256(canonical(scene).encode()).hexdigest()


def canonical(value: Any) -> str:
    if isinstance(value, Mapping):
        return "{" + ",".join(f"{json.dumps(key)}:{canonical(value[key])}" for key in sorted(value)) + "}"
    if isinstance(value, list | tuple):
        return "[" + ",".join(map(canonical, value)) + "]"
    if isinstance(value, bool) or not isinstance(value, int | float):
        return json.dumps(value, ensure_ascii=False)
    return number(float(value))


def number(value: float) -> str:
    """Return a number as ECMAScript writes it (ECMA-262, Number::toString)."""
    if value == 0:
        return "0"
    digits, power = shortest(abs(value))
    sign = "-" if value < 0 else ""
    count = len(digits)
    if count <= power <= 21:
        return sign + digits + "0" * (power - count)
    if 0 < power <= 21:
        return f"{sign}{digits[:power]}.{digits[power:]}"
    if -6 < power <= 0:
        return f"{sign}0.{'0' * -power}{digits}"
    rest = f".{digits[1:]}" if count > 1 else ""
    return f"{sign}{digits[0]}{rest}e{'+' if power > 0 else '-'}{abs(power - 1)}"


def shortest(value: float) -> tuple[str, int]:
    """Return the digits of the shortest decimal of `value`, 0.DIGITS times ten to the power."""
    text = repr(value)
    mantissa, _, exponent = text.partition("e")
    whole, _, part = mantissa.partition(".")
    part = "" if part == "0" else part
    digits = (whole + part).lstrip("0")
    power = len(whole) + int(exponent or 0) - (len(whole + part) - len((whole + part).lstrip("0")))
    if whole == "0":
        power = int(exponent or 0) - (len(part) - len(part.lstrip("0")))
    return digits.rstrip("0") or "0", power
