"""The state machine answers any messages in any order, never raises, and keeps its promises of order."""

from __future__ import annotations

import itertools
import json
import random
import struct
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from service.live import contact_update
from service.live.contact_update import Hand
from service.live.conversation import Phase
from service.live.live_stream import LiveStream
from service.live.messages import V1, V2, VERSIONS, Version
from service.problems import Problem
from tests.service.harness import settings_of
from tests.service.live.driver import Driver, contact, place

SETTINGS = settings_of(max_updates=100_000)
NUMBERS = [
    0,
    1,
    -1,
    16,
    480,
    48_000,
    2**31,
    2**32 - 1,
    2**64,
    10**400,
    0.5,
    -0.0,
    1e-320,
    1e308,
    float("nan"),
    float("inf"),
]
WORDS = ["", "pull", "realtime", "f32le", "s16le", "s0", "hello", "\ud800", "\x00", "a" * 5000, "0.3 N"]
FIELDS = sorted({name for made in V2.client.values() for name in made["properties"]} | {"session", "z"})


def anything(random_: random.Random, depth: int = 0) -> Any:
    """Return some JSON value."""
    kind = random_.randrange(8 if depth < 3 else 5)
    if kind in (0, 1):
        return random_.choice(NUMBERS)
    if kind == 2:
        return random_.choice(WORDS)
    if kind == 3:
        return random_.choice([None, True, False])
    if kind == 4:
        return {}
    if kind == 5:
        return [anything(random_, depth + 1) for _ in range(random_.randrange(4))]
    return {random_.choice(FIELDS): anything(random_, depth + 1) for _ in range(random_.randrange(4))}


def plausible(random_: random.Random) -> dict[str, Any]:
    """Return a message that nearly fits, or does."""
    client = random_.choice(VERSIONS).client
    kind = random_.choice([*client, "contact", "more", "more", *V1.server])
    fields = client.get(kind, client["contact"])["properties"]
    message: dict[str, Any] = {"type": kind}
    for name, made in fields.items():
        if name == "type" or random_.random() < 0.3:
            continue
        if random_.random() < 0.15:
            message[name] = anything(random_)
        elif made.get("type") == "integer":
            message[name] = random_.randrange(made["minimum"], min(made["maximum"], made["minimum"] + 5000) + 1)
        elif made.get("type") == "number":
            message[name] = random_.uniform(-0.1, 2.0)
        elif "enum" in made:
            message[name] = random_.choice(made["enum"])
        elif name == "scene":
            message[name] = random_.choice([{}, {"scan": {"load": 0.1}}, {"scan": {"load": -3}}, anything(random_)])
        elif name == "record":
            message[name] = random_.random() < 0.5
    return message


def mangled(random_: random.Random, text: str) -> str:
    at = random_.randrange(len(text) + 1)
    return text[:at] + random_.choice(["", '"', "{", "\x00", "é", text]) + text[at + random_.randrange(3) :]


def one_step(random_: random.Random, driver: Driver) -> None:
    """Send one message of some kind, or let something else happen."""
    kind = random_.randrange(12)
    if kind < 5:
        driver.text(json.dumps(plausible(random_)))
    elif kind == 5:
        driver.text(json.dumps(anything(random_)))
    elif kind == 6:
        driver.text(mangled(random_, json.dumps(plausible(random_))))
    elif kind == 7:
        driver.binary(random_.randbytes(random_.choice([0, 1, 27, 28, 28, 28, 29, 40, 40, 500])))
    elif kind == 8:
        driver.binary(contact(random_.randrange(2**32), load=random_.uniform(-0.1, 2.0)))
    elif kind == 9:
        x, y, turn = (random_.choice([0.0, 1.0, 999.0]) * random_.uniform(-1.1, 1.1) for _ in range(3))
        driver.binary(place(random_.randrange(2**32), x, y, direction=turn, load=random_.uniform(-0.1, 2.0)))
    elif kind == 10:
        driver.now += random_.expovariate(20.0)
        driver.machine.check(driver.now)
        driver.perform()
    driver.write()


def befall(what: int, driver: Driver) -> None:
    """Cause an event other than a message."""
    if what == 0:
        driver.machine.lost()
    elif what == 1:
        driver.machine.displaced()
    else:
        driver.machine.end("expired")
    driver.perform()


