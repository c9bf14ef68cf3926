"""What every sink can do, so that a session plays into any of them and tests need no hardware.

Model: `start`, then `write` block after block from one thread, then `close` (all that was written is heard or kept)
    or `stop` (silence now). `close` and `stop` may come from another thread, and more than once; a `write` that they
    overtake, or that comes later, raises CannotRender, which ends the writer. Samples are float32 and already
    limited: the safety limiter is the voice's, not the sink's.
Limits: `write` waits while the sink is full, and never longer than `timeout` seconds without getting on.
"""

from __future__ import annotations

from typing import Protocol

from synth.encode.formats import Block, Metadata

WRITE_TIMEOUT_S = (
    2.0  # a device that takes nothing for this long is not coming back; shorter would end a busy machine's
)


class Sink(Protocol):
    """A place that takes blocks."""

    @property
    def name(self) -> str:
        """Return what it is called, for people."""

    @property
    def latency(self) -> float:
        """Return the seconds between `write` and being heard, at most; 0 for a file."""

    @property
    def underruns(self) -> int:
        """Return how many times silence was played because no samples were there."""

    @property
    def device_underflows(self) -> int:
        """Return how many gaps the device itself reports; 0 where there is none."""

    @property
    def dropped_frames(self) -> int:
        """Return how many frames were not played because the device had stalled and they were stale."""

    @property
    def failure(self) -> str | None:
        """Return why it no longer works, a sentence for people; None while it does."""

    def start(self, sample_rate: int, channels: int, metadata: Metadata | None = None) -> None:
        """Open it; raises CannotRender or InvalidRequest where it cannot be, at once and not at the first block."""

    def write(self, block: Block, timeout: float = WRITE_TIMEOUT_S) -> None:
        """Take `block` [frames, channels] of any length; raises CannotRender where it fails, stalls or is closed."""

    def stop(self) -> None:
        """Fall silent at once; a file is completed with what it has."""

    def close(self) -> None:
        """Let out what was written, then end. Never raises for a failed device: `failure` says so."""
