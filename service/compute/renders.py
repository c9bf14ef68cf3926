"""Renders, explanations and pictures over HTTP: which are admitted, where they run, and when they end.

Model: each runs in a process of its own (`render_process`), which is killed when its client disconnects. An order
    begins in a slot for short work (`work_places`). It frees the slot once it proves long, or has sent a price. The
    price, in processor seconds, is admitted within two bounds: of the client's sum under way, and of the sum of all.
Limits: an engine that is passed in (by a test) works in threads of this process, which end after the current piece. A
    render that fails after its head was sent ends the connection early; the reader sees that from Content-Length.
"""

from __future__ import annotations

import asyncio
import math
from collections import Counter
from collections.abc import AsyncGenerator
from dataclasses import replace
from functools import partial
from typing import Any, Protocol

from starlette.requests import Request
from starlette.responses import Response

from service.compute.render_process import Copies
from service.compute.render_steps import Answer, Message, Order, Price, work
from service.compute.threads import ThreadWork
from service.compute.work_places import Place, Places
from service.engine import Engine
from service.http.chunked_answer import PumpedResponse, while_wanted
from service.http.rate_limits import KEY, Limits
from service.operations.metrics import Metrics
from service.operations.settings import Settings
from service.problems import Problem
from service.store.owned_textures import OwnedTextures
from service.store.store import Store
from synth.errors import Fault

RETRY_SECONDS = 60  # after a refusal for lack of processor time; renders of this size take minutes
SHORTER = 0.9  # of the longest admissible duration is suggested, because the price is an estimate

OVER: Any = object()  # end of the steps


class Worker(Protocol):
    """Computes one order."""

    async def next(self) -> Message:
        """Return the next message, None after the last. Raises what the work raises."""

    def go_on(self) -> None:
        """Continue after the price."""

    def lower(self) -> None:
        """Continue at the lowest priority."""

    def close(self) -> None:
        """End the work, at any stage."""


class ThreadWorker:
    """Computes one order in threads of this process, one step per thread."""

    def __init__(self, engine: Engine, order: Order, body: bytes, store: Store) -> None:
        self._steps = work(engine, order, body, store)

    async def next(self) -> Message:
        """See `Worker`."""
        message: Message = None
        while message is None:
            step = await ThreadWork(partial(next, self._steps, OVER), "render").done
            if step is OVER:
                return None
            message = step
        return message

    def go_on(self) -> None:
        """See `Worker`; nothing is to be done."""

    def lower(self) -> None:
        """See `Worker`; threads keep their priority."""

    def close(self) -> None:
        """See `Worker`; no further step is taken."""


class UnderWay:
    """One order under way: its worker, its slot for short work, and its price."""

    def __init__(self, renders: Renders, client: str) -> None:
        self._renders, self.client = renders, client
        self.seconds = 0.0
        self.worker: Worker | None = None
        self.cut = asyncio.Event()
        self._place: Place | None = None
        self._closed = False

    async def begin(self, order: Order, body: bytes) -> Answer:
        """Return the head of the answer."""
        self._place = await self._renders.places.enter(self.client, self._lower)
        self.worker = await self._renders.worker(order, body)
        message = await self.worker.next()
        if isinstance(message, Price):
            self._renders.admit(self, message)
            self.seconds = message.seconds
            self._place.leave()
            self.worker.lower()
            self.worker.go_on()
            message = await self.worker.next()
        assert isinstance(message, Answer), message
        if not message.whole:
            self._place.leave()
        return message

    async def chunks(self) -> AsyncGenerator[bytes, None]:
        """Yield the body."""
        assert self.worker is not None
        while (chunk := await self.worker.next()) is not None:
            assert isinstance(chunk, bytes)
            if chunk:
                yield chunk

    async def whole(self) -> bytes:
        """Return the body."""
        return b"".join([chunk async for chunk in self.chunks()])

    def _lower(self) -> None:
        if self.worker is not None:
            self.worker.lower()

    def close(self) -> None:
        """End the order. Further calls do nothing."""
        if self._closed:
            return
        self._closed = True
        if self.worker is not None:
            self.worker.close()
        if self._place is not None:
            self._place.leave()
        self._renders.leave(self)


