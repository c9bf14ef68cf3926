"""A grey picture as a PNG file.

Stage   ENCODE.
Limits  8 bits of grey.
"""

from __future__ import annotations

import io
from typing import Any

import numpy as np


def png_of(picture: np.ndarray[Any, np.dtype[np.uint8]]) -> bytes:
    """Return the PNG file of `picture`, [rows, columns]: 0 is black, 255 is white."""
    from PIL import Image  # imported only when a picture is required

    written = io.BytesIO()
    Image.fromarray(picture).save(written, "PNG", optimize=True)
    return written.getvalue()
