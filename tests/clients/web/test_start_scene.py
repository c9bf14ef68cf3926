"""The page begins with a fingertip; a link, a file and the catalogue give exactly the scene that they have."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

from tests.clients.web.conftest import START_SCENE, loaded
from tests.clients.web.form import tile
from tests.clients.web.test_one_state import AGREED, linked

if TYPE_CHECKING:
    from playwright.sync_api import Page

SCENE = "() => ridgewave.state.scene"
TOUCH = """() => { const pad = document.getElementById("pad"); const {left, top} = pad.getBoundingClientRect();
  const event = (kind, x) => pad.dispatchEvent(new PointerEvent(kind,
    {pointerId: 41, pointerType: "touch", button: 0, clientX: left + x, clientY: top + 50, bubbles: true}));
  event("pointerdown", 20);
  setInterval(() => event("pointermove", 100 + 80 * Math.sin(performance.now() / 200)), 8); }"""


def test_the_first_touch_is_that_of_a_fingertip_and_sounds(touch_page: Page) -> None:
    assert touch_page.evaluate(SCENE) == START_SCENE and linked(touch_page) is None
    assert touch_page.is_disabled("#undo")
    touch_page.evaluate(TOUCH)
    heard = "ridgewave.fingers.some(({source}) => source?.played > 4800)"
    touch_page.wait_for_function(f"() => {heard}")
    assert touch_page.evaluate("() => ridgewave.fingers[0].scene.held") == START_SCENE
    label = "document.getElementById('waveform').getAttribute('aria-label')"
    touch_page.wait_for_function(f"() => /acceleration: the largest value is (?!0 )/.test({label})")


def test_the_views_show_where_a_fingertip_touches(touch_page: Page) -> None:
    touch_page.wait_for_function(AGREED)
    told = touch_page.get_attribute("#contact", "aria-label") or ""
    patches, shown = re.search(r"(\d+) contact patches, .* of ([0-9.]+) mm", told), "#plan li"
    assert patches is not None and int(patches[1]) > 1, told
    assert 2.0 < float(patches[2]) < 20.0, "the part of the finger that touches, not all of it"
    touch_page.wait_for_selector(shown, state="attached")
    assert touch_page.inner_text("#accuracy [role=status]") == ""


def test_a_texture_of_the_catalogue_keeps_the_finger(touch_page: Page) -> None:
    touch_page.check(tile("grating-500um-40um"))
    assert touch_page.evaluate(SCENE) == START_SCENE | {"texture": {"kind": "grating-500um-40um"}}
    touch_page.check(tile("sinusoid"))
    assert touch_page.evaluate(SCENE) == linked(touch_page) == {"finger": START_SCENE["finger"]}
    touch_page.check(tile("corduroy-8-wale"))
    assert touch_page.evaluate(SCENE) == START_SCENE and linked(touch_page) is None


def test_a_link_to_the_comb_stays_one(comb_page: Page) -> None:
    scenes: list[Any] = [comb_page.evaluate(SCENE), linked(comb_page)]
    comb_page.evaluate("() => ridgewave.state.write(['scan', 'load'], '1 N')")
    comb_page.click("#undo")
    scenes.append(linked(comb_page))
    comb_page.reload()
    loaded(comb_page)
    assert [*scenes, comb_page.evaluate(SCENE)] == [{}] * 4
