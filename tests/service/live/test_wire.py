"""The live protocol over real WebSockets: what is heard, and how it ends."""

from __future__ import annotations

import json
import threading

import numpy as np
import pytest

from service.live.live_stream import LiveStream
from service.live.messages import V1, V2, Version
from service.sessions.session import Session
from synth.motion.motion import Update
from synth.scene.scene import parse_scene
from tests.service.harness import Running, kept_engine, problem, serving, until, warmed_up
from tests.service.live.client import live
from tests.service.live.driver import place
from tests.service.plain_engine import PlainEngine
from tests.service.plain_hand import PlainHand, expected

RATE = 48000
SCENE = parse_scene({})


def session_of(running: Running, name: str) -> Session:
    return running.service.sessions._sessions[name]


def hands(engine: PlainEngine) -> list[PlainHand]:
    """Return the hands of the sessions, in order; each session opens one more, to learn its full scale."""
    return [hand for hand in engine.hands if all(channel.full_scale for channel in hand.first.output.channel_list)]


def hand_of(engine: PlainEngine) -> PlainHand:
    return hands(engine)[-1]


# What is heard


def test_a_realtime_stream_is_the_plain_hand_sample_for_sample(running: Running, engine: PlainEngine) -> None:
    with live(running) as client:
        ready = client.hello(pacing="realtime")
        for seq in range(1, 40):
            client.contact(seq, load=seq / 40)
            client.until("applied")
        client.say("scene", scene={"scan": {"speed": "160 mm/s"}})
        client.until("scene")
        client.frames(client.sound // 4 + 4800)
        client.say("stop")
        pcm = client.rest()
        assert client.code == 1000 and client.reason == "stopped"
    applied = hand_of(engine).applied
    np.testing.assert_array_equal(pcm, expected(parse_scene({}), applied, len(pcm)))
    told = [(message["frame"], message["seq"]) for message in client.texts("applied")]
    assert told == [(frame, update.seq) for frame, update in applied.updates] and len(told) == 39
    assert client.texts("end")[0] == {"type": "end", "reason": "stopped", "frame": len(pcm)}
    assert ready["frame"] == 0 and applied.scenes[0][0] == client.texts("scene")[0]["frame"]


def test_a_place_over_a_real_socket_reaches_the_hand(running: Running, engine: PlainEngine) -> None:
    with live(running, subprotocols=["ridgewave.v2", "ridgewave.v1"]) as client:
        ready = client.hello(scene={"texture": {"kind": "dots"}})
        assert (ready["protocol"], ready["over_area"]) == ("ridgewave.v2", True)
        client.socket.send(place(7, 0.5, -0.25, direction=1.5, load=0.5, time=2.0))
        client.say("more", frames=480)
        assert client.until("applied") == {"type": "applied", "seq": 7, "frame": 0}
    assert hand_of(engine).applied.updates == [(0, Update(7, 2.0, -0.5, None, 0.5, 0.25, 1.5))]


def test_a_pull_stream_gives_what_it_was_granted(running: Running, engine: PlainEngine) -> None:
    with live(running) as client:
        client.hello(block=100)
        client.say("more", frames=1050)
        client.say("more", frames=950)
        pcm = client.frames(2000)
        client.contact(1, load=1.0)
        client.say("more", frames=500)
        client.until("applied")
        pcm = client.frames(2500)
        assert len(pcm) == 2500
        np.testing.assert_array_equal(pcm, expected(SCENE, hand_of(engine).applied, 2500))
        assert hand_of(engine).applied.updates[0][0] == 2000


@pytest.mark.parametrize(("version", "path"), [(V1, "schema.json"), (V2, "schema.v2.json")])
def test_every_message_of_the_server_fits_the_schema_that_it_serves(
    running: Running, version: Version, path: str
) -> None:
    import jsonschema_rs

    answer = running.client.get(f"/v1/live/{path}")
    assert answer.status_code == 200 and answer.json() == version.schema()
    jsonschema_rs.meta.validate(answer.json())
    served = answer.json()
    validator = jsonschema_rs.Draft202012Validator({"$ref": "#/$defs/server", "$defs": served["$defs"]})
    with live(running, subprotocols=[version.name]) as client:
        assert client.hello(pacing="realtime", record=True)["protocol"] == version.name
        client.contact(1, load=5000.0)
        client.contact(2)
        client.until("applied")
        client.say("scene", scene={"scan": {"speed": 0.1}})
        client.until("scene")
        client.say("stop")
        client.rest()
        texts = [message for message in client.received if isinstance(message, dict)]
    assert {message["type"] for message in texts} == {"ready", "problem", "applied", "scene", "end"}
    for message in texts:
        validator.validate(message)


# How it ends


def test_a_connection_that_breaks_is_resumed_where_it_was(running: Running, engine: PlainEngine) -> None:
    with live(running) as client:
        name = client.hello(pacing="realtime")["session"]
        client.contact(1, load=0.9)
        first = client.frames(9600)
        client.break_off()
    until(lambda: session_of(running, name).peer is None)
    kept = len(first) - 1000
    with live(running) as again:
        ready = again.hello(resume={"session": name, "frame": kept})
        assert ready["frame"] == kept and ready["session"] == name
        second = again.frames(24000)
        assert len(hands(engine)) == 1
        whole = np.concatenate([first[:kept], second])
        np.testing.assert_array_equal(whole, expected(SCENE, hand_of(engine).applied, len(whole)))


def test_a_half_open_connection_is_taken_over(running: Running, engine: PlainEngine) -> None:
    with live(running) as old, live(running) as new:
        name = old.hello(pacing="realtime")["session"]
        first = old.frames(4800)
        new.hello(resume={"session": name, "frame": len(first)})
        second = new.frames(9600)
        old.rest()
        assert old.code == 1008 and old.texts("problem")[0]["problem"] == "/docs#problem-busy"
        assert len(running.service.sessions) == 1
        whole = np.concatenate([first, second])
        np.testing.assert_array_equal(whole, expected(SCENE, hand_of(engine).applied, len(whole)))
        new.say("stop")
        new.rest()
        assert new.code == 1000 and len(running.service.sessions) == 0


def test_a_take_over_waits_for_the_block_that_a_thread_renders(running: Running, engine: PlainEngine) -> None:
    with live(running) as old, live(running) as new:
        name = old.hello(pacing="realtime")["session"]
        old.frames(4800)
        hand, session = hand_of(engine), session_of(running, name)
        earlier = session.peer
        stream = session.stream
        assert isinstance(stream, LiveStream)
        stream.quick = False
        gate = hand.gate = threading.Event()
        until(lambda: hand.waits)
        frame = stream.frame
        new.say("hello", resume={"session": name, "frame": frame})
        until(lambda: session.peer is not earlier)
        gate.set()
        new.until("ready")
        pcm = new.frames(4800)
        np.testing.assert_array_equal(pcm, expected(SCENE, hand.applied, frame + len(pcm))[frame:])


def test_a_resume_that_cannot_be_leaves_the_session_alone(running: Running) -> None:
    with live(running) as old, live(running) as new:
        name = old.hello(pacing="realtime")["session"]
        new.say("hello", resume={"session": name, "frame": 10**9})
        new.rest()
        assert new.code == 1008 and new.texts("problem")[0]["problem"] == "/docs#problem-not-found"
        before = old.sound
        old.frames(before // 4 + 4800)


def test_a_session_that_nobody_resumes_expires() -> None:
    engine = PlainEngine()
    with serving(engine, resume=0.1) as running:
        with live(running) as client:
            name = client.hello()["session"]
            client.break_off()
        until(lambda: len(running.service.sessions) == 0)
        with live(running) as client:
            client.say("hello", resume={"session": name, "frame": 0})
            client.rest()
            assert client.code == 1008


def test_a_slow_reader_is_told_and_closed_and_makes_nobody_late() -> None:
    """Another stream beside it stays on time and complete."""
    engine = PlainEngine()
    channels = {"output": {"sample_rate": 192000, "channels": [{"quantity": "acceleration"}] * 4}}
    with serving(engine, slow_reader=0.2) as running, live(running) as well:
        warmed_up(running, engine)
        well.hello(pacing="realtime")
        with live(running, max_queue=1, ping_interval=None) as sleeper:
            name = sleeper.hello(pacing="realtime", scene=channels)["session"]
            until(lambda: name not in running.service.sessions._sessions)
            sleeper.rest()
            assert sleeper.code == 4408
        before = well.sound
        pcm = well.frames(before // 4 + 4800)
        np.testing.assert_array_equal(pcm, expected(SCENE, hands(engine)[0].applied, len(pcm)))
        assert well.texts("problem") == []


@pytest.mark.usefixtures("unhurried")
def test_a_stop_ends_every_stream_with_a_fade(running: Running, engine: PlainEngine) -> None:
    with live(running) as one, live(running) as two, live(running) as waiting:
        one.hello(pacing="realtime")
        two.hello()
        one.frames(4800)
        two.say("more", frames=4800)
        two.frames(4800)
        answer = running.client.post("/v1/stop")
        assert answer.json() == {"stopped": {"sessions": 2, "streams": 2, "plays": 0}}
        for client, hand in ((one, hands(engine)[0]), (two, hands(engine)[1])):
            pcm = client.rest()
            assert (client.code, client.reason) == (1000, "stopped")
            assert client.texts("end")[0]["reason"] == "stopped" and pcm[-1] == 0.0
            np.testing.assert_array_equal(pcm, expected(SCENE, hand.applied, len(pcm)))
        waiting.rest()
        assert waiting.code == 1000
    until(lambda: len(running.service.sessions) == 0)


def test_a_voice_that_crashes_ends_its_own_session_only(
    running: Running, engine: PlainEngine, caplog: pytest.LogCaptureFixture
) -> None:
    with live(running) as one, live(running) as two:
        one.hello(pacing="realtime")
        two.hello(pacing="realtime")
        one.frames(4800)
        failing = hands(engine)[0]
        failing.fails = RuntimeError("a secret that no peer may learn")
        one.rest()
        assert one.code == 1011 and one.texts("end")[0]["reason"] == "our mistake"
        (found,) = one.texts("problem")
        assert found["problem"] == "/docs#problem-internal" and found["instance"].startswith("urn:uuid:")
        assert "secret" not in json.dumps(one.texts("problem")) and found["instance"] in caplog.text
        before = two.sound
        pcm = two.frames(before // 4 + 4800)
        np.testing.assert_array_equal(pcm, expected(SCENE, hand_of(engine).applied, len(pcm)))


def test_an_engine_that_cannot_or_fails_says_so_and_no_more() -> None:
    for engine, code, kind in (
        (PlainEngine(refuse="No such surface."), 1011, "cannot-render"),
        (PlainEngine(mistake=True), 1011, "internal"),
    ):
        with serving(engine) as running, live(running) as client:
            client.say("hello")
            client.rest()
            assert client.code == code
            (found,) = client.texts("problem")
            assert found["problem"] == f"/docs#problem-{kind}" and "secret" not in json.dumps(found)


def test_a_scene_whose_contact_cannot_be_solved_is_the_clients_to_change() -> None:
    flat = {"effects": {"curvature": {"radius": 1000}}}
    with serving(kept_engine()) as running, live(running) as client:
        client.say("hello", scene=flat)
        client.rest()
        assert client.code == 1008
        (found,) = client.texts("problem")
        assert found["problem"] == "/docs#problem-scene-refused" and found["errors"][0]["pointer"] == "/finger"


@pytest.mark.parametrize(
    ("message", "code"),
    [("x" * 70_000, 1009), (b"x" * 70_000, 1009), ("{", 1007)],
    ids=["long text", "long bytes", "not JSON"],
)
def test_what_is_no_message_closes_the_connection(running: Running, message: str | bytes, code: int) -> None:
    with live(running) as client:
        client.hello(pacing="realtime")
        client.socket.send(message)
        client.rest()
        assert client.code == code


def test_text_that_is_not_utf8_closes_with_1007_and_without_a_traceback(
    running: Running, caplog: pytest.LogCaptureFixture
) -> None:
    with live(running) as client:
        client.hello(pacing="realtime")
        client.socket.send(b"\xff\xfe", text=True)
        client.rest()
        assert client.code == 1007
    assert "Traceback" not in caplog.text


def test_a_connection_that_breaks_while_its_voice_is_opened_leaves_nothing(engine: PlainEngine) -> None:
    with serving(engine) as running:
        warmed_up(running, engine)
        engine.gate = threading.Event()
        with live(running) as client:
            client.say("hello")
            until(lambda: "hand" in engine.opened)
            client.break_off()
        engine.gate.set()
        until(lambda: len(engine.hands) == 2 and len(running.service.sessions) == 0)


# Recordings


def test_a_recording_is_there_while_the_session_lives_and_after(running: Running, engine: PlainEngine) -> None:
    with live(running) as client:
        name = client.hello(pacing="realtime", record=True)["session"]
        client.contact(1)
        client.until("applied")
        path = f"/v1/sessions/{name}/recording"
        answer = running.client.get(path)
        assert answer.status_code == 200 and answer.headers["content-type"] == "application/json"
        assert [seq for _, seq in answer.json()["updates"]] == [1]
        client.contact(2)
        client.until("applied")
        client.say("stop")
        client.rest()
    until(lambda: len(running.service.sessions) == 0)
    assert [seq for _, seq in running.client.get(path).json()["updates"]] == [1, 2]


def test_without_record_or_after_a_while_there_is_no_recording() -> None:
    with serving(PlainEngine(), session_idle=0.1) as running:
        with live(running) as client:
            plain = client.hello()["session"]
            problem(running.client.get(f"/v1/sessions/{plain}/recording"), 404, "not-found")
        with live(running) as client:
            name = client.hello(record=True)["session"]
            client.say("stop")
            client.rest()
        until(lambda: running.client.get(f"/v1/sessions/{name}/recording").status_code == 404)
        problem(running.client.get("/v1/sessions/nobody/recording"), 404, "not-found")
