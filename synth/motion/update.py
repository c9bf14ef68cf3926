"""One update of a live hand, as a client sends it."""

from __future__ import annotations

from typing import NamedTuple


class Update(NamedTuple):
    """One contact update.

    time: s of the client's clock. position: m, or speed: m/s: exactly one. load: N; None keeps the last.
    """

    seq: int
    time: float
    position: float | None
    speed: float | None
    load: float | None
