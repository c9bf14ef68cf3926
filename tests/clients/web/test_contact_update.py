"""A contact update has the bytes that docs/live.md specifies."""

from __future__ import annotations

import math
import random
import struct
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from playwright.sync_api import Page

PACK = "(contacts) => contacts.map((contact) => [...new Uint8Array(modules.packContact(contact))])"
REFUSED = """(contact) => {
  try {
    modules.packContact(contact);
  } catch (error) {
    return error.message;
  }
}"""


def expected(contact: dict[str, Any]) -> bytes:
    """Return the bytes that docs/live.md asks for."""
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
        contact |= {chance.choice(["position", "speed"]): value}
        made.append(contact | chance.choice([{}, {"load": chance.uniform(-1, 1e3)}, {"load": 0}]))
    return made


def test_the_bytes_are_those_of_the_document(modules: Page) -> None:
    made = contacts()
    packed = [bytes(one) for one in modules.evaluate(PACK, made)]
    assert packed == [expected(contact) for contact in made]
    document = "01 01 00 00 01 00 00 00 00 00 00 00 00 00 29 40 7b 14 ae 47 e1 7a b4 3f 00 00 00 3f"
    assert packed[0] == bytes.fromhex(document)


@pytest.mark.parametrize("contact", [{"seq": 0, "time": 0}, {"seq": 0, "time": 0, "position": 0, "speed": 0}])
def test_a_contact_is_a_position_or_a_speed(modules: Page, contact: dict[str, Any]) -> None:
    assert "exactly one" in modules.evaluate(REFUSED, contact)
