"""The PCM of a stream's last moments, for a peer whose connection broke: any frame of it, bit for bit.

Limits: KEPT_BYTES a stream, or two blocks where these are more: one that was on its way when the connection broke, and
    one that waited behind it.
"""

from __future__ import annotations

KEPT_SECONDS = 1.0  # a peer that notices a broken connection later than this starts anew
KEPT_BLOCKS = 8  # as long, where blocks are long
KEPT_BYTES = 1 << 20  # a second of five channels at 48 kHz; more, and a few streams of many channels fill the memory


def kept_frames(rate: int, block: int, frame_bytes: int) -> int:
    """Return how many frames are kept of a stream whose messages have `block` frames at most."""
    wanted = max(round(KEPT_SECONDS * rate), KEPT_BLOCKS * block)
    return max(min(wanted, KEPT_BYTES // frame_bytes), 2 * block)


class ReplayBuffer:
    """A ring of `frames` frames of `frame_bytes` bytes each; `end` is the frame after the newest."""

    def __init__(self, frames: int, frame_bytes: int) -> None:
        self.end = 0
        self._frames, self._frame_bytes = frames, frame_bytes
        self._ring = bytearray(frames * frame_bytes)

    @property
    def size(self) -> int:
        """Return the bytes that it takes."""
        return len(self._ring)

    @property
    def begin(self) -> int:
        """Return the oldest frame that is kept."""
        return max(0, self.end - self._frames)

    def keep(self, pcm: bytes) -> None:
        """Append a block of no more than the ring holds."""
        ring, size = self._ring, len(pcm)
        assert size <= len(ring), "a block larger than the ring"
        at = self.end % self._frames * self._frame_bytes
        first = len(ring) - at
        if size <= first:
            ring[at : at + size] = pcm
        else:
            ring[at:] = pcm[:first]
            ring[: size - first] = pcm[first:]
        self.end += size // self._frame_bytes

    def read(self, frame: int, frames: int) -> bytes:
        """Return `frames` frames from `frame` on, all of which are kept."""
        assert self.begin <= frame and frame + frames <= self.end, "frames that are not kept"
        at = frame % self._frames * self._frame_bytes
        size = frames * self._frame_bytes
        pcm = bytes(self._ring[at : at + size])
        return pcm + bytes(self._ring[: size - len(pcm)])
