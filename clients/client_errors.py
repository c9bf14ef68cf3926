"""What the Python client raises.

RidgewaveError (synth.errors)
├── InvalidRequest             an argument is at fault, found before anything was sent: `faults`
└── ClientError
    ├── ProblemError       the service answered with a problem document: `problem`, `retry_after`
    │   ├── RefusedError   4xx: the request is at fault; `faults` lists each field
    │   └── ServiceError   5xx: full, shutting down, cannot be done there, or the service's own mistake
    ├── ConnectionLost     nothing answers, or the connection broke and could not be made again
    ├── ResumeLost         the connection is back, and the service no longer has the sound to go on from
    ├── ProtocolError      what came is not what the service's documentation promises
    └── StreamEnded        a live stream is over: `reason`, `frame`, `problem`, and the frames that are left, `rest`
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
    """A problem document (RFC 9457) as the service sends it; docs/problems.md lists the kinds."""

    type: str
    title: str
    status: int
    detail: str
    faults: tuple[Fault, ...] = ()
    instance: str | None = None

    @property
    def kind(self) -> str:
        """Return the name of the problem, such as "scene-refused": the last part of its type."""
        return self.type.rpartition("#problem-")[2]

    @classmethod
    def read(cls, document: Mapping[str, Any]) -> Problem:
        """Return the problem that a JSON object holds; fields that it lacks are empty."""
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
        """Return the problem as text for a person: every fault, or what it says as a whole."""
        told = "\n".join(fault.sentence() for fault in self.faults) or self.detail or self.title
        return f"{told} ({self.instance})" if self.instance else told


def read_problem(body: bytes | bytearray, status: int, reason: str = "") -> Problem:
    """Return the problem in the body of an answer; where there is none, one that names the status alone."""
    try:
        document = json.loads(body)
    except ValueError:
        document = None
    if isinstance(document, dict) and "title" in document:
        return Problem.read({"status": status, **document})
    told = f"{status} {reason}".strip()
    return Problem("about:blank", reason or told, status, f"The service answered {told}.")


class ClientError(RidgewaveError):
    """Base of what the client raises once it has asked."""


class ProblemError(ClientError):
    """The service answered with `problem`; `retry_after` is the seconds after which it may be asked again, or None."""

    def __init__(self, problem: Problem, retry_after: float | None = None) -> None:
        self.problem = problem
        self.retry_after = retry_after
        super().__init__(problem.sentence())

    @property
    def faults(self) -> tuple[Fault, ...]:
        """Return what is wrong, a field each."""
        return self.problem.faults


class RefusedError(ProblemError):
    """The request is at fault."""


class ServiceError(ProblemError):
    """The request is sound; the service cannot carry it out, now or at all."""


class ConnectionLost(ClientError):
    """Nothing answers, or the connection broke and could not be made again."""


class ResumeLost(ClientError):
    """The service no longer has the live session, or the sound from the frame on that was asked for."""


class ProtocolError(ClientError):
    """What came is not what the service's documentation promises: another service, or another version."""


class StreamEnded(ClientError):
    """A live stream is over.

    reason: the word of the service's `end`, such as "stopped", "finished", "shutting down", "slow reader".
    frame: the frame after the last. problem: what the service said about it, or None.
    rest: the frames that were asked for and came before the end, float32 [fewer than asked, channels].
    """

    def __init__(
        self, reason: str, frame: int, problem: Problem | None = None, rest: npt.NDArray[np.float32] | None = None
    ) -> None:
        self.reason, self.frame, self.problem = reason, frame, problem
        self.rest = np.zeros((0, 1), np.float32) if rest is None else rest
        told = f": {problem.sentence()}" if problem else ""
        super().__init__(f"the stream ended at frame {frame} ({reason}){told}")


def problem_error(problem: Problem, retry_after: float | None = None) -> ProblemError:
    """Return the exception for `problem`, by its status."""
    kind = ServiceError if problem.status >= 500 else RefusedError
    return kind(problem, retry_after)


def retry_seconds(value: str | None) -> float | None:
    """Return the seconds of a Retry-After header; None where there is none, or a date."""
    return float(value) if value is not None and value.strip().isdigit() else None
