"""VOICE: a running plan. State that renders block after block.

Stage   3 (VOICE).
Model   At constant speed and load the phase is frame times a 64-bit step, so frame N computed directly is frame N
        streamed. With motion the phase is carried from block to block, or follows the position where that is known.
Source  design, sections 1, 4 and 8.
Limits  float32 at the block: 6e-8 of full scale. Blocks are not limited to full scale; `output.Limiter` does that.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from copy import copy
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from synth.motion.motion import Motion, ScanMotion
from synth.plan.plan import Plan, plan_of
from synth.plan.preparation import Preparation, prepare
from synth.plan.usual_hand import prepare_hand, with_hand_scale
from synth.response.cache import ResponseCache
from synth.response.phases import phase_step, turns_to_phase
from synth.scene.scene import Scene
from synth.scene.source import SceneLike, scene_from
from synth.voice.limiter import Block, fade_envelope
from synth.voice.moving import MovingReader, completed
from synth.voice.moving_tables import MovingTables, tables_for
from synth.voice.solved_frames import SolvedFrames

if TYPE_CHECKING:
    from synth.voice.voice_effects import VoiceEffects

BLOCK = 1 << 14  # frames a block of `blocks`: large enough that Python costs nothing, small enough for flat memory


class Voice:
    """Renders one scene, block after block.

    solved: what `prepare` returned. channels: channels of a block. frame: the next frame. phase: where the texture
    stands at frame 0, a 64-bit fraction of a turn.
    live: for a hand that does not wait. The rows of load round the scan's own are solved here, the usual range in a
    thread; until they are ready the nearest rows play. Otherwise a block waits for the rows that it needs. A scene that
    is silent by itself has the full scale 1, or, live, that of a usual hand on it. paced: its blocks have deadlines, so
    that a recording is read from tables, never solved at its frames. cache: responses shared with others. follow: have
    rows solved for a live hand from the beginning; otherwise its readers are told when (`hand_readers`).
    """

    def __init__(
        self,
        solved: Preparation,
        *,
        phase: int = 0,
        live: bool = False,
        paced: bool = False,
        cache: ResponseCache | None = None,
        follow: bool = True,
    ) -> None:
        self._cache = cache or ResponseCache()
        self._follows = follow
        self.solved = solved = with_hand_scale(solved, self._cache) if live else solved
        self.scene = solved.scene
        self.frame = 0
        self.channels = len(solved.all_channels)
        self._live = live
        self._phase = phase
        self._moves = solved.moving and solved.spectrum is not None
        self._motion = ScanMotion(solved.scene)
        self._step = phase_step(solved.scene.scan.speed, solved.scene.texture.period, self.sample_rate)
        self._reader: MovingReader | None = None
        self._by_hand = False
        self._before = np.full(4, math.nan)
        self._readers = []
        self._frames: SolvedFrames | None = None
        self._effects: VoiceEffects | None = None
        if solved.effects is not None and solved.spectrum is not None:
            self._effects = _effects_of(solved, phase, wait=True, paced=live or paced)
        if solved.simulated:
            pass  # the simulation takes the place of the response
        elif solved.spectrum is not None and not solved.moving:
            self._readers = [(c.reader, 1.0 / c.full_scale, c.level) for c in solved.channels if c.reader is not None]
        elif solved.spectrum is not None and solved.frames is not None and not (live or paced):
            self._frames = SolvedFrames(solved, solved.frames)
        elif solved.spectrum is not None:
            self._reader = MovingReader(solved, phase, MovingTables(solved, wait=True))
            self._reader.cover(*self._motion.recorded_loads())
        self._still = solved.scene.texture.amplitude == 0.0
        self._hand_reader: MovingReader | None = None
        self._hand_effects: VoiceEffects | None = None
        if live and not self._still:
            self._ready_for_hand()

    def __repr__(self) -> str:
        scales = zip(self.quantities, self.full_scale, strict=True)
        channels = ", ".join(f"{quantity} (full scale {scale:.3g})" for quantity, scale in scales)
        return f"<Voice at frame {self.frame}, {self.sample_rate} Hz: {channels}>"

    @property
    def sample_rate(self) -> int:
        """Frames a second."""
        return self.scene.output.sample_rate

    @property
    def quantities(self) -> tuple[str, ...]:
        """Quantity of each channel."""
        return tuple(channel.quantity for channel in self.solved.all_channels)

    @property
    def full_scale(self) -> tuple[float, ...]:
        """SI value that is 1.0 in the audio, of each channel."""
        return tuple(channel.full_scale for channel in self.solved.all_channels)

    @property
    def warnings(self) -> tuple[str, ...]:
        """What a user should know before listening."""
        return self.plan.warnings

    @property
    def plan(self) -> Plan:
        """The plan that this voice runs, with the error of the rows of load solved so far."""
        if self._reader is None:
            solved = self.solved if self._effects is None else self._effects.solved
            return plan_of(replace(solved, scene=self.scene), framed=self._frames is not None)
        return plan_of(replace(self._reader.solved, scene=self.scene), self._reader.rows)

    @property
    def frames_together(self) -> int:
        """Frames that are solved together, 0 where they are read from tables."""
        return 0 if self._frames is None else self._frames.chunk

    @property
    def phase(self) -> int:
        """Where the texture stands at the next frame, a 64-bit fraction of a turn."""
        if self._reader is not None:
            return int(self._reader.phase[0])
        if self._by_hand and self._effects is not None:
            return int(self._effects.place[0])
        if self._frames is not None or self._moves:
            return int(turns_to_phase(self._motion.at(self.frame, 1).position / self.scene.texture.period)[0])
        return (self._phase + self._step * self.frame) % 2**64

    @property
    def memory_bytes(self) -> int:
        """Bytes of what was prepared, and of the tables and rows of a moving voice."""
        moving = self._frames or self._reader
        held = 0 if self._effects is None else self._effects.memory_bytes
        return self.solved.memory_bytes + held + (0 if moving is None else moving.memory_bytes)

    def render(self, frames: int, motion: Motion | None = None) -> Block:
        """Return the next `frames` frames, float32 [frames, channels], value / full_scale.

        motion: what the hand does at these frames; without it the scene's own scan goes on (after a motion: from where
        the hand left the texture). Raises ValueError if the motion has another number of frames.
        """
        if motion is not None and motion.samples.shape[1] != frames:
            raise ValueError(f"a motion of {motion.frames} frames cannot fill a block of {frames}")
        out = np.empty((frames, self.channels), np.float32)
        if frames and motion is not None and self._by_hand and motion.complete:
            self._follow(motion, out)
        elif frames:
            self._fill(out, motion)
        self.frame += frames
        return out

    def _fill(self, out: Block, motion: Motion | None) -> None:
        if self._still:
            out[:] = 0.0
        elif motion is not None:
            self._hand(out, motion)
        elif self._by_hand:
            self._follow(Motion(self._motion.at(self.frame, len(out)).samples), out)
        elif self.solved.spectrum is None:
            out[:] = 0.0
        else:
            self._scan(out)

    def _scan(self, out: Block) -> None:
        """Render the scene's own scan."""
        phase, own = self.phase, None
        if self._moves and (self._reader is not None or self._effects is not None):
            own = self._motion.at(self.frame, len(out))
        for number, (reader, gain, level) in enumerate(self._readers):
            reader.read(phase, self._step, gain, out, number)
            if level:
                out[:, number] += np.float32(gain * level)
        if self._frames is not None:
            self._frames.read(self.frame, out[:, : len(self.solved.channels)])
        elif self._reader is not None:
            assert own is not None
            self._reader.read(own, out)
        if self._effects is not None:
            self._effects.along(self.frame, phase, self._step, own, out)

    def _hand(self, out: Block, motion: Motion) -> None:
        if not self._by_hand:
            phase = self.phase
            if self._hand_reader is None and self._hand_effects is None:
                self._ready_for_hand()
            self._reader, self._effects, self._by_hand = self._hand_reader, self._hand_effects, True
            if self._reader is not None:
                self._reader.phase[0] = phase
            if self._effects is not None:
                self._effects.place[0] = phase
        if not motion.complete:
            motion = completed(motion, self.sample_rate, self._before)
        self._follow(motion, out)

    def _follow(self, motion: Motion, out: Block) -> None:
        """Render a complete motion; what a live voice costs a block is this."""
        if self._reader is not None:
            self._reader.read_hand(motion, out)
        if self._effects is not None:
            self._effects.after(motion, out)

    def _ready_for_hand(self) -> None:
        """Make what follows a hand: the response in rows of load, unless a simulation takes its place; the effects."""
        hand = prepare_hand(self.scene, self.full_scale, self._cache)
        if not hand.simulated:
            self._hand_reader = MovingReader(hand, 0, tables_for(hand, self._cache, wait=not self._live))
        if hand.effects is not None:
            self._hand_effects = _effects_of(hand, 0, wait=not self._live, paced=self._live)
        for reader in self.hand_readers if self._follows else ():
            reader.follow()

    @property
    def hand_readers(self) -> tuple[MovingReader, ...]:
        """What reads rows of load for a hand."""
        own = () if self._hand_reader is None else (self._hand_reader,)
        return own if self._hand_effects is None else (*own, *self._hand_effects.readers)

    @property
    def late(self) -> int:
        """Frames by which what follows a hand is late."""
        return 0 if self._hand_effects is None else self._hand_effects.late

    @property
    def usual_loads_ready(self) -> bool:
        """True when the usual range of loads is solved, coarsely."""
        followed = None if self._hand_reader is None else self._hand_reader.followed
        return followed is None or followed.solver.usual_range_ready

    @property
    def rows_ready(self) -> bool:
        """True when the loads round the hands are solved to the tolerance too, and no thread works for them."""
        followed = None if self._hand_reader is None else self._hand_reader.followed
        return followed is None or followed.solver.resting

    def close(self, *, wait: bool = True) -> None:
        """End the threads that solve rows, unless other voices need them; this one can still render what is solved.

        wait: until they have ended.
        """
        for reader in self.hand_readers:
            reader.close(wait=wait)

    @property
    def hand_reader(self) -> MovingReader | None:
        """What reads the blocks of a hand that has begun to move it, where that is all there is to a block."""
        alone = self._by_hand and self._effects is None and not self._still
        return self._reader if alone and not any(channel.is_approach for channel in self.solved.channels) else None

    @property
    def cheap_twin(self) -> bool:
        """True where `twin` takes microseconds: a hand without effects."""
        return self._hand_effects is None and self._hand_reader is not None

    def twin(self) -> Voice:
        """Return a voice that a hand may lead on from here: the same scene, gain and rows, live, nothing rendered yet.

        With effects it begins anew and takes milliseconds.
        """
        if not self.cheap_twin:
            made = Voice(self.solved, live=self._live, cache=self._cache, follow=False)
            for mine, theirs in zip(self.hand_readers, made.hand_readers, strict=True):
                theirs.use_rows(mine.edges)
            return made
        made = copy(self)
        made.frame, made._before = 0, self._before.copy()
        assert self._hand_reader is not None
        made._hand_reader = made._reader = self._hand_reader.twin()
        return made

    def begin_at(self, phase: int) -> None:
        """Have the texture stand at `phase` (a 64-bit fraction of a turn) at frame 0; the voice has not begun."""
        assert self.frame == 0, "the voice has begun"
        self._phase = phase
        if self._reader is not None:
            self._reader.phase[0] = phase
        if self._effects is not None:
            self._effects.begin_at(phase)

    def seek(self, frame: int) -> None:
        """Go to `frame` of the scene's own scan; ValueError after a hand has moved it."""
        if self._by_hand:
            raise ValueError("a voice that a hand has moved cannot seek: its phase depends on the motion so far")
        self.frame = frame


def _effects_of(solved: Preparation, phase: int, *, wait: bool, paced: bool) -> VoiceEffects:
    """Return the effects of a voice; only a scene that has some loads them."""
    from synth.voice.voice_effects import VoiceEffects

    return VoiceEffects(solved, phase, wait=wait, paced=paced)


def open_voice(scene: SceneLike, *, cache: ResponseCache | None = None, live: bool = False) -> Voice:
    """Return a voice for `scene`, its response solved (milliseconds to seconds; the time is spent without the GIL).

    scene: a Scene, a mapping, the path of a JSON file, or a name of the catalogue. cache: responses solved before.
    live: for a hand that does not wait, see `Voice`; close such a voice when it is done.
    Raises SceneError where the scene is at fault, CannotRender where it cannot be carried out.

    Example: block = synth.open_voice("grating-1mm-31um").render(480)  # float32 [480, 1], in units of full_scale
    """
    kept = cache or ResponseCache()
    return Voice(prepare(scene_from(scene), kept, paced=live), live=live, cache=kept)


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
