"""A voice for endless streams: it ramps in and out, cross-fades between scenes, and stays within full scale.

Stage   3 (VOICE), for sessions and devices.
Model   `prepare` makes a change of scene ready in any thread while the stream plays; `apply` starts it at the next
        block. The new voice begins at the present phase of the texture, and a raised cosine cross-fades to it. A change
        during a cross-fade waits for its end; of several, the newest is taken. The safety limiter is last; its
        look-ahead delays changes by LOOK_AHEAD.
Source  design, sections 4 (ramps) and 8 (limiter).
Limits  Sample rate, channels, quantities and full scale stay those of the first scene. If that scene is silent, the
        full scale is that of a usual hand on it. Only `prepare`, `apply` and `release` are thread-safe; `apply` and
        `release` take effect at the next block.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from operator import index

import numpy as np

from synth.arrays import Block
from synth.errors import Fault, SceneError
from synth.held_memory import Held, held_by
from synth.plan.effect_choice import added_quantities
from synth.plan.plan import Plan
from synth.plan.preparation import Preparation
from synth.plan.prepare import prepare
from synth.plan.usual_hand import with_full_scale, with_stream_scale
from synth.response_cache import SHARED, ResponseCache
from synth.scene.scene import Scene
from synth.voice.limiter import Limiter, look_ahead
from synth.voice.voice import Voice

RAMP_TIME = 0.01  # s of fade-in and fade-out: a stop takes 20 ms at most; shorter fades click
CHANGE_TIME = 0.05  # s of a cross-fade between scenes; a shorter one is heard as a step on slow waveforms


@dataclass(frozen=True, slots=True)
class Change:
    """A prepared change of scene.

    scene: as requested.
    solved: the scene, prepared with the stream's full scale.
    voice: its voice, at the first frame.
    hand: the voice of the scene that follows the hand, at its first frame; only for a voice that follows a hand.
    """

    scene: Scene
    solved: Preparation
    voice: Voice
    hand: Voice | None = None


class LiveVoice:
    """An endless voice for one listener. Raises SceneError as `synth.plan.prepare.prepare` does.

    scene: the first scene.
    cache: responses shared with other voices.
    exact: tables are made to the scene's tolerance, which takes seconds.
    sample_rate, channels, quantities, full_scale: as of a voice; they do not change.
    reduction_db: the largest gain reduction (dB) of the limiter in the last block.
    before_limiter: the last block before the limiter; None where the limiter did not act.
    """

    def __init__(self, scene: Scene, *, cache: ResponseCache | None = None, exact: bool = False) -> None:
        self._cache, self._exact = cache or SHARED, exact
        self._first = scene
        self.scene = scene
        self._voice = Voice(self._scaled(prepare(scene, self._cache, paced=True, exact=exact)), paced=True)
        self.sample_rate, self.channels = self._voice.sample_rate, self._voice.channels
        self.quantities, self.full_scale = self._voice.quantities, self._voice.full_scale
        self._ahead = look_ahead(self.sample_rate)
        self._limiter = Limiter(self.channels, self.sample_rate, self._ahead)
        self._crossing_frames = max(1, round(CHANGE_TIME * self.sample_rate))
        self._silent = 0
        self._primed = False
        self._coming: Voice | None = None
        self._crossed = 0
        self._waiting: Change | None = None
        self._gain = 0.0
        self._rise = RAMP_TIME
        self._held = 0  # frames before the gain begins to move
        self.reduction_db = 0.0
        self.before_limiter: Block | None = None
        self._released = False
        self.frame = 0

    @property
    def plan(self) -> Plan:
        """The plan of the present scene, or of the scene that is being faded in."""
        return (self._coming or self._voice).plan

    @property
    def warnings(self) -> tuple[str, ...]:
        """The warnings of that plan."""
        return (self._coming or self._voice).warnings

    @property
    def finished(self) -> bool:
        """True once the voice was released and has faded out, including the limiter's look-ahead."""
        return self._released and self._silent >= max(1, self._ahead)

    def held(self, change: Change | None = None) -> Held:
        """Return the memory that this voice keeps alive, or that `change` keeps."""
        return held_by(self if change is None else change)

    def prepare(self, scene: Scene) -> Change:
        """Return the prepared change to `scene`. Raises SceneError where it changes a value that a stream fixes."""
        faults = fixed_faults(self._first, scene)
        if faults:
            raise SceneError(faults)
        solved = prepare(with_full_scale(scene, self.full_scale), self._cache, paced=True, exact=self._exact)
        return Change(scene, solved, Voice(solved, paced=True))

    def apply(self, change: Change) -> None:
        """Change to the prepared scene from the next block on."""
        self._waiting = change

    def release(self) -> None:
        """Fade out, beginning with the next block."""
        self._released = True

    def _scaled(self, solved: Preparation) -> Preparation:
        """Return `solved` with the full scales of the stream."""
        return with_stream_scale(solved, self._cache)

    def render(self, frames: int) -> Block:
        """Return the next `frames` frames, float32 [frames, channels], within -1..1."""
        frames = index(frames)
        self.frame += frames
        if self.finished:
            self.before_limiter = None
            return np.zeros((frames, self.channels), dtype=np.float32)
        self._prime()
        late, block = self._limiter.pending, self._unlimited(frames)
        out = np.empty_like(block)
        self._limiter.process_into(block, out)
        self.reduction_db = self._limiter.take_reduction()
        self.before_limiter = np.concatenate((late, block))[:frames] if self.reduction_db else None
        return out

    def _prime(self) -> None:
        """Fill the limiter's look-ahead, once, so that the output is not late."""
        if not self._primed:
            self._primed = True
            self._limiter.process(self._unlimited(self._ahead))  # its output is discarded

    def _unlimited(self, frames: int) -> Block:
        """Return the next frames before the limiter, whose output is `_ahead` frames behind them."""
        blocks: list[Block] = []
        left = frames
        while left or not blocks:
            if self._coming is None:
                self._begin_change()
            count = left if self._coming is None else min(left, self._crossing_frames - self._crossed)
            blocks.append(self._next(count))
            left -= count
        block = blocks[0] if len(blocks) == 1 else np.concatenate(blocks)
        self._ramp(block)
        return block

    def _begin_change(self) -> None:
        """Begin the cross-fade to the waiting change, if there is one."""
        change = self._waiting
        if change is not None:
            self._waiting = None
            begun_before = change.voice.frame > 0
            self._cross_to(Voice(change.solved, paced=True) if begun_before else change.voice)
            self.scene = change.scene

    def _cross_to(self, voice: Voice) -> None:
        """Begin the cross-fade to `voice` at the present phase of the texture."""
        self._coming, self._crossed = voice, 0
        voice.begin_at(self._voice.phase)

    def _next(self, frames: int) -> Block:
        block = self._rendered(self._voice, frames)
        if self._coming is None:
            return block
        n = self._crossed + np.arange(1, frames + 1)
        part = 0.5 - 0.5 * np.cos(math.pi * n / self._crossing_frames)
        block += ((self._rendered(self._coming, frames) - block) * part[:, np.newaxis]).astype(np.float32)
        self._crossed += frames
        if self._crossed >= self._crossing_frames:
            self._crossing_done(self._coming)
        return block

    def _rendered(self, voice: Voice, frames: int) -> Block:
        """Return the next frames of one of the two voices of a cross-fade."""
        return voice.render(frames)

    def _crossing_done(self, voice: Voice) -> None:
        """End the cross-fade: only `voice` continues."""
        self._voice, self._coming = voice, None

    def _ramp(self, block: Block) -> None:
        """Move the gain toward 1, or after a release toward 0, and apply it to `block`."""
        goal = 0.0 if self._released else 1.0
        if self._gain == goal == 1.0:
            return
        seconds = RAMP_TIME if self._released else self._rise
        step = 1.0 / max(1, round(seconds * self.sample_rate))
        away = np.maximum(np.arange(1, len(block) + 1) - self._held, 0) * (step if goal else -step)
        self._held = max(0, self._held - len(block))
        gains = np.clip(self._gain + away, 0.0, 1.0)
        block *= (0.5 - 0.5 * np.cos(math.pi * gains))[:, np.newaxis].astype(np.float32)
        self._gain = float(gains[-1]) if len(gains) else self._gain
        if self._released:
            self._silent += int(np.count_nonzero(gains == 0.0))


def fixed_faults(first: Scene, scene: Scene) -> list[Fault]:
    """Return a fault for each field that a stream fixes and `scene` changes."""
    listed = scene.output.channels is not None

    def fixed_fields(one: Scene) -> list[tuple[str, str]]:
        """Return the pointer and the value, as text, of each field that a stream fixes."""
        channels, added = one.output.channel_list, ", ".join(added_quantities(one)) or "no channel"
        return [
            ("/output/sample_rate", f"{one.output.sample_rate} Hz"),
            ("/output/channels" if listed else "/output/quantity", ", ".join(channel.quantity for channel in channels)),
            ("/effects", f"effects that add {added}"),
            ("/output/channels" if listed else "/output/full_scale", str([channel.full_scale for channel in channels])),
        ]

    faults: dict[str, Fault] = {}
    for (pointer, value), (_pointer, kept) in zip(fixed_fields(scene), fixed_fields(first), strict=True):
        if value != kept and pointer not in faults:
            hint = "Open a new session for a different value."
            faults[pointer] = Fault(pointer, value, f"{kept}, as at the start of the stream", hint)
    return list(faults.values())
