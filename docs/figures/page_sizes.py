"""Pictures of the pad page on four screens, light and dark, in its first second and while it is stroked.

    python -m docs.figures.page_sizes FOLDER [URL]

Opens the page of a service of its own, or that at URL, in headless Chromium with WebGL in software, and writes
FOLDER/SCREEN-LOOK-MOMENT.png. The moments: `first` is a second after the address was entered, `ghost` is when the ghost
has left its waveform, `stroke` is during a stroke of a finger.
"""

from __future__ import annotations

import sys
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any

from docs.figures.pages import PATIENCE, SOLID, chromium, serving

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

SCREENS = {"1440x900": (1440, 900), "1280x720": (1280, 720), "390x844": (390, 844), "844x390": (844, 390)}
LOOKS = ("light", "dark")
PLAYED = "() => ridgewave.fingers.some(({source}) => source && source.played > 24000)"
STROKE = """() => { const pad = document.getElementById("pad");
  const {left, top, width, height} = pad.getBoundingClientRect();
  const event = (kind, share) => pad.dispatchEvent(new PointerEvent(kind, {pointerId: 41, pointerType: "touch",
    button: 0, clientX: left + share * width, clientY: top + 0.55 * height, bubbles: true}));
  event("pointerdown", 0.3);
  const began = performance.now();
  setInterval(() => event("pointermove", 0.5 + 0.3 * Math.sin((performance.now() - began) / 300)), 10); }"""
WAVED = "() => document.querySelector('.views.shown') !== null"


def main(folder: Path, url: str | None = None) -> None:
    """Write the pictures into `folder`."""
    from playwright.sync_api import sync_playwright

    folder.mkdir(parents=True, exist_ok=True)
    with serving() if url is None else nullcontext(url) as address, sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium(), args=[*SOLID])
        try:
            for screen in SCREENS:
                for look in LOOKS:
                    show(browser, address, folder, screen, look)
        finally:
            browser.close()


def show(browser: Browser, url: str, folder: Path, screen: str, look: str) -> None:
    """Write the pictures of one screen in one look."""
    width, height = SCREENS[screen]
    phone = width < 1000
    options: dict[str, Any] = {"viewport": {"width": width, "height": height}, "color_scheme": look}
    page = browser.new_page(**options, has_touch=phone, is_mobile=phone)
    page.set_default_timeout(PATIENCE)

    def taken(moment: str) -> None:
        page.screenshot(path=folder / f"{screen}-{look}-{moment}.png")

    page.goto(url)
    page.wait_for_timeout(1000)
    taken("first")
    page.wait_for_function(WAVED)
    page.wait_for_timeout(500)  # of the ghost's way over the pad
    taken("ghost")
    stroke(page)
    taken("stroke")
    page.close()


def stroke(page: Page) -> None:
    """Put a finger on the pad that strokes on by itself."""
    page.evaluate(STROKE)
    page.wait_for_function(PLAYED)


if __name__ == "__main__":
    main(Path(sys.argv[1]), *sys.argv[2:3])
