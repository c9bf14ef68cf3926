"""The calls of the service over HTTP: what each sends, and how to read its answer.

`Client` and `AsyncClient` send them.
"""

from __future__ import annotations

import contextlib
import os
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Generic, TypeVar
from urllib.parse import quote

import httpx

from clients.client_errors import (
    ConnectionLost,
    ProblemError,
    ProtocolError,
    StreamEnded,
    problem_error,
    read_problem,
    retry_seconds,
)
from clients.http_client.rendered_sound import read_shape, read_sound
from clients.pcm_buffer import SAMPLE_TYPES, Block, PcmBuffer
from clients.scene_and_key import change_to_send, checked_key, checked_url, json_text, scene_to_send
from synth.encode.sound import Sound
from synth.errors import CannotRender, Fault, InvalidRequest, shown

DEFAULT_URL = "http://127.0.0.1:8000"
CONNECT_SECONDS = 5.0  # s; a running service accepts connections at once
ANSWER_SECONDS = 120.0  # s without a byte; a first render compiles for seconds, `accuracy` measures for up to a minute

T = TypeVar("T")
Document = dict[str, Any]


@dataclass(frozen=True, slots=True)
class Call(Generic[T]):
    """One request.

    answer: reads a successful response.
    body: a JSON document, or None.
    sound: media type and bytes of a body that is a sound file.
    file, fields: of a form, which replaces the body: name and content of the file, and the form's other fields.
    """

    method: str
    path: str
    answer: Callable[[httpx.Response], T]
    body: Mapping[str, Any] | None = None
    query: Mapping[str, str] = field(default_factory=dict)
    sound: tuple[str, bytes] | None = None
    file: tuple[str, bytes] | None = None
    fields: Mapping[str, str] = field(default_factory=dict)

    @property
    def keywords(self) -> dict[str, Any]:
        """The keyword arguments of `request` of httpx."""
        keywords: dict[str, Any] = {"params": self.query}
        if self.body is not None:
            keywords |= {"content": json_text(self.body).encode(), "headers": {"Content-Type": "application/json"}}
        if self.sound is not None:
            keywords |= {"content": self.sound[1], "headers": {"Content-Type": self.sound[0]}}
        if self.file is not None:
            keywords |= {"files": {"file": self.file}, "data": dict(self.fields)}
        return keywords

    def read(self, response: httpx.Response) -> T:
        """Return the result in a complete response; raises RefusedError, ServiceError, ProtocolError."""
        check(response)
        try:
            return self.answer(response)
        except (ValueError, KeyError, TypeError, RecursionError, CannotRender) as error:
            raise ProtocolError(f"{self.method} {self.path}: not an answer of this service") from error


def settings_of(base_url: str, key: str | None) -> dict[str, Any]:
    """Return the keyword arguments of a client of httpx."""
    headers = {} if key is None else {"Authorization": f"Bearer {checked_key(key)}"}
    timeout = httpx.Timeout(ANSWER_SECONDS, connect=CONNECT_SECONDS)
    url = checked_url("base_url", base_url, ("http", "https"), DEFAULT_URL)
    return {"base_url": url, "headers": headers, "timeout": timeout}


def check(response: httpx.Response) -> None:
    """Raise the exception for an unsuccessful response, whose body must have been read."""
    if not response.is_success:
        raise _refusal(response)


@contextlib.contextmanager
def transported() -> Iterator[None]:
    """Raise ConnectionLost and ProtocolError in place of the exceptions of httpx for failed connections and bodies."""
    try:
        yield
    except httpx.DecodingError as error:
        raise ProtocolError("the service sent a body that its Content-Encoding does not fit") from error
    except httpx.TransportError as error:
        raise ConnectionLost(f"the service does not answer: {str(error) or type(error).__name__}") from error


def _refusal(response: httpx.Response) -> ProblemError:
    problem = read_problem(response.content, response.status_code, response.reason_phrase)
    return problem_error(problem, retry_seconds(response.headers.get("Retry-After")))


