"""The wall of textures: groups, pictures of those in view, a search, and the numbers of the chosen one."""

from __future__ import annotations

from typing import TYPE_CHECKING

import ridgewave as rw
from tests.clients.web.browser import watched
from tests.clients.web.conftest import WIDE, link_to, loaded
from tests.clients.web.form import CHOSEN, tile

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

    from tests.service.harness import Running

NAME = "percale-200-count-area"
LINEN = "linen-40-per-inch-area"


def offered() -> dict[str, list[str]]:
    """Return the names on the wall by their groups: where a surface is there as an area, its line is not."""
    found: dict[str, list[str]] = {}
    for name, entry in rw.textures().items():
        if f"{name}-area" not in rw.textures():
            found.setdefault(entry.group, []).append(name)
    return found


def test_the_wall_has_the_groups_of_the_catalogue(still_page: Page) -> None:
    groups = still_page.evaluate(
        """() => [...document.querySelectorAll(".wall-group")].map((group) =>
             [group.getAttribute("aria-label"), [...group.querySelectorAll("input")].map(({value}) => value)])"""
    )
    wanted = {"Generated": ["sinusoid"], **offered()}
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


def test_a_texture_that_is_felt_by_its_friction_brings_it_and_takes_it_away(still_page: Page) -> None:
    effects = "() => ridgewave.state.scene.effects ?? null"
    still_page.evaluate("() => ridgewave.state.take({})")
    still_page.check(tile("glass-wet"))
    assert still_page.evaluate(effects) == rw.textures()["glass-wet"].everyday["effects"]
    still_page.check(tile("rubber-smooth"))
    assert still_page.evaluate(effects) == rw.textures()["rubber-smooth"].everyday["effects"]
    still_page.click("#slot-b")  # empty: it takes the present texture
    still_page.check(tile(NAME))
    assert still_page.evaluate(effects) is None
    still_page.click("#slot-a")
    assert still_page.evaluate(effects) == rw.textures()["rubber-smooth"].everyday["effects"]
    still_page.evaluate("() => ridgewave.state.take({effects: {stick_slip: {surface: 'leather'}}})")
    still_page.check(tile(NAME))
    assert still_page.evaluate(effects) == {"stick_slip": {"surface": "leather"}}, "written by hand"


def test_a_texture_that_is_not_on_the_wall_is_shown_by_its_kind_and_a_sinusoid_can_be_chosen(still_page: Page) -> None:
    shown = "() => document.getElementById('texture-name').textContent"
    for texture, title, words in (
        ({"kind": "grating", "duty": 0.3}, "Grating", "kind \u201cgrating\u201d"),
        ({"kind": "rough"}, "Rough", "kind \u201crough\u201d"),
        ({"kind": "linen-40-per-inch"}, "Linen, 40 threads per inch", "a tea towel"),
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


def test_only_pictures_in_view_are_requested_and_each_once(chromium: Browser, service: Running) -> None:
    with watched(chromium, service.url + link_to({}), viewport=WIDE, reduced_motion="reduce") as (page, _):
        asked: list[str] = []
        page.on("request", lambda request: asked.append(request.url) if "/picture" in request.url else None)
        loaded(page)
        shown = "() => [...document.querySelectorAll('.tile img[src]')].filter(({naturalWidth}) => naturalWidth).length"
        page.wait_for_function(f"() => ({shown})() > 4")
        page.wait_for_load_state("networkidle")
        pictures = [url for url in asked if url.endswith("/picture") and "/textures/" in url]
        assert 4 < len(pictures) < len(rw.textures()) / 2
        page.evaluate("() => { const wall = document.getElementById('texture'); wall.scrollTop = wall.scrollHeight; }")
        last = "() => [...document.querySelectorAll('.tile img')].at(-1).naturalWidth"
        page.wait_for_function(f"() => ({last})() === 240")
        page.evaluate("() => { document.getElementById('texture').scrollTop = 0; }")
        page.wait_for_load_state("networkidle")
        pictures = [url for url in asked if url.endswith("/picture") and "/textures/" in url]
        assert len(pictures) == len(set(pictures)) < len(rw.textures())


def test_the_search_hides_what_lacks_a_word(still_page: Page) -> None:
    shown = """() => [...document.querySelectorAll('.tile input')].filter((one) => one.checkVisibility())
      .map(({value}) => value)"""
    everything = len(still_page.evaluate(shown))
    still_page.fill("#texture-search", "corduroy wide")
    assert still_page.evaluate(shown) == ["corduroy-8-wale"]
    still_page.fill("#texture-search", "Abrasives")
    assert still_page.evaluate(shown) == offered()["Abrasives"]
    still_page.fill("#texture-search", "xylophone")
    assert still_page.evaluate(shown) == [] and still_page.is_visible("text=No texture has these words.")
    still_page.fill("#texture-search", "")
    assert len(still_page.evaluate(shown)) == everything == sum(len(names) for names in offered().values()) + 1


def test_the_slots_change_between_two_textures_and_each_follows_the_choice(still_page: Page) -> None:
    texture = "() => ridgewave.state.scene.texture?.kind ?? 'sinusoid'"
    words = "() => [...document.querySelectorAll('.slots span')].map(({textContent}) => textContent)"
    still_page.check(tile(NAME))
    still_page.click("#slot-b")
    assert still_page.evaluate(texture) == NAME, "an empty slot takes the present texture"
    still_page.check(tile(LINEN))
    assert still_page.evaluate(words) == [
        "Cotton percale of 200 threads",
        "Linen, 40 threads per inch",
    ]
    for slot, kind in (("a", NAME), ("b", LINEN), ("a", NAME)):
        still_page.click(f"#slot-{slot}")
        assert still_page.evaluate(texture) == kind == still_page.evaluate(CHOSEN)
        assert still_page.get_attribute(f"#slot-{slot}", "aria-pressed") == "true"
    still_page.check(tile("sinusoid"))
    still_page.click("#slot-b")
    still_page.click("#slot-a")
    assert still_page.evaluate(texture) == "sinusoid"
