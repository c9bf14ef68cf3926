"""A voice: the state of a running plan, which renders block after block.

Stage   3 (VOICE).
Model   At constant speed and load the phase is the frame number times a 64-bit step, so a frame has the same samples
        whether it is rendered directly or in a stream. A varying scan is solved along its motion. Where blocks have
        deadlines, and for a hand, z is read from the response table, or solved directly where that is too coarse.
Source  design, sections 1, 4 and 8.
Limits  Blocks are float32: 6e-8 of full scale. They may exceed full scale; `limiter.Limiter` keeps them within it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from copy import copy
from dataclasses import replace
from operator import index
from typing import TYPE_CHECKING, Self

import numpy as np

from synth.arrays import Block
from synth.held_memory import held_by
from synth.motion.motion import Motion, completed
from synth.motion.moved_skin import SkinAfterHand, mover_of
from synth.motion.scan_motion import ScanMotion
from synth.plan.effect_choice import added_where_smooth, require_fixed_ends
from synth.plan.motion_peak import fades
from synth.plan.plan import Plan, plan_of, warnings_of
from synth.plan.preparation import Preparation
from synth.plan.prepare import prepare
from synth.plan.usual_hand import prepare_hand, with_hand_scale
from synth.response.phases import phase_step, turns_to_phase
from synth.response_cache import SHARED, ResponseCache
from synth.scene.scene import Scene, SceneLike, scene_from
from synth.voice.solved_frames import SolvedFrames

if TYPE_CHECKING:
    from synth.voice.table_reading import HandReader, ScanReader
    from synth.voice.voice_effects import VoiceEffects

BLOCK = 1 << 14  # frames per block of `blocks`: large compared with the cost of Python, small in memory


class Voice:
    """Renders one scene, block after block.

    solved: result of `prepare`. If it was prepared for a hand, every motion is rendered as that of a hand.
    live: for an interactive hand: its table is made now, and automatic full scales allow for the hand.
    paced: blocks have deadlines.
    cache: responses and tables shared with other voices.
    frame: the next frame.
    channels: number of channels of a block.
    """

    def __init__(
        self,
        solved: Preparation,
        *,
        live: bool = False,
        paced: bool = False,
        cache: ResponseCache | None = None,
    ) -> None:
        self._cache = cache or SHARED
        self.solved = solved = with_hand_scale(solved, self._cache) if live else solved
        self.scene = solved.scene
        self.frame = 0
        self.channels = len(solved.all_channels)
        self._phase, self._live = 0, live
        self._by_hand = solved.by_hand
        sounds = solved.spectrum is not None or (solved.effects is not None and bool(solved.effects.stages))
        self._moves = solved.moving and not solved.by_hand and sounds
        self._motion = ScanMotion(solved.scene, whole=solved.live)
        self._step = phase_step(solved.scene.scan.speed, solved.scene.texture.period, self.sample_rate)
        self._smooth = solved.scene.texture.amplitude == 0.0
        self._still = self._smooth and not added_where_smooth(solved.scene)
        self._steady = []
        self._scan: SolvedFrames | ScanReader | None = None
        if solved.spectrum is None or solved.stepped or solved.by_hand:
            pass  # silence, or a simulation runs in place of the response, or only a hand moves the finger
        elif not solved.moving:
            self._steady = [(c.reader, 1.0 / c.full_scale, c.level) for c in solved.channels if c.reader is not None]
        elif solved.frames is not None:
            self._scan = SolvedFrames(solved, solved.frames)
        else:
            from synth.voice.table_reading import ScanReader, reader_of  # imported only for a voice that moves live

            self._scan = ScanReader(reader_of(solved), solved.scene)
        self._effects: VoiceEffects | None = None
        if solved.effects is not None and sounds and not solved.by_hand:
            self._effects = _effects_of(solved, paced=live or paced)
        self._before = np.full(4, math.nan)
        self._skin: SkinAfterHand | None = None
        self._for_hand = solved if solved.by_hand else None
        self._hand: HandReader | None = None
        self._hand_effects: VoiceEffects | None = None
        if (live or solved.by_hand) and not self._still:
            self._ready_for_hand()

    def __repr__(self) -> str:
        scales = zip(self.quantities, self.full_scale, strict=True)
        channels = ", ".join(f"{quantity} (full scale {scale:.3g})" for quantity, scale in scales)
        return f"<Voice at frame {self.frame}, {self.sample_rate} Hz: {channels}>"

    @property
    def sample_rate(self) -> int:
        """Frames per second."""
        return self.scene.output.sample_rate

    @property
    def quantities(self) -> tuple[str, ...]:
        """Quantity of each channel."""
        return tuple(channel.quantity for channel in self.solved.all_channels)

    @property
    def full_scale(self) -> tuple[float, ...]:
        """SI value of a sample of 1.0 in each channel."""
        return tuple(channel.full_scale for channel in self.solved.all_channels)

    @property
    def warnings(self) -> tuple[str, ...]:
        """The warnings of the plan."""
        return warnings_of(self.told)

    @property
    def plan(self) -> Plan:
        """The plan of this voice; after a hand has moved it, the plan for a hand."""
        return plan_of(self.told)

    @property
    def told(self) -> Preparation:
        """The preparation that the plan describes."""
        solved = self._for_hand if self._by_hand and self._for_hand is not None else self.solved
        return replace(solved, scene=self.scene)

    @property
    def over_points(self) -> bool:
        """Whether a simulation follows a hand over an area, on points."""
        effects = self.told.effects
        plan = None if effects is None else effects.simulation
        return plan is not None and plan.simulation.stepper.line is not None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        """Do nothing: a voice holds memory only. `with` serves code that also opens a `Live`."""

    @property
    def frames_together(self) -> int:
        """Number of frames solved together, or 0."""
        return self._scan.chunk if isinstance(self._scan, SolvedFrames) else 0

    @property
    def phase(self) -> int:
        """Phase of the texture at the next frame, a 64-bit fraction of a turn."""
        if self._by_hand and self._hand is not None:
            return self._hand.phase
        if self._by_hand and self._hand_effects is not None:
            return int(self._hand_effects.place[0])
        if self._moves:
            return int(turns_to_phase(self._motion.at(self.frame, 1).position / self.scene.texture.period)[0])
        return (self._phase + self._step * self.frame) % 2**64

    @property
    def memory_bytes(self) -> int:
        """Memory in bytes of all that the voice keeps alive: its scene, tables, surfaces, solvers and own state.

        Where frames are solved together, the working memory of a chunk counts, too.
        """
        working = self._scan.memory_bytes if isinstance(self._scan, SolvedFrames) else 0
        return held_by(self).bytes + working

    @property
    def late(self) -> int:
        """Frames by which the output is behind the motion of a hand."""
        reading = 0 if self._hand is None else self._hand.delay
        return max(reading, 0 if self._hand_effects is None else self._hand_effects.late)

    def render(self, frames: int, motion: Motion | None = None) -> Block:
        """Return the next `frames` frames, float32 [frames, channels], value / full_scale.

        motion: motion of the hand at these frames. Without it the scene's own scan continues, from the phase at which
            the hand left the texture.
        Raises ValueError if the motion has another number of frames, and TypeError for a number that is not whole.
        """
        frames = index(frames)  # an integer of NumPy would overflow in the phase
        if motion is not None and not motion.fills(frames):
            raise ValueError(f"a motion of {motion.frames} frames cannot fill a block of {frames}; see Motion.of")
        out = np.empty((frames, self.channels), np.float32)
        if frames and self._still:
            out[:] = 0.0
        elif frames and motion is not None:
            self._follow(motion, out)
        elif frames and self._by_hand:
            self._follow(Motion(self._motion.of_hand(self.frame, frames).samples), out)
        elif frames:
            self._go_on(out)
        if self._smooth and not self._still:
            self._silence(out)
        self.frame += frames
        return out

    def _go_on(self, out: Block) -> None:
        """Render the scene's own scan."""
        if self.solved.spectrum is None:
            out[:] = 0.0
        phase = 0 if self._moves else self.phase  # a motion has places
        for number, (reader, gain, level) in enumerate(self._steady):
            reader.read(phase, self._step, gain, out, number)
            if level:
                out[:, number] += np.float32(gain * level)
        if self._scan is not None:
            self._scan.read(self.frame, out[:, : len(self.solved.channels)])
        if self._effects is not None:
            own = self._motion.at(self.frame, len(out)) if self._moves else None
            self._effects.along(self.frame, phase, self._step, own, out)

    def _silence(self, out: Block) -> None:
        """Silence what a smooth texture has nothing of: z, and the channels of effects that read it."""
        own = len(self.solved.channels)
        out[:, :own] = 0.0
        out[:, own + added_where_smooth(self.scene) :] = 0.0

    def _follow(self, motion: Motion, out: Block) -> None:
        """Render the motion of a hand."""
        if not self._by_hand:
            self._take_in_hand()
        if not motion.complete:
            speed_unknown = len(motion.position) > 0 and math.isnan(self._before[0])
            motion = completed(motion, self.sample_rate, self._before)
            if speed_unknown:  # the first frame is silent: the speed is known from the second position on
                out[0] = 0.0
                motion, out = motion.part(1), out[1:]
            if not len(out):
                return
        if self._skin is not None:
            motion = self._skin.after(motion)
        if self._hand is not None and not self._smooth:
            self._hand.read(motion, out)
        if self._hand_effects is not None:
            self._hand_effects.after(motion, out, 0 if self._hand is None else self._hand.delay)

    def _take_in_hand(self) -> None:
        phase = self.phase
        if self._for_hand is None:
            self._ready_for_hand()
        self._by_hand = True
        self._stand_at(phase)

    def _stand_at(self, phase: int) -> None:
        """Set the phase of the texture where a hand takes over."""
        if self._skin is not None:
            self._skin.begin_at(phase)
        if self._hand is not None:
            self._hand.phase = phase
        if self._hand_effects is not None:
            self._hand_effects.begin_at(phase)

    def _ready_for_hand(self) -> None:
        """Make the reader (unless a simulation replaces it) and the effects that follow a hand."""
        if self._for_hand is None:
            self._for_hand = prepare_hand(self.scene, self.full_scale, self._cache)
        hand = self._for_hand
        mover = mover_of(hand.scene, by_hand=True)
        if mover is not None:
            self._skin = SkinAfterHand(mover, hand.scene.texture.period, self.sample_rate)
        if hand.table is not None or hand.direct is not None:
            from synth.voice.table_reading import HandReader, reader_of

            self._hand = HandReader(reader_of(hand), hand.scene.texture.period, self.sample_rate)
        if hand.effects is not None:
            self._hand_effects = _effects_of(hand, paced=self._live)

    def twin(self) -> Voice:
        """Return a new voice for a hand with this one's scene, gain and table. With effects this takes milliseconds."""
        made = copy(self)
        made.frame, made._before = 0, np.full(4, math.nan)
        if self._for_hand is not None and not self._still:
            made._ready_for_hand()
        return made

    def begin_at(self, phase: int) -> None:
        """Set the phase of the texture (a 64-bit fraction of a turn) at frame 0, before the first block."""
        assert self.frame == 0, "the voice has rendered a block"
        self._phase = phase
        if self._effects is not None:
            self._effects.begin_at(phase)
        self._stand_at(phase)

    def seek(self, frame: int) -> None:
        """Go to `frame` of the scene's own scan. Raises ValueError after a hand has moved the voice."""
        if self._by_hand:
            raise ValueError("a voice that a hand has moved cannot seek: its phase depends on the motion so far")
        self.frame = index(frame)


