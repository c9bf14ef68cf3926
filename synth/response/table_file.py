"""A table as a file: the safetensors container, written and read back.

Stage   RESPONSE: the file format of its result.
Model   A file begins with the length of the header: eight bytes, little-endian. The header is JSON with the type,
        shape and place of each array. Its `__metadata__` contains the version of the format, the table's own header
        and its hash. The arrays follow, float32, little-endian, without gaps. The hash covers the table's header and
        its arrays, so an altered file is refused.
Source  https://github.com/huggingface/safetensors, format; docs/table.md.
Limits  A file holds LARGEST_BYTES at most. A file that is not a complete table of this version raises CannotRender.
"""

from __future__ import annotations

import json
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from synth.errors import CannotRender
from synth.response.mip_levels import MipLevels
from synth.response.place_spline import padded
from synth.response.table import ResponseTable
from synth.response.table_error import TableError

VERSION = "1"
LARGEST_BYTES = 1 << 26  # largest file: 16 times the largest table that is made; a larger one is refused unread
LARGEST_HEADER = 1 << 23  # bytes of the largest JSON header
LENGTH = 8  # bytes of the header's length
METADATA = "__metadata__"


def table_bytes(table: ResponseTable) -> bytes:
    """Return the file of `table`; the same table gives the same bytes."""
    header: dict[str, Any] = {
        METADATA: {
            "ridgewave_table": VERSION,
            "hash": table.hash,
            "header": json.dumps(table.header),
        }
    }
    place, parts = 0, []
    for name, tensor in table.tensors.items():
        raw = np.ascontiguousarray(tensor, dtype="<f4").tobytes()
        header[name] = {"dtype": "F32", "shape": list(tensor.shape), "data_offsets": [place, place + len(raw)]}
        parts.append(raw)
        place += len(raw)
    text = json.dumps(header, separators=(",", ":")).encode()
    text += b" " * (-len(text) % LENGTH)
    return b"".join([len(text).to_bytes(LENGTH, "little"), text, *parts])


def read_table(path: Path) -> ResponseTable:
    """Return the table in the file at `path`. Raises CannotRender and OSError."""
    size = path.stat().st_size
    if size > LARGEST_BYTES:
        raise _refused(f"it has {size} bytes, and a table has at most {LARGEST_BYTES}")
    return table_of_bytes(path.read_bytes())


def table_of_bytes(content: bytes) -> ResponseTable:
    """Return the table in `content`. Raises CannotRender unless it is a complete table of this version."""
    length = int.from_bytes(content[:LENGTH], "little")
    if len(content) < LENGTH or length > min(LARGEST_HEADER, len(content) - LENGTH):
        raise _refused("its header is incomplete, or it is not a table")
    try:
        document = json.loads(content[LENGTH : LENGTH + length].decode())
        metadata = document.pop(METADATA)
        version, stated = str(metadata["ridgewave_table"]), str(metadata["hash"])
        header = json.loads(metadata["header"])
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
        raise _refused("its header is not that of a table") from error
    if version != VERSION:
        raise _refused(f"it is of version {version[:20]}, and this program reads version {VERSION}")
    try:
        table = _table(header, _tensors(document, memoryview(content)[LENGTH + length :]))
        altered = table.hash != stated or json.loads(json.dumps(table.header)) != header
    except (ValueError, KeyError, TypeError, IndexError, OverflowError, AttributeError, RecursionError) as error:
        raise _refused("its arrays do not match its header: it is incomplete or was altered") from error
    if altered:
        raise _refused("its hash does not match its contents: it was altered")
    return table


def _refused(why: str) -> CannotRender:
    return CannotRender(f"The table cannot be read: {why}. Make it again with `ridgewave table SCENE -o NAME`.")


def _tensors(document: dict[str, Any], body: memoryview) -> dict[str, np.ndarray[Any, np.dtype[np.float32]]]:
    """Return the arrays that the header lists, in its order. Raises ValueError unless they fill the body exactly."""
    found, place = {}, 0
    for name, entry in document.items():
        begin, end = entry["data_offsets"]
        if entry["dtype"] != "F32" or begin != place or not begin <= end <= len(body):
            raise ValueError(name)
        array = np.frombuffer(body[begin:end], dtype="<f4").reshape(entry["shape"]).astype(np.float32)
        if not np.all(np.isfinite(array)):
            raise ValueError(name)
        found[name], place = array, end
    if place != len(body):
        raise ValueError("bytes after the arrays")
    return found


def _table(header: dict[str, Any], tensors: dict[str, np.ndarray[Any, np.dtype[np.float32]]]) -> ResponseTable:
    """Return the table. Raises ValueError where a number is outside the range that a reader can use."""
    loads, highest, places = tensors["loads"], header["harmonics"], header["places"]
    rows, counts = len(loads), len(header["error_harmonics"])
    shapes = {"loads": (rows,), "means": (2, rows), "errors": (3, counts, rows - 1), "beyond": (3, rows - 1)}
    shapes |= {f"level_{n}": (rows, 2, p) for n, p in zip(highest, places, strict=True)}
    rules = (
        {name: array.shape for name, array in tensors.items()} == shapes,
        rows >= 2 and loads[0] == 0.0 and bool(np.all(np.diff(loads) > 0.0)),
        highest[-1] == 1 and all(one > other for one, other in pairwise(highest)),
        all(p > 2 * n for n, p in zip(highest, places, strict=True)),
        all(0.0 < float(header[name]) < 1e9 for name in ("period", "band", "lift_load")),
        len(header["mean_law"]) == 2 and bool(np.all(np.isfinite(header["mean_law"]))),
    )
    if not all(rules):
        raise ValueError("header")
    pool = [padded(tensors[f"level_{n}"]).ravel() for n in highest]
    error = TableError(loads.astype(float), tuple(header["error_harmonics"]), tensors["errors"], tensors["beyond"])
    return ResponseTable(
        period=float(header["period"]),
        band=float(header["band"]),
        lift_load=float(header["lift_load"]),
        levels=MipLevels(tuple(highest), tuple(places)),
        loads=loads,
        means=tensors["means"],
        pool=np.concatenate(pool),
        error=error,
        full=bool(header["full_from_last_row"]),
        mean_law=(float(header["mean_law"][0]), float(header["mean_law"][1])),
        scene=json.dumps(header["scene"], sort_keys=True),
        interpolation=str(header["interpolation"]),
    )
