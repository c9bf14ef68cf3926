"""The interface of all sinks, so that a session plays into any of them and tests need no hardware.

Model: `start`, then `write` block after block from one thread, then `close` (everything written is played or stored)
    or `stop` (silence now). `close` and `stop` may come from another thread, and more than once. A `write` during or
    after them raises CannotRender. Samples are float32, and the voice has limited them already.
Limits: `write` waits while the sink is full, at most `timeout` seconds without progress.
"""

from __future__ import annotations

from typing import Protocol

from synth.encode.formats import Block, Metadata

WRITE_TIMEOUT_S = 2.0  # with less, a play on a busy machine would fail without need


class Sink(Protocol):
    """A destination of blocks."""

    @property
    def name(self) -> str:
        """Return the name that is shown to people."""

    @property
    def latency(self) -> float:
        """Return the largest delay from `write` to the output, in seconds; 0 for a file."""

    @property
    def underruns(self) -> int:
        """Return how often silence was played for lack of samples."""

    @property
    def device_underflows(self) -> int:
        """Return the number of gaps that the device itself reports."""

    @property
    def dropped_frames(self) -> int:
        """Return the number of frames that were dropped after a stall of the device."""

    @property
    def failure(self) -> str | None:
        """Return a sentence on why the sink no longer works; None while it works."""

    def start(self, sample_rate: int, channels: int, metadata: Metadata | None = None) -> None:
        """Open the sink. Raises CannotRender or InvalidRequest if that fails."""

    def write(self, block: Block, timeout: float = WRITE_TIMEOUT_S) -> None:
        """Take `block` [frames, channels] of any length. Raises CannotRender if the sink fails, stalls or is closed."""

    def stop(self) -> None:
        """Fall silent at once; a file is completed with what was written."""

    def close(self) -> None:
        """Play or store what was written, then end. Does not raise for a failed device; `failure` reports it."""
