"""What one live stream counts, as plain numbers that only rise, and how they come into the metrics of the process.

Model: counting is an addition, since it happens for every update and every block; `tell` adds what is new since it
    was last called. Blocks may be rendered in a thread meanwhile: what it misses it finds the next time.
"""

from __future__ import annotations

from service.operations.metrics import Metrics


class StreamCounts:
    """Updates that came and that a block was rendered with; blocks and frames that the limiter turned down."""

    __slots__ = ("_told", "applied", "limited_blocks", "limited_frames", "received", "reduction_db")

    def __init__(self) -> None:
        self.received = self.applied = 0
        self.limited_blocks = self.limited_frames = 0
        self.reduction_db = 0.0  # the largest
        self._told = (0, 0, 0, 0, 0)

    def tell(self, metrics: Metrics, rate: int, waiting: int = 0) -> None:
        """Add what is new to `metrics`; waiting: updates that may still be applied, the others are dropped."""
        received, applied = self.received, self.applied
        now = (received, applied, received - applied - waiting, self.limited_blocks, self.limited_frames)
        if now == self._told:
            return
        new = [count - told for count, told in zip(now, self._told, strict=True)]
        self._told = now
        metrics.updates(*new[:3])
        if new[3]:
            metrics.limited(self.reduction_db, new[4] / rate, new[3])
