"""VOICE: a running plan. State that renders block after block.

Stage   3 (VOICE).
Model   At constant speed and load the phase is frame times a 64-bit step, so frame N computed directly is frame N streamed.
        With motion the phase is carried from block to block, or follows the position where that is known.
Source  design, sections 1, 4 and 8.
Limits  float32 at the block: 6e-8 of full scale. Blocks are not limited to full scale; `output.Limiter` does that.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from synth.cache import ResponseCache
from synth.contact.reading import read_steady
from synth.motion import Motion, ScanMotion
from synth.moving import MovingReader, completed
from synth.output import Block, fade_envelope
from synth.plan import Plan, plan_of
from synth.preparation import Preparation, phase_step, prepare
from synth.scene import Scene

BLOCK = 1 << 14  # frames a block of `blocks`: large enough that Python costs nothing, small enough for flat memory


class Voice:
    """Renders one scene, block after block.

    solved: what `prepare` returned. phase: where the texture stands at frame 0, a 64-bit fraction of a turn.
    wait: rows of load that a block needs are solved before it is rendered (False: the nearest rows play meanwhile).
    """

    def __init__(self, solved: Preparation, *, phase: int = 0, wait: bool = True) -> None:
        self.solved = solved
        self.scene = solved.scene
        self.frame = 0
        self._wait = wait
        self._phase = phase
        self._motion = ScanMotion(solved.scene)
        self._step = phase_step(solved.scene.scan.speed, solved.scene.texture.period, self.sample_rate)
        self._reader: MovingReader | None = None
        self._by_hand = False
        self._before = np.full(4, math.nan)
        self._tables = []
        if solved.spectrum is not None and not solved.moving:
            self._tables = [solved.steady_table(channel).coefficients for channel in solved.channels]
        elif solved.spectrum is not None:
            self._reader = MovingReader(solved, phase, load_varies=solved.load_varies, wait=wait)
            if solved.load_varies and self._reader.rows is not None:
                self._reader.rows.cover(*solved.loads)
                self._reader.take_over_rows()

    @property
    def sample_rate(self) -> int:
        """Frames a second."""
        return self.scene.output.sample_rate

    @property
    def channels(self) -> int:
        """Channels of a block."""
        return len(self.solved.channels)

    @property
    def quantities(self) -> tuple[str, ...]:
        """Quantity of each channel."""
        return tuple(channel.quantity for channel in self.solved.channels)

    @property
    def full_scale(self) -> tuple[float, ...]:
        """SI value that is 1.0 in the audio, of each channel."""
        return tuple(channel.full_scale for channel in self.solved.channels)

    @property
    def warnings(self) -> tuple[str, ...]:
        """What a user should know before listening."""
        return self.solved.warnings

    @property
    def plan(self) -> Plan:
        """The plan that this voice runs."""
        return plan_of(self.solved)

    @property
    def phase(self) -> int:
        """Where the texture stands at the next frame, a 64-bit fraction of a turn."""
        if self._reader is not None:
            return int(self._reader.phase[0])
        return (self._phase + self._step * self.frame) % 2**64

    @property
    def memory_bytes(self) -> int:
        """Bytes of tables and rows."""
        tables = sum(table.nbytes for table in self._tables)
        return tables + (0 if self._reader is None else self._reader.memory_bytes)

    def render(self, frames: int, motion: Motion | None = None) -> Block:
        """Return the next `frames` frames, float32 [frames, channels], value / full_scale.

        motion: what the hand does at these frames; without it the scene's own scan goes on (after a motion: from where the
        hand left the texture). Raises ValueError if the motion has another number of frames.
        """
        if motion is not None and motion.frames != frames:
            raise ValueError(f"a motion of {motion.frames} frames cannot fill a block of {frames}")
        out = np.empty((frames, self.channels), dtype=np.float32)
        if frames:
            self._fill(out, motion)
        self.frame += frames
        return out

    def _fill(self, out: Block, motion: Motion | None) -> None:
        if self.solved.spectrum is None:
            out[:] = 0.0
        elif motion is not None:
            self._hand(out, motion)
        elif self._tables and not self._by_hand:
            phase, step = np.uint64(self.phase), np.uint64(self._step)
            for number, table in enumerate(self._tables):
                read_steady(table, phase, step, 1.0, out, number)
        else:
            assert self._reader is not None
            own = self._motion.at(self.frame, len(out))
            self._reader.read(Motion(own.samples) if self._by_hand else own, out)

    def _hand(self, out: Block, motion: Motion) -> None:
        if not self._by_hand:
            self._reader = MovingReader(self.solved, self.phase, load_varies=True, wait=self._wait)
            self._by_hand = True
        assert self._reader is not None
        if not motion.complete:
            motion = completed(motion, self.sample_rate, self.scene.texture.period, self._before)
        self._reader.read(motion, out)

    def seek(self, frame: int) -> None:
        """Go to `frame` of the scene's own scan; ValueError after a hand has moved it."""
        if self._by_hand:
            raise ValueError("a voice that a hand has moved cannot seek: its phase depends on the motion so far")
        self.frame = frame


def open_voice(scene: Scene, *, cache: ResponseCache | None = None, wait: bool = True) -> Voice:
    """Return a voice for `scene`, its response solved (milliseconds to seconds; the time is spent without the GIL)."""
    return Voice(prepare(scene, cache), wait=wait)


def total_frames(scene: Scene) -> int:
    """Return how many frames `output.duration` is."""
    return round(scene.output.duration * scene.output.sample_rate)


def blocks(voice: Voice, frames: int = BLOCK) -> Iterator[Block]:
    """Yield the whole duration of a voice's scene in blocks, with the fades that `output.fade` asks for."""
    total = total_frames(voice.scene)
    fade = round(voice.scene.output.fade * voice.sample_rate)
    while voice.frame < total:
        first = voice.frame
        block = voice.render(min(frames, total - first))
        if fade and (first < fade or first + len(block) > total - fade):
            block *= fade_envelope(first, len(block), total, fade)[:, np.newaxis].astype(np.float32)
        yield block


def render(scene: Scene, *, cache: ResponseCache | None = None) -> Block:
    """Return the whole duration of `scene`, float32 [frames, channels], value / full_scale, not limited."""
    voice = open_voice(scene, cache=cache)
    return np.concatenate(list(blocks(voice, 1 << 18)))
