"""`Client` and `AsyncClient`: every call to the service, and answers that the service never gives."""

from __future__ import annotations

import asyncio
import json
import socket
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest
import soundfile

import ridgewave as rw
from clients import (
    AsyncClient,
    Client,
    ConnectionLost,
    ProtocolError,
    RefusedError,
    ServiceError,
    StreamEnded,
)
from service.app import create_app
from synth.errors import InvalidRequest
from synth.scene.scene import parse_scene
from tests.file_metadata import read_metadata
from tests.service.harness import Running, serving, settings_of
from tests.service.plain_engine import FULL_SCALE, TABLE, PlainEngine, sine

SHORT = {"output": {"duration": 0.1}}
FRAMES = 4800


@pytest.fixture(scope="module")
def running(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Running]:
    with serving(PlainEngine(), file_folder=tmp_path_factory.mktemp("recordings")) as server:
        yield server


@pytest.fixture
def client(running: Running) -> Iterator[Client]:
    with Client(running.url) as made:
        yield made


def answering(answer: Callable[[httpx.Request], httpx.Response]) -> Client:
    return Client("http://localhost", transport=httpx.MockTransport(answer))


# Renders


@pytest.mark.parametrize("sound_format", ["f32le", "wav"])
def test_a_render_is_the_samples_of_the_service(client: Client, sound_format: str) -> None:
    sound = client.render(SHORT, format=sound_format)
    assert sound.frames.dtype == np.float32
    assert np.array_equal(sound.frames, sine(parse_scene(SHORT), 0, FRAMES))
    assert (sound.sample_rate, sound.full_scale, sound.quantities) == (48000, (FULL_SCALE,), ("acceleration",))
    assert sound.seconds == pytest.approx(0.1)
    assert np.allclose(sound.values, sound.frames * FULL_SCALE)


@pytest.mark.parametrize(("sound_format", "bits"), [("wav16", 16), ("l16", 16), ("wav24", 24), ("flac", 24)])
def test_integer_formats_are_read_as_floats(client: Client, sound_format: str, bits: int) -> None:
    sound = client.render(SHORT, format=sound_format)
    assert sound.frames.shape == (FRAMES, 1) and sound.frames.dtype == np.float32
    assert np.abs(sound.frames - sine(parse_scene(SHORT), 0, FRAMES)).max() <= 0.5001 / 2 ** (bits - 1)


def test_several_channels_stay_apart(client: Client) -> None:
    sound = client.render({"output": {"duration": 0.01, "channels": ["velocity", "displacement"]}})
    assert sound.frames.shape == (480, 2)
    assert sound.quantities == ("velocity", "displacement") and len(sound.full_scale) == 2


def test_a_checked_scene_of_the_engine_is_a_scene(client: Client) -> None:
    assert client.render(parse_scene(SHORT)).frames.shape == (FRAMES, 1)


@pytest.mark.parametrize(("name", "subtype"), [("a.wav", "PCM_16"), ("b.flac", "PCM_24"), ("c.wav", "FLOAT")])
def test_a_sound_is_saved_with_its_scale_and_scene(client: Client, tmp_path: Path, name: str, subtype: str) -> None:
    sound = client.render(SHORT)
    path = sound.save(tmp_path / name, "pcm16" if subtype == "PCM_16" else None)
    assert soundfile.info(path).subtype == subtype
    frames, rate = soundfile.read(path, dtype="float32", always_2d=True)
    assert rate == 48000 and np.abs(frames - sound.frames).max() <= 1 / 32768
    metadata = read_metadata(path)
    assert metadata is not None and metadata.full_scale == (FULL_SCALE,)
    assert isinstance(metadata.scene, dict) and metadata.scene["output"]["duration"] == 0.1


def test_a_name_that_is_no_sound_file_is_refused(client: Client, tmp_path: Path) -> None:
    with pytest.raises(InvalidRequest):
        client.render(SHORT).save(tmp_path / "a.mp3")


# Other calls


