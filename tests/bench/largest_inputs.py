"""The largest input of each route that takes one, or that answers with one. `python -m tests.bench inputs` sends them.

Model: a `Kind` prepares its session, texture or table before anything is measured, and returns a call that may then be
    made from several threads. Sessions have a recording of 40,000 points, which is 989 kB of JSON of the 1 MiB that a
    body may have.
Limits: `LEFT_OUT` names the routes that have no input of any size, each with its reason.
"""

from __future__ import annotations

import http.client
import io
import json
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache, cached_property, partial
from itertools import count
from typing import Any
from urllib.parse import urlsplit

import numpy as np
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Subprotocol

POINTS = 40_000  # of the longest recording in a body of 1 MiB, with six digits a number
LIVE_POINTS = 2_400  # the same for a live message of 64 KiB
SIDE = 4000  # points a side of the largest surface: 64 MB
SMALL_SIDE = 500
SESSIONS = 3  # that streams are taken from in turn: each has one reader at a time
PATIENCE = 120.0  # s for an answer
GZIP = {"Accept-Encoding": "gzip"}
BOUNDARY = "largest"
LEFT_OUT = {
    "POST /v1/stop": "would end the neighbour; its body is read and not parsed",
    "DELETE /v1/textures/{name}": "has no input",
    "GET /v1/devices": "has no input",
    "GET /v1/live/schema.json": "has no input; the newer version is asked",
    "GET /healthz": "has no input",
    "GET /readyz": "has no input",
}

Ask = Callable[[], object]


@dataclass(frozen=True, slots=True)
class Kind:
    """One kind of request.

    name: a method and a path as in the OpenAPI document, and after a comma what differs.
    prepare: makes what the requests need. It returns a call that sends one, reads the answer, and returns its status.
    """

    name: str
    prepare: Callable[[], Ask]

    @property
    def operation(self) -> str:
        """Return the method and the path."""
        return self.name.partition(",")[0]


def recording(points: int) -> dict[str, Any]:
    """Return a partial scene with a recording of `points` points."""
    steps = ((0.05 * n, 0.01 * math.sin(0.02 * n), 0.3 + 0.1 * math.sin(0.013 * n)) for n in range(points))
    return {"scan": {"trajectory": [[round(t, 4), round(x, 6), round(load, 4)] for t, x, load in steps]}}


def text(document: object) -> bytes:
    """Return `document` as JSON without spaces."""
    return json.dumps(document, separators=(",", ":")).encode()


class Peer:
    """A client of the service at `url`, and what its requests need."""

    def __init__(self, url: str) -> None:
        self.place = urlsplit(url)
        self.scene = text(recording(POINTS) | {"output": {"duration": 1.0}})
        self._number = count()

    def asked(self, method: str, path: str, body: bytes | None = None, **headers: str) -> tuple[int, bytes]:
        """Return the status and the body of an answer."""
        client = http.client.HTTPConnection(self.place.hostname or "", self.place.port, timeout=PATIENCE)
        try:
            client.request(method, path, body, GZIP | {"Content-Type": "application/json"} | headers)
            answer = client.getresponse()
            return answer.status, answer.read()
        finally:
            client.close()

    def made(self, path: str, body: bytes, **headers: str) -> Any:
        """Return the JSON that a POST answers."""
        status, answer = self.asked("POST", path, body, **{"Accept-Encoding": "identity"}, **headers)
        if status not in (200, 201):
            raise RuntimeError(f"{path}: {status} {answer[:300]!r}")
        return json.loads(answer)

    def status(self, method: str, path: str, body: bytes | None = None, **headers: str) -> int:
        """Return the status of an answer."""
        return self.asked(method, path, body, **headers)[0]

    @cached_property
    def sessions(self) -> list[str]:
        """Return the paths of sessions with the largest scene."""
        return [f"/v1/sessions/{self.made('/v1/sessions', self.scene)['id']}" for _ in range(SESSIONS)]

    def session(self) -> str:
        """Return the paths of the sessions in turn."""
        return self.sessions[next(self._number) % SESSIONS]

    def form(self, name: str, side: int) -> tuple[bytes, dict[str, str]]:
        """Return the form of an import and its headers. side: points a side."""
        heights = io.BytesIO()
        np.save(heights, np.random.default_rng(1).normal(0.0, 1e-6, (side, side)).astype("<f4"))
        opening = f'--{BOUNDARY}\r\nContent-Disposition: form-data; name="'
        fields = {"name": name, "unit": "m", "pixel": "10 um"}
        parts = [f'{opening}{field}"\r\n\r\n{value}\r\n' for field, value in fields.items()]
        parts.append(f'{opening}file"; filename="{name}.npy"\r\n\r\n')
        body = "".join(parts).encode() + heights.getvalue() + f"\r\n--{BOUNDARY}--\r\n".encode()
        return body, {"Content-Type": f"multipart/form-data; boundary={BOUNDARY}"}

    @cache  # noqa: B019 (one peer a run)
    def texture(self, name: str, side: int) -> str:
        """Return the path of an imported texture."""
        body, headers = self.form(name, side)
        self.made("/v1/textures", body, **headers)
        return f"/v1/textures/{name}"

    def live(self, hello: bytes) -> tuple[ClientConnection, Any]:
        """Return a live connection, and the answer to its `hello`."""
        url = f"ws://{self.place.netloc}/v1/live"
        connection = connect(
            url, subprotocols=[Subprotocol("ridgewave.v2")], compression=None, max_size=None, ping_interval=None
        )
        connection.send(hello.decode())
        return connection, json.loads(connection.recv(PATIENCE))


