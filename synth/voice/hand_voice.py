"""A live voice moved by a hand: the scene's own scan until the first update, then the motion of the updates.

Stage   3 (VOICE), for the live protocol.
Model   `update_smoothing` turns updates into position and load at audio rate. The first update begins a cross-fade. So
        does a jump: an update that puts the finger elsewhere at once. The old motion goes on during the cross-fade; the
        new one begins at the position of the update. An update without a load keeps the previous load; the first update
        then has the load of the scene. A jump during a cross-fade waits for its end; of several, the newest is taken. A
        landing finger is ramped in. `lift` lifts the finger until the next update. A `HandLog` keeps everything that
        affects the samples, and `recording` replays it.
Source  design, sections 4 (motion, recording) and 7.
Limits  An update has its full effect `motion_delay` after the frame at which it was applied. There is one hand.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from synth.arrays import Block
from synth.motion.motion import LOAD, Motion, Update
from synth.motion.path_smoothing import PathFollower
from synth.motion.update_smoothing import DELAY
from synth.plan.direct_plan import follows_path
from synth.plan.effect_choice import require_fixed_ends
from synth.plan.plan import plan_of
from synth.plan.preparation import Preparation
from synth.plan.usual_hand import nominal_scene, prepare_hand, with_full_scale, with_hand_scale
from synth.response_cache import ResponseCache
from synth.scene.effects_section import lowest_load
from synth.scene.scene import Scene, scene_document
from synth.voice.fades import faded
from synth.voice.hand_log import FORMAT, VERSION, HandLog
from synth.voice.limiter import LOOK_AHEAD
from synth.voice.live_voice import Change, LiveVoice
from synth.voice.voice import Voice

LANDING_TIME = 0.02  # s of the ramp of a landing finger; shorter: its load rises within 1 ms, which is heard as a knock


class HandVoice(LiveVoice):
    """An endless voice for one hand.

    scene, cache, exact: as for `LiveVoice`.
    record: whether a log is kept.
    """

    def __init__(
        self, scene: Scene, *, cache: ResponseCache | None = None, record: bool = False, exact: bool = False
    ) -> None:
        require_fixed_ends(scene)
        super().__init__(scene, cache=cache, exact=exact)
        self.log = HandLog() if record else None
        self._spare: Voice | None = self._voice_for_hand(self.scene)
        self._follower: PathFollower | None = None
        self._leaving: PathFollower | None = None
        self._jump: Update | None = None
        self._load = nominal_scene(scene).scan.load
        self._lifted = False
        self._motion: Motion | None = None
        self._by_hand: set[Voice] = set()
        self._last_load: float | None = None  # N, at the last frame of the hand

    def _scaled(self, solved: Preparation) -> Preparation:
        return with_hand_scale(solved, self._cache)

    @property
    def motion_delay(self) -> float:
        """The longest time (s) from applying an update to its full effect."""
        return LOOK_AHEAD + DELAY + self.late / self.sample_rate

    @property
    def late(self) -> int:
        """Frames by which the output is behind the hand's motion, not counting the limiter."""
        return (self._spare or self._voice).late

    @property
    def lowest_load(self) -> float:
        """The lowest load (N) that an update may have: below 0 where adhesion lets the finger pull."""
        return lowest_load(self.scene.effects)

    @property
    def over_area(self) -> bool:
        """Whether updates can lead the finger over an area and turn it; otherwise it stays on one line."""
        return follows_path(nominal_scene(self.scene)) or (self._spare or self._voice).over_points

    @property
    def touched(self) -> bool:
        """True from the first update on."""
        return self._follower is not None or self._jump is not None

    @property
    def plan_document(self) -> dict[str, Any]:
        """The plan of the present or coming scene under a hand as JSON, without the scene and the cost."""
        document = plan_of((self._spare or self._coming or self._voice).told, with_scene=False).document()
        response = document["response"] | {"delay_behind_a_hand_seconds": self.motion_delay}
        return {name: value for name, value in document.items() if name not in ("scene", "cost")} | {
            "response": response
        }

    @property
    def recorded_bytes(self) -> int:
        """Memory of the log in bytes, 0 without one."""
        return 0 if self.log is None else self.log.used_bytes

    def end_recording(self) -> None:
        """End the log here, as if it were full."""
        if self.log is not None:
            self.log.end(self.frame)

    def recording(self) -> dict[str, Any]:
        """Return the recording so far as a JSON document (see `recording`). The voice must keep a log."""
        assert self.log is not None, "the voice does not keep a log"
        return {
            "format": FORMAT,
            "version": VERSION,
            "scene": scene_document(self._first),
            "full_scale": list(self.full_scale),
            "quantities": list(self.quantities),
            "frames": self.frame if self.log.ended_at is None else self.log.ended_at,
            "faded": 0 if self.log.ended_at is not None else self.log.cut_frames,
            "complete": self.log.ended_at is None,
            "events": list(self.log.events),
        }

    def touch(self, update: Update) -> None:
        """Apply `update` from the next frame on."""
        self._prime()  # the frames between two updates are those that are rendered between them, of the first too
        if self.log is not None:
            over_area = update.across is not None or update.direction is not None
            self._note("contact", *(update if over_area else update[:5]))
        if update.load is None:
            update = update._replace(load=self._load)
        else:
            self._load = update.load
        self._lifted = False
        if self._follower is None:
            self._jump = update
            return
        if self._last_load == 0.0 and self._load > 0.0:
            self._gain, self._rise, self._held = 0.0, LANDING_TIME, self._voice.late
        moved = self._follower.copy()
        if moved.apply(update):
            self._jump = update
        else:
            self._follower, self._jump = moved, None

    def lift(self) -> None:
        """Lift the finger from the next frame on: the load goes to 0 until the next update."""
        self._note("lift")
        self._lifted = True
        if self._follower is not None:
            self._follower.release()

    def release(self) -> None:
        """Fade out, beginning with the next block."""
        self._held = 0
        if not self._released:
            self._note("release")
        super().release()

    def cut(self, block: Block, frames: int) -> Block:
        """Return the first `frames` of `block`, the last block rendered, faded to zero. The sound ends with them.

        For an end that cannot wait for the fade of `release`.
        """
        self.frame += frames - len(block)
        if self.log is not None:
            self.log.cut_frames = frames
        return faded(block, frames)

    def prepare(self, scene: Scene) -> Change:
        """Return the prepared change to `scene`. Raises SceneError where it changes a value that a stream fixes."""
        require_fixed_ends(scene)
        return replace(super().prepare(scene), hand=self._voice_for_hand(scene))

    def apply(self, change: Change) -> None:
        """Change to the prepared scene from the next block on."""
        self._note("scene", scene_document(change.scene))
        super().apply(change)

    def _note(self, name: str, *values: Any) -> None:
        if self.log is not None:
            self.log.note(self.frame, name, *values)

    def _voice_for_hand(self, scene: Scene) -> Voice:
        """Return a voice of `scene` that follows a hand, with the stream's full scale. Slow: it solves the table."""
        nominal = nominal_scene(scene).model_copy(update={"texture": scene.texture})
        solved = prepare_hand(nominal, self.full_scale, self._cache, exact=self._exact)
        scaled = replace(solved, scene=with_full_scale(nominal, self.full_scale))
        return Voice(scaled, live=True, cache=self._cache)

    def _begin_change(self) -> None:
        change = self._waiting
        if change is not None and change.hand is not None:
            if self._follower is not None:
                self._waiting = None
                self.scene = change.scene
                self._cross_to_hand(change.hand)
                return
            self._spare = change.hand
        super()._begin_change()
        if self._coming is None and self._jump is not None:
            self._begin_at(self._jump)

    def _begin_at(self, update: Update) -> None:
        """Cross-fade to the motion that `update` begins: the first update, or a jump."""
        self._jump = None
        if self._follower is None:
            assert self._spare is not None
            turned = self.scene.scan.direction
            self._follower = PathFollower(self.sample_rate, lowest_load=self.lowest_load, direction=turned)
            self._follower.begin(update.position or 0.0, update.speed or 0.0, self._load)
            self._follower.apply(update)
            voice, self._spare = self._spare, None
        else:
            self._leaving = self._follower
            self._follower = self._follower.copy()
            self._follower.apply(update)
            voice = self._voice.twin()
        if self._lifted:
            self._follower.release()
        self._cross_to_hand(voice)

    def _cross_to_hand(self, voice: Voice) -> None:
        self._by_hand.add(voice)
        self._cross_to(voice)

    def _next(self, frames: int) -> Block:
        self._motion = None
        return super()._next(frames)

    def _rendered(self, voice: Voice, frames: int) -> Block:
        if voice not in self._by_hand:
            return voice.render(frames)
        if self._leaving is not None and voice is self._voice:
            return voice.render(frames, self._leaving.motion(frames))
        if self._motion is None:
            assert self._follower is not None
            self._motion = self._follower.motion(frames)
            self._last_load = self._motion.samples.item(LOAD, -1)
        return voice.render(frames, self._motion)

    def _crossing_done(self, voice: Voice) -> None:
        self._by_hand.discard(self._voice)
        self._leaving = None
        super()._crossing_done(voice)
