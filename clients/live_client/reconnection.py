"""What the end of a live connection means, and when to connect again.

    broken (reset, half-open, 1006, 1011, 1012, HTTP 500, 502, 504)    connect again, after a `Backoff`
    full (1013, HTTP 503)                                              connect again, after Retry-After or RETRY_AFTER
    anything else (1000, 1001, 1007 to 1010, 4408, other HTTP)         do not: the answer would be the same

The bound of the delay doubles from one try to the next. Each delay is drawn at random below it (full jitter, Brooker
2015), so that the clients of a restarted service do not all connect at once.
"""

from __future__ import annotations

import random
from collections.abc import Callable
from dataclasses import dataclass, field

from clients.client_errors import ClientError, ConnectionLost, Problem, ServiceError, problem_error
from synth.errors import Fault, InvalidRequest, shown

BROKEN_CODES = frozenset({1005, 1006, 1011, 1012})  # no code, no close frame (or no pong), internal error, restart
BROKEN_STATUS = frozenset({500, 502, 504})  # from a service or a proxy that may recover soon
FULL_CODE = 1013
FULL_STATUS = 503
POLICY_CODE = 1008
END_REASONS = {1000: "stopped", 1001: "shutting down", 1008: "policy", 1009: "too large", 4408: "slow reader"}
"""The reason of an end that the service reported by its close code alone."""

FIRST_DELAY = 0.1  # s before the second try, at most; longer extends the silence, shorter burdens a service that starts
LARGEST_DELAY = 2.0  # s between tries, at most; longer wastes time while the service still keeps the session
MOST_DOUBLED = 60  # times; far more than any delay, and within a float: 1024 tries take 17 minutes
PATIENCE = 10.0  # s from the break to the last try: the default of RIDGEWAVE_RESUME; later there is nothing to resume
RETRY_AFTER = 1.0  # s before a full service that sends no Retry-After is tried again; unverified default


@dataclass(frozen=True, slots=True)
class Closure:
    """How a connection ended.

    code: the close code; None without a close frame.
    reason: text from the peer or from the operating system.
    status: the HTTP status of a refused upgrade.
    problem, retry_after: what a refused upgrade contained.
    """

    code: int | None = None
    reason: str = ""
    status: int | None = None
    problem: Problem | None = None
    retry_after: float | None = None

    @property
    def full(self) -> bool:
        """Whether the service was full."""
        return self.code == FULL_CODE or self.status == FULL_STATUS

    @property
    def broken(self) -> bool:
        """Whether the connection broke; not if a peer closed or refused it."""
        if self.status is not None:
            return self.status in BROKEN_STATUS
        return self.code is None or self.code in BROKEN_CODES

    @property
    def worth_another_try(self) -> bool:
        """Whether the same request may succeed soon."""
        return self.broken or self.full

    @property
    def end_reason(self) -> str:
        """The reason for which the service ended the stream."""
        return END_REASONS.get(self.code or 0, self.reason)

    def tells_session_is_gone(self, last: Problem | None) -> bool:
        """Return whether the service refused to resume because the session, or its past sound, is gone.

        last: the last problem that the service reported on the connection, if any.
        """
        problem = last or self.problem
        return self.code == POLICY_CODE and problem is not None and problem.kind == "not-found"

    def error(self, problem: Problem | None = None) -> ClientError:
        """Return the exception for this end. problem: the last problem that the service reported, if any."""
        reported = self.problem or problem
        if reported is not None:
            return problem_error(reported, self.retry_after)
        if self.full:
            return ServiceError(Problem("about:blank", "Full", FULL_STATUS, "The service is full."), self.retry_after)
        words = self.reason or "no reason given"
        if self.status is not None:
            return ConnectionLost(f"the service refused the connection: HTTP {self.status} ({words})")
        if self.code is not None:
            return ConnectionLost(f"the service closed the connection: {self.code} ({words})")
        return ConnectionLost(f"the connection broke: {words}")


class Closed(Exception):
    """Raised by a connection that ended or could not be made. `Live` and `AsyncLive` catch it; users never see it."""

    def __init__(self, closure: Closure) -> None:
        self.closure = closure
        super().__init__(closure.reason)


@dataclass
class Backoff:
    """When to connect again: at once, then after growing, random delays.

    first: largest delay before the second try, in seconds; it doubles with each further try.
    largest: bound of all delays, in seconds.
    patience: seconds from the break to the last try.
    uniform: returns a random number in [low, high).

    Raises InvalidRequest for a delay or a patience that is no time.
    """

    first: float = FIRST_DELAY
    largest: float = LARGEST_DELAY
    patience: float = PATIENCE
    uniform: Callable[[float, float], float] = random.uniform
    _since: float | None = field(default=None, init=False)
    _tries: int = field(default=0, init=False)

    def __post_init__(self) -> None:
        given = {"first": self.first, "largest": self.largest, "patience": self.patience}
        faults = [
            Fault(f"/{name}", shown(value), "0 s or more", "Write a number of seconds.")
            for name, value in given.items()
            if not (hasattr(value, "__float__") and value >= 0.0)
        ]
        if faults:
            raise InvalidRequest(faults)

    def delay(self, now: float, at_least: float = 0.0) -> float | None:
        """Return the seconds to wait before the next try; None if the try would be too late. now: monotonic seconds."""
        if self._since is None:
            self._since = now
        doubled = min(self._tries - 1, MOST_DOUBLED)
        bound = 0.0 if self._tries == 0 else min(self.largest, self.first * 2**doubled)
        wait = at_least + self.uniform(0.0, bound)
        self._tries += 1
        return wait if now + wait - self._since <= self.patience else None

    def settle(self) -> None:
        """Forget the break, because sound was received after it."""
        self._since, self._tries = None, 0