def test_a_texture_is_imported_used_and_deleted(client: Client, tmp_path: Path) -> None:
    path = tmp_path / "wave.csv"
    np.savetxt(path, 20.0 * np.sin(2.0 * np.pi * np.arange(160) / 160))
    told = client.import_texture(path, unit="um", pixel="5 um", dry_run=True)
    assert not told["kept"] and told["report"]["size"] == [pytest.approx(0.8e-3)]
    made = client.import_texture(path, unit="um", pixel="5 um", level="none", name="wave")
    assert made["kept"] and client.textures()[-1]["name"] == "wave"
    with client.open_session({"texture": {"kind": "wave"}}) as session:
        assert session.scene["texture"]["surface"] == made["address"]
    client.delete_texture("wave")
    with pytest.raises(RefusedError) as refused:
        client.import_texture(path)
    assert {fault.pointer for fault in refused.value.faults} == {"/unit", "/pixel"}


def test_every_other_call_is_there(client: Client, tmp_path: Path) -> None:
    assert client.healthz()
    assert client.explain({})["simulated"] == []
    assert client.analyze({})["felt_by"] == "nothing"  # so the plain engine says
    rw.render({}, output={"duration": "0.1 s"}).save(tmp_path / "scan.wav")
    assert client.analyze_recording(tmp_path / "scan.wav", scale=2.0, quantity="velocity")["felt_by"] == "nothing"
    assert client.accuracy({}, quantity="acceleration")["methods"]
    assert client.accuracy({}, live=True)["methods"]
    names = [entry["name"] for entry in client.textures()]
    assert client.texture(names[0])["name"] == names[0]
    assert client.table({}) == TABLE.read_bytes()
    assert isinstance(client.devices(), list)


def test_a_session_is_read_steered_and_ended(client: Client) -> None:
    with client.open_session({}) as session:
        assert session.sample_rate == 48000 and session.channels == 1
        with session.stream() as stream:
            first = stream.read(1000)
            session.change({"scan": {"load": "0.6 N"}})
            assert first.shape == (1000, 1) and stream.read(1).shape == (1, 1)
            assert stream.frame == 1001
        assert session.scene["scan"]["load"] == 0.6
        assert client.session(session.id).look()["scene"] == session.scene
    with pytest.raises(RefusedError) as gone:
        session.look()
    assert gone.value.problem.kind == "not-found"


@pytest.mark.parametrize("frames", [-5, 1.5, "480"])
def test_a_read_of_no_whole_number_is_refused_and_loses_nothing(client: Client, frames: Any) -> None:
    with client.open_session() as session, session.stream(duration=0.1) as stream:
        stream.read(10)
        with pytest.raises(InvalidRequest, match="whole number"):
            stream.read(frames)
        assert len(stream.read(FRAMES - 10)) == FRAMES - 10


def test_a_finite_stream_ends_with_the_unread_frames(client: Client) -> None:
    with client.open_session({}) as session, session.stream(duration=0.05, format="l16") as stream:
        assert stream.read(2000).shape == (2000, 1)
        with pytest.raises(StreamEnded) as ended:
            stream.read(2000)
    assert ended.value.rest.shape == (400, 1)
    assert ended.value.frame == 2400


@pytest.mark.parametrize("frames", [-1, 1.5, None])
def test_a_number_of_frames_that_is_none_is_refused_and_takes_nothing(client: Client, frames: Any) -> None:
    with client.open_session({}) as session, session.stream(duration=0.05) as stream:
        assert stream.read(100).shape == (100, 1)
        with pytest.raises(InvalidRequest, match="a whole number from 0"):
            stream.read(frames)
        assert stream.read(2300).shape == (2300, 1)
        assert stream.frame == 2400


def test_a_session_records_on_the_machine_of_the_service(client: Client) -> None:
    with client.open_session({}) as session:
        assert session.play("file:client.wav")["state"] == "playing"
        assert session.end_play()["failure"] is None


def test_leaving_a_stopped_session_raises_nothing(client: Client) -> None:
    with client.open_session({}):
        assert client.stop()["sessions"] >= 1


