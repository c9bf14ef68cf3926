"""`/`, `/vr` and `/web/...`: the touch page, if the service has one (RIDGEWAVE_WEB); without one `/` leads to /docs.

Model: the files are readable without a key, since they hold nothing secret: `security.OPEN_PATHS`. A browser may keep
    them and asks for them again each time (`no-cache` with an ETag of the content), so that an update is seen at once.
    What the page may do is in the two policies below, which come with what a browser opens as a page: nothing from
    another host, no script or style inside the HTML. With every script they would be a sixth of what is sent.
"""

from __future__ import annotations

import asyncio

from fastapi import APIRouter, Request
from starlette.responses import RedirectResponse, Response

from service.http.content_negotiation import is_known, takes_gzip
from service.lifespan import service_of
from service.problems import Problem

router = APIRouter(tags=["page"], include_in_schema=False)

POLICIES = {
    "Content-Security-Policy": (
        "default-src 'self'; connect-src 'self' ws: wss:; img-src 'self' data: blob:; media-src 'self' blob:; "
        "worker-src 'self' blob:; object-src 'none'; base-uri 'none'; frame-ancestors 'none'"
    ),
    "Permissions-Policy": (
        "speaker-selection=(self), gamepad=(self), xr-spatial-tracking=(self), autoplay=(self), "
        "camera=(), microphone=(), geolocation=(), display-capture=(), usb=(), serial=(), payment=()"
    ),
}
OPENED = ("text/html", "image/svg+xml")
"""Media types that a browser opens as a page of its own."""


@router.head("/")
@router.get("/")
async def index(request: Request) -> Response:
    """The page; without one, the way to the page of calls."""
    if service_of(request).page is None:
        return RedirectResponse("/docs", 307)
    return await _answer(request, "index.html")


@router.head("/vr")
@router.get("/vr")
async def headset(request: Request) -> Response:
    """The page for a headset."""
    return await _answer(request, "vr.html")


@router.head("/web/{name:path}")
@router.get("/web/{name:path}")
async def file(request: Request, name: str) -> Response:
    """A file of the page."""
    return await _answer(request, name)


async def _answer(request: Request, name: str) -> Response:
    page = service_of(request).page
    found = None if page is None else await asyncio.to_thread(page.find, name)
    if found is None:
        raise Problem("not-found", "The page has no such file." if page else "There is no page (RIDGEWAVE_WEB).")
    policies = POLICIES if found.media_type.startswith(OPENED) else {}
    headers = policies | {"Cache-Control": "no-cache", "ETag": f'W/"{found.tag}"', "Vary": "Accept-Encoding"}
    if is_known(request, found.tag):
        return Response(status_code=304, headers=headers)
    packed = found.packed if takes_gzip(request.headers) else None
    if packed is not None:
        headers["Content-Encoding"] = "gzip"
    body = found.content if packed is None else packed
    headers["Content-Length"] = str(len(body))
    return Response(b"" if request.method == "HEAD" else body, headers=headers, media_type=found.media_type)
