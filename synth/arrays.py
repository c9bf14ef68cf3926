"""The array types of the engine.

Model   Arrays are float64. Only blocks of sound and the files of tables are float32.
"""

from __future__ import annotations

from typing import Any

import numpy as np

Array = np.ndarray[Any, np.dtype[np.float64]]
Block = np.ndarray[Any, np.dtype[np.float32]]  # a block of sound: value / full scale, [frames, channels]