def fuzz(messages: int, seed: int) -> int:
    """Send so many random messages; return the number of connections used."""
    random_ = random.Random(seed)
    connections = 0
    streams: dict[str, LiveStream] = {}
    driver = Driver(SETTINGS, streams)
    for _ in range(messages):
        if driver.closed is not None or driver.detached or len(driver.sent) > 3000:
            in_order(driver)
            if len(streams) > 3:
                streams.clear()
            driver = Driver(SETTINGS, streams, version=random_.choice(VERSIONS))
            connections += 1
        if driver.machine.phase is Phase.HELLO and random_.random() < 0.9:
            options = {"pacing": random_.choice(["pull", "realtime"]), "block": random_.randrange(16, 100)}
            scene = {"output": {"sample_rate": 1000}, "texture": {"kind": random_.choice(["sinusoid", "dots"])}}
            hello = {"type": "hello", "scene": scene, **options}
            if streams and random_.random() < 0.3:
                hello = {"type": "hello", "resume": {"session": "s0", "frame": random_.randrange(2000)}}
            driver.text(json.dumps(hello))
        if random_.random() < 0.002:
            befall(random_.randrange(3), driver)
        one_step(random_, driver)
    return connections


def in_order(driver: Driver) -> None:
    """Check a connection: `ready` comes first and once, `end` last and once, `applied` before its block."""
    order = [kind for kind in driver.order() if kind != "problem"]
    assert order.count("end") <= 1 and order.count("ready") <= 1
    if "pcm" in order:
        assert order[0] == "ready"
    if "end" in order:
        assert order[-1] == "end"
    for kind, after in itertools.pairwise(order):
        if kind == "applied":
            assert after in ("pcm", "scene")


def test_five_thousand_messages_of_any_kind() -> None:
    assert fuzz(5_000, 1) > 50


@pytest.mark.thorough
@pytest.mark.timeout(900)
def test_twenty_five_thousand_messages_of_any_kind() -> None:
    assert fuzz(25_000, 100) > 200


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=20),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.sampled_from(FIELDS), inner, max_size=4),
    max_leaves=10,
)


@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.too_slow], derandomize=True)
@given(
    st.lists(st.one_of(JSON.map(json.dumps), st.text(max_size=40), st.binary(max_size=40)), max_size=12), st.booleans()
)
def test_any_sequence_is_answered(messages: list[str | bytes], greeted: bool) -> None:
    driver = Driver(SETTINGS, version=V2)
    if greeted:
        driver.say("hello", pacing="realtime", scene={"output": {"sample_rate": 1000}})
    for message in messages:
        if isinstance(message, str):
            driver.text(message)
        else:
            driver.binary(message)
        driver.now += 0.01
        driver.write()
    in_order(driver)
    assert all(isinstance(problem["errors"], list) for problem in driver.texts("problem"))


HEADS = st.tuples(st.integers(0, 3), st.integers(0, 8), st.sampled_from([0, 0, 0, 1])).map(
    lambda head: struct.pack("<BBH", *head)
)


@settings(max_examples=500, deadline=None, derandomize=True)
@given(HEADS, st.binary(min_size=36, max_size=36), st.sampled_from(VERSIONS), st.booleans(), st.booleans())
def test_bytes_of_a_contact_are_an_update_in_range_or_refused_by_field(
    head: bytes, rest: bytes, version: Version, short: bool, turns: bool
) -> None:
    """Any bytes behind a likely head, as long as either form."""
    data = (head + rest)[: 28 if short else 40]
    try:
        update = contact_update.from_bytes(data, version, Hand(0.0, over_area=turns, simulated=False))
    except Problem as problem:
        assert all(fault.allowed and fault.hint for fault in problem.faults)
        return
    _, _, position, speed, load, across, direction = update
    assert (position is None) != (speed is None)
    assert all(abs(place) <= 1e3 for place in (position or 0.0, across or 0.0, direction or 0.0))
    assert abs(speed or 0.0) <= 10.0 and 0.0 <= (load or 0.0) <= 1e3
    assert (across is None) == short and (turns or not direction)
