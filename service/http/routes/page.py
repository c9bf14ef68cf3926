"""`/`, `/vr` and `/web/...`: the touch page of the folder RIDGEWAVE_WEB; without one, `/` redirects to /docs.

Model: the files require no key, because they contain no secrets (`security.OPEN_PATHS`). A browser may keep them, but
    revalidates them each time (`no-cache`, and an ETag of the content), so that an update is seen at once.
    Two policies restrict what the page may do: nothing from another host, no script or style inside the HTML. They are
    sent only with files that a browser opens as a page: with every script, they would be a sixth of what is sent.
"""

from __future__ import annotations

import asyncio
from pathlib import Path

from fastapi import APIRouter, Request
from starlette.responses import RedirectResponse, Response

from service.http.content_negotiation import is_known
from service.http.page_files import find_page_file
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
OPENED = ("text/html", "image/svg+xml")  # media types that a browser opens as a page


@router.head("/")
@router.get("/")
async def index(request: Request) -> Response:
    """The page; without one, a redirect to /docs."""
    settings = service_of(request).settings
    if not settings.web:
        return RedirectResponse(f"{settings.root_path}/docs", 307)
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
    folder = service_of(request).settings.web
    if not folder:
        raise Problem("not-found", "The service has no page (RIDGEWAVE_WEB).")
    found = await asyncio.to_thread(find_page_file, Path(folder), name)
    if found is None:
        raise Problem("not-found", "The page has no such file.")
    policies = POLICIES if found.media_type.startswith(OPENED) else {}
    headers = policies | {"Cache-Control": "no-cache", "ETag": f'W/"{found.tag}"'}
    if is_known(request, found.tag):
        return Response(status_code=304, headers=headers)
    headers["Content-Length"] = str(len(found.content))
    return Response(b"" if request.method == "HEAD" else found.content, headers=headers, media_type=found.media_type)