def _effects_of(solved: Preparation, *, paced: bool) -> VoiceEffects:
    """Return the effects of a voice. The import is here because only a scene with effects needs it."""
    from synth.voice.voice_effects import VoiceEffects

    return VoiceEffects(solved, paced=paced)


def open_voice(scene: SceneLike, *, cache: ResponseCache | None = None, live: bool = False) -> Voice:
    """Return a voice for `scene`. Solving its response takes milliseconds to seconds, without holding the GIL.

    scene: a Scene, a mapping, the path of a JSON file, or a name of the catalogue.
    cache: responses solved before; by default those of this process.
    live: for an interactive hand, see `Voice`.
    Raises SceneError for an invalid scene, and for one whose contact cannot be solved.

    Example: block = synth.open_voice("grating-1mm-31um").render(480)  # float32 [480, 1], in units of full_scale
    """
    kept, asked = cache or SHARED, scene_from(scene)
    if live:
        require_fixed_ends(asked)
    return Voice(prepare(asked, kept, paced=live), live=live, cache=kept)


def total_frames(scene: Scene) -> int:
    """Return the number of frames in `output.duration`."""
    return round(scene.output.duration * scene.output.sample_rate)


def blocks(voice: Voice, frames: int = BLOCK) -> Iterator[Block]:
    """Yield the whole duration of a voice's scene in blocks, with the fades of `output.fade`."""
    total = total_frames(voice.scene)
    fade = round(voice.scene.output.fade * voice.sample_rate)
    while voice.frame < total:
        first = voice.frame
        block = voice.render(min(frames, total - first))
        if fade and (first < fade or first + len(block) > total - fade):
            block *= fades(voice.scene, first, len(block))[:, np.newaxis].astype(np.float32)
        yield block
