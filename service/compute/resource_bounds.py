"""Bounds the memory and the processor time of a process that the service or the command line has started."""

from __future__ import annotations

import resource


def bound(kind: int, most: int) -> None:
    """Bound a resource of this process by `most`, or by the user's own bound (ulimit) where that is less."""
    hard = resource.getrlimit(kind)[1]
    resource.setrlimit(kind, (most if hard == resource.RLIM_INFINITY else min(most, hard), hard))
