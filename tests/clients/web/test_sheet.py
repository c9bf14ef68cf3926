"""The drawer of the scene, the sheets under the pad of a narrow screen, and the answer in words."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

from tests.clients.web.browser import watched
from tests.clients.web.conftest import link_to, loaded

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

    from tests.service.harness import Running

PHONE: dict[str, Any] = {"viewport": {"width": 390, "height": 844}, "has_touch": True, "is_mobile": True}
PARTS = (".feel", ".plots", ".scene-fields")
SECTIONS = "() => [...document.querySelectorAll('#form > details')].map(({id}) => id.replace('section-', ''))"
FELT = """async ([drawn, quantity]) =>
  (await import("/web/page/answer.js")).answerOf({drawn, quantity, fullScale: 1})"""


def test_the_drawer_opens_with_the_fields_that_are_set_first(chromium: Browser, service: Running) -> None:
    scene = {"output": {"bandwidth": "1 kHz"}, "texture": {"amplitude": "30 um"}}
    with watched(chromium, service.url + link_to(scene), reduced_motion="reduce") as (page, _):
        loaded(page)
        usual = page.evaluate(SECTIONS)
        assert page.is_hidden("#scene") and page.get_attribute("#drawer", "aria-expanded") == "false"
        page.click("#drawer")
        assert page.is_visible("#scene") and page.get_attribute("#drawer", "aria-expanded") == "true"
        first = [name for name in usual if name in scene]
        assert page.evaluate(SECTIONS) == first + [name for name in usual if name not in scene]
        fields = (
            "() => document.querySelector('#section-texture .fields .field input, #section-texture .fields select').id"
        )
        assert page.evaluate(fields) == "field-texture-amplitude"
        page.click("#close-drawer")
        assert page.is_hidden("#scene")
        assert page.evaluate("() => document.activeElement.id") == "drawer"


def test_the_search_shows_only_fields_with_its_words(still_page: Page) -> None:
    shown = (
        "() => [...document.querySelectorAll('#form details')].filter((one) => one.checkVisibility()).map(({id}) => id)"
    )
    before = still_page.evaluate(shown)
    still_page.fill("#scene-search", "ridge period")
    assert still_page.evaluate(shown) == ["section-finger"]
    assert still_page.is_visible("#field-finger-ridge_period") and still_page.is_hidden("#field-finger-friction")
    still_page.fill("#scene-search", "")
    assert set(before) <= set(still_page.evaluate(shown))


def test_a_phone_shows_one_sheet_at_a_time_under_a_pad_that_stays(chromium: Browser, service: Running) -> None:
    with watched(chromium, service.url + link_to({}), **PHONE, reduced_motion="reduce") as (page, _):
        loaded(page)
        pad = page.locator("#pad").bounding_box()
        assert pad is not None and (pad["width"], pad["height"]) == (390, 470)
        for tab, part in zip(("plot", "scene", "feel"), (PARTS[1], PARTS[2], PARTS[0]), strict=True):
            page.click(f"[data-tab={tab}]")
            assert [one for one in PARTS if page.is_visible(one)] == [part]
            page.evaluate("() => scrollTo(0, 0)")
            assert page.locator("#pad").bounding_box() == pad
        sheet = page.locator(".sheet")
        open_sheet = sheet.bounding_box()
        page.click("[data-tab=feel]")  # pressed again, it closes
        shut = sheet.bounding_box()
        assert open_sheet is not None and shut is not None and shut["height"] == 104 < 400 < open_sheet["height"]
        assert shut["y"] + shut["height"] == 844
        for one in ("#texture-search", "label[for=import]", "#slot-b", "#load"):
            box = page.locator(one).bounding_box()
            assert box is not None and box["width"] > 30 and box["y"] + box["height"] <= 844, one


@pytest.mark.parametrize(
    ("amplitude", "said"),
    [
        (4.0, "12 dB over threshold at 152 Hz"),
        (0.25, "12 dB under threshold at 152 Hz"),
        (1.1, "Near the threshold at 152 Hz"),
    ],
)
def test_the_answer_is_the_line_that_is_the_most_above_the_threshold(
    functions: Page, amplitude: float, said: str
) -> None:
    """A stronger line elsewhere, further below its threshold, does not count."""
    drawn = {
        "frequencies": [20, 152, 600],
        "amplitudes": [50 * amplitude, amplitude, 5 * amplitude],
        "threshold": [[10, 1000], [100, 1], [200, 1], [1000, 100]],
        "largest": {"amplitude": 50 * amplitude, "frequency": 20},
    }
    assert functions.evaluate(FELT, [drawn, "acceleration"]) == said


def test_silence_and_a_force_have_an_answer(functions: Page) -> None:
    drawn = {"frequencies": [100], "amplitudes": [0.0], "threshold": [[10, 1], [1000, 1]], "largest": {"amplitude": 0}}
    assert functions.evaluate(FELT, [drawn, "acceleration"]) == "No vibration."
    drawn |= {"threshold": [], "largest": {"amplitude": 1}}
    assert functions.evaluate(FELT, [drawn, "tangential_force"]) == "This quantity has no threshold."
    assert functions.evaluate(FELT, [drawn, "acceleration"]) == "", "it is not loaded yet"
