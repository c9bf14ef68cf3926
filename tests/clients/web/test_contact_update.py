"""A contact update has the bytes that docs/live.md specifies."""

from __future__ import annotations

import math
import random
import struct
from typing import TYPE_CHECKING, Any

import pytest

from tests.clients.web.browser import watched
from tests.clients.web.conftest import MODULES, modules_loaded
from tests.clients.web.page_service import serving_pages
from tests.service.plain_engine import PlainEngine

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

PACK = "(contacts) => contacts.map((contact) => [...new Uint8Array(modules.packContact(contact))])"
CREDIT = struct.pack("<I", 480)
REFUSED = """(contact) => {
  try {
    modules.packContact(contact);
  } catch (error) {
    return error.message;
  }
}"""


def expected(contact: dict[str, Any]) -> bytes:
    """Return the bytes that docs/live.md asks for."""
    credit = contact.get("more", 0)
    return without_credit(contact) + (struct.pack("<I", credit) if credit else b"")


def without_credit(contact: dict[str, Any]) -> bytes:
    if "x" in contact:
        turn, load = contact.get("direction"), contact.get("load")
        flags = 2 * (load is None) | 4 * (turn is None)
        place = contact["x"], contact["y"], turn or 0.0, load or 0.0
        return struct.pack("<BBHIdddff", 2, flags, 0, contact["seq"], contact["time"], *place)
    is_speed, load = "speed" in contact, contact.get("load")
    value = contact["speed" if is_speed else "position"]
    flags = is_speed | 2 * (load is None)
    return struct.pack("<BBHIddf", 1, flags, 0, contact["seq"], contact["time"], value, load or 0.0)


def contacts() -> list[dict[str, Any]]:
    """Return many contacts: the ends of each range, and what lies between."""
    chance = random.Random(1)
    made: list[dict[str, Any]] = [{"seq": 1, "time": 12.5, "speed": 0.08, "load": 0.5}]
    for seq in (0, 1, 2**16, 2**31, 2**32 - 1):
        made += [{"seq": seq, "time": -1e-9, "position": place, "load": 1e3} for place in (-1e3, 0.0, 1e3)]
    for _ in range(500):
        value = math.ldexp(chance.uniform(-1, 1), chance.randint(-40, 3))
        contact = {"seq": chance.randrange(2**32), "time": chance.uniform(0, 1e6)}
        across, turn = chance.uniform(-1e3, 1e3), chance.choice([{}, {"direction": chance.uniform(-1e3, 1e3)}])
        contact |= chance.choice([{"position": value}, {"speed": value}, {"x": value, "y": across} | turn])
        contact |= chance.choice([{}, {"more": 480}, {"more": 0}, {"more": 10_000_000}])
        made.append(contact | chance.choice([{}, {"load": chance.uniform(-1, 1e3)}, {"load": 0}]))
    return made


def test_the_bytes_are_those_of_the_document(functions: Page) -> None:
    made = contacts()
    packed = [bytes(one) for one in functions.evaluate(PACK, made)]
    assert packed == [expected(contact) for contact in made]
    document = "01 01 00 00 01 00 00 00 00 00 00 00 00 00 29 40 7b 14 ae 47 e1 7a b4 3f 00 00 00 3f"
    assert packed[0] == bytes.fromhex(document)
    place = {"seq": 5, "time": 12.5, "x": 0.02, "y": 0.0075, "direction": 0.5, "load": 0.25}
    document = (
        "02 00 00 00 05 00 00 00 00 00 00 00 00 00 29 40 7b 14 ae 47 e1 7a 94 3f b8 1e 85 eb 51 b8 7e 3f "
        "00 00 00 3f 00 00 80 3e"
    )
    assert bytes(functions.evaluate(PACK, [place])[0]) == bytes.fromhex(document)


@pytest.mark.parametrize(
    "given",
    [
        {},
        {"position": 0, "speed": 0},
        {"x": 0},
        {"y": 0},
        {"x": 0, "y": 0, "position": 0},
        {"x": 0, "y": 0, "speed": 0},
        {"position": 0, "y": 0},
        {"position": 0, "direction": 0},
    ],
)
def test_a_contact_is_a_position_a_speed_or_a_place(functions: Page, given: dict[str, Any]) -> None:
    assert "exactly one" in functions.evaluate(REFUSED, {"seq": 0, "time": 0, **given})


PRETENDED = """
  const sockets = [];
  const open = () => {
    const socket = {readyState: WebSocket.OPEN, sent: [], send: (message) => socket.sent.push(message), close() {}};
    sockets.push(socket);
    return socket;
  };
  const connection = new modules.LiveConnection({url: "/v1/live", open});
  connection.start();
"""

