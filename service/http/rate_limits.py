"""How much one caller may ask for: streams at a time, and requests a second, by key and by address.

Model: a token bucket for each caller's requests, and a count of the streams it has under way (HTTP, live, plays). A
    caller is a key, and an address: both are counted, and the tighter bound holds. All of loopback is one address, an
    IPv6 address counts with its /64, and behind a proxy that RIDGEWAVE_TRUSTED_PROXIES names it is the rightmost entry
    of X-Forwarded-For that is none of them.
    Own code: the library `limits` has windows but no token bucket, and does not count what is under way.
Limits: each worker counts by itself, so a service of N workers lets N times as much pass. At most `CALLERS` buckets
    are remembered; the one unused for longest is forgotten, which gives that caller a full one.
"""

from __future__ import annotations

import ipaddress
import math
import threading
import time
from collections import Counter, OrderedDict
from collections.abc import Callable

from starlette.types import ASGIApp, Receive, Scope, Send

from service.http.connection_limit import room_of
from service.operations.settings import Settings
from service.problems import Problem

CALLERS = 10_000  # buckets remembered, 2 MB; fewer forget a busy caller sooner in a flood from many addresses
UNLIMITED_PATHS = frozenset({"/v1/stop", "/healthz", "/readyz"})  # a stop is never refused for its rate
ROUNDING = 1e-9  # of a token: who comes back exactly when it was told to must not be refused by the last digit
KEY = "ridgewave.key"  # in a scope: the number of the key that the request carried, as KeyCheck found it

Address = ipaddress.IPv4Address | ipaddress.IPv6Address


class TokenBucket:
    """Takes `rate` a second on average, and `burst` at once. Of one thread."""

    __slots__ = ("_burst", "_filled", "_now", "_rate", "_tokens")

    def __init__(self, rate: float, burst: float, now: Callable[[], float] = time.monotonic) -> None:
        self._rate, self._burst, self._now = rate, burst, now
        self._tokens, self._filled = burst, now()

    def take(self, tokens: float = 1.0) -> float:
        """Return 0 where `tokens` were there, and are now taken; else the seconds until they will be there."""
        now = self._now()
        self._tokens = min(self._burst, self._tokens + (now - self._filled) * self._rate)
        self._filled = now
        if self._tokens >= tokens - ROUNDING:
            self._tokens -= tokens
            return 0.0
        return (tokens - self._tokens) / self._rate


class Ticket:
    """The place of one stream; `release` gives it back, once, from any thread."""

    def __init__(self, give_back: Callable[[], None]) -> None:
        self._give_back: Callable[[], None] | None = give_back
        self._lock = threading.Lock()

    def release(self) -> None:
        """Give the place back; again is the same as once."""
        with self._lock:
            give_back, self._give_back = self._give_back, None
        if give_back is not None:
            give_back()


class Limits:
    """The limits of one process."""

    def __init__(self, settings: Settings, now: Callable[[], float] = time.monotonic) -> None:
        self._settings = settings
        self._now = now
        self._trusted = tuple(ipaddress.ip_network(entry) for entry in settings.trusted_proxies)
        self._buckets: OrderedDict[str, TokenBucket] = OrderedDict()
        self._streams: Counter[str] = Counter()
        self._lock = threading.Lock()

    def admit(self, scope: Scope) -> Ticket:
        """Return the place of one more stream for whoever sent the request or WebSocket `scope`.

        Raises Problem (429, too-many-streams) where its key or its address has as many as one may have.
        """
        bounds = {
            f"address {self.address(scope)}": (self._settings.streams_per_address, "address"),
            f"key {scope.get(KEY)}": (self._settings.streams_per_key if KEY in scope else math.inf, "key"),
        }
        with self._lock:
            for caller, (most, what) in bounds.items():
                if self._streams[caller] >= most:
                    detail = (
                        f"This {what} has {most} streams, and may have no more (RIDGEWAVE_STREAMS_PER_{what.upper()})."
                    )
                    raise Problem("too-many-streams", detail)
            self._streams.update(bounds.keys())
        return Ticket(lambda: self._leave(tuple(bounds)))

    def take_request(self, caller: str) -> None:
        """Count one request of `caller`; raises Problem (429, rate-limited) where it is one too many."""
        bucket = self._buckets.get(caller)
        if bucket is None:
            bucket = TokenBucket(self._settings.requests_per_second, self._settings.request_burst, self._now)
            self._buckets[caller] = bucket
            if len(self._buckets) > CALLERS:
                self._buckets.popitem(last=False)
        self._buckets.move_to_end(caller)
        wait = bucket.take()
        if wait > 0.0:
            detail = (
                f"More than {self._settings.requests_per_second:g} requests a second (RIDGEWAVE_REQUESTS_PER_SECOND)."
            )
            raise Problem("rate-limited", detail, headers={"Retry-After": str(max(1, math.ceil(wait)))})

    def caller(self, scope: Scope) -> str:
        """Return whom the work for `scope` is counted for: its key, or without one its address."""
        return f"key {scope[KEY]}" if KEY in scope else f"address {self.address(scope)}"

    def address(self, scope: Scope) -> str:
        """Return the address that `scope` counts for: loopback, an IPv4 address, an IPv6 network, or unknown."""
        address = _parsed((scope.get("client") or ("", 0))[0])
        if address is not None and self._is_trusted(address):
            values = [value.decode("latin-1") for name, value in scope["headers"] if name == b"x-forwarded-for"]
            for entry in reversed([entry for value in values for entry in value.split(",")]):
                further = _parsed(entry)
                if further is None:
                    break  # what stands further left was not written by a proxy that is trusted
                address = further
                if not self._is_trusted(address):
                    break
        return _counted_as(address)

    def _is_trusted(self, address: Address) -> bool:
        return any(address in network for network in self._trusted)

    def _leave(self, callers: tuple[str, ...]) -> None:
        with self._lock:
            self._streams.subtract(callers)
            for caller in callers:
                if self._streams[caller] <= 0:
                    del self._streams[caller]


class RateLimit:
    """A layer that counts requests and WebSockets: by address before the keys are looked at, by key behind that."""

    def __init__(self, app: ASGIApp, limits: Limits, *, by_key: bool) -> None:
        self._app = app
        self._limits = limits
        self._by_key = by_key

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Count one request, then hand it on; raises Problem, which the outermost layer answers."""
        if scope["type"] in ("http", "websocket") and scope["path"] not in UNLIMITED_PATHS:
            if not self._by_key:
                room = room_of(scope)
                if room is not None:
                    room.admit()
                self._limits.take_request(f"address {self._limits.address(scope)}")
            elif KEY in scope:
                self._limits.take_request(f"key {scope[KEY]}")
        await self._app(scope, receive, send)


def _parsed(text: str) -> Address | None:
    """Return the address in `text`, whose port, brackets and zone are left out, an IPv4 one in IPv6 as itself."""
    text = text.strip().strip('"')
    if text.startswith("["):
        text = text[1:].partition("]")[0]
    elif text.count(":") == 1:
        text = text.partition(":")[0]
    try:
        address = ipaddress.ip_address(text.partition("%")[0])
    except ValueError:
        return None
    return getattr(address, "ipv4_mapped", None) or address


def _counted_as(address: Address | None) -> str:
    if address is None:
        return "unknown"
    if address.is_loopback:
        return "loopback"
    return str(address if address.version == 4 else ipaddress.ip_network((address, 64), strict=False))
