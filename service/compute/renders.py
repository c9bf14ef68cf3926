"""Renders, plans and pictures over HTTP: who may compute what, where, and until when.

Model: each is computed in a process of its own (`render_process`), which ends when its client leaves, so what computes
    for an hour holds up neither the streams nor the end of the service, and nobody waits for it: it begins in a place
    for short work (`places`) and gives that up once it proves long or has told a price above CHEAP_SECONDS. A price is
    admitted within two bounds of processor seconds, of the client's renders under way and of all.
Limits: an engine that is given (a test's) works in threads of this process, which end after the piece that they are at.
    A render that fails after its header was sent ends the connection early, which Content-Length lets a reader see.
"""

from __future__ import annotations

import asyncio
import math
from collections import Counter
from collections.abc import AsyncGenerator, Coroutine
from functools import partial
from typing import Any, Protocol, TypeVar

from starlette.requests import ClientDisconnect, Request
from starlette.responses import Response
from starlette.types import Receive

from service.compute.render_process import Copies
from service.compute.render_steps import Answer, Message, Order, Price, work
from service.compute.threads import ThreadWork
from service.compute.work_places import Place, Places
from service.engine import Engine
from service.http.chunked_answer import PumpedResponse, departure
from service.http.rate_limits import Limits
from service.operations.metrics import Metrics
from service.operations.settings import Settings
from service.problems import Problem
from synth.errors import Fault

RETRY_SECONDS = 60  # for a render that found the processors taken by others: theirs take minutes
SHORTER = 0.9  # times the longest duration that the bound admits: the price is an estimate

OVER: Any = object()  # after the last step of a work in threads

Result = TypeVar("Result")


class Worker(Protocol):
    """Who computes one order."""

    async def next(self) -> Message:
        """Return the next message, None after the last; raises what the work raises."""

    def go_on(self) -> None:
        """Have it compute what it told the price of."""

    def lower(self) -> None:
        """Have it go on at the lowest priority."""

    def close(self) -> None:
        """Have it end, wherever it is."""


class ThreadWorker:
    """One order in threads of this process, a step in each."""

    def __init__(self, engine: Engine, order: Order, body: bytes) -> None:
        self._steps = work(engine, order, body)

    async def next(self) -> Message:
        """See `Worker`."""
        message: Message = None
        while message is None:
            told = await ThreadWork(partial(next, self._steps, OVER), "render").done
            if told is OVER:
                return None
            message = told
        return message

    def go_on(self) -> None:
        """See `Worker`; the next step goes on."""

    def lower(self) -> None:
        """See `Worker`; a thread has no lower priority."""

    def close(self) -> None:
        """See `Worker`; there is no next step."""


class UnderWay:
    """One order under way: its worker, its place among short work, and its price."""

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

    async def while_wanted(self, work: Coroutine[Any, Any, Result], receive: Receive) -> Result:
        """Return what `work` returns; raises ClientDisconnect or Problem (closing) as soon as nobody waits for it."""
        task = asyncio.ensure_future(work)
        left, cut = asyncio.ensure_future(departure(receive)), asyncio.ensure_future(self.cut.wait())
        waits: list[asyncio.Future[Any]] = [task, left, cut]
        try:
            await asyncio.wait(waits, return_when=asyncio.FIRST_COMPLETED)
            if task.done():
                return task.result()
            if left.done():
                raise ClientDisconnect
            raise Problem("closing", "The service is shutting down.")
        finally:
            for one in waits:
                one.cancel()
            await asyncio.gather(*waits, return_exceptions=True)

    def _lower(self) -> None:
        if self.worker is not None:
            self.worker.lower()

    def close(self) -> None:
        """End what is still under way; again is the same as once."""
        if self._closed:
            return
        self._closed = True
        if self.worker is not None:
            self.worker.close()
        if self._place is not None:
            self._place.leave()
        self._renders.leave(self)


class Renders:
    """The renders of one process.

    apart: in processes of their own, which make an engine of their own; otherwise with `engine`, in threads.
    """

    def __init__(
        self, engine: Engine, settings: Settings, metrics: Metrics, limits: Limits, *, apart: bool = False
    ) -> None:
        self._engine, self._settings, self._metrics, self._limits = engine, settings, metrics, limits
        self._copies = Copies(settings.cache_bytes, settings.render_seconds_per_client) if apart else None
        self._prices: Counter[str] = Counter()
        self._all: set[UnderWay] = set()
        self._ended = False
        self.places = Places(settings.solves_per_client, settings.max_solves, partial(metrics.waited, "render"))
        self.under_way = 0

    def warm_up(self) -> None:
        """Have the process be there that renders are copied from; for a thread."""
        if self._copies is not None:
            self._copies.start()

    def cut(self) -> None:
        """End every answer that is not over, and begin no more: the service ends."""
        self._ended = True
        for one in self._all:
            one.cut.set()

    def close(self) -> None:
        """Let the processes go."""
        if self._copies is not None:
            self._copies.close()

    async def answer(self, order: Order, body: bytes, request: Request) -> Response:
        """Return the answer to `order` for the scene in `body`; raises ClientDisconnect where nobody waits any more."""
        if self.under_way >= self._settings.max_renders:
            raise Problem("full", "Too many renders at one time.", headers={"Retry-After": "1"})
        if self._ended:
            raise Problem("closing", "The service is shutting down.")
        one = UnderWay(self, self._limits.caller(request.scope))
        self.under_way += 1
        self._all.add(one)
        try:
            head = await one.while_wanted(one.begin(order, body), request.receive)
            if head.voice_seconds is not None:
                self._metrics.built("voice", head.voice_seconds)
                self._metrics.render_began()
            if not head.whole:
                chunks, kind = one.chunks(), head.media_type
                return PumpedResponse(chunks, head.headers, kind, released=one.close, cut=one.cut)
            whole = await one.while_wanted(one.whole(), request.receive)
        except BaseException:
            one.close()
            raise
        one.close()
        return Response(whole, 200, head.headers, media_type=head.media_type)

    async def worker(self, order: Order, body: bytes) -> Worker:
        """Return who works at `order`."""
        if self._copies is None:
            return ThreadWorker(self._engine, order, body)
        return await self._copies.open(order, body)

    def admit(self, one: UnderWay, price: Price) -> None:
        """Take the price of `one` on; raises Problem where the client, or all together, would have too much."""
        allowed, in_all = self._settings.render_seconds_per_client, self._settings.render_seconds
        theirs, total = self._prices[one.client], self._prices.total()
        costs = f"This render would take about {price.seconds:.0f} s of processor time"
        if price.seconds > min(allowed, in_all):
            raise _too_costly(costs, price, min(allowed, in_all))
        if theirs + price.seconds > allowed:
            raise Problem(
                "too-many-renders",
                f"{costs}, and your renders under way {theirs:.0f} s; one client may have {allowed:g} s under way "
                "(RIDGEWAVE_RENDER_SECONDS_PER_CLIENT). Wait for them, end one, or shorten output.duration.",
                headers={"Retry-After": str(RETRY_SECONDS)},
            )
        if total + price.seconds > in_all:
            raise Problem(
                "full",
                f"{costs}, and all renders under way {total:.0f} s; the service takes on {in_all:g} s "
                "(RIDGEWAVE_RENDER_SECONDS). Try again later, or shorten output.duration.",
                headers={"Retry-After": str(RETRY_SECONDS)},
            )
        self._prices[one.client] += price.seconds  # type: ignore[assignment]

    def leave(self, one: UnderWay) -> None:
        """Take note that `one` is over."""
        self.under_way -= 1
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
