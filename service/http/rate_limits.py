"""Limits the requests per second and the concurrent streams of one caller.

Model: each caller has a token bucket for its requests, and a count of its streams (HTTP, live, plays). A caller is
    counted by its key and by its address; the tighter bound holds. All of loopback is one address. An IPv6 address
    counts with its /64. Behind a proxy of RIDGEWAVE_TRUSTED_PROXIES, the address is the rightmost entry of
    X-Forwarded-For that is not a trusted proxy.
    The library `limits` does not replace this: it has no token bucket, and no count of concurrent streams.
Limits: each worker counts by itself, so N workers let N times as much pass. At most `CALLERS` buckets are kept; a
    caller whose bucket was dropped starts with a full one.
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

CALLERS = 10_000  # buckets, 2 MB; with fewer, a flood from many addresses makes a busy caller's bucket full sooner
PROBES = frozenset({"/healthz", "/readyz"})  # they require no key and are never refused for their rate
STOP = "/v1/stop"  # likewise, with a right key: wrong keys are counted as on every other path
ROUNDING = 1e-9  # tokens; without it, rounding may refuse a caller that waits exactly for Retry-After
KEY = "ridgewave.key"  # in a scope: the number of the owner of the request's key, set by KeyCheck

Address = ipaddress.IPv4Address | ipaddress.IPv6Address


class TokenBucket:
    """Allows `rate` tokens per second on average, and `burst` at once. Not thread-safe."""

    __slots__ = ("_burst", "_filled", "_now", "_rate", "_tokens")

    def __init__(self, rate: float, burst: float, now: Callable[[], float] = time.monotonic) -> None:
        self._rate, self._burst, self._now = rate, burst, now
        self._tokens, self._filled = burst, now()

    def take(self) -> float:
        """Take a token and return 0; if there is none, return the seconds until there is one."""
        now = self._now()
        self._tokens = min(self._burst, self._tokens + (now - self._filled) * self._rate)
        self._filled = now
        if self._tokens >= 1.0 - ROUNDING:
            self._tokens -= 1.0
            return 0.0
        return (1.0 - self._tokens) / self._rate


class Ticket:
    """The place of one stream among those that its caller may have. Thread-safe."""

    def __init__(self, give_back: Callable[[], None]) -> None:
        self._give_back: Callable[[], None] | None = give_back
        self._lock = threading.Lock()

    def release(self) -> None:
        """Give the place back; a second call does nothing."""
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
        self._unnamed = "127.0.0.1" if settings.uds else ""  # a peer without address: every one is, at a Unix socket
        self._buckets: OrderedDict[str, TokenBucket] = OrderedDict()
        self._streams: Counter[str] = Counter()
        self._lock = threading.Lock()

    def admit(self, scope: Scope) -> Ticket:
        """Return the place of one more stream for the caller of `scope`.

        Raises Problem (429, too-many-streams) if its key or its address has as many streams as allowed.
        """
        bounds = {
            f"address {self.address(scope)}": (self._settings.streams_per_address, "address"),
            f"key {scope.get(KEY)}": (self._settings.streams_per_key if KEY in scope else math.inf, "key"),
        }
        with self._lock:
            for caller, (most, what) in bounds.items():
                if self._streams[caller] >= most:
                    name = f"RIDGEWAVE_STREAMS_PER_{what.upper()}"
                    raise Problem("too-many-streams", f"This {what} already has {most} streams ({name}).")
            self._streams.update(bounds.keys())
        return Ticket(lambda: self._leave(tuple(bounds)))

    def take_request(self, caller: str) -> None:
        """Count a request of `caller`; raises Problem (429, rate-limited) for one too many."""
        bucket = self._buckets.get(caller)
        if bucket is None:
            bucket = TokenBucket(self._settings.requests_per_second, self._settings.request_burst, self._now)
            self._buckets[caller] = bucket
            if len(self._buckets) > CALLERS:
                self._buckets.popitem(last=False)
        self._buckets.move_to_end(caller)
        wait = bucket.take()
        if wait > 0.0:
            rate = f"{self._settings.requests_per_second:g} requests per second"
            headers = {"Retry-After": str(max(1, math.ceil(wait)))}
            raise Problem("rate-limited", f"More than {rate} (RIDGEWAVE_REQUESTS_PER_SECOND).", headers=headers)

    def caller(self, scope: Scope) -> str:
        """Return the caller of `scope`: its key, or its address if it has no key."""
        return f"key {scope[KEY]}" if KEY in scope else f"address {self.address(scope)}"

    def address(self, scope: Scope) -> str:
        """Return the address under which `scope` counts: loopback, an IPv4 address, an IPv6 network, or unknown."""
        address = _parsed((scope.get("client") or (self._unnamed, 0))[0])
        if address is not None and self._is_trusted(address):
            values = [value.decode("latin-1") for name, value in scope["headers"] if name == b"x-forwarded-for"]
            for entry in reversed([entry for value in values for entry in value.split(",")]):
                previous = _parsed(entry)
                if previous is None:
                    break  # entries further left were not written by a trusted proxy
                address = previous
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
    """A layer that counts requests and WebSockets: by address before the check of keys, by key after it."""

    def __init__(self, app: ASGIApp, limits: Limits, admits: Callable[[Scope], bool], *, by_key: bool) -> None:
        """Make the layer. admits: returns whether a request has a right key, or needs none."""
        self._app = app
        self._limits = limits
        self._admits = admits
        self._by_key = by_key

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Count a request and pass it on; raises Problem, which `Bouncer` answers."""
        if scope["type"] in ("http", "websocket") and not self._is_unlimited(scope):
            if not self._by_key:
                room = room_of(scope)
                if room is not None:
                    room.admit()
                self._limits.take_request(f"address {self._limits.address(scope)}")
            elif KEY in scope:
                self._limits.take_request(f"key {scope[KEY]}")
        await self._app(scope, receive, send)

    def _is_unlimited(self, scope: Scope) -> bool:
        if scope["type"] != "http":
            return False
        return scope["path"] in PROBES or (scope["path"] == STOP and scope["method"] == "POST" and self._admits(scope))


def _parsed(text: str) -> Address | None:
    """Return the address in `text` without port, brackets and zone, or None. An IPv4-mapped address becomes IPv4."""
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
