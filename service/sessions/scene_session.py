"""Sessions: a scene that plain HTTP can listen to and steer.

Model: a session holds a scene and what is fixed about its sound (rate, channels, quantities, full scale). Each reader
    and each play gets a live voice of its own, at frame 0, so that every one ramps in; a change of the scene reaches
    them all. Ids hold 128 random bits: who does not know one cannot reach the session, nor who has another key than
    the one that opened it.
Limits: sessions live in one process. As many as the settings allow; one that nobody reads, plays or asks about expires.
    A stream begins at frame 0 of the scene, not where an earlier one left off.
"""

from __future__ import annotations

import asyncio
import math
import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from service.compute.threads import Solves
from service.engine import Engine, LiveVoice
from service.http.paced_stream import Reader
from service.operations.metrics import Metrics
from service.operations.settings import Settings
from service.problems import Problem
from service.sessions.scene_changes import Changes, Waiting, merged
from service.sessions.session_ids import new_id, not_found
from service.sessions.voice_source import Source
from service.sinks.player import Player
from synth.errors import Fault, SceneError
from synth.scene.scene import Output, Scene, merge_patch, object_from_text, parse_scene, scene_document


class Session:
    """One session; its methods run in the event loop, and hand what is slow to `solves`, as work of `client`."""

    def __init__(
        self,
        name: str,
        owner: int | None,
        scene: Scene,
        voice: LiveVoice,
        engine: Engine,
        solves: Solves,
        metrics: Metrics,
        client: str,
    ) -> None:
        """owner: the number of the key that opened it, None where no keys are set."""
        self.id, self.owner = name, owner
        self.sample_rate, self.channels = voice.sample_rate, voice.channels
        self.full_scale, self.quantities = tuple(voice.full_scale), tuple(voice.quantities)
        self.scene = scene
        self.reader: Reader | None = None
        self.player: Player | None = None
        self.ended = False
        self.touched = time.monotonic()
        self._engine, self._solves, self._metrics, self._client = engine, solves, metrics, client
        self._spare: LiveVoice | None = voice
        self._lock = asyncio.Lock()  # no voice is opened while the scene changes
        self._changes = Changes(self._apply)

    @property
    def active(self) -> bool:
        """Return whether somebody listens or something plays."""
        return self.reader is not None or (self.player is not None and self.player.playing)

    def touch(self) -> None:
        """Begin the idle time anew."""
        self.touched = time.monotonic()

    def expires_in(self, idle: float) -> float | None:
        """Return the seconds until it expires if nothing happens; None while it is active."""
        return None if self.active else max(0.0, self.touched + idle - time.monotonic())

    async def open_source(self) -> Source:
        """Return blocks from frame 0 on, of a voice of its own."""
        async with self._lock:
            voice, self._spare = self._spare, None
            if voice is None:
                voice = await self._solved(self._metrics.timed, "voice", self._engine.open_live, self.scene)
        if self.ended:
            raise Problem("not-found", "The session has ended.")
        return Source(voice)

    async def change(self, body: bytes) -> None:
        """Merge the partial scene that `body` holds; every voice cross-fades to it from its next block on.

        Raises SceneError for a scene that is refused, Problem (409) for one that would change what is fixed; then
        nothing has changed.
        """
        settled: asyncio.Future[None] = asyncio.get_running_loop().create_future()

        def settle(error: Exception | None) -> None:
            if settled.done():
                return
            if error is None:
                settled.set_result(None)
            else:
                settled.set_exception(error)

        self._changes.add(Waiting(lambda: object_from_text(body), len(body), settle))
        await settled

    async def _apply(self, batch: Sequence[Waiting]) -> None:
        async with self._lock:
            players = [self.player] if self.player is not None and self.player.playing else []
            sources = [holder.source for holder in (self.reader, *players) if holder is not None and holder.source]

            def change(scene: Scene, patch: Mapping[str, object]) -> Scene:
                return changed_scene(scene, patch, self.full_scale)

            def prepare(scene: Scene) -> list[Any]:
                timed = self._metrics.timed
                if not sources:
                    return [timed("voice", self._engine.open_live, scene)]
                return [timed("change", source.prepare, scene) for source in sources]

            made = await self._solved(merged, self.scene, batch, change, prepare)
            if made.coming is not None:
                self.scene, prepared = made.coming
                self._spare = None if sources else prepared[0]
                for source, coming in zip(sources, prepared, strict=False):
                    source.change(coming)
        for place, one in enumerate(batch):
            one.settle(made.refused.get(place))

    def end(self, *, at_once: bool = False) -> None:
        """Have the reader and the play fade and end; at_once: a device drops what it still holds."""
        self.ended = True
        if self.reader is not None:
            self.reader.end(at_once=at_once)
        if self.player is not None:
            self.player.end(at_once=at_once)

    def document(self, settings: Settings) -> dict[str, Any]:
        """Return what `GET /v1/sessions/{id}` shows."""
        return {
            "id": self.id,
            "scene": scene_document(self.scene),
            "sample_rate": self.sample_rate,
            "channels": self.channels,
            "quantities": list(self.quantities),
            "full_scale": list(self.full_scale),
            "streaming": self.reader is not None,
            "play": None if self.player is None else self.player.document(),
            "expires_in": self.expires_in(settings.session_idle),
            "heard_within": settings.lead + settings.stream_block + self._engine.live_delay,
            "stream": f"/v1/sessions/{self.id}/stream",
        }

    async def _solved(self, work: Callable[..., Any], *arguments: Any) -> Any:
        return await self._solves.run(self._client, work, *arguments)