class Renders:
    """The renders of one process of the service."""

    def __init__(
        self, engine: Engine, settings: Settings, metrics: Metrics, limits: Limits, *, apart: bool = False
    ) -> None:
        """apart: compute in processes with engines of their own; otherwise in threads, with `engine`."""
        self._engine, self._settings, self._metrics, self._limits = engine, settings, metrics, limits
        self._textures = OwnedTextures(settings)
        folder = self._textures.store.folder
        self._copies = Copies(settings.cache_bytes, settings.render_seconds_per_client, folder) if apart else None
        self._prices: Counter[str] = Counter()
        self._all: set[UnderWay] = set()
        self._ended = False
        self.places = Places(settings.solves_per_client, settings.max_solves, partial(metrics.waited, "render"))

    @property
    def under_way(self) -> int:
        """Return how many renders run or wait."""
        return len(self._all)

    def warm_up(self) -> None:
        """Start the template process of the renders. Blocks for about a second: call it from a thread."""
        if self._copies is not None:
            self._copies.start()

    def cut(self) -> None:
        """Cut every unfinished answer, and admit no more: the service shuts down."""
        self._ended = True
        for one in self._all:
            one.cut.set()

    def close(self) -> None:
        """End the processes."""
        if self._copies is not None:
            self._copies.close()

    async def answer(self, order: Order, body: bytes, request: Request) -> Response:
        """Return the answer to `order` for the scene in `body`. Raises ClientDisconnect if the client disconnects."""
        if self.under_way >= self._settings.max_renders:
            raise Problem("full", "Too many renders at a time.", headers={"Retry-After": "1"})
        if self._ended:
            raise Problem("closing", "The service is shutting down.")
        order = replace(order, owner=self._textures.owner(request.scope.get(KEY)))
        one = UnderWay(self, self._limits.caller(request.scope))
        self._all.add(one)
        try:
            head = await while_wanted(one.begin(order, body), request.receive, one.cut)
            if head.voice_seconds is not None:
                self._metrics.built("voice", head.voice_seconds)
                self._metrics.render_began()
            if not head.whole:
                chunks, kind = one.chunks(), head.media_type
                return PumpedResponse(chunks, head.headers, kind, released=one.close, cut=one.cut)
            whole = await while_wanted(one.whole(), request.receive, one.cut)
        except BaseException:
            one.close()
            raise
        one.close()
        return Response(whole, 200, head.headers, media_type=head.media_type)

    async def worker(self, order: Order, body: bytes) -> Worker:
        """Return a worker for `order`."""
        if self._copies is None:
            return ThreadWorker(self._engine, order, body, self._textures.store)
        return await self._copies.open(order, body)

    def admit(self, one: UnderWay, price: Price) -> None:
        """Count the price of `one`. Raises Problem if it would exceed the bound of its client or of the service."""
        allowed, in_all = self._settings.render_seconds_per_client, self._settings.render_seconds
        theirs, total = self._prices[one.client], self._prices.total()
        costs = f"This render would take about {price.seconds:.0f} s of processor time"
        if price.seconds > min(allowed, in_all):
            raise _too_costly(costs, price, min(allowed, in_all))
        if theirs + price.seconds > allowed:
            raise Problem(
                "too-many-renders",
                f"{costs}, and your renders under way {theirs:.0f} s. A client may have {allowed:g} s under way "
                "(RIDGEWAVE_RENDER_SECONDS_PER_CLIENT). Wait for them, end one, or shorten output.duration.",
                headers={"Retry-After": str(RETRY_SECONDS)},
            )
        if total + price.seconds > in_all:
            raise Problem(
                "full",
                f"{costs}, and all renders under way {total:.0f} s. The service admits {in_all:g} s "
                "(RIDGEWAVE_RENDER_SECONDS). Try again later, or shorten output.duration.",
                headers={"Retry-After": str(RETRY_SECONDS)},
            )
        self._prices[one.client] += price.seconds  # type: ignore[assignment]

    def leave(self, one: UnderWay) -> None:
        """Forget `one`, which is over."""
        self._all.discard(one)
        if one.seconds:
            self._prices[one.client] -= one.seconds  # type: ignore[assignment]
            if self._prices[one.client] < 1e-6:
                del self._prices[one.client]


def _too_costly(costs: str, price: Price, allowed: float) -> Problem:
    longest = SHORTER * price.sound * allowed / price.seconds
    shorter = math.floor(longest) if longest >= 10.0 else float(f"{longest:.1g}")
    fault = Fault(
        "/output/duration",
        f"about {price.sound:.4g} s of sound in {price.seconds:.0f} s of processor time",
        f"at most {allowed:g} s of processor time (RIDGEWAVE_RENDER_SECONDS_PER_CLIENT, RIDGEWAVE_RENDER_SECONDS)",
        f"Write {shorter:g} s or less, leave out effects, allow a larger accuracy.tolerance, or use the command line.",
    )
    return Problem("too-costly", f"{costs}. {fault.hint}", (fault,))
