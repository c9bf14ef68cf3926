"""Writes the text messages of the server. Their schema is in `service.live.messages`."""

from __future__ import annotations

import base64
import json
from typing import Any

import numpy as np

from service.problems import Problem
from synth.encode.formats import Block


def applied(seq: int, frame: int) -> str:
    """Return `applied`: update `seq` takes effect at `frame`. Formatted by hand, because most blocks have one."""
    return f'{{"type":"applied","seq":{seq},"frame":{frame}}}'


def scene(frame: int, fields: dict[str, Any]) -> str:
    """Return `scene`: the cross-fade to the changed scene begins at `frame`."""
    return _text({"type": "scene", "frame": frame, **fields})


def limited(frame: int, gain_reduction_db: float) -> str:
    """Return `limited`: the largest reduction, in the block at `frame`."""
    return _text({"type": "limited", "frame": frame, "gain_reduction_db": round(gain_reduction_db, 3)})


def before_limiter(frame: int, block: Block) -> str:
    """Return `before_limiter`: the sound from `frame` on, before the limiter. A sample that is not finite becomes 0."""
    samples = base64.b64encode(np.where(np.isfinite(block), block, 0.0).astype("<f4").tobytes()).decode("ascii")
    return f'{{"type":"before_limiter","frame":{frame},"samples":"{samples}"}}'


def skipped(frame: int, seconds: float) -> str:
    """Return `skipped`: the service sent nothing for `seconds` before the block at `frame`."""
    return _text({"type": "skipped", "frame": frame, "seconds": round(seconds, 6)})


def problem(found: Problem, root_path: str) -> str:
    """Return `problem`: the problem document, with its `type` under the name `problem`."""
    document = found.document(root_path)
    return _text({"type": "problem", "problem": document.pop("type"), **document})


def end(reason: str, frame: int) -> str:
    """Return `end`: no sound follows. frame: the one after the last."""
    return _text({"type": "end", "reason": reason, "frame": frame})


def ready(fields: dict[str, Any]) -> str:
    """Return `ready`, the answer to `hello`."""
    return _text({"type": "ready", **fields})


def _text(message: dict[str, Any]) -> str:
    return json.dumps(message, separators=(",", ":"), allow_nan=False)