def render(scene: Any, sound_format: str) -> Call[Sound]:
    """Return the call that renders a scene."""
    document = scene_to_send(scene)

    def answer(response: httpx.Response) -> Sound:
        return read_sound(response.content, response.headers, document)

    return Call("POST", "/v1/render", answer, document, {"format": sound_format})


def explain(scene: Any) -> Call[Document]:
    """Return the call that explains a scene."""
    return Call("POST", "/v1/explain", _object, scene_to_send(scene))


def analyze(scene: Any) -> Call[Document]:
    """Return the call that tells what is felt of a scene."""
    return Call("POST", "/v1/analyze", _object, scene_to_send(scene))


def analyze_recording(path: str | os.PathLike[str], told: Mapping[str, object]) -> Call[Document]:
    """Return the call that tells what is felt of the sound file at `path`; raises OSError if it cannot be read."""
    kind = "audio/flac" if Path(path).suffix.lower() == ".flac" else "audio/wav"
    query = {name: str(value) for name, value in told.items() if value is not None}
    return Call("POST", "/v1/analyze", _object, query=query, sound=(kind, Path(path).read_bytes()))


def accuracy(scene: Any, quantity: str | None, live: bool) -> Call[Document]:
    """Return the call that measures what accuracy costs."""
    query = {} if quantity is None else {"quantity": quantity}
    if live:
        query["live"] = "true"
    return Call("POST", "/v1/accuracy", _object, scene_to_send(scene), query)


def textures() -> Call[list[Document]]:
    """Return the call that lists the named textures: the catalogue, then the imported ones."""
    return Call("GET", "/v1/textures", lambda response: list(_object(response)["textures"]))


def texture(name: str) -> Call[Document]:
    """Return the call that shows one named texture."""
    return Call("GET", f"/v1/textures/{quote(name, safe='')}", _object)


def import_texture(path: str | os.PathLike[str], options: Mapping[str, str | None], dry_run: bool) -> Call[Document]:
    """Return the call that imports the file at `path`; raises OSError if it cannot be read."""
    fields = {name: value for name, value in options.items() if value is not None}
    query = {"dry_run": "true"} if dry_run else {}
    file = Path(path).name, Path(path).read_bytes()
    return Call("POST", "/v1/textures", _object, query=query, file=file, fields=fields)


def delete_texture(name: str) -> Call[None]:
    """Return the call that deletes an imported texture."""
    return Call("DELETE", f"/v1/textures/{quote(name, safe='')}", lambda _: None)


def make_table(scene: Any) -> Call[str]:
    """Return the call that makes the table of a scene and returns its hash."""
    return Call("POST", "/v1/tables", lambda response: str(_object(response)["hash"]), scene_to_send(scene))


def table(name: str) -> Call[bytes]:
    """Return the call for the file of the table whose hash is `name`; the hash of the file is checked."""

    def answer(response: httpx.Response) -> bytes:
        """Return the file. Raises ValueError if it is that of another table."""
        from synth.response.table_file import table_of_bytes

        if table_of_bytes(response.content).hash != name:
            raise ValueError("another table")
        return response.content

    return Call("GET", f"/v1/tables/{quote(name, safe='')}", answer)


def devices() -> Call[list[Document]]:
    """Return the call that lists the audio devices of the service's machine."""
    return Call("GET", "/v1/devices", lambda response: list(_object(response)["devices"]))


def stop() -> Call[Document]:
    """Return the call that silences everything."""
    return Call("POST", "/v1/stop", lambda response: dict(_object(response)["stopped"]))


def healthz() -> Call[bool]:
    """Return the call that checks whether the service answers."""
    return Call("GET", "/healthz", lambda _: True)


def open_session(scene: Any) -> Call[Document]:
    """Return the call that opens a session."""
    return Call("POST", "/v1/sessions", _session, scene_to_send(scene))


