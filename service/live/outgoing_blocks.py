"""The blocks of one live connection: how many frames are due, the messages of a block, and the last fade.

Model: with pacing realtime the clock decides when a block is due, with pacing pull the credit of the client. Sound that
    is kept for a client that resumes is sent before new sound. At the end the voice fades out, which needs no credit.
    If kept sound was not sent again yet, that is faded in its place. No I/O, no clock.
"""

from __future__ import annotations

from service.live import server_messages
from service.live.live_stream import LiveStream
from service.live.message_checks import refused
from service.live.messages import Version
from service.operations.metrics import Metrics
from service.sessions.pacer import Pacer
from synth.errors import shown

CREDIT_SECONDS = 60.0  # of outstanding credit; with more, a change would be heard very late
FADE_BOUND_SECONDS = 0.1  # for a voice that never reports that it has faded out


class OutgoingBlocks:
    """What one connection has sent of a stream, and may send.

    pace: the clock of the blocks, and of writes.
    position: frame of the next block to send. It is behind the stream's frame while kept sound is sent again.
    """

    def __init__(self, pace: Pacer, version: Version, metrics: Metrics) -> None:
        self.pace, self.position = pace, 0
        self._version, self._metrics = version, metrics
        self._credit = 0
        self._fading, self._faded, self._fade_bound = False, 0, 0

    def begin(self, stream: LiveStream, position: int, now: float) -> None:
        """Begin to send `stream` at the frame `position`."""
        self.position = position
        self.pace.begin(position, stream.rate, now)
        self._fade_bound = round(FADE_BOUND_SECONDS * stream.rate)

    # What is due

    def grant(self, stream: LiveStream, frames: int, at: str) -> None:
        """Add credit. Raises Problem if there is too much of it. at: the pointer of the field that grants it."""
        room = round(CREDIT_SECONDS * stream.rate) - self._credit
        if stream.realtime:
            raise refused(at, str(frames), "no credit with pacing realtime", "Leave it out.")
        if frames > room:
            allowed = f"at most {room} frames now: {CREDIT_SECONDS:g} s of sound outstanding"
            raise refused(at, shown(frames), allowed, "Grant less, more often.")
        self._credit += frames

    def lack_credit(self, stream: LiveStream) -> bool:
        """Return whether the next block waits for credit."""
        return not self._credit and not stream.realtime

    def wait(self, stream: LiveStream, now: float) -> float | None:
        """Return the seconds until a block is due, None if it first needs credit."""
        if stream.realtime:
            return max(0.0, self.pace.due - now)
        return 0.0 if self._credit else None

    def due_frames(self, stream: LiveStream, now: float) -> int:
        """Return the frames that clock or credit allow in a block now, 0 for none."""
        if stream.realtime:
            return stream.block if now >= self.pace.due else 0
        return min(stream.block, self._credit)

    def lateness(self, stream: LiveStream, now: float) -> float:
        """Return by how many seconds the next block is late."""
        return now - self.pace.due + self.pace.skipped if stream.realtime else 0.0

    # The messages of a block

    def messages(self, stream: LiveStream, pcm: bytes, frames: int, now: float) -> list[str | bytes]:
        """Return the messages, in order, for the rendered block of `frames`."""
        messages: list[str | bytes] = [
            *stream.notices(self.position, self._version),
            *stream.before_limiter(self.position, frames),
            pcm,
        ]
        skipped, own = self.pace.skipped, self.pace.take_skipped(own=True)
        if skipped:
            messages.insert(0, server_messages.skipped(self.position, skipped))
        self.position += frames
        self._metrics.block_sent("live", frames, self.pace.own_late(now) if stream.realtime else None, own)
        if stream.realtime:
            self.pace.advance(self.position)
        else:
            self._credit -= frames
        if (limited := stream.limited(now)) is not None:
            messages.append(limited)
        return messages

    # The last fade

    def last_frames(self, stream: LiveStream) -> int:
        """Return the length of the next block of the fade, 0 after the last one."""
        kept, self._fading = stream.frame - self.position, True
        if kept and not self._faded:
            self._fade_bound = 0  # the kept sound is faded in place of the voice
            return min(kept, stream.fade_frames, stream.block)
        if self._faded < self._fade_bound and not stream.voice.finished:
            stream.voice.release()
            rest = stream.fade_frames - self._faded
            return min(stream.block, rest if rest > 0 else 1 + stream.fade_frames // 5)
        return 0

    def last_messages(self, stream: LiveStream, pcm: bytes, frames: int) -> list[str | bytes]:
        """Return the message for a block of the fade."""
        if not self._fading:  # the end was requested while the block was rendered, so the block itself must fade
            kept = min(frames, stream.fade_frames)
            pcm, frames, self._fade_bound = stream.cut(kept), kept, 0
        self._faded += frames
        self.position += frames
        self._metrics.block_sent("live", frames)
        return [pcm]
