"""The menu of textures: groups, a picture of the chosen one, and its numbers with their sources."""

from __future__ import annotations

from typing import TYPE_CHECKING

import ridgewave as rw

if TYPE_CHECKING:
    from playwright.sync_api import Page

NAME = "percale-200-count"


def test_the_menu_has_the_groups_of_the_catalogue(still_page: Page) -> None:
    groups = still_page.evaluate(
        """() => [...document.querySelectorAll("#texture optgroup")]
             .map(({label, children}) => [label, [...children].map(({value}) => value)])"""
    )
    wanted: dict[str, list[str]] = {}
    for name, entry in rw.textures().items():
        wanted.setdefault(entry.group, []).append(name)
    assert dict(groups) == wanted and [label for label, _ in groups] == list(wanted)


def test_a_chosen_texture_shows_its_picture_and_its_sources(still_page: Page) -> None:
    picture = still_page.locator("#texture-picture")
    picture.wait_for(state="hidden")
    still_page.select_option("#texture", NAME)
    picture.wait_for()
    assert picture.evaluate("(image) => image.decode().then(() => image.naturalWidth)") == 240
    assert "percale" in (picture.get_attribute("alt") or "")
    still_page.click("#texture-sources summary")
    still_page.wait_for_function("() => document.querySelectorAll('#texture-sources li').length > 0")
    entry = rw.textures()[NAME]
    lines = still_page.locator("#texture-sources li").all_inner_texts()
    assert f"texture.period {entry.document['texture']['period']} ({entry.sources['texture.period']})" in lines
    still_page.select_option("#texture", "sinusoid")
    picture.wait_for(state="hidden")
    still_page.locator("#texture-sources").wait_for(state="hidden")
