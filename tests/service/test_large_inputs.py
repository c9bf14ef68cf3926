"""Nothing in proportion to an input is made in the event loop: it is made once and kept, or in a thread.

`tests.bench.bench_largest_inputs` measures what the inputs cost a neighbour. Here no clock decides: what reads, writes
and compresses is replaced by what also records sizes, and whether an event loop ran in its thread.
"""

from __future__ import annotations

import asyncio
import io
import json
from collections.abc import Callable, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, cast

import numpy as np
import pytest
from fastapi import FastAPI
from starlette.middleware.gzip import GZipResponder
from starlette.types import Message, Receive, Scope, Send

from service.app import create_app
from service.http.content_negotiation import APART
from service.http.reference import Reference
from service.http.routes.imported_textures import PIECE_BYTES
from synth.motion.motion import Update
from synth.scene import scene
from synth.scene.scene import parse_scene
from synth.surfaces.surface_data import SurfaceData
from synth.voice.hand_voice import HandVoice
from tests.bench.largest_inputs import LEFT_OUT, kinds, recording
from tests.service.harness import Running, ask, kept_engine, settings_of
from tests.service.plain_engine import PlainEngine

SCENE = recording(2_500)  # 60 kB
LARGE = APART  # bytes that a loop may read, write or compress at once: half of what these inputs have
FIELDS: dict[str, Any] = {f"x{number}": {} for number in range(4_000)}
GZIP = {"Accept-Encoding": "gzip"}

Made = list[tuple[str, int, bool]]
"""What was made, its size, and whether an event loop ran in that thread."""


@pytest.fixture
def made(monkeypatch: pytest.MonkeyPatch) -> Made:
    """Return the list to which each reading, writing and compressing of JSON, scenes and documents is added."""
    found: Made = []

    def watch(owner: Any, name: str, size: Callable[[Sequence[Any], Any], int]) -> None:
        """Have `owner.name` add itself to the list. size: of its arguments and its result."""
        plain = getattr(owner, name)

        def watched(*arguments: Any, **named: Any) -> Any:
            result = plain(*arguments, **named)
            found.append((f"{owner.__name__}.{name}", size(arguments, result), in_loop()))
            return result

        monkeypatch.setattr(owner, name, watched)

    watch(json.JSONDecoder, "decode", lambda arguments, _: len(arguments[1]))
    watch(json.JSONEncoder, "encode", lambda _, result: len(result))
    watch(GZipResponder, "_compress_body", lambda arguments, _: len(arguments[1]))
    watch(scene.Scene, "document", lambda arguments, _: 20 * len(arguments[0].scan.trajectory or ()))
    watch(FastAPI, "openapi", lambda _, result: len(result["paths"]) * 1000)
    return found


def in_loop() -> bool:
    """Return whether an event loop runs in this thread."""
    try:
        asyncio.get_running_loop()
    except RuntimeError:
        return False
    return True


def test_every_route_is_asked_with_its_largest_input_or_left_out_with_a_reason() -> None:
    paths = create_app(settings_of(), PlainEngine()).openapi()["paths"]
    routes = {f"{method.upper()} {path}" for path, calls in paths.items() for method in calls}
    asked = {kind.operation for kind in kinds("http://127.0.0.1:1")}
    assert not asked & set(LEFT_OUT)
    assert routes - asked == set(LEFT_OUT)
    assert asked - routes == {"GET /openapi.json", "live hello", "live scene"}


def in_loop_at_once(made: Made) -> Made:
    """Return what was made in the loop and was larger than LARGE."""
    return [one for one in made if one[2] and one[1] > LARGE]


REQUESTS: dict[str, tuple[str, str, Any]] = {
    "open": ("POST", "/v1/sessions", SCENE),
    "show": ("GET", "{session}", None),
    "change": ("PATCH", "{session}", SCENE),
    "header": ("HEAD", "{session}/stream", None),
    "stream": ("GET", "{session}/stream?duration=0.02", None),
    "play": ("POST", "{session}/play", {"device": "file:take.wav"}),
    "play, refused": ("POST", "{session}/play", {"device": [FIELDS]}),
    "rename, refused": ("PATCH", "/v1/textures/cloth", FIELDS),
    "render": ("POST", "/v1/render", {**SCENE, "output": {"duration": 0.1}}),
    "explain": ("POST", "/v1/explain", SCENE),
    "picture": ("POST", "/v1/picture", {"scene": SCENE, "points": 8192}),
    "table": ("POST", "/v1/tables", SCENE),
    "accuracy": ("POST", "/v1/accuracy", SCENE),
    "list": ("GET", "/v1/textures", None),
    "threshold": ("GET", "/v1/threshold?points=10000", None),
    "OpenAPI": ("GET", "/openapi.json", None),
    "page": ("GET", "/docs", None),
}
REFUSED = {"play, refused", "rename, refused"}


@pytest.mark.parametrize("name", REQUESTS)
def test_no_route_makes_in_the_event_loop_what_grows_with_its_input(name: str, running: Running, made: Made) -> None:
    session = f"/v1/sessions/{running.open_session(SCENE)}"
    made.clear()
    method, path, body = REQUESTS[name]
    answer = running.client.request(method, path.format(session=session), json=body, headers=GZIP)
    assert answer.status_code == 422 if name in REFUSED else answer.is_success, answer.text
    assert made or method == "HEAD", "the test sees nothing of the work"
    assert not in_loop_at_once(made)


