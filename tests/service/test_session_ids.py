"""Ids of sessions: the node, the random bits, and the problem for an unknown id."""

from __future__ import annotations

import base64

import pytest

from service.operations.settings_environment import SettingsError
from service.sessions.session_ids import LONGEST_ID, new_id, not_found, resume_url
from tests.service.harness import problem, serving, settings_of
from tests.service.live.client import live
from tests.service.plain_engine import PlainEngine

LONGEST_NODE = "Node_" + 27 * "-"


@pytest.mark.parametrize("node", ["", "a", "node-1", LONGEST_NODE])
def test_an_id_is_the_node_and_128_random_bits(node: str) -> None:
    name, other = new_id(node), new_id(node)
    before, dot, random = name.rpartition(".")
    assert (before, bool(dot)) == (node, bool(node))
    assert len(base64.urlsafe_b64decode(random + "==")) == 16
    assert name != other and len(name) <= LONGEST_ID


@pytest.mark.parametrize("node", ["a.b", "a/b", "a b", "ä", LONGEST_NODE + "-"])
def test_a_node_that_could_not_be_told_from_the_rest_is_refused(node: str) -> None:
    with pytest.raises(SettingsError, match="RIDGEWAVE_NODE"):
        settings_of(node=node)


def test_where_to_resume_is_said_by_url() -> None:
    assert resume_url("a.x-_1") == "/v1/live?session=a.x-_1"


@pytest.mark.parametrize(
    ("session", "settings", "said"),
    [
        ("b.x", {"node": "a"}, "The id is of the node b, and this is the node a"),
        ("b.x", {}, "this is a service without RIDGEWAVE_NODE"),
        ("b.x", {"workers": 2, "node": "b"}, "2 workers, and another of them may have it"),
        ("x", {"workers": 2}, "2 workers"),
    ],
)
def test_what_is_not_here_is_said_to_be_elsewhere_where_it_may_be(
    session: str, settings: dict[str, object], said: str
) -> None:
    assert said in not_found(session, "None.", settings_of(**settings)).detail


@pytest.mark.parametrize("session", ["x", "a.x", "<b>.x", "a b.x", ".x", 99 * "n" + ".x"])
def test_nothing_else_is_said_of_other_ids(session: str) -> None:
    assert not_found(session, "None.", settings_of(node="a")).detail == "None."


def test_sessions_of_both_kinds_carry_their_node() -> None:
    with serving(PlainEngine(), node="lab-1") as running, serving(PlainEngine(), node="lab-2") as other:
        document = running.client.post("/v1/sessions", json={}).json()
        assert document["id"].startswith("lab-1.") and document["stream"] == f"/v1/sessions/{document['id']}/stream"
        assert running.client.get(document["stream"] + "?duration=0.01").status_code == 200
        with live(running) as client:
            ready = client.hello()
            assert ready["session"].startswith("lab-1.")
            assert ready["resume_url"] == resume_url(ready["session"])
        told = problem(other.client.get(f"/v1/sessions/{document['id']}"), 404, "not-found")["detail"]
        assert "of the node lab-1, and this is the node lab-2" in told


def test_one_worker_of_several_says_that_another_may_have_a_recording() -> None:
    with serving(PlainEngine(), workers=2) as running:
        told = problem(running.client.get(f"/v1/sessions/{new_id('')}/recording"), 404, "not-found")["detail"]
        assert "another of them may have it" in told
