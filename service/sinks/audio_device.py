"""Plays blocks on an audio device, such as a voice coil or a loudspeaker, through PortAudio.

Model: `write` fills a ring buffer, from which PortAudio's callback copies. The ring holds four blocks and as many more
    as the device buffers itself, because the device takes those at once when it starts. Where the ring is short, the
    callback writes zeros and counts an underrun; it never raises, waits or allocates. The stream starts when the ring
    is full, so that a sound does not begin with an underrun. The edges of later underruns are softened.
    `stop` fades to zero in 5 ms inside the callback, because an abrupt end of a voice coil is felt as a knock.
    If the device has taken nothing for `STALLED_SECONDS`, the frames in the ring are stale and dropped.
Source: python-sounddevice over PortAudio. Samples are float32 throughout, so the device gets the voice's samples.
Limits: the latency is the ring (40 ms by default, plus as much as the device buffers) plus the device's own. A device
    that takes nothing for the timeout of `write` has stalled. A device whose stream ends by itself has vanished.
    `failure` and the next `write` report both. The device does not play again when it comes back, because an actuator
    must not move unexpectedly. Opening and starting a device may take 5 s, and ending it 1 s; after that the driver's
    thread is abandoned and `failure` reports it. What the device has buffered (two periods or more) cannot be dropped.
"""

from __future__ import annotations

import math
import threading
import time
from typing import Any

import numpy as np

from service.sinks.device_access import Claims, within
from service.sinks.device_list import DeviceDescription, find_device, let_go_at_exit, portaudio
from service.sinks.gap_fade import Joins
from service.sinks.ring_buffer import Ring
from service.sinks.sink import WRITE_TIMEOUT_S
from synth.encode.formats import Block, Metadata
from synth.errors import CannotRender

BLOCK_SECONDS = 0.010  # the callback's period: longer adds latency, shorter costs wake-ups
RING_BLOCKS = 4  # at least three, to survive a late thread; each adds a period of latency
FADE_SECONDS = 0.005  # of `stop`: below the 20 ms that a stop may take, and long enough to avoid a knock
STALLED_SECONDS = 0.5  # without a callback: 50 periods, longer than the delays of a busy machine
OPEN_SECONDS = 5.0  # for PortAudio to open or start a stream; wireless devices take a second or two
END_SECONDS = 1.0  # for PortAudio to end a stream