def test_the_scene_of_a_session_is_written_once_for_all_answers(running: Running, made: Made) -> None:
    session = f"/v1/sessions/{running.open_session(SCENE)}"
    made.clear()
    shown = [running.client.get(session).json() for _ in range(3)]
    headers = [running.client.head(f"{session}/stream?format=wav&duration=1") for _ in range(2)]
    assert shown[0]["scene"]["scan"]["trajectory"] == SCENE["scan"]["trajectory"]
    assert all(int(one.headers["content-length"]) > LARGE for one in headers)
    assert not [one for one in made if one[0] == "Scene.document"]
    assert not [one for one in made if one[0] == "JSONEncoder.encode" and one[1] > LARGE]


def test_a_changed_scene_is_in_all_answers(running: Running) -> None:
    session = f"/v1/sessions/{running.open_session(SCENE)}"
    changed = running.client.patch(session, json={"scan": {"load": 0.5}}).json()
    assert changed["scene"]["scan"]["load"] == 0.5 and "trajectory" not in changed["scene"]["scan"]
    assert running.client.get(session).json()["scene"] == changed["scene"]
    sound = running.client.get(f"{session}/stream?format=wav&duration=0.02").content
    assert json.dumps(changed["scene"], separators=(",", ":")).encode() in sound


def test_a_refused_change_leaves_the_scene_in_all_answers(running: Running) -> None:
    session = f"/v1/sessions/{running.open_session(SCENE)}"
    before = running.client.get(session).json()["scene"]
    assert running.client.patch(session, json={"scan": {"load": -1.0}}).status_code == 422
    assert running.client.get(session).json()["scene"] == before


def test_openapi_and_docs_are_made_once(running: Running, made: Made) -> None:
    answers = [[running.client.get(path).content for _ in range(2)] for path in ("/openapi.json", "/docs")]
    assert all(first == again for first, again in answers)
    assert len([one for one in made if one[0] == "FastAPI.openapi"]) == 1


def test_a_service_that_only_serves_makes_openapi_and_docs_at_its_start(
    engine: PlainEngine, monkeypatch: pytest.MonkeyPatch
) -> None:
    app = create_app(settings_of(), engine)
    service, begun = app.state.service, []
    monkeypatch.setattr(Reference, "make", lambda _reference: begun.append(in_loop()))
    monkeypatch.setattr("service.lifespan.gc.freeze", lambda: None)
    service.serves_only = True
    service.warm_up()
    service.finish()
    assert service.warm and begun == [False]


def test_the_plan_of_a_live_session_makes_no_document_of_its_scene(made: Made) -> None:
    hand = kept_engine().open_hand(parse_scene(recording(50)))
    assert isinstance(hand, HandVoice)
    hand.touch(Update(0, 0.0, 0.0, None, 0.3))
    hand.render(480)
    whole = hand.plan.document()
    made.clear()
    plan = hand.plan_document
    assert not made
    assert plan["response"].pop("delay_behind_a_hand_seconds") == hand.motion_delay
    assert plan == {name: value for name, value in whole.items() if name not in ("scene", "cost")}


def test_the_files_of_an_import_are_deleted_in_a_thread(
    app: FastAPI, read_here: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    plain, deleted = TemporaryDirectory.cleanup, []

    def cleanup(folder: TemporaryDirectory[str]) -> None:
        if folder.name.rpartition("/")[2].startswith("ridgewave-"):
            deleted.append(in_loop())
        plain(folder)
        assert not Path(folder.name).exists()

    monkeypatch.setattr(TemporaryDirectory, "cleanup", cleanup)
    heights = "\n".join(f"{number % 20}" for number in range(200)).encode()
    fields = {"unit": "um", "pixel": "5 um"}
    answer = ask(app, "POST", "/v1/textures?dry_run=true", files={"file": ("scan.csv", heights)}, data=fields)
    assert answer.status_code == 200, answer.text
    assert deleted == [False]


def test_an_export_is_sent_in_pieces(engine: PlainEngine, tmp_path: Path) -> None:
    app = create_app(settings_of(data_folder=tmp_path), engine)
    heights = np.random.default_rng(1).normal(size=(400, 500)).astype(np.float32) * np.float32(1e-6)
    own = app.state.service.textures
    own.store.keep("", "cloth", SurfaceData(heights, (1e-5, 1e-5)), "heightmap", {"file": "cloth.npy"}, own.quota)
    sizes: list[int] = []

    async def watched(scope: Scope, receive: Receive, send: Send) -> None:
        async def counted(message: Message) -> None:
            sizes.append(len(message.get("body", b"")))
            await send(message)

        await app(scope, receive, counted)

    answer = ask(cast(FastAPI, watched), "GET", "/v1/textures/cloth/surface")
    assert answer.status_code == 200, answer.text
    assert int(answer.headers["content-length"]) == len(answer.content) == sum(sizes)
    assert np.array_equal(np.load(io.BytesIO(answer.content)), heights)
    assert max(sizes) <= PIECE_BYTES < len(answer.content)
    app.state.service.finish()
