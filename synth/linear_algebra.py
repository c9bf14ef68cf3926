"""Linear algebra on one thread a process.

Stage   None: a tool of all stages.
Model   The libraries of linear algebra start a thread a processor, and each spins while it waits. The products here are
        small. On a processor that other processes need too, a product then takes ten times as long.
Limits  A program that has imported numpy before keeps its threads.
"""

from __future__ import annotations

import os

ONE_THREAD = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1")
"""Environment variables of the libraries, which read them when numpy is imported."""


def use_one_thread() -> None:
    """Set ONE_THREAD for this process and those that it starts, where the user has not set them."""
    for name, value in ONE_THREAD.items():
        os.environ.setdefault(name, value)