# What goes wrong


def test_a_refused_scene_names_each_fault(client: Client) -> None:
    with pytest.raises(RefusedError) as refused:
        client.render({"scan": {"load": "-1 N", "speed": "20 m/s"}})
    assert {fault.pointer for fault in refused.value.faults} == {"/scan/load", "/scan/speed"}
    assert (refused.value.problem.status, refused.value.problem.kind) == (422, "scene-refused")
    assert "scan.load: got '-1 N'" in str(refused.value)


def test_a_scene_that_json_cannot_hold_is_refused_before_it_is_sent() -> None:
    with Client("http://localhost", transport=httpx.MockTransport(lambda _: pytest.fail("sent"))) as client:
        with pytest.raises(InvalidRequest):
            client.render({"scan": {"load": float("nan")}})
        with pytest.raises(InvalidRequest):
            client.render("paper-finger")


def test_a_full_service_says_when_to_try_again() -> None:
    document = {"type": "/docs#problem-full", "title": "Full", "status": 503, "detail": "Full.", "errors": []}
    with (
        answering(lambda _: httpx.Response(503, json=document, headers={"Retry-After": "7"})) as client,
        pytest.raises(ServiceError) as full,
    ):
        client.open_session({})
    assert full.value.retry_after == 7.0 and full.value.problem.kind == "full"


def test_a_key_is_sent_as_a_bearer_token_and_a_missing_one_is_a_problem() -> None:
    with serving(PlainEngine(), api_keys="first,se/cr+et") as server:
        with Client(server.url) as client, pytest.raises(RefusedError) as refused:
            client.explain({})
        assert refused.value.problem.kind == "key-required"
        with Client(server.url, key="se/cr+et") as client:
            assert client.explain({})["left_out"] == []


def test_a_key_that_no_header_can_hold_is_refused_and_not_shown() -> None:
    with pytest.raises(InvalidRequest, match="not shown") as refused:
        Client(key="a key\r\nX: y")
    assert "a key" not in str(refused.value)


@pytest.mark.parametrize(
    "answer",
    [
        httpx.Response(200, content=b"<html>", headers={"Content-Type": "text/html"}),
        httpx.Response(200, json=[1]),
        httpx.Response(200, content=20_000 * b"["),
    ],
)
def test_an_answer_of_another_service_is_a_protocol_error(answer: httpx.Response) -> None:
    with answering(lambda _: answer) as client:
        for call in (client.explain, client.render, client.textures, client.open_session):
            with pytest.raises(ProtocolError):
                call()


def test_a_body_that_cannot_be_unpacked_is_a_protocol_error() -> None:
    def damaged(_request: httpx.Request) -> httpx.Response:
        return httpx.Response(200, stream=httpx.ByteStream(b"no gzip"), headers={"Content-Encoding": "gzip"})

    with answering(damaged) as client, pytest.raises(ProtocolError, match="Content-Encoding"):
        client.textures()


def test_a_duration_with_a_unit_is_refused_as_the_number_it_must_be(client: Client) -> None:
    with client.open_session() as session, pytest.raises(InvalidRequest, match="a number, in s"):
        session.stream(duration="2 s").__enter__()  # type: ignore[arg-type]


def test_a_session_without_its_fields_is_a_protocol_error() -> None:
    with answering(lambda _: httpx.Response(201, json={"hello": "world"})) as client:
        with pytest.raises(ProtocolError):
            client.open_session()
        with pytest.raises(ProtocolError):
            client.session("s")


ADDRESSES = ("127.0.0.1:8000", "ws://127.0.0.1:8000", "http://h:x", "http://h:99999", "http://[h", "http://h h", "")


@pytest.mark.parametrize("url", [*ADDRESSES, f"http://{64 * 'a'}.b", None, 5])
def test_an_invalid_address_is_refused_at_once(url: Any) -> None:
    for kind in (Client, AsyncClient):
        with pytest.raises(InvalidRequest) as refused:
            kind(url)
        assert [fault.pointer for fault in refused.value.faults] == ["/base_url"]


