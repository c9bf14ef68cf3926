"""A client of at most 100 lines, written from docs/live.md, gets its sound in lock step: at any rate, and all of it."""

from __future__ import annotations

import socket
from pathlib import Path

import numpy as np
import pytest

from service.live.websocket import LiveProtocol
from synth.scene.scene import parse_scene
from tests.service.harness import serving
from tests.service.live import reference_client
from tests.service.live.reference_client import ReferenceClient, Way
from tests.service.plain_engine import PlainEngine
from tests.service.plain_hand import expected


def test_it_has_at_most_100_lines_and_knows_nothing_of_the_service() -> None:
    text = Path(reference_client.__file__).read_text("utf-8")
    assert len(text.splitlines()) <= 100
    assert "import service" not in text and "from service" not in text and "setsockopt" not in text


@pytest.mark.parametrize("way", ["one message", "two messages", "two writes"])
@pytest.mark.parametrize(("block", "blocks"), [(48, 1500), (480, 300)])
def test_it_gets_every_block_with_the_contact_that_it_sent_for_it(way: Way, block: int, blocks: int) -> None:
    """Blocks of 48 in two messages each are past the rate: 3,000 messages, of which 500 may be read a second."""
    engine = PlainEngine()
    with serving(engine, max_updates=500 if block == 48 and way != "one message" else 2000) as running:
        client = ReferenceClient(running.url, block)
        with client.socket:
            sound = b"".join(client.pull(way, load=0.2 + 0.1 * (seq % 3)) for seq in range(blocks))
    applied = [(told["frame"], told["seq"]) for told in client.messages if told["type"] == "applied"]
    assert applied == [(block * seq, seq + 1) for seq in range(blocks)]
    assert [told for told in client.messages if told["type"] != "applied"] == []
    heard = np.frombuffer(sound, "<f4")
    np.testing.assert_array_equal(heard, expected(parse_scene({}), engine.hands[-1].applied, len(heard)))


def test_past_the_rate_it_was_made_to_wait(monkeypatch: pytest.MonkeyPatch) -> None:
    """The same at 100 messages a second: the socket was not read for some time, so the rate did act."""
    waited: list[float] = []
    act = LiveProtocol._wait_for_turn

    def counted(self: LiveProtocol) -> None:
        waited.append(self._frames.pause)
        act(self)

    monkeypatch.setattr(LiveProtocol, "_wait_for_turn", counted)
    with serving(PlainEngine(), max_updates=100) as running:
        client = ReferenceClient(running.url, 48)
        with client.socket:
            for _ in range(150):
                client.pull("two messages")
    assert client.frames == 150 * 48 and sum(pause > 0.0 for pause in waited) >= 50


def test_its_socket_is_as_it_comes() -> None:
    with serving(PlainEngine()) as running:
        client = ReferenceClient(running.url, 480)
        with client.socket:
            assert client.socket.getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY) == 0
