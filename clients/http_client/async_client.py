"""`AsyncClient`: the service over HTTP, for programs with an event loop.

    async with AsyncClient("http://127.0.0.1:8000") as client:
        sound = await client.render({"scan": {"speed": "120 mm/s"}})

`httpx.AsyncClient` sends the calls of `clients.http_client.calls`. Each method is that of `Client`, awaited.
"""

from __future__ import annotations

import contextlib
import os
from collections.abc import AsyncIterator, Mapping
from types import TracebackType
from typing import Any, Self, TypeVar

import httpx

from clients.client_errors import ClientError, RefusedError
from clients.http_client import calls as calls
from clients.http_client.calls import Call, Document, SessionState, StreamFrames
from clients.pcm_buffer import Block, whole_frames
from synth.encode.sound import Sound

T = TypeVar("T")


class AsyncClient:
    """The service at `base_url`. Arguments and exceptions are those of `Client`."""

    def __init__(
        self,
        base_url: str = calls.DEFAULT_URL,
        key: str | None = None,
        transport: httpx.AsyncBaseTransport | None = None,
    ) -> None:
        self._http = httpx.AsyncClient(transport=transport, **calls.settings_of(base_url, key))

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        await self.close()

    async def close(self) -> None:
        """Close the connections."""
        await self._http.aclose()

    async def render(self, scene: Any = None, format: str = "f32le") -> Sound:
        """As `Client.render`."""
        return await self.carry(calls.render(scene, format))

    async def explain(self, scene: Any = None) -> Document:
        """As `Client.explain`."""
        return await self.carry(calls.explain(scene))

    async def analyze(self, scene: Any = None) -> Document:
        """As `Client.analyze`."""
        return await self.carry(calls.analyze(scene))

    async def analyze_recording(
        self, path: str | os.PathLike[str], *, quantity: str | None = None, scale: float | None = None,
        channel: int | None = None,
    ) -> Document:  # fmt: skip
        """As `Client.analyze_recording`."""
        return await self.carry(
            calls.analyze_recording(path, {"quantity": quantity, "scale": scale, "channel": channel})
        )

    async def accuracy(self, scene: Any = None, quantity: str | None = None, *, live: bool = False) -> Document:
        """As `Client.accuracy`."""
        return await self.carry(calls.accuracy(scene, quantity, live))

    async def textures(self) -> list[Document]:
        """As `Client.textures`."""
        return await self.carry(calls.textures())

    async def texture(self, name: str) -> Document:
        """As `Client.texture`."""
        return await self.carry(calls.texture(name))

    async def import_texture(
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
        """As `Client.import_texture`."""
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
        return await self.carry(calls.import_texture(path, options, dry_run))

    async def delete_texture(self, name: str) -> None:
        """As `Client.delete_texture`."""
        await self.carry(calls.delete_texture(name))

    async def table(self, scene: Any = None) -> bytes:
        """As `Client.table`."""
        return await self.carry(calls.table(await self.carry(calls.make_table(scene))))

    async def devices(self) -> list[Document]:
        """As `Client.devices`."""
        return await self.carry(calls.devices())

    async def stop(self) -> Document:
        """As `Client.stop`."""
        return await self.carry(calls.stop())

    async def healthz(self) -> bool:
        """As `Client.healthz`."""
        try:
            return await self.carry(calls.healthz())
        except ClientError:
            return False

    async def open_session(self, scene: Any = None) -> AsyncSession:
        """As `Client.open_session`; `async with await client.open_session(scene) as session` ends it."""
        return AsyncSession(self, await self.carry(calls.open_session(scene)))

    async def session(self, name: str) -> AsyncSession:
        """As `Client.session`."""
        return AsyncSession(self, await self.carry(calls.look(name)))

    async def recording(self, name: str) -> Document:
        """As `Client.recording`."""
        return await self.carry(calls.recording(name))

    async def carry(self, call: Call[T]) -> T:
        """Send a call and return its result."""
        with calls.transported():
            response = await self._http.request(call.method, call.path, **call.keywords)
        return call.read(response)

    @contextlib.asynccontextmanager
    async def carry_open(self, call: Call[None]) -> AsyncIterator[httpx.Response]:
        """Send a call and yield the response, whose body was not read."""
        with calls.transported():
            async with self._http.stream(call.method, call.path, **call.keywords) as response:
                if not response.is_success:
                    await response.aread()
                calls.check(response)
                yield response


class AsyncSession(SessionState):
    """A session of the service, made by `AsyncClient.open_session`. Each method is that of `Session`, awaited."""

    def __init__(self, client: AsyncClient, document: Document) -> None:
        super().__init__(document)
        self._client = client

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        with contextlib.suppress(ClientError if kind is not None else RefusedError):  # it may have ended already
            await self.delete()

    async def look(self) -> Document:
        """As `Session.look`."""
        self.document = await self._client.carry(calls.look(self.id))
        return self.document

    async def change(self, partial: Mapping[str, Any]) -> Document:
        """As `Session.change`."""
        self.document = await self._client.carry(calls.change(self.id, partial))
        return self.document

    async def delete(self) -> None:
        """As `Session.delete`."""
        await self._client.carry(calls.delete(self.id))

    async def play(self, device: str | int | None = None) -> Document:
        """As `Session.play`."""
        return await self._client.carry(calls.play(self.id, device))

    async def end_play(self) -> Document:
        """As `Session.end_play`."""
        return await self._client.carry(calls.end_play(self.id))

    @contextlib.asynccontextmanager
    async def stream(self, duration: float | None = None, format: str = "f32le") -> AsyncIterator[AsyncStream]:
        """As `Session.stream`."""
        async with self._client.carry_open(calls.stream(self.id, duration, format)) as response:
            yield AsyncStream(response)


class AsyncStream(StreamFrames):
    """The sound of a session, made by `AsyncSession.stream`."""

    def __init__(self, response: httpx.Response) -> None:
        super().__init__(response)
        self._parts = response.aiter_raw()

    async def read(self, frames: int) -> Block:
        """As `Stream.read`."""
        frames = whole_frames("frames", frames)
        with calls.transported():
            while not self.has(frames):
                part = await anext(self._parts, None)
                if part is None:
                    raise self.ended()
                self.append(part)
        return self.take(frames)
