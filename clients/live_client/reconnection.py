"""What the end of a connection means: over, an invalid request, or to be made again, and when.

Model: a `Closure` says how a connection ended, or why it was not made. `worth_another_try` sorts it:

    broken (reset, half-open, 1006, 1011, 1012, HTTP 500, 502, 504)    again, after a `Backoff`
    full (1013, HTTP 503)                                              again, after Retry-After, or RETRY_AFTER
    anything else (1000, 1001, 1007 to 1010, 4408, other HTTP)         not again: it would only be answered the same

Source: delays double from one to the next and are drawn at random below that (full jitter, Brooker 2015), so that
    clients of a service that comes back do not come all at once.
"""

from __future__ import annotations

import random
from collections.abc import Callable
from dataclasses import dataclass, field

from clients.client_errors import ClientError, ConnectionLost, Problem, ServiceError, problem_error

BROKEN_CODES = frozenset({1005, 1006, 1011, 1012})  # no word, no close frame (or no pong), their mistake, restarting
BROKEN_STATUS = frozenset({500, 502, 504})  # answers of a service or a proxy that may be well in a moment
FULL_CODE = 1013
FULL_STATUS = 503
POLICY_CODE = 1008

FIRST_DELAY = 0.1  # s before the second try, at most; longer is a longer silence, shorter hammers a service that starts
LARGEST_DELAY = 2.0  # s between tries, at most; longer wastes the time for which the service keeps a session
PATIENCE = 10.0  # s from the break to giving up: RIDGEWAVE_RESUME's default, beyond which there is nothing to resume
RETRY_AFTER = 1.0  # s before a full service is asked again where it does not say; unverified default


@dataclass(frozen=True, slots=True)
class Closure:
    """How a connection ended.

    code: the close code, None where there was no close frame. status: that of an upgrade that was refused with HTTP.
    reason: words of the peer or of the operating system. problem, retry_after: what came with a refused upgrade.
    """

    code: int | None = None
    reason: str = ""
    status: int | None = None
    problem: Problem | None = None
    retry_after: float | None = None

    @property
    def full(self) -> bool:
        """Return whether there was no room."""
        return self.code == FULL_CODE or self.status == FULL_STATUS

    @property
    def broken(self) -> bool:
        """Return whether the connection broke, as opposed to being closed or refused by somebody."""
        if self.status is not None:
            return self.status in BROKEN_STATUS
        return self.code is None or self.code in BROKEN_CODES

    @property
    def worth_another_try(self) -> bool:
        """Return whether the same request may do better in a moment."""
        return self.broken or self.full

    def error(self, problem: Problem | None = None) -> ClientError:
        """Return the exception for it; `problem` is what the service last said, if it said anything."""
        told = self.problem or problem
        if told is not None:
            return problem_error(told, self.retry_after)
        if self.full:
            return ServiceError(Problem("about:blank", "Full", FULL_STATUS, "The service is full."), self.retry_after)
        words = self.reason or "no reason given"
        if self.status is not None:
            return ConnectionLost(f"the service refused the connection: HTTP {self.status} ({words})")
        if self.code is not None:
            return ConnectionLost(f"the service closed the connection: {self.code} ({words})")
        return ConnectionLost(f"the connection broke: {words}")


class Closed(Exception):
    """Raised by a connection that has ended, or could not be made; shells catch it, people never see it."""

    def __init__(self, closure: Closure) -> None:
        self.closure = closure
        super().__init__(closure.reason)


@dataclass
class Backoff:
    """When to try again: at once, then after growing, jittered delays, until `patience` seconds after the break.

    first, largest, patience: seconds. uniform: gives a number in [low, high); a test gives its own.
    """

    first: float = FIRST_DELAY
    largest: float = LARGEST_DELAY
    patience: float = PATIENCE
    uniform: Callable[[float, float], float] = random.uniform
    _since: float | None = field(default=None, init=False)
    _tries: int = field(default=0, init=False)

    def delay(self, now: float, at_least: float = 0.0) -> float | None:
        """Return the seconds to wait before the next try; None where it would come too late. now: monotonic seconds."""
        if self._since is None:
            self._since = now
        bound = 0.0 if self._tries == 0 else min(self.largest, self.first * 2 ** (self._tries - 1))
        wait = at_least + self.uniform(0.0, bound)
        self._tries += 1
        return wait if now + wait - self._since <= self.patience else None

    def settle(self) -> None:
        """Forget the break: sound has come since."""
        self._since, self._tries = None, 0
