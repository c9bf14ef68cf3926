"""The wall of textures: groups, pictures of those in view, a search, and the numbers of the chosen one."""

from __future__ import annotations

from typing import TYPE_CHECKING

import ridgewave as rw
from tests.clients.web.form import tile

if TYPE_CHECKING:
    from playwright.sync_api import Page

NAME = "percale-200-count"


def test_the_wall_has_the_groups_of_the_catalogue(still_page: Page) -> None:
    groups = still_page.evaluate(
        """() => [...document.querySelectorAll(".wall-group")].map((group) =>
             [group.getAttribute("aria-label"), [...group.querySelectorAll("input")].map(({value}) => value)])"""
    )
    wanted: dict[str, list[str]] = {"Generated": ["sinusoid"]}
    for name, entry in rw.textures().items():
        wanted.setdefault(entry.group, []).append(name)
    assert dict(groups) == wanted and [label for label, _ in groups] == list(wanted)


def test_a_chosen_texture_shows_its_picture_and_its_sources(still_page: Page) -> None:
    picture = still_page.locator("#texture-picture")
    picture.wait_for(state="hidden")
    still_page.check(tile(NAME))
    picture.wait_for()
    assert picture.evaluate("(image) => image.decode().then(() => image.naturalWidth)") == 240
    assert "percale" in (picture.get_attribute("alt") or "")
    still_page.click("#texture-sources summary")
    still_page.wait_for_function("() => document.querySelectorAll('#texture-sources li').length > 0")
    entry = rw.textures()[NAME]
    lines = still_page.locator("#texture-sources li").all_inner_texts()
    assert f"texture.period {entry.document['texture']['period']} ({entry.sources['texture.period']})" in lines
    still_page.check(tile("sinusoid"))
    picture.wait_for(state="hidden")
    still_page.locator("#texture-sources").wait_for(state="hidden")


def test_a_texture_that_is_not_on_the_wall_is_shown_by_its_kind_and_a_sinusoid_can_be_chosen(still_page: Page) -> None:
    shown = "() => document.getElementById('texture-name').textContent"
    for texture, title, words in (
        ({"kind": "grating", "duty": 0.3}, "Grating", "kind \u201cgrating\u201d"),
        ({"kind": "rough"}, "Rough", "kind \u201crough\u201d"),
        ({"kind": "sinusoid", "period": "1 mm"}, "Sinusoid", "A sinusoid"),
        (None, "Sinusoid", "A sinusoid"),
        ({"kind": None}, "Sinusoid", "A sinusoid"),
        ({"kind": "grating", "duty": 0.3}, "Grating", "kind \u201cgrating\u201d"),
    ):
        still_page.evaluate("(texture) => ridgewave.state.take({texture})", texture)
        assert still_page.evaluate(shown) == title and words in still_page.inner_text("#texture-about")
    still_page.check(tile("sinusoid"))
    assert still_page.evaluate("() => ridgewave.state.scene") == {}
    assert still_page.evaluate(shown) == "Sinusoid" and "A sinusoid" in still_page.inner_text("#texture-about")
