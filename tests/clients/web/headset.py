"""The VR page in a browser without a graphics card, with three.js beside it and, if asked, an emulated headset.

Model: three.js comes as a build fetches it (hatch_build.py), IWER from npm by the hashes of package-lock.json. Both go
    to a folder of the test run; the page gets three.js by a route of the browser, IWER by a script before its own.
Limits: a software renderer is slow: after the first picture it draws few pixels and nothing but fingertips, and motions
    are given in frames, not in seconds.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import hatch_build
from tests.clients.web.browser import Watch, missing
from tests.clients.web.npm import node_modules

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

HERE = Path(__file__).parent
PATIENCE = 60.0  # s: a software renderer on a busy machine
DRAW_LITTLE = """() => {
  const {room} = ridgewave;
  room?.renderer.setPixelRatio(0.2);
  for (const {material} of room ? [room.floor, ...room.table.children] : []) if (material) material.visible = false;
}"""
TOOLS = (HERE / "pages" / "headset.js").read_text("utf-8")


def three_folder(folder: Path) -> Path:
    """Return a folder with three.js: `folder`, filled; skip the test where it cannot be had (in CI: fail)."""
    if reason := hatch_build.vendored(folder):
        missing(f"three.js cannot be had: {reason}")
    return folder


def iwer_script(folder: Path) -> str:
    """Return the emulated headset's script, fetched into `folder`; skip the test where there is none (in CI: fail)."""
    return (node_modules(folder) / "iwer" / "build" / "iwer.min.js").read_text("utf-8")


@contextmanager
def at_the_table(
    browser: Browser, url: str, three: Path | None, *scripts: str, ready: str = "#view[data-ready]", **options: Any
) -> Iterator[tuple[Page, Watch]]:
    """Yield the VR page with `scripts` before its own, and what watches it; fail in the end if anything went wrong.

    `three` is the folder with three.js, None for none; `ready` selects what is there when the page has begun.
    """
    context = browser.new_context(**{"viewport": {"width": 640, "height": 420}, **options})
    context.set_default_timeout(1e3 * PATIENCE)
    page = context.new_page()
    watch = Watch(page, url)

    def vendor(route: Any) -> None:
        path = three / route.request.url.rsplit("/", 1)[1] if three else None
        if path and path.is_file():
            route.fulfill(path=path, content_type="text/javascript")
        else:
            route.fulfill(status=404)

    page.route("**/web/vendor/*", vendor)
    for script in (*scripts, TOOLS):
        page.add_init_script(script)
    try:
        page.goto(f"{url}/vr")
        page.wait_for_selector(ready)
        page.evaluate(DRAW_LITTLE)
        yield page, watch
    finally:
        context.close()
    watch.check()
