"""The path under which a proxy offers the service: RIDGEWAVE_ROOT_PATH, such as `/lab/touch`.

Model: a proxy may pass the prefix on, or remove it. `RootPath` removes it where it is still there, so that all layers,
    routes and lists of paths behind it know the service's own paths only. Links that the service writes begin with the
    setting; those of its pages are relative. Without the slash at its end, the prefix redirects to the page.
Limits: the log shows paths as sent. A proxy that removes the prefix must redirect the prefix without the slash itself.
"""

from __future__ import annotations

from starlette.requests import Request
from starlette.responses import RedirectResponse, Response
from starlette.types import ASGIApp, Receive, Scope, Send


class RootPath:
    """The outermost layer: removes `root_path` from the path of a request or WebSocket."""

    def __init__(self, app: ASGIApp, root_path: str) -> None:
        self._app, self._root_path = app, root_path

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass the request on with the service's own path."""
        if scope["type"] in ("http", "websocket") and scope["path"].startswith(self._root_path + "/"):
            scope["path"] = scope["path"][len(self._root_path) :]
        await self._app(scope, receive, send)


async def redirect_to_page(request: Request) -> Response:
    """Redirect `/lab/touch` to `/lab/touch/`: relative links need the slash."""
    query = f"?{request.url.query}" if request.url.query else ""
    return RedirectResponse(f"{request.app.state.service.settings.root_path}/{query}", 307)