def look(session: str) -> Call[Document]:
    """Return the call that reads the state of a session."""
    return Call("GET", _session_path(session), _session)


def change(session: str, partial: Mapping[str, Any]) -> Call[Document]:
    """Return the call that changes the scene of a session."""
    return Call("PATCH", _session_path(session), _session, change_to_send(partial))


def delete(session: str) -> Call[None]:
    """Return the call that ends a session."""
    return Call("DELETE", _session_path(session), lambda _: None)


def play(session: str, device: str | int | None) -> Call[Document]:
    """Return the call that plays a session on the service's machine."""
    return Call("POST", _session_path(session, "play"), _object, {"device": device})


def end_play(session: str) -> Call[Document]:
    """Return the call that ends a play."""
    return Call("DELETE", _session_path(session, "play"), _object)


def recording(session: str) -> Call[Document]:
    """Return the call for the recording of a live session."""
    return Call("GET", _session_path(session, "recording"), _object)


def stream(session: str, duration: float | None, sound_format: str) -> Call[None]:
    """Return the call for the stream of a session; raises InvalidRequest for formats other than raw samples.

    duration: s; None never ends.
    """
    if sound_format not in ("f32le", "l16"):
        raise InvalidRequest([Fault("/format", shown(sound_format), "f32le or l16", "Write f32le.")])
    if duration is not None and not hasattr(duration, "__float__"):
        raise InvalidRequest([Fault("/duration", shown(duration), "a number, in s", "Write 2.0 for 2 s.")])
    length = {} if duration is None else {"duration": repr(float(duration))}
    return Call("GET", _session_path(session, "stream"), lambda _: None, None, {"format": sound_format, **length})


def _session_path(session: str, rest: str = "") -> str:
    return f"/v1/sessions/{quote(session, safe='')}" + (f"/{rest}" if rest else "")


def _object(response: httpx.Response) -> Document:
    document = response.json()
    if not isinstance(document, dict):
        raise ValueError("not a JSON object")
    return document


def _session(response: httpx.Response) -> Document:
    """Return the description of a session; raises KeyError, TypeError or ValueError if it is none."""
    return SessionState(_object(response)).document


class SessionState:
    """The state of a session. document: its newest description by the service."""

    def __init__(self, document: Document) -> None:
        self.document = document
        self.id = str(document["id"])
        self.sample_rate = int(document["sample_rate"])
        self.channels = int(document["channels"])
        self.quantities = tuple(str(quantity) for quantity in document["quantities"])
        self.full_scale = tuple(float(value) for value in document["full_scale"])

    @property
    def scene(self) -> Document:
        """The complete scene, as of the last call that opened, changed or read the session."""
        return dict(self.document["scene"])


class StreamFrames:
    """The received frames of a stream; raises ProtocolError if the headers do not describe the samples."""

    def __init__(self, response: httpx.Response) -> None:
        try:
            shape = read_shape(response.headers)
        except (KeyError, ValueError) as error:
            raise ProtocolError("the headers of the answer do not describe its samples") from error
        if shape.sound_format not in SAMPLE_TYPES:
            raise ProtocolError(f"requested raw samples, got {shape.sound_format}")
        self.sample_rate, self.channels = shape.sample_rate, shape.channels
        self.frame = 0
        self._buffer = PcmBuffer(shape.sound_format, shape.channels)

    def append(self, samples: bytes) -> None:
        """Append received bytes."""
        self._buffer.append(samples)

    def has(self, frames: int) -> bool:
        """Return whether the next `frames` were received."""
        return self._buffer.frames >= frames

    def take(self, frames: int) -> Block:
        """Return the next `frames`."""
        self.frame += frames
        return self._buffer.take(frames)

    def ended(self) -> StreamEnded:
        """Return the exception for the end of the stream, with the unread frames."""
        rest = self.take(self._buffer.frames)
        return StreamEnded("finished", self.frame, rest=rest)
