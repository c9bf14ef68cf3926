"""Use without a mouse and without sight: axe-core finds nothing serious, and every control has a name."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, Any

import pytest

from tests.clients.web.browser import visited, watched
from tests.clients.web.conftest import START_SCENE, WIDE, link_to, loaded
from tests.service.harness import Running

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

NARROW = {"width": 360, "height": 740}
LOOKS: dict[str, dict[str, Any]] = {
    "light": {"viewport": WIDE, "color_scheme": "light"},
    "dark": {"viewport": WIDE, "color_scheme": "dark"},
    "narrow": {"viewport": NARROW, "color_scheme": "light", "has_touch": True},
    "narrow dark": {"viewport": NARROW, "color_scheme": "dark", "has_touch": True},
}
GRAVE = ("serious", "critical")


def violations(page: Page, part: str | None = None) -> list[str]:
    """Return what axe-core finds that is serious or critical, in the page or a part of it: rule, and the elements."""
    axe = pytest.importorskip("axe_playwright_python.sync_playwright")
    found = axe.Axe().run(page, part).response["violations"]
    return [
        f"{rule['id']}: {rule['help']}: {[(node['target'], node['failureSummary']) for node in rule['nodes']]}"
        for rule in found
        if rule["impact"] in GRAVE
    ]


@pytest.mark.parametrize(
    ("look", "opened"),
    [
        ("narrow dark", True),
        pytest.param("light", False, marks=pytest.mark.thorough),  # below, while it is touched
        pytest.param("light", True, marks=pytest.mark.thorough),
        pytest.param("dark", True, marks=pytest.mark.thorough),
        pytest.param("narrow", True, marks=pytest.mark.thorough),
    ],
)
def test_axe_finds_nothing_serious(chromium: Browser, service: Running, look: str, opened: bool) -> None:
    with watched(chromium, service.url + link_to({} if opened else START_SCENE), **LOOKS[look]) as (page, _):
        loaded(page)  # opened: every effect is offered with the comb
        if opened:
            page.evaluate("() => document.querySelectorAll('details').forEach((section) => { section.open = true; })")
            page.evaluate("() => ridgewave.state.write(['output', 'bandwidth'], 1000)")  # wider bands are slow to plan
            for effect in ("inertia", "viscous_skin"):
                page.evaluate("(effect) => ridgewave.state.write(['effects', effect], {})", effect)
        page.wait_for_function("() => document.querySelector('#plan li') !== null")
        assert violations(page) == []


def test_axe_finds_nothing_serious_before_any_answer_has_come(kept_touch_page: Page, service: Running) -> None:
    page = kept_touch_page
    page.route("**/v1/{picture,explain,threshold}*", lambda _: None)  # held for as long as the page is open
    with visited(page, service.url + "/"):
        loaded(page)
        assert page.is_visible("#pad-note")
        assert violations(page) == []


def test_axe_finds_nothing_serious_while_it_is_touched(comb_page: Page) -> None:
    comb_page.click("#stroke")
    comb_page.wait_for_function("() => document.querySelector('.views.live') !== null")
    assert violations(comb_page) == []


def test_on_a_phone_nothing_is_too_wide_and_a_finger_has_room_on_every_control(
    chromium: Browser, service: Running
) -> None:
    with watched(chromium, service.url + "/", **LOOKS["narrow"], is_mobile=True) as (page, _):
        loaded(page)
        page.evaluate("() => document.querySelectorAll('details').forEach((section) => { section.open = true; })")
        assert page.evaluate("() => document.documentElement.scrollWidth") <= NARROW["width"]
        small = page.evaluate(
            """() => [...document.querySelectorAll("button, select, summary, .button, input:not([type=file])")]
                 .filter((control) => control.checkVisibility())
                 .map((one) => [one.id || one.textContent || one.type, (one.closest("label") ?? one)])
                 .filter(([, control]) => control.getBoundingClientRect().height < 43.9).map(([name]) => name)"""
        )
        assert small == []


def test_headings_go_down_by_one_level_at_a_time(still_page: Page) -> None:
    headings = "document.querySelectorAll('h1, h2, h3, h4')"
    levels = still_page.evaluate(f"() => [...{headings}].map((one) => Number(one.tagName[1]))")
    assert levels[0] == 1
    assert levels.count(1) == 1
    assert all(after - before <= 1 for before, after in pairwise(levels))


def test_the_tab_key_reaches_every_control_and_shows_where_it_is(still_page: Page) -> None:
    wanted: set[Any] = set(
        still_page.evaluate(
            """() => [...document.querySelectorAll("button, select, summary, input, a, [tabindex='0']")]
                 .filter((one) => one.checkVisibility() && !one.disabled && one.type !== "radio")
                 .map((one, index) => { one.dataset.stop = index; return index; })"""
        )
    )
    reached: set[Any] = set()
    still_page.focus("body")
    for _ in range(3 * len(wanted)):
        still_page.keyboard.press("Tab")
        stop, outline = still_page.evaluate(
            """() => { const one = document.activeElement;
                 const seen = one.type === "file" ? one.closest("label") : one;
                 return [one.dataset.stop, getComputedStyle(seen).outlineStyle]; }"""
        )
        if stop is not None:
            assert outline != "none", stop
            reached.add(int(stop))
    assert wanted <= reached
