"""`Client`: the service over HTTP, for programs with threads.

    with Client("http://127.0.0.1:8000") as client:
        sound = client.render({"scan": {"speed": "120 mm/s"}})

`httpx.Client` sends the calls of `clients.http_client.calls`.
"""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator, Mapping
from types import TracebackType
from typing import Any, Self, TypeVar

import httpx

from clients.client_errors import ClientError, RefusedError
from clients.http_client import calls as calls
from clients.http_client.calls import Call, Document, SessionState, StreamFrames
from clients.pcm_buffer import Block, whole_frames
from synth.encode.sound import Sound

T = TypeVar("T")


class Client:
    """The service at `base_url`.

    key: a key of the service, sent as a Bearer token; None if it requires none.
    transport: of httpx, such as `httpx.MockTransport`; None is the network.
    Every call raises RefusedError (the request is at fault), ServiceError (the service cannot carry it out),
    ConnectionLost (nothing answers), ProtocolError (another service answers).
    """

    def __init__(
        self, base_url: str = calls.DEFAULT_URL, key: str | None = None, transport: httpx.BaseTransport | None = None
    ) -> None:
        self._http = httpx.Client(transport=transport, **calls.settings_of(base_url, key))

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Close the connections."""
        self._http.close()

    def render(self, scene: Any = None, format: str = "f32le") -> Sound:
        """Return the sound of a scene.

        scene: a partial scene as a mapping, or a `synth.Scene`; None is the default scene.
        format: of the transfer. "f32le" and "wav" are float32, not limited; "wav16", "wav24", "flac" and "l16" are
            limited integers, which are converted to float32.
        """
        return self.carry(calls.render(scene, format))

    def explain(self, scene: Any = None) -> Document:
        """Return the plan of a scene: what is simulated, why, with which error and cost."""
        return self.carry(calls.explain(scene))

    def analyze(self, scene: Any = None) -> Document:
        """Return what is felt of a steady scene, by the whole finger and by the receptors of its skin."""
        return self.carry(calls.analyze(scene))

    def analyze_recording(
        self, path: str | os.PathLike[str], *, quantity: str | None = None, scale: float | None = None,
        channel: int | None = None,
    ) -> Document:  # fmt: skip
        """Return what is felt of a vibration in a WAV or FLAC file.

        quantity, scale: write them where the file has none of its own. channel: from 0.
        """
        told = {"quantity": quantity, "scale": scale, "channel": channel}
        return self.carry(calls.analyze_recording(path, told))

    def accuracy(self, scene: Any = None, quantity: str | None = None, *, live: bool = False) -> Document:
        """Return the error and the cost of every method for a scene. Takes up to a minute."""
        return self.carry(calls.accuracy(scene, quantity, live))

    def textures(self) -> list[Document]:
        """Return the named textures: the catalogue, then those that were imported with this key (`stored`)."""
        return self.carry(calls.textures())

    def texture(self, name: str) -> Document:
        """Return one named texture."""
        return self.carry(calls.texture(name))

    def import_texture(
        self,
        path: str | os.PathLike[str],
        *,
        unit: str | None = None,
        pixel: str | None = None,
        height: str | None = None,
        level: str | None = None,
        missing: str | None = None,
        resample: str | None = None,
        width: str | None = None,
        part: str | None = None,
        slope: str | None = None,
        hurst: str | None = None,
        shortest: str | None = None,
        name: str | None = None,
        dry_run: bool = False,
    ) -> Document:
        """Import a file of heights (docs/import.md); return its name, report and picture.

        unit, pixel, height: what the file does not state, as in "um" or "mm, um", "5 um", "120 um".
        level: "none", "tilt" or "curvature". missing: "refuse", "fill" or "crop".
        resample: distance to which a profile is interpolated linearly, as in "5 um".
        width, part, slope, hurst, shortest: of a ZIP file with a set of maps, as in "2 m", "80 mm", and hurst "0.8".
        name: of the texture; None for that of the file. dry_run: report only.
        """
        options = {
            "unit": unit,
            "pixel": pixel,
            "height": height,
            "level": level,
            "missing": missing,
            "resample": resample,
            "width": width,
            "part": part,
            "slope": slope,
            "hurst": hurst,
            "shortest": shortest,
            "name": name,
        }
        return self.carry(calls.import_texture(path, options, dry_run))

    def delete_texture(self, name: str) -> None:
        """Delete an imported texture."""
        self.carry(calls.delete_texture(name))

    def table(self, scene: Any = None) -> bytes:
        """Return the file of the scene's response table (docs/table.md); its hash was checked."""
        return self.carry(calls.table(self.carry(calls.make_table(scene))))

    def devices(self) -> list[Document]:
        """Return the audio devices of the service's machine."""
        return self.carry(calls.devices())

    def stop(self) -> Document:
        """Silence all plays and streams of the service and end all sessions; return their numbers."""
        return self.carry(calls.stop())

    def healthz(self) -> bool:
        """Return whether the service answers."""
        try:
            return self.carry(calls.healthz())
        except ClientError:
            return False

    def open_session(self, scene: Any = None) -> Session:
        """Open a session: read it with `stream`, steer it with `change`. As a context manager it ends on exit."""
        return Session(self, self.carry(calls.open_session(scene)))

    def session(self, name: str) -> Session:
        """Return the session with the id `name`."""
        return Session(self, self.carry(calls.look(name)))

    def recording(self, name: str) -> Document:
        """Return the recording of the live session with the id `name`, which was opened with `record`."""
        return self.carry(calls.recording(name))

    def carry(self, call: Call[T]) -> T:
        """Send a call and return its result."""
        with calls.transported():
            response = self._http.request(call.method, call.path, **call.keywords)
        return call.read(response)

    @contextlib.contextmanager
    def carry_open(self, call: Call[None]) -> Iterator[httpx.Response]:
        """Send a call and yield the response, whose body was not read."""
        with (
            calls.transported(),
            self._http.stream(call.method, call.path, **call.keywords) as response,
        ):
            if not response.is_success:
                response.read()
            calls.check(response)
            yield response


