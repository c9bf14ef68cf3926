"""The array types that the engine computes with.

Model   float64 throughout; only blocks of sound and files of tables are float32.
"""

from __future__ import annotations

from typing import Any

import numpy as np

Array = np.ndarray[Any, np.dtype[np.float64]]
Block = np.ndarray[Any, np.dtype[np.float32]]  # of sound, [frames, channels], value / full scale
