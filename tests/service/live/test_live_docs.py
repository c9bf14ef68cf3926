"""docs/live.md agrees with the service: the conversation, and the tables of messages and codes."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

from service.live.actions import CODES
from service.live.contact_update import CREDIT, CREDIT_SIZES, LAYOUT, PLACE_LAYOUT
from service.live.messages import V2, VERSIONS
from tests.readme_blocks import code_blocks
from tests.service.harness import kept_engine, serving
from tests.service.live.client import LiveClient, live

PAGE = (Path(__file__).resolve().parents[3] / "docs" / "live.md").read_text(encoding="utf-8")
(TRANSCRIPT,) = (block.text.splitlines() for block in code_blocks(PAGE) if block.mark == "transcript")


def normalised(message: dict[str, Any]) -> dict[str, Any]:
    """Return `message` without what differs between runs or machines: ids, floats, the plan."""
    kept = {name: value for name, value in message.items() if name not in ("session", "resume_url", "plan")}
    if message["type"] == "end":
        kept["frame"] = "checked apart"
    return {name: shape(value) for name, value in kept.items()}


def shape(value: Any) -> Any:
    if isinstance(value, list):
        return [shape(item) for item in value]
    return "a float" if isinstance(value, float) else value


def hear(client: LiveClient, said: str) -> None:
    """Check that the service sends what the page says."""
    if said.startswith("close"):
        _, code, reason = said.split()
        assert client.next() is None
        assert (client.code, client.reason) == (int(code), reason)
        return
    message = client.next()
    if said.startswith("binary"):
        assert isinstance(message, bytes) and len(message) == int(said.split()[1]), said
        return
    while isinstance(message, bytes) and '"end"' in said:
        message = client.next()  # a fade may be longer by the limiter's look-ahead
    assert isinstance(message, dict), said
    assert normalised(message) == normalised(json.loads(said))
    assert set(message) == set(json.loads(said))
    if message["type"] == "end":
        assert message["frame"] == client.sound // 4


def test_the_conversation_of_the_page_is_had_with_the_service() -> None:
    with serving(kept_engine()) as running, live(running) as client:
        for line in TRANSCRIPT:
            who, _, said = line.partition(" ")
            if who == "S":
                hear(client, said)
            elif said.startswith("{"):
                client.socket.send(said)
            else:
                client.socket.send(bytes.fromhex(said))


def test_the_hexadecimal_examples_say_what_the_page_says_of_them() -> None:
    example, credit, place = (block.text for block in code_blocks(PAGE) if re.match(r"[0-9a-f]{2} ", block.text))
    assert credit.strip() == f"{example.strip()} {CREDIT.pack(480).hex(' ')}"
    assert LAYOUT.unpack(bytes.fromhex(example)) == (1, 1, 0, 1, 12.5, 0.08, 0.5)
    assert PLACE_LAYOUT.unpack(bytes.fromhex(place)) == (2, 0, 0, 5, 12.5, 0.02, 0.0075, 0.5, 0.25)
    assert f"C {example.strip()}" in TRANSCRIPT
    offsets = [int(row) for row in re.findall(r"^\| (\d+) \| [uf]\d", PAGE, re.M)]
    assert offsets == [0, 1, 2, 4, 8, 16, 24, 0, 1, 2, 4, 8, 16, 24, 32, 36]
    assert (LAYOUT.size, PLACE_LAYOUT.size, *CREDIT_SIZES) == (28, 40, 32, 44)


def test_every_message_field_and_code_is_on_the_page() -> None:
    assert all(f"`{version.name}`" in PAGE for version in VERSIONS)
    for table in (V2.client, V2.server):
        for kind, made in table.items():
            assert f"`{kind}`" in PAGE or f"### {kind}" in PAGE
            for name in made["properties"]:
                assert f"`{name}`" in PAGE, f"{kind}.{name}"
    for reason, code in CODES.items():
        assert re.search(rf"^\| {code} \|.*`{reason}`", PAGE, re.M), reason
