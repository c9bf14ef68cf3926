"""The exceptions of the Python client.

RidgewaveError (synth.errors)
├── InvalidRequest         an argument is invalid; nothing was sent: `faults`
└── ClientError
    ├── ProblemError       the service answered with a problem document: `problem`, `retry_after`
    │   ├── RefusedError   4xx: the request is at fault; `faults` lists each field
    │   └── ServiceError   5xx: full, shutting down, unable to answer, or a bug of the service
    ├── ConnectionLost     nothing answers, or the connection broke and could not be restored
    ├── ResumeLost         the connection was restored, but the service no longer has the session or its past sound
    ├── ProtocolError      the answer is not from this service, or not from this version
    └── StreamEnded        a stream is over: `reason`, `frame`, `problem`, and the unread frames, `rest`
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from synth.errors import Fault, RidgewaveError


@dataclass(frozen=True, slots=True)
class Problem:
    """A problem document (RFC 9457) of the service; docs/problems.md lists the kinds."""

    type: str
    title: str
    status: int
    detail: str
    faults: tuple[Fault, ...] = ()
    instance: str | None = None

    @property
    def kind(self) -> str:
        """The name of the problem, such as "scene-refused": the last part of its type."""
        return self.type.rpartition("#problem-")[2]

    @classmethod
    def read(cls, document: Mapping[str, Any]) -> Problem:
        """Return the problem in a JSON object; missing fields are empty."""
        found = document.get("errors")
        entries = [entry for entry in found if isinstance(entry, Mapping)] if isinstance(found, list) else []
        names = ("pointer", "value", "allowed", "hint")
        status = document.get("status")
        instance = document.get("instance")
        return cls(
            str(document.get("type", "about:blank")),
            str(document.get("title", "")),
            status if isinstance(status, int) else 0,
            str(document.get("detail", "")),
            tuple(Fault(*(str(entry.get(name, "")) for name in names)) for entry in entries),
            None if instance is None else str(instance),
        )

    def sentence(self) -> str:
        """Return the problem as text: all faults, or the detail if there are none."""
        text = "\n".join(fault.sentence() for fault in self.faults) or self.detail or self.title
        return f"{text} ({self.instance})" if self.instance else text


def read_problem(body: bytes | bytearray, status: int, reason: str = "") -> Problem:
    """Return the problem in the body of an answer; for other bodies, a problem that names the status only."""
    try:
        document = json.loads(body)
    except (ValueError, RecursionError):
        document = None
    if isinstance(document, dict) and "title" in document:
        return Problem.read({"status": status, **document})
    text = f"{status} {reason}".strip()
    return Problem("about:blank", reason or text, status, f"The service answered {text}.")


class ClientError(RidgewaveError):
    """Base of the exceptions after a request was made."""


class ProblemError(ClientError):
    """The service answered with `problem`. retry_after: seconds after which to try again, or None."""

    def __init__(self, problem: Problem, retry_after: float | None = None) -> None:
        self.problem = problem
        self.retry_after = retry_after
        super().__init__(problem.sentence())

    @property
    def faults(self) -> tuple[Fault, ...]:
        """The faults of the request, one per field."""
        return self.problem.faults


class RefusedError(ProblemError):
    """The request is at fault."""


class ServiceError(ProblemError):
    """The request is valid, but the service cannot carry it out."""


class ConnectionLost(ClientError):
    """Nothing answers, or the connection broke and could not be restored."""


class ResumeLost(ClientError):
    """The service no longer has the live session, or its sound from the requested frame on."""


class ProtocolError(ClientError):
    """The answer is not from this service, or not from this version."""


class StreamEnded(ClientError):
    """A stream is over.

    reason: the reason that the service gave, such as "stopped", "finished", "shutting down", "slow reader".
    frame: the number of the frame after the last one.
    problem: the problem that ended the stream, or None.
    rest: the unread frames before the end, float32 [fewer than requested, channels].
    """

    def __init__(
        self, reason: str, frame: int, problem: Problem | None = None, rest: npt.NDArray[np.float32] | None = None
    ) -> None:
        self.reason, self.frame, self.problem = reason, frame, problem
        self.rest = np.zeros((0, 1), np.float32) if rest is None else rest
        detail = f": {problem.sentence()}" if problem else ""
        super().__init__(f"the stream ended at frame {frame} ({reason}){detail}")


def problem_error(problem: Problem, retry_after: float | None = None) -> ProblemError:
    """Return the exception for `problem`, which depends on its status."""
    kind = ServiceError if problem.status >= 500 else RefusedError
    return kind(problem, retry_after)


def retry_seconds(value: str | None) -> float | None:
    """Return the seconds of a Retry-After header; None without one, or for a date."""
    return float(value) if value is not None and value.strip().isdigit() else None
