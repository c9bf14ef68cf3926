"""HEAD for every path that has GET: the same answer without its body (RFC 9110, 9.3.2).

A path with a route of its own for HEAD keeps it: that of a stream must not begin to play.
"""

from __future__ import annotations

from collections.abc import Callable, Set

from starlette.types import ASGIApp, Message, Receive, Scope, Send


class HeadAsGet:
    """An ASGI layer. methods: returns the methods of the routes of a path."""

    def __init__(self, app: ASGIApp, methods: Callable[[Scope], Set[str]]) -> None:
        self._app, self._methods = app, methods

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on; HEAD as GET where no route answers HEAD."""

        async def send_without_body(message: Message) -> None:
            """Send `message`, a body as an empty one."""
            await send({**message, "body": b""} if message["type"] == "http.response.body" else message)

        if scope["type"] == "http" and scope["method"] == "HEAD" and "HEAD" not in self._methods(scope):
            await self._app({**scope, "method": "GET"}, receive, send_without_body)
        else:
            await self._app(scope, receive, send)