class Sessions:
    """The sessions of one process."""

    def __init__(self, engine: Engine, settings: Settings, solves: Solves, metrics: Metrics) -> None:
        self._engine, self._settings, self._solves, self._metrics = engine, settings, solves, metrics
        self._sessions: dict[str, Session] = {}
        self._opening = 0
        self._closed = False

    def __len__(self) -> int:
        return len(self._sessions)

    async def create(self, body: bytes, client: str, owner: int | None) -> Session:
        """Return a new session of the scene that `body` holds, which belongs to the key of that number.

        client: whom its solves are counted for. Raises Problem (503) where there are too many.
        """
        self._refuse_workers()
        if self._closed:
            raise Problem("closing", "The service is shutting down.")
        if len(self._sessions) + self._opening >= self._settings.max_sessions:
            raise Problem("full", "As many sessions as there may be.", headers={"Retry-After": self._retry_after()})
        self._opening += 1
        try:
            scene, voice = await self._solves.run(client, self._open, body)
        finally:
            self._opening -= 1
        name = new_id(self._settings.node)
        session = Session(name, owner, scene, voice, self._engine, self._solves, self._metrics, client)
        self._sessions[session.id] = session
        return session

    def find(self, name: str, owner: int | None) -> Session:
        """Return the session of that id, its idle time begun anew; raises Problem (404), also for another's session."""
        self._refuse_workers()
        session = self._sessions.get(name)
        if session is None or session.owner != owner or session.expires_in(self._settings.session_idle) == 0.0:
            sentence = "No such session: it was never there, was deleted or stopped, or has expired."
            raise not_found(name, sentence, self._settings)
        session.touch()
        return session

    def delete(self, name: str, owner: int | None) -> None:
        """End a session with a fade and forget it; raises Problem (404)."""
        session = self.find(name, owner)
        del self._sessions[session.id]
        session.end()

    def end_all(self, *, at_once: bool = False) -> dict[str, int]:
        """End and forget every session; return how many of each there were."""
        ended, self._sessions = list(self._sessions.values()), {}
        counts = {
            "sessions": len(ended),
            "streams": sum(session.reader is not None for session in ended),
            "plays": sum(session.player is not None and session.player.playing for session in ended),
        }
        for session in ended:
            session.end(at_once=at_once)
        return counts

    def close(self) -> list[Player]:
        """End everything for good; return the plays whose ends are worth waiting for."""
        self._closed = True
        players = [session.player for session in self._sessions.values() if session.player is not None]
        self.end_all()
        return players

    def expire(self) -> None:
        """End the sessions whose idle time is over."""
        for session in list(self._sessions.values()):
            if session.expires_in(self._settings.session_idle) == 0.0:
                del self._sessions[session.id]
                session.end()

    def _open(self, body: bytes) -> tuple[Scene, LiveVoice]:
        """Return the scene with its full scale written into it, and its first voice; for a thread."""
        scene = parse_scene(object_from_text(body))
        voice = self._metrics.timed("voice", self._engine.open_live, scene)
        pinned = with_full_scale(scene, tuple(voice.full_scale))
        return pinned, voice if pinned == scene else self._metrics.timed("voice", self._engine.open_live, pinned)

    def _retry_after(self) -> str:
        waits = [session.expires_in(self._settings.session_idle) for session in self._sessions.values()]
        soonest = min((wait for wait in waits if wait is not None), default=self._settings.session_idle)
        return str(max(1, math.ceil(soonest)))

    def _refuse_workers(self) -> None:
        if self._settings.workers > 1:
            raise Problem("one-worker", "Sessions live in one process: start the service with RIDGEWAVE_WORKERS=1.")


