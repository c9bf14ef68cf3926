"""Ids of sessions: their form, and the problem for an unknown id.

Model: an id is `NODE.RANDOM`, or `RANDOM` if RIDGEWAVE_NODE is not set. RANDOM is 128 random bits in base64url. Neither
    part has a dot, so a proxy can read the node: in a path after /v1/sessions/, and in the query of /v1/live.
Limits: several workers on one port are one node, and only one of them has a given live session.
"""

from __future__ import annotations

import re
import secrets
from urllib.parse import quote

from service.operations.settings import NODE_NAME, Settings
from service.problems import Problem

RANDOM_BYTES = 16
LONGEST_ID = 64  # characters; a node, the dot and the random part (22) are at most 55


def new_id(node: str) -> str:
    """Return a new id on `node`, which may be empty."""
    random = secrets.token_urlsafe(RANDOM_BYTES)
    return f"{node}.{random}" if node else random


def resume_url(session: str) -> str:
    """Return the path and query at which a client resumes `session`, without a prefix of a proxy."""
    return f"/v1/live?session={quote(session, safe='')}"


def not_found(session: str, sentence: str, settings: Settings) -> Problem:
    """Return the problem of an unknown id: `sentence`, and where else the session may be."""
    node, dot, _ = session.partition(".")
    if dot and re.fullmatch(NODE_NAME, node) and node != settings.node:
        here = f"the node {settings.node}" if settings.node else "a service without RIDGEWAVE_NODE"
        sentence += f" The id is of the node {node}, and this is {here}. The proxy in front must route by it."
    elif settings.workers > 1:
        sentence += f" This service has {settings.workers} workers, and another of them may have it: connect again."
    return Problem("not-found", sentence)