def kinds(url: str) -> list[Kind]:
    """Return each kind of request to the service at `url`."""
    peer = Peer(url)
    return [*_of_documents(peer), *_of_scenes(peer), *_of_sessions(peer), *_of_textures(peer), *_of_live(peer)]


def _plain(peer: Peer, name: str, path: str, body: bytes | None = None) -> Kind:
    """Return a kind that needs nothing."""
    return Kind(name, lambda: partial(peer.status, name.split()[0], path, body))


def _of_documents(peer: Peer) -> Iterator[Kind]:
    paths = ("/openapi.json", "/docs", "/v1/scene/schema.json", "/v1/live/schema.v2.json", "/v1/textures", "/metrics")
    for path in paths:
        yield _plain(peer, f"GET {path}", path)
    yield _plain(peer, "GET /v1/threshold", "/v1/threshold?points=10000")


def _of_scenes(peer: Peer) -> Iterator[Kind]:
    yield _plain(peer, "POST /v1/render", "/v1/render", peer.scene)
    yield _plain(peer, "POST /v1/explain", "/v1/explain", peer.scene)
    fine = {"texture": {"period": "2.5 um", "amplitude": "0.1 um"}}
    yield _plain(peer, "POST /v1/analyze", "/v1/analyze", text(fine))
    dots: dict[str, Any] = {"texture": {"kind": "connor-dots-3200um"}}
    drawn = text({"scene": dots, "points": 8192, "phases": 1024, "area": 256})
    yield _plain(peer, "POST /v1/picture", "/v1/picture", drawn)
    yield _plain(peer, "POST /v1/accuracy", "/v1/accuracy", peer.scene)
    yield _plain(peer, "POST /v1/tables", "/v1/tables", peer.scene)

    def table() -> Ask:
        return partial(peer.status, "GET", peer.made("/v1/tables", text(dots))["url"])

    yield Kind("GET /v1/tables/{hash}", table)