def changed_scene(scene: Scene, patch: Mapping[str, object], full_scale: tuple[float, ...]) -> Scene:
    """Return `scene` changed by `patch`, with the session's full scale.

    Raises SceneError for a scene that is refused, Problem (fixed) for one that would change what a session keeps.
    """
    changed = parse_scene(merge_patch(scene_document(scene), patch))
    faults = [*_fixed_faults(scene.output, changed.output), *_added_faults(scene, changed)]
    if faults:
        raise Problem("fixed", "A session keeps its rate, channels, quantities and full scale.", tuple(faults))
    return with_full_scale(changed, full_scale)


def with_full_scale(scene: Scene, full_scale: tuple[float, ...]) -> Scene:
    """Return `scene` with each channel's full scale written out, so that no change of the scene chooses another.

    Where the voice chose none that a scene may state (a silent scene), the scene stays as it is.
    """
    document = scene_document(scene)
    output = dict(document["output"])
    quantities = [channel.quantity for channel in scene.output.channel_list]
    output["channels"] = [
        {"quantity": name, "full_scale": float(value)} for name, value in zip(quantities, full_scale, strict=False)
    ]
    try:
        pinned = parse_scene(document | {"output": _without(output, "quantity", "full_scale")})
    except SceneError:
        return scene
    added = full_scale[len(quantities) :]
    return _with_added_scales(pinned, added) if added else pinned


def _with_added_scales(scene: Scene, full_scale: tuple[float, ...]) -> Scene:
    from synth.plan.effect_choice import with_added_scales

    return with_added_scales(scene, full_scale)


def _without(section: dict[str, Any], *names: str) -> dict[str, Any]:
    return {name: value for name, value in section.items() if name not in names}


def _fixed_faults(before: Output, after: Output) -> list[Fault]:
    """Return what a change of `before` to `after` would do to what is fixed, a fault each."""
    faults = []
    if after.sample_rate != before.sample_rate:
        faults.append(_fixed("/output/sample_rate", f"{after.sample_rate} Hz", f"{before.sample_rate} Hz"))
    if len(after.channel_list) != len(before.channel_list):
        count = len(before.channel_list)
        return [*faults, _fixed("/output/channels", f"{len(after.channel_list)} channels", f"{count}, as it began")]
    for index, (was, now) in enumerate(zip(before.channel_list, after.channel_list, strict=True)):
        if now.quantity != was.quantity:
            faults.append(_fixed(f"/output/channels/{index}/quantity", now.quantity, was.quantity))
        if now.full_scale not in (None, was.full_scale):
            faults.append(_fixed(f"/output/channels/{index}/full_scale", str(now.full_scale), str(was.full_scale)))
    return faults


def _added_faults(before: Scene, after: Scene) -> list[Fault]:
    """Return what a change would do to the channels that effects add, a fault each."""
    from synth.plan.effect_choice import added_quantities, outputs_of

    was, now = (", ".join(added_quantities(scene)) or "no channel" for scene in (before, after))
    if was != now:
        return [_fixed("/effects", f"effects that add {now}", f"effects that add {was}, as it began")]
    faults = []
    for (effect, settings), (_effect, kept) in zip(outputs_of(after), outputs_of(before), strict=True):
        for asked, scale in zip(effect.scales(settings), effect.scales(kept), strict=True):
            if asked not in (None, scale):
                faults.append(_fixed(f"/effects/{effect.name}/full_scale", str(asked), str(scale)))
    return faults


def _fixed(pointer: str, value: str, allowed: str) -> Fault:
    return Fault(pointer, value, allowed, "Leave it out, or open another session.")
