"""The most recent PCM of a stream, for a client that resumes.

Limits: a stream keeps KEPT_BYTES, or two blocks if these are larger: one that was being sent when the connection broke,
    and one that waited behind it.
"""

from __future__ import annotations

KEPT_SECONDS = 1.0  # a client that notices a broken connection later than this cannot continue without a gap
KEPT_BLOCKS = 8  # kept even if they are longer than KEPT_SECONDS
KEPT_BYTES = 1 << 20  # 1 s of five channels at 48 kHz; with more, a few streams of many channels fill the memory


def kept_frames(rate: int, block: int, frame_bytes: int) -> int:
    """Return how many frames a stream keeps. block: frames of its longest message."""
    wanted = max(round(KEPT_SECONDS * rate), KEPT_BLOCKS * block)
    return max(min(wanted, KEPT_BYTES // frame_bytes), 2 * block)


class ReplayBuffer:
    """A ring buffer of `frames` frames of `frame_bytes` bytes. end: the frame after the newest."""

    def __init__(self, frames: int, frame_bytes: int) -> None:
        self.end = 0
        self._frames, self._frame_bytes = frames, frame_bytes
        self._ring = bytearray(frames * frame_bytes)

    @property
    def size(self) -> int:
        """Return the size in bytes."""
        return len(self._ring)

    @property
    def begin(self) -> int:
        """Return the oldest kept frame."""
        return max(0, self.end - self._frames)

    def keep(self, pcm: bytes) -> None:
        """Append a block, which must not be larger than the buffer."""
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
        """Return `frames` frames from `frame` on. All of them must be kept."""
        assert self.begin <= frame and frame + frames <= self.end, "frames that are not kept"
        at = frame % self._frames * self._frame_bytes
        size = frames * self._frame_bytes
        pcm = bytes(self._ring[at : at + size])
        return pcm + bytes(self._ring[: size - len(pcm)])