def _of_sessions(peer: Peer) -> Iterator[Kind]:
    def of_session(method: str, rest: str = "", body: bytes | None = None) -> Ask:
        return partial(peer.status, method, peer.sessions[0] + rest, body)

    def opened() -> object:
        status, answer = peer.asked("POST", "/v1/sessions", peer.scene, **{"Accept-Encoding": "identity"})
        if status == 201:
            peer.asked("DELETE", f"/v1/sessions/{json.loads(answer)['id']}")
        return status

    def heard() -> object:
        return peer.status("GET", f"{peer.session()}/stream?duration=0.02")

    def played() -> object:
        session, name = peer.session(), f"file:take{np.random.default_rng().integers(1 << 60)}.wav"
        status = peer.status("POST", f"{session}/play", text({"device": name}))
        peer.status("DELETE", f"{session}/play")
        return status

    def beside_sessions(ask: Ask) -> Ask:
        assert len(peer.sessions) == SESSIONS  # they are opened here
        return ask

    session = "/v1/sessions/{session_id}"
    yield Kind("POST /v1/sessions", lambda: opened)
    yield Kind(f"DELETE {session}", lambda: opened)
    yield Kind(f"GET {session}", partial(of_session, "GET"))
    yield Kind(f"PATCH {session}", partial(of_session, "PATCH", "", text(recording(POINTS))))
    small = text({"finger": {"youngs_modulus": 90e3}})
    yield Kind(f"PATCH {session}, small", partial(of_session, "PATCH", "", small))
    yield Kind(f"GET {session}/stream, HEAD", partial(of_session, "HEAD", "/stream"))
    yield Kind(f"GET {session}/stream", partial(beside_sessions, heard))
    yield Kind(f"POST {session}/play", partial(beside_sessions, played))
    yield Kind(f"DELETE {session}/play", partial(beside_sessions, played))
    yield Kind(f"POST {session}/play, 1 MB", partial(of_session, "POST", "/play", text({"device": "x" * 1_000_000})))


def _of_textures(peer: Peer) -> Iterator[Kind]:
    def of_texture(method: str, rest: str = "", body: bytes | None = None, side: int = SMALL_SIDE) -> Ask:
        path = peer.texture("small" if side == SMALL_SIDE else "large", side)
        return partial(peer.status, method, path + rest, body)

    def imported() -> Ask:
        body, headers = peer.form("other", SIDE)
        return partial(peer.status, "POST", "/v1/textures?dry_run=true", body, **headers)

    texture = "/v1/textures/{name}"
    fields = text({f"x{n}": {} for n in range(75_000)})
    yield Kind(f"GET {texture}", partial(of_texture, "GET"))
    yield Kind(f"PATCH {texture}", partial(of_texture, "PATCH", "", b'{"name":' + b" " * 1_000_000 + b'"small"}'))
    yield Kind(f"PATCH {texture}, 1 MB of fields", partial(of_texture, "PATCH", "", fields))
    yield Kind(f"GET {texture}/picture", partial(of_texture, "GET", "/picture"))
    yield Kind(f"GET {texture}/picture, 64 MB", partial(of_texture, "GET", "/picture", side=SIDE))
    yield Kind(f"GET {texture}/surface", partial(of_texture, "GET", "/surface", side=SIDE))
    yield Kind("POST /v1/textures", imported)


def _of_live(peer: Peer) -> Iterator[Kind]:
    scene = recording(LIVE_POINTS)

    def opened() -> object:
        connection, answer = peer.live(text({"type": "hello", "scene": scene}))
        with connection:
            return answer["type"]

    def sent(changed: dict[str, Any]) -> Ask:
        connection = peer.live(text({"type": "hello"}))[0]  # without credit: it gets no sound, which nobody would read
        message = text({"type": "scene", "scene": changed}).decode()

        def send() -> object:
            connection.send(message)
            return "sent"

        return send

    def fetched() -> Ask:
        """Record ten seconds of a hand that moves a thousand times a second, rendered as fast as it goes."""
        connection, answer = peer.live(text({"type": "hello", "record": True}))
        for number in range(10_000):
            contact = {"type": "contact", "seq": number, "time": 0.001 * number, "position": 1e-4 * math.sin(number)}
            connection.send(text(contact).decode())
            connection.send('{"type":"more","frames":48}')
            while not isinstance(connection.recv(PATIENCE), bytes):
                pass
        connection.close()
        return partial(peer.status, "GET", f"/v1/sessions/{answer['session']}/recording")

    yield Kind("live hello", lambda: opened)
    yield Kind("live scene", partial(sent, scene))
    yield Kind("live scene, refused", partial(sent, {f"x{n}": {} for n in range(4_800)}))
    yield Kind("GET /v1/sessions/{session_id}/recording", fetched)