CONVERSATION = (
    f"async (readies) => {{{PRETENDED}"
    + """  const [socket] = sockets;
  const say = (document) => socket.onmessage({data: JSON.stringify(document)});
  const said = [];
  for (const [index, message] of readies.entries()) {
    say({session: "s", resume_url: "", channels: 1, frame: 0, max_silence_ms: 250, plan: {}, ...message});
    await modules.pause(5);
    socket.sent.length = 0;
    connection.move({x: 0.5, y: 0.25, direction: 1.5, load: 0.5, time: 2});
    said.push(...socket.sent.map((bytes) => [...new Uint8Array(bytes)]));
  }
  connection.stop();
  return said;
}"""
)


def test_a_place_is_sent_where_the_texture_is_over_an_area_and_else_its_position(functions: Page) -> None:
    """Of version 1, then of version 2: a line, an area, and an area that a change of scene makes a line."""
    messages = [
        {"type": "ready"},
        {"type": "ready", "over_area": False},
        {"type": "ready", "over_area": True},
        {"type": "scene", "over_area": False},
        {"type": "scene", "over_area": True},
    ]
    said = [bytes(one) for one in functions.evaluate(CONVERSATION, messages)]
    line = [struct.pack("<BBHIddf", 1, 0, 0, seq, 2.0, -0.5, 0.5) for seq in range(5)]
    area = [struct.pack("<BBHIdddff", 2, 0, 0, seq, 2.0, 0.5, 0.25, 1.5, 0.5) for seq in range(5)]
    assert said == [line[0], line[1], area[2], line[3], area[4]]


WITHOUT_LOAD = (
    f"async ({{ready, places, wait}}) => {{{PRETENDED}"
    + """  const [first] = sockets;
  first.onmessage({data: JSON.stringify(ready)});
  for (const place of places) connection.move({time: 2, ...place});
  connection.grant(480);
  first.onclose({code: 1006});
  while (sockets.length < 2) await modules.pause(10);
  await modules.pause(wait);
  const [, second] = sockets;
  second.onmessage({data: JSON.stringify(ready)});
  connection.move({time: 2, x: 0.75, y: 0.5});
  connection.grant(480);
  connection.stop();
  const updates = ({sent}) => sent.filter((message) => message instanceof ArrayBuffer);
  return sockets.map((socket) => updates(socket).map((bytes) => [...new Uint8Array(bytes)]));
}"""
)


def test_a_place_without_load_and_direction_is_sent_with_the_last_ones(functions: Page) -> None:
    """The service may miss those of a place that is replaced, or of one before a break."""
    ready = {
        "type": "ready",
        "session": "s",
        "resume_url": "",
        "channels": 1,
        "frame": 0,
        "plan": {},
        "over_area": True,
    }
    places = [{"x": 0.5, "y": 0.25, "direction": 1.5, "load": 0.5}, {"x": 0.25, "y": 0.25}, {"x": 0.125, "y": 0.25}]
    found = functions.evaluate(WITHOUT_LOAD, {"ready": ready, "places": places, "wait": 50})
    before, after = ([struct.unpack("<BBHIdddff", bytes(one)[:40])[3:] for one in updates] for updates in found)
    assert [[bytes(one)[40:] for one in updates] for updates in found] == [[b"", CREDIT], [b""]]
    assert before == [(0, 2.0, 0.5, 0.25, 1.5, 0.5), (2, 2.0, 0.125, 0.25, 1.5, 0.5)]
    assert after == [(3, 2.0, 0.75, 0.5, 1.5, 0.5)]


STROKE = """async (scene) => {
  const player = await modules.Player.open({sampleRate: 48000});
  const finger = new modules.Finger({player, scene});
  const ready = await finger.open();
  finger.move({x: 0.5, y: 0.25, direction: 1.5, load: 0.5});
  await modules.once(finger, "applied");
  await finger.close();
  await player.close();
  return ready.protocol;
}"""


@pytest.mark.parametrize(("kind", "found"), [("dots", (-0.5, None, 0.5, -0.25, 1.5)), ("sinusoid", (-0.5, None, 0.5))])
def test_a_finger_of_the_page_reaches_the_hand_of_the_service(
    chromium: Browser, kind: str, found: tuple[float | None, ...]
) -> None:
    engine = PlainEngine()
    with serving_pages(engine) as running, watched(chromium, running.url + MODULES) as (page, _):
        modules_loaded(page)
        assert page.evaluate(STROKE, {"texture": {"kind": kind}}) == "ridgewave.v2"
    update = engine.hands[-1].applied.updates[0][1]
    assert update[2:] == (*found, None, None)[:5]


def test_a_place_of_zero_is_a_position_of_zero_without_a_sign(functions: Page) -> None:
    packed = functions.evaluate(
        "() => [...new Uint8Array(modules.packContact(modules.alongLine({seq: 0, time: 0, x: 0, y: 0})))]"
    )
    assert bytes(packed)[16:24] == bytes(8)