class DeviceSink:
    """Plays blocks on one output device."""

    def __init__(
        self,
        device: str | int | None = None,
        *,
        block_seconds: float = BLOCK_SECONDS,
        ring_blocks: int = RING_BLOCKS,
        claims: Claims | None = None,
    ) -> None:
        """Open nothing yet.

        device: its name or index; None for the default device.
        claims: the devices in use by this process; None if this is the only sink.
        """
        assert ring_blocks >= 3, "a ring shorter than three blocks runs dry"
        self.name = "the default device" if device is None else str(device)
        self.underruns = 0  # callbacks that found the ring short
        self.device_underflows = 0  # gaps that PortAudio itself reports
        self.dropped_frames = 0  # stale after a stall
        self._device, self._block_seconds, self._ring_blocks = device, block_seconds, ring_blocks
        self._claims = claims or Claims()
        self._stream: Any = None
        self._failure: str | None = None
        self._lock = threading.Lock()  # starting and ending the stream; never taken by the callback
        self._playing = self._begun = self._fading = self._closed = False  # begun: the callback was called
        self._faded = 0
        self._called = 0.0

    @property
    def latency(self) -> float:
        """Return the seconds from `write` to the output, with a full ring."""
        if self._stream is None:
            return self._ring_blocks * self._block_seconds
        return self._ring.capacity / self._sample_rate + self._device_latency

    @property
    def failure(self) -> str | None:
        """Return why the device no longer plays; None while it plays."""
        if self._failure is None and self._stalled():
            return _stall_sentence(self.name, STALLED_SECONDS)
        return self._failure

    def start(self, sample_rate: int, channels: int, metadata: Metadata | None = None) -> None:
        """Open the device.

        Raises InvalidRequest if there is no such device, DeviceBusy if it is in use, CannotRender if it does not open.
        """
        assert self._stream is None, "a sink starts once"
        sounddevice = portaudio()
        device = find_device(self._device)
        self.name = device["name"]
        self._claims.take(device["index"], self.name)
        try:
            self._prepare(sounddevice, device, sample_rate, channels)
        except BaseException:
            self._claims.give_back(device["index"])
            raise
        self._index = device["index"]

    def _prepare(self, sounddevice: Any, device: DeviceDescription, sample_rate: int, channels: int) -> None:
        """Make the stream, not yet running, and its ring."""
        block = max(1, round(self._block_seconds * sample_rate))
        self._sample_rate = sample_rate
        fade_frames = max(2, round(FADE_SECONDS * sample_rate))
        self._ramp = np.linspace(1.0, 0.0, fade_frames, dtype=np.float32)[:, np.newaxis]
        self._joins = Joins(fade_frames, channels)
        self._stream = self._open(sounddevice, device, sample_rate, channels, block)
        self._device_latency = float(self._stream.latency)
        own_blocks = math.ceil(self._device_latency * sample_rate / block)
        self._ring = Ring((self._ring_blocks + own_blocks) * block, channels)

    def write(self, block: Block, timeout: float = WRITE_TIMEOUT_S) -> None:
        """Put `block` into the ring. Raises CannotRender if the device takes nothing for `timeout` seconds."""
        assert self._stream is not None, "start comes first"
        assert block.dtype == np.float32 and block.ndim == 2, "blocks are float32 [frames, channels]"
        done, moved = 0, time.monotonic()
        while True:
            if self._failure is not None or self._closed:
                raise CannotRender(self._failure or f"{self.name} is closed.")
            taken = self._ring.write(block[done:])
            done += taken
            if self._ring.filled == self._ring.capacity and not self._playing:
                with self._lock:
                    if not self._closed:
                        self._play()
            if done == len(block):
                return
            now = time.monotonic()
            moved = now if taken else moved
            if now - moved > timeout:
                self._failure = _stall_sentence(self.name, timeout)
            else:
                time.sleep(self._block_seconds / 4)

    def stop(self) -> None:
        """Fade to silence in 5 ms, drop the rest of the ring, and end."""
        self._finish(fade=True)

    def close(self) -> None:
        """Play the rest of the ring, then end. `failure` reports a device that fails meanwhile."""
        self._finish(fade=False)

    def _open(self, sounddevice: Any, device: DeviceDescription, sample_rate: int, channels: int, block: int) -> Any:
        """Return the stream, not yet running."""

        def opened() -> Any:
            """Open the stream. Runs in a thread, because a broken driver may never return."""
            return sounddevice.OutputStream(
                samplerate=sample_rate,
                blocksize=block,
                device=device["index"],
                channels=channels,
                dtype="float32",
                latency="low",
                callback=self._fill,
                finished_callback=self._ended,
            )

        try:
            return within(OPEN_SECONDS, opened, too_late=lambda stream: stream.close())
        except TimeoutError as error:
            let_go_at_exit()
            raise CannotRender(f"{self.name} did not open within {OPEN_SECONDS:g} s.") from error
        except sounddevice.PortAudioError as error:
            asked = f"{channels} channel{'s' if channels > 1 else ''} at {sample_rate} Hz"
            offers = f"{device['channels']} channels, {device['default_sample_rate']:.0f} Hz by default"
            raise CannotRender(f"{self.name} does not open for {asked} (it has {offers}): {error}.") from error

    def _fill(self, out: Block, frames: int, times: Any, status: Any) -> None:
        """Copy the next frames to the device. This is PortAudio's callback, in a thread of its own."""
        stalled, self._called, self._begun = self._begun and self._stalled(), time.monotonic(), True
        if status.output_underflow:
            self.device_underflows += 1
        if stalled:
            self.dropped_frames += self._ring.drop()
            self._joins.cut()
        taken = self._ring.read_into(out)
        if taken < frames:
            out[taken:] = 0.0
            if not self._closed:
                self.underruns += 1
        self._joins.soften(out, frames if self._closed else taken)  # after the last frame zeros are not a gap
        if self._fading:
            count = min(frames, len(self._ramp) - self._faded)
            out[:count] *= self._ramp[self._faded : self._faded + count]
            out[count:] = 0.0
            self._faded += count

    def _ended(self) -> None:
        """Note that the stream has ended. PortAudio calls this, also when a device vanishes."""
        if not self._closed:
            self._failure = f"{self.name} stopped by itself: the device was removed, or its driver failed."

    def _play(self) -> None:
        """Start the stream. Needs the lock."""
        if self._playing:
            return
        self._called = time.monotonic()
        self._playing = True
        try:
            within(OPEN_SECONDS, self._stream.start)
        except TimeoutError:
            self._failure = f"{self.name} did not start within {OPEN_SECONDS:g} s."
        except portaudio().PortAudioError as error:
            self._playing = False
            self._failure = f"{self.name} does not start: {error}."

    def _stalled(self) -> bool:
        return self._playing and time.monotonic() - self._called > STALLED_SECONDS

    def _finish(self, fade: bool) -> None:
        """Let the callback empty the ring or fade out, unless the device has failed; then end the stream."""
        with self._lock:
            if self._closed:
                return
            self._closed = True
            if self._stream is None:
                return
            self._fading = fade
            try:
                if self._ring.filled and not fade:
                    self._play()
                while self._playing and self._failure is None and not self._stalled() and not self._silent():
                    time.sleep(self._block_seconds / 4)
                self._end()
                self._playing = False
            finally:
                self._claims.give_back(self._index)

    def _silent(self) -> bool:
        return self._faded >= len(self._ramp) if self._fading else self._ring.filled == 0

    def _end(self) -> None:
        """End the stream. For a stalled device PortAudio may never return."""
        self._failure = failure = self.failure
        try:
            within(END_SECONDS, lambda: self._end_stream(abort=failure is not None))
        except TimeoutError:
            self._failure = f"{self._failure or self.name + ' failed.'} It did not end within {END_SECONDS:g} s."
            let_go_at_exit()

    def _end_stream(self, abort: bool) -> None:
        try:
            if abort:
                self._stream.abort()
            else:  # returns when the device has played what PortAudio holds
                self._stream.stop()
            self._stream.close()
        except portaudio().PortAudioError as error:
            self._failure = self._failure or f"{self.name} did not end well: {error}."


def _stall_sentence(name: str, seconds: float) -> str:
    return f"{name} has stalled: it took no samples for {seconds:g} s."
