"""A layered table as a file that a later process reads (`kept_files`).

Stage   RESPONSE: a file format of its result.
Model   A NumPy archive without pickled objects: one array per field of `LayeredTable`. Each array has a checksum.
Limits  A file belongs to one version of the program; it is not a format for exchange.
"""

from __future__ import annotations

from dataclasses import fields
from io import BytesIO

import numpy as np

from synth.kept_files import FileForm
from synth.response.layered_table import LayeredTable


def layered_bytes(table: LayeredTable) -> bytes:
    """Return the file of `table`."""
    content = BytesIO()
    np.savez(content, **{field.name: getattr(table, field.name) for field in fields(table)})
    return content.getvalue()


def layered_of_bytes(content: bytes) -> LayeredTable:
    """Return the table in `content`. Raises an exception of NumPy or zipfile unless it is a complete one."""
    with np.load(BytesIO(content), allow_pickle=False) as file:
        return LayeredTable(**{field.name: file[field.name] for field in fields(LayeredTable)})


LAYERED_FORM = FileForm(".npz", layered_bytes, layered_of_bytes)
