"""Ids of sessions: which node has one, and what is said where an id leads nowhere.

Model: `NODE.RANDOM`, or `RANDOM` where RIDGEWAVE_NODE is not set. RANDOM is 128 random bits in base64url, so a dot
    stands in neither part, and a proxy reads the node off the id: in a path after /v1/sessions/, and in the query of
    /v1/live, where a client that resumes puts it.
Limits: a node is one process. Several workers on one port are one node, of which only one has a live session.
"""

from __future__ import annotations

import re
import secrets
from urllib.parse import quote

from service.operations.settings import NODE_NAME, Settings
from service.problems import Problem

RANDOM_BYTES = 16
LONGEST_ID = 64  # characters; a node, the dot and 22 of the random part are at most 55


def new_id(node: str) -> str:
    """Return a new id that names `node`, "" for none."""
    random = secrets.token_urlsafe(RANDOM_BYTES)
    return f"{node}.{random}" if node else random


def resume_url(session: str) -> str:
    """Return the reference that a client resumes `session` by."""
    return f"/v1/live?session={quote(session, safe='')}"


def not_found(session: str, sentence: str, settings: Settings) -> Problem:
    """Return the problem of an id that leads nowhere here: `sentence`, and where else the session may be."""
    node, dot, _ = session.partition(".")
    if dot and re.fullmatch(NODE_NAME, node) and node != settings.node:
        here = f"the node {settings.node}" if settings.node else "a service without RIDGEWAVE_NODE"
        sentence += f" The id is of the node {node}, and this is {here}: the proxy in front routes by that name."
    elif settings.workers > 1:
        sentence += f" This service has {settings.workers} workers, and another of them may have it: connect again."
    return Problem("not-found", sentence)
