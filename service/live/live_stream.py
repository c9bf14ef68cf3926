"""What outlives a connection: the voice, the newest update, and the last second of PCM. No I/O, no clock.

Model: the newest update takes effect at the first frame of the next block. So does a change of scene, once the
    cross-fade of the previous change is over. The `frame` of `applied` and of `scene` is therefore exact.
Limits: one thread or task at a time uses a stream (`VoiceStream.turn`).
"""

from __future__ import annotations

from bisect import bisect_right
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from itertools import islice
from typing import Any

import numpy as np

from service.engine import Engine, HandVoice
from service.live import server_messages
from service.live.contact_update import Hand
from service.live.live_metrics import StreamCounts
from service.live.message_checks import refused
from service.live.messages import LARGEST_BLOCK, SMALLEST_BLOCK, Version
from service.live.replay_buffer import ReplayBuffer, kept_frames
from service.live.silence_watchdog import SilenceWatchdog
from service.operations.metrics import Metrics
from service.operations.settings import Settings
from service.problems import Problem
from service.sessions.fixed_output import open_pinned
from service.sessions.session_ids import resume_url
from service.sessions.voice_stream import VoiceStream
from synth.encode.formats import Block
from synth.encode.samples import SoundFormat, block_bytes
from synth.motion.motion import Update
from synth.scene.scene import Scene, parse_scene
from synth.scene.text import json_text
from synth.scene.trajectory import is_turned
from synth.voice.fades import faded

BLOCK_SECONDS = 0.01  # default length of a block: 100 per second
CHANGE_SECONDS = 0.05  # between changes; below `live_voice.CHANGE_TIME`, the frame of `scene` would be too early
LEAST_REDUCTION_DB = 0.01  # a smaller reduction is inaudible and is not reported
LIMITED_SECONDS = 1.0  # between two `limited` messages
SAMPLES = {"f32le": SoundFormat.F32LE, "s16le": SoundFormat.WAV16}  # the latter's samples are little-endian


@dataclass(frozen=True, slots=True)
class Options:
    """What `hello` fixes for a session. block: frames, None for the default."""

    format: str = "f32le"
    block: int | None = None
    pacing: str = "pull"
    record: bool = False
    before_limiter: bool = False

    @classmethod
    def of(cls, hello: Mapping[str, Any]) -> Options:
        """Return the options of the message `hello`."""
        asked = {name: hello[name] for name in ("format", "pacing", "record", "before_limiter") if name in hello}
        return cls(**asked, block=None if hello.get("block") is None else int(hello["block"]))


