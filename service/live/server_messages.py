"""The text messages of the server, as they go over the wire; `service.live.messages` holds their schema."""

from __future__ import annotations

import json
from typing import Any

from service.problems import Problem


def applied(seq: int, frame: int) -> str:
    """Return that update `seq` is felt from `frame` on; one goes out with nearly every block, so it is not dumped."""
    return f'{{"type":"applied","seq":{seq},"frame":{frame}}}'


def scene(frame: int, plan: dict[str, Any]) -> str:
    """Return that the cross-fade to the changed scene begins at `frame`."""
    return _text({"type": "scene", "frame": frame, "plan": plan})


def limited(frame: int, gain_reduction_db: float) -> str:
    """Return that the limiter turned down by so much at most, in the block at `frame`."""
    return _text({"type": "limited", "frame": frame, "gain_reduction_db": round(gain_reduction_db, 3)})


def skipped(frame: int, seconds: float) -> str:
    """Return that the service was late: for so long nothing came before the block at `frame`."""
    return _text({"type": "skipped", "frame": frame, "seconds": round(seconds, 6)})


def problem(found: Problem) -> str:
    """Return the problem document, its `type` under the name `problem`, since `type` is the message's own."""
    document = found.document()
    return _text({"type": "problem", "problem": document.pop("type"), **document})


def end(reason: str, frame: int) -> str:
    """Return that no sound follows; `frame` is the one after the last."""
    return _text({"type": "end", "reason": reason, "frame": frame})


def ready(fields: dict[str, Any]) -> str:
    """Return the answer to hello."""
    return _text({"type": "ready", **fields})


def _text(message: dict[str, Any]) -> str:
    return json.dumps(message, separators=(",", ":"), allow_nan=False)
