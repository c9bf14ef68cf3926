"""Pictures of the web page, for README.md: pad.png, a texture being stroked, and vr.png, the table of textures.

    python -m docs.figures.pages [FOLDER]

Starts the service with its page (that of RIDGEWAVE_WEB, if named), opens `/` and `/vr` in headless Chromium, and takes
the pictures while a finger strokes. Needs the extras `test` and `plots`, Chromium, and three.js beside the page.
Limits: what a page shows depends on fonts and on the moment, so two runs differ in some pixels.
"""

from __future__ import annotations

import io
import re
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import httpx
from PIL import Image

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

HERE = Path(__file__).resolve().parent
WIDTH, HEIGHT = 1280, 800  # pixels
LARGEST = 200_000  # bytes of a picture: a reader's page stays quick
PALETTES = (256, 128, 64)  # colours, the most that fit are taken
PATIENCE = 60_000.0  # ms: the first scene compiles the solver, and a processor draws the table
SOLID = (
    *("--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"),
    "--autoplay-policy=no-user-gesture-required",
)
HEARD = 96_000  # frames of sound before the pad's picture: its waveform and spectrum are full
PRESSED = "() => [...ridgewave.fingers].some((finger) => finger.touching)"
DRAWN = """() => ridgewave.views.surface.relief?.drawings > 20 && !document.querySelector("[data-stale]")
  && ridgewave.views.threshold && [...document.querySelectorAll(".tile img[src]")].length > 8"""
LISTEN = """() => {
  window.heard = 0;
  for (const finger of ridgewave.fingers) {
    finger.addEventListener("block", ({detail}) => { heard += detail.samples.length; });
  }
}"""


def main(folder: Path = HERE) -> None:
    """Write pad.png and vr.png into `folder`."""
    from playwright.sync_api import sync_playwright

    with serving() as url, sync_playwright() as playwright:
        for name, picture in (("pad", pad), ("vr", table)):
            browser = playwright.chromium.launch(executable_path=chromium(), args=[*SOLID])
            try:
                (folder / f"{name}.png").write_bytes(small(picture(browser, url)))
            finally:
                browser.close()


def chromium() -> str:
    """Return the path of Chromium."""
    for name in ("chromium", "chromium-browser", "chromium-headless-shell"):
        if path := shutil.which(name):
            return path
    raise SystemExit("Chromium is missing: install the Debian package chromium.")


@contextmanager
def serving() -> Iterator[str]:
    """Yield the address of a service of its own, on a free port."""
    command = [sys.executable, "-m", "clients", "serve", "--port", "0"]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as service:
        assert service.stderr is not None
        try:
            for line in service.stderr:
                if found := re.search(r"listening on (http://[^\s\"]+)", line):
                    until_ready(found[1])
                    yield found[1]
                    return
            raise SystemExit("The service did not start.")
        finally:
            service.terminate()


def until_ready(url: str) -> None:
    """Return once the service has compiled its kernels: a stroke that comes before may have gaps."""
    give_up = time.monotonic() + PATIENCE / 1e3
    while httpx.get(url + "/readyz").status_code != 200:
        if time.monotonic() > give_up:
            raise SystemExit("The service did not become ready.")
        time.sleep(0.1)


def pad(browser: Browser, url: str) -> bytes:
    """Return the pad as it is stroked, PNG."""
    page = opened(browser, url)
    page.click("#start:enabled")
    page.click("#stroke:enabled")
    page.wait_for_function(PRESSED)
    page.wait_for_function(DRAWN)
    page.evaluate(LISTEN)
    page.wait_for_function("(frames) => heard >= frames", arg=HEARD)
    return taken(page)


def table(browser: Browser, url: str) -> bytes:
    """Return the table of textures with a fingertip on a swatch, PNG."""
    page = opened(browser, f"{url}/vr")
    page.wait_for_selector("#view[data-ready]")
    box = page.locator("#view").bounding_box()
    assert box is not None, "it is seen"
    page.mouse.move(box["x"] + box["width"] * 0.46, box["y"] + box["height"] * 0.49)
    page.mouse.down()
    page.wait_for_function(PRESSED)
    return taken(page)


def opened(browser: Browser, url: str) -> Page:
    """Return a light page of the picture's size at `url`."""
    page = browser.new_page(viewport={"width": WIDTH, "height": HEIGHT}, color_scheme="light")
    page.set_default_timeout(PATIENCE)
    page.goto(url)
    return page


def taken(page: Page) -> bytes:
    """Return the picture of the page, which is closed then."""
    picture = page.screenshot()
    page.close()
    return picture


def small(picture: bytes) -> bytes:
    """Return the PNG with the most colours that it may have to stay below LARGEST."""
    image = Image.open(io.BytesIO(picture)).convert("RGB")
    for colours in PALETTES:
        packed = io.BytesIO()
        image.quantize(colours, Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE).save(packed, "PNG", optimize=True)
        if packed.tell() < LARGEST:
            return packed.getvalue()
    raise SystemExit(f"The picture has {packed.tell()} bytes with {colours} colours: more than {LARGEST}.")


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:2]))
