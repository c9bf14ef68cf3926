"""The form of the page: its scene as the page holds it, and a field written as a person writes it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from playwright.sync_api import Page

    from tests.clients.web.random_scenes import Document

CHOSEN = "() => document.querySelector('#texture input:checked')?.value ?? ''"
"""The name of the texture that is chosen on the wall, "" for none."""
PERIOD = "#field-texture-period"
REFUSED = "status of 422"  # what Chromium logs of a scene that the service refuses


def scene_of(page: Page) -> Document:
    """Return the scene of the form."""
    scene: Document = page.evaluate("() => ridgewave.state.scene")
    return scene


def written(page: Page, field: str, text: str) -> None:
    """Enter `text` into a field, after opening its section."""
    page.evaluate("(field) => { document.querySelector(field).closest('details').open = true; }", field)
    page.fill(field, text)
    page.press(field, "Enter")


def tile(name: str) -> str:
    """Return the selector of a texture on the wall."""
    return f"#texture input[value='{name}']"


def at(scene: Any, path: tuple[str, ...]) -> Any:
    """Return what a scene has at a path; None where it has nothing."""
    for step in path:
        scene = (scene or {}).get(step)
    return scene