class LiveStream(VoiceStream):
    """The stream of one session.

    max_silence: s without an update after which the load ramps to zero.
    hand: what the scene that is heard allows a contact.
    turning: whether a change of `scan.direction` is being prepared, because the hand turns the finger.
    """

    kind = "live"

    def __init__(self, name: str, voice: HandVoice, options: Options, max_silence: float) -> None:
        super().__init__(voice)
        self.voice: HandVoice = voice
        self.name, self.options, self.records = name, options, options.record
        self.rate, self.realtime = voice.sample_rate, options.pacing == "realtime"
        default = max(SMALLEST_BLOCK, min(LARGEST_BLOCK, round(BLOCK_SECONDS * self.rate)))
        self.block = options.block or default
        self._samples = SAMPLES[options.format]
        longest, frame_bytes = max(self.block, self.fade_frames), voice.channels * self._samples.bytes_per_sample
        self.replay = ReplayBuffer(kept_frames(self.rate, longest, frame_bytes), frame_bytes)
        self._sending_bytes = longest * (voice.channels * 4 + frame_bytes)
        self._before_limiter: deque[tuple[int, Block]] = deque()  # (frame, block) of the kept sound, where it acted
        if options.before_limiter:
            self._sending_bytes += self.replay.size // self._samples.bytes_per_sample * 4
        self.max_silence = max_silence
        self.hand, self.turning = Hand.of(voice), False
        self.counts = StreamCounts()
        self._latest = self._none = np.empty((0, voice.channels), np.float32)
        self._newest, self._waiting = -1, None
        self._watchdog = SilenceWatchdog(max_silence)
        self._free_from = 0
        self._applied: int | None = None
        self._changed = False
        self._reduction, self._reduced_at, self._limited_at = 0.0, 0, -LIMITED_SECONDS

    _waiting: Update | None

    @property
    def frame(self) -> int:
        """Return the frame at which the next block begins."""
        return self.replay.end

    @property
    def used_bytes(self) -> int:
        """Return the bytes of kept PCM, unsent blocks and the recording; the voice itself is not counted."""
        return self.replay.size + self._sending_bytes + self.voice.recorded_bytes

    def require_kept(self, frame: int) -> None:
        """Raise Problem (not-found) if the stream cannot continue from `frame`."""
        if not self.replay.begin <= frame <= self.frame:
            allowed = f"{self.replay.begin} to {self.frame}"
            raise refused("/resume/frame", str(frame), allowed, "Begin a new session.", "not-found")

    def take(self, update: Update, now: float) -> None:
        """Keep `update` for the next block, in place of the one that waits, unless a newer one has arrived."""
        if update.seq > self._newest:
            waiting = self._waiting
            self._newest, self._waiting = update.seq, update if waiting is None else update.after(waiting)
            self._watchdog.heard(now)

    def turned_by(self, update: Update) -> dict[str, Any] | None:
        """Return the change of the scene for the first `update` that turns the finger on a texture along a line."""
        if not self.hand.may_turn or self.turning or not is_turned(update.direction or 0.0):
            return None
        self.turning = True
        scan = self.voice.scene.scan
        constant = {name: getattr(scan, name) for name in ("speed", "load", "lift_load")}
        return {"scan": {**constant, "direction": update.direction}}

    def own_end(self, settings: Settings) -> tuple[str, Problem | None] | None:
        """Return why the stream ends by itself before its next block, None if it goes on: the reason and a problem."""
        if self.voice.finished:
            return "finished", None
        if self.frame >= settings.max_stream * self.rate - self.fade_frames:
            return "too long", None
        if self.options.record and self.frame >= settings.max_duration * self.rate:
            return "too long", Problem("too-large", "A recorded session may last as long as RIDGEWAVE_MAX_DURATION.")
        return None

    def begin(self, now: float, late: float = 0.0) -> None:
        """Apply the newest update and a prepared change to the next block. late: lateness of the block, in s."""
        update = self._waiting
        if update is not None:
            self._waiting, self._applied = None, update.seq
            self.counts.applied += 1
            self.voice.touch(update)
        if self._watchdog.lifts(now, late):
            self.voice.lift()
        if self.frame >= self._free_from and self.take_change():
            self._changed = True
            self._free_from = self.frame + 1 + round(CHANGE_SECONDS * self.rate)

    def render(self, frames: int) -> bytes:
        """Return the PCM of the next `frames`, and keep it. Takes some 20 us."""
        first = self.frame
        block = self._latest = self.voice.render(frames)
        pcm = block_bytes(block, self._samples)
        self.replay.keep(pcm)
        if self.options.before_limiter and self.voice.before_limiter is not None:
            self._before_limiter.append((first, self.voice.before_limiter))
            while self._before_limiter[0][0] + len(self._before_limiter[0][1]) <= self.replay.begin:
                self._before_limiter.popleft()
        reduction = self.voice.reduction_db
        if reduction > LEAST_REDUCTION_DB:
            self._reduced(first, frames, reduction)
        return pcm

    def _reduced(self, first: int, frames: int, reduction_db: float) -> None:
        counts = self.counts
        counts.limited_blocks += 1
        counts.limited_frames += frames
        counts.reduction_db = max(counts.reduction_db, reduction_db)
        if reduction_db > self._reduction:
            self._reduction, self._reduced_at = reduction_db, first

    def tell_counts(self, metrics: Metrics, *, ended: bool = False) -> None:
        """Add the increase of the counts to `metrics`. ended: a waiting update counts as dropped."""
        self.counts.tell(metrics, self.rate, 0 if ended or self._waiting is None else 1)

    def notices(self, frame: int, version: Version) -> list[str]:
        """Return the messages of `version` that precede the rendered block at `frame`."""
        messages = []
        self._latest = self._none  # `cut` no longer needs it
        if self._applied is not None:
            messages.append(server_messages.applied(self._applied, frame))
            self._applied = None
        if self._changed:
            self._changed = False
            self.hand, self.turning = Hand.of(self.voice), False
            messages.append(server_messages.scene(frame, self._scene_fields(version)))
        return messages

    def before_limiter(self, frame: int, frames: int) -> list[str]:
        """Return the messages that hold the next `frames` as they were before the limiter, where it acted."""
        blocks, end, messages = self._before_limiter, frame + frames, []
        newest_before = bisect_right(blocks, frame, key=lambda kept: kept[0]) - 1
        for first, block in islice(blocks, max(0, newest_before), None):
            if first >= end:
                break
            part = block[max(0, frame - first) : end - first]
            if len(part):
                messages.append(server_messages.before_limiter(max(first, frame), part))
        return messages

    def recording(self) -> bytes:
        """Return the JSON of the recording. Slow: call it from a thread."""
        return json_text(self.voice.recording())

    def limited(self, now: float) -> str | None:
        """Return the message about the limiter if it acted, at most once per second."""
        if not self._reduction or now - self._limited_at < LIMITED_SECONDS:
            return None
        message = server_messages.limited(self._reduced_at, self._reduction)
        self._reduction, self._limited_at = 0.0, now
        return message

    def cut(self, frames: int) -> bytes:
        """Return the PCM of the first `frames` of the latest block, faded to zero. The stream ends there."""
        return block_bytes(self.voice.cut(self._latest, frames), self._samples)

    def kept(self, frame: int, frames: int, *, fading: bool) -> bytes | None:
        """Return the kept PCM from `frame` on, None if it is not rendered yet. fading: with the last fade."""
        if frame == self.frame:
            return None
        pcm = self.replay.read(frame, frames)
        if not fading:
            return pcm
        kind = "<f4" if self._samples.is_float else "<i2"
        block = np.frombuffer(pcm, kind).reshape(-1, self.voice.channels)
        gained = faded(block, len(block))
        return (gained if self._samples.is_float else np.rint(gained)).astype(kind).tobytes()

    def _scene_fields(self, version: Version) -> dict[str, Any]:
        """Return the fields of `ready` and `scene` that describe the scene that is heard."""
        area = {"over_area": self.hand.over_area} if version.has_area else {}
        return {"plan": self.voice.plan_document, **area}

    def ready(self, frame: int, version: Version, root_path: str) -> str:
        """Return the answer to `hello`, in `version`; the sound begins at `frame`. root_path: the setting."""
        voice = self.voice
        return server_messages.ready(
            {
                "session": self.name,
                "resume_url": root_path + resume_url(self.name),
                "protocol": version.name,
                "sample_rate": voice.sample_rate,
                "channels": voice.channels,
                "quantities": list(voice.quantities),
                "full_scale": list(voice.full_scale),
                "format": self.options.format,
                "block": self.block,
                "pacing": self.options.pacing,
                "recording": self.options.record,
                "frame": frame,
                "max_silence_ms": self.max_silence * 1e3,
                "motion_delay_ms": voice.motion_delay * 1e3,
                **self._scene_fields(version),
            }
        )


def open_stream(
    engine: Engine, name: str, document: Mapping[str, Any], options: Options, max_silence: float
) -> tuple[Scene, LiveStream]:
    """Return the scene `document` with its full scale written out, and its stream. Slow: call it from a thread.

    Raises SceneError and CannotRender.
    """
    scene, voice = open_pinned(parse_scene(document), partial(engine.open_hand, record=options.record))
    return scene, LiveStream(name, voice, options, max_silence)
