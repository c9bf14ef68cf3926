"""For the tests of views: the page that contains them, samples for them, and their text alternatives."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from tests.clients.web.browser import watched

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

Lines = list[list[float]]
PUSH = """async ({name, lines, fullScale, quantity, blocks, block, begin}) => {
  const picture = views[name];
  await views.drawn(picture.panel, () => {
    for (let index = 0; index < blocks; index++) {
      picture.push(views.sinusoids(lines, 48000, block, begin + index * block), fullScale, quantity, 48000);
    }
  });
  const {largest, ...drawn} = picture.drawn;
  return {...drawn, largest};
}"""


@contextmanager
def opened(browser: Browser, url: str, **options: Any) -> Iterator[Page]:
    """Yield the page, once its pictures are there; fail in the end if it logged an error."""
    with watched(browser, url, **{"viewport": {"width": 900, "height": 700}, **options}) as (page, _):
        drawable(page)
        yield page


def drawable(page: Page) -> None:
    """Return once the pictures are there."""
    page.wait_for_function("() => window.views !== undefined")


def push(page: Page, name: str, lines: Lines, quantity: str = "acceleration", **other: Any) -> dict[str, Any]:
    """Push sinusoids [Hz, of full scale, rad] and return what was drawn."""
    told = {"name": name, "lines": lines, "quantity": quantity}
    usual = {"fullScale": 36.0, "blocks": 60, "block": 480, "begin": 0}
    drawn: dict[str, Any] = page.evaluate(PUSH, told | usual | other)
    return drawn


def label_of(page: Page, name: str, wanted: str) -> str:
    """Return the text alternative of a picture, once it holds `wanted`."""
    handle = page.wait_for_function(
        "([name, wanted]) => { const told = document.getElementById(name).getAttribute('aria-label') ?? '';"
        " return told.includes(wanted) ? told : null; }",
        arg=[name, wanted],
    )
    return str(handle.json_value())