class Session(SessionState):
    """A session of the service, made by `Client.open_session`."""

    def __init__(self, client: Client, document: Document) -> None:
        super().__init__(document)
        self._client = client

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        with contextlib.suppress(ClientError if kind is not None else RefusedError):  # it may have ended already
            self.delete()

    def look(self) -> Document:
        """Return the present state of the session."""
        self.document = self._client.carry(calls.look(self.id))
        return self.document

    def change(self, partial: Mapping[str, Any]) -> Document:
        """Change the scene by a partial scene, cross-faded; return the state of the session."""
        self.document = self._client.carry(calls.change(self.id, partial))
        return self.document

    def delete(self) -> None:
        """End the session; its stream and its play fade out."""
        self._client.carry(calls.delete(self.id))

    def play(self, device: str | int | None = None) -> Document:
        """Play on a device of the service's machine, or into "file:NAME.wav" there; return the state of the play."""
        return self._client.carry(calls.play(self.id, device))

    def end_play(self) -> Document:
        """End the play; return its final state."""
        return self._client.carry(calls.end_play(self.id))

    @contextlib.contextmanager
    def stream(self, duration: float | None = None, format: str = "f32le") -> Iterator[Stream]:
        """Yield the sound in real time.

        duration: seconds; None is endless. format: "f32le", or "l16" for half the bytes.
        """
        with self._client.carry_open(calls.stream(self.id, duration, format)) as response:
            yield Stream(response)


class Stream(StreamFrames):
    """The sound of a session, made by `Session.stream`."""

    def __init__(self, response: httpx.Response) -> None:
        super().__init__(response)
        self._parts = response.iter_raw()

    def read(self, frames: int) -> Block:
        """Return the next `frames`, float32 [frames, channels], in units of the session's full scale.

        Raises InvalidRequest; StreamEnded, whose `rest` holds the unread frames before the end; ConnectionLost.
        """
        frames = whole_frames("frames", frames)
        with calls.transported():
            while not self.has(frames):
                part = next(self._parts, None)
                if part is None:
                    raise self.ended()
                self.append(part)
        return self.take(frames)