def test_an_error_without_a_problem_document_still_has_its_status() -> None:
    with (
        answering(lambda _: httpx.Response(502, content=b"<html>bad gateway</html>")) as client,
        pytest.raises(ServiceError, match="502"),
    ):
        client.explain()


def test_a_frame_that_is_cut_short_is_not_a_sound() -> None:
    headers = {
        "Ridgewave-Format": "f32le;rate=8000;channels=2",
        "Ridgewave-Full-Scale": "1, 2",
        "Ridgewave-Quantities": "velocity, force",
    }
    with (
        answering(lambda _: httpx.Response(200, content=bytes(12), headers=headers)) as client,
        pytest.raises(ProtocolError),
    ):
        client.render()


def test_a_refused_connection_is_a_lost_connection() -> None:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        port = listener.getsockname()[1]
    with Client(f"http://127.0.0.1:{port}") as client:
        assert not client.healthz()
        with pytest.raises(ConnectionLost):
            client.explain()


def test_a_request_is_what_docs_http_says() -> None:
    asked: list[httpx.Request] = []

    def answer(request: httpx.Request) -> httpx.Response:
        asked.append(request)
        return httpx.Response(200, json={})

    with answering(answer) as client:
        client.explain({"scan": {"load": "0.2 N"}})
        client.recording("a/b")
    assert (asked[0].method, asked[0].url.path) == ("POST", "/v1/explain")
    assert asked[0].content == b'{"scan":{"load":"0.2 N"}}'
    assert asked[0].headers["content-type"] == "application/json"
    assert asked[1].url.raw_path == b"/v1/sessions/a%2Fb/recording"


# Without threads


@asynccontextmanager
async def in_process() -> AsyncIterator[AsyncClient]:
    app = create_app(settings_of(), PlainEngine())
    try:
        async with AsyncClient("http://localhost", transport=httpx.ASGITransport(app)) as client:
            yield client
    finally:
        app.state.service.finish()


def test_the_async_client_gives_the_same(client: Client) -> None:
    async def asked() -> tuple[Any, ...]:
        async with in_process() as other:
            sound = await other.render(SHORT)
            names = [entry["name"] for entry in await other.textures()]
            assert (await other.texture(names[0]))["name"] == names[0]
            assert await other.healthz() and isinstance(await other.devices(), list)
            assert (await other.accuracy({}, "acceleration"))["methods"]
            with pytest.raises(RefusedError):
                await other.render({"nonsense": 1})
            assert await other.table() == TABLE.read_bytes()
            return sound.frames, await other.explain(SHORT), names

    frames, plan, names = asyncio.run(asked())
    assert np.array_equal(frames, client.render(SHORT).frames)
    assert json.dumps(plan) == json.dumps(client.explain(SHORT))
    assert names == [entry["name"] for entry in client.textures()]


def test_an_async_session_is_read_steered_and_ended(running: Running) -> None:
    async def heard() -> None:
        async with AsyncClient(running.url) as client:
            async with await client.open_session({}) as session:
                async with session.stream(duration=0.05) as stream:
                    await session.change({"scan": {"load": "0.6 N"}})
                    assert (await stream.read(2000)).shape == (2000, 1)
                    with pytest.raises(StreamEnded) as ended:
                        await stream.read(2000)
                    assert len(ended.value.rest) == 400
                assert (await session.play("file:async.wav"))["state"] == "playing"
                assert (await session.end_play())["failure"] is None
                assert (await (await client.session(session.id)).look())["id"] == session.id
            with pytest.raises(RefusedError):
                await session.look()
            assert await client.stop() == {"plays": 0, "sessions": 0, "streams": 0}

    asyncio.run(heard())


def test_both_clients_have_the_same_calls() -> None:
    from clients.http_client.async_client import AsyncSession
    from clients.http_client.sync_client import Session

    for plain, other in ((Client, AsyncClient), (Session, AsyncSession)):
        assert {n for n in vars(plain) if n[0] != "_"} == {n for n in vars(other) if n[0] != "_"}
