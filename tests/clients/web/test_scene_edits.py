"""Undo, redo, links and merges of the page lose no change of a scene."""

from __future__ import annotations

import random
import string
from typing import TYPE_CHECKING

from synth.scene.merge import merge_patch
from synth.scene.scene import parse_scene
from tests.clients.web.conftest import START_SCENE
from tests.clients.web.form import PERIOD, REFUSED, at, scene_of, written
from tests.clients.web.random_scenes import drawn_scene, fields, near_default
from tests.service.harness import Running

if TYPE_CHECKING:
    from playwright.sync_api import Page

    from tests.clients.web.browser import Watch

MANY = 50
EXCLUSIVE = {
    "finger": [{"ridge_amplitude"}, {"roughness"}],
    "texture": [{"amplitude"}, {"roughness"}],
    "scan": [{"speed", "load"}, {"stroke"}, {"trajectory"}],
    "output": [{"quantity", "full_scale"}, {"channels"}],
}
"""Of each section, the sets of fields of which a scene has but one: docs/scene.md."""


def test_all_changes_are_undone_and_redone(watched_page: tuple[Page, Watch]) -> None:
    touch_page, watch = watched_page
    watch.allow(REFUSED)
    draw = random.Random(8)  # its scenes are rendered or refused
    scenes = [START_SCENE, *(drawn_scene(draw) for _ in range(5))]
    for scene in scenes[1:]:
        touch_page.evaluate("(scene) => ridgewave.state.take(scene)", scene)
    for scene in reversed(scenes[:-1]):
        touch_page.keyboard.press("Control+z")
        assert scene_of(touch_page) == scene
    assert touch_page.locator("#undo").is_disabled()
    for scene in scenes[1:]:
        touch_page.keyboard.press("Control+Shift+Z")
        assert scene_of(touch_page) == scene
    assert touch_page.locator("#redo").is_disabled()
    touch_page.keyboard.press("Control+z")
    touch_page.evaluate("(scene) => ridgewave.state.take(scene)", scenes[1])
    assert touch_page.locator("#redo").is_disabled(), "a change ends what could be redone"


def test_the_last_two_hundred_scenes_are_undone_and_no_more(touch_page: Page) -> None:
    undone = touch_page.evaluate(
        """async () => {
          const { UndoHistory } = await import("/web/scene/undo.js");
          const history = new UndoHistory({ scan: { speed: 0 } });
          for (let number = 1; number <= 201; number += 1) history.push({ scan: { speed: number } });
          const undone = [];
          while (history.canUndo) undone.push(history.undo().scan.speed);
          return undone;
        }"""
    )
    assert undone == list(range(200, 0, -1))


def test_a_slider_that_is_dragged_is_one_change(touch_page: Page) -> None:
    touch_page.evaluate("() => { document.querySelector('#section-scan').open = true; }")
    slider = touch_page.locator("[data-path='scan.speed'] input[type=range]")
    box = slider.bounding_box()
    assert box is not None
    touch_page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    touch_page.mouse.down()
    for part in (0.6, 0.7, 0.8):
        touch_page.mouse.move(box["x"] + part * box["width"], box["y"] + box["height"] / 2)
    touch_page.mouse.up()
    assert parse_scene(scene_of(touch_page)).scan.speed > 0.08
    touch_page.click("#undo")
    assert scene_of(touch_page) == START_SCENE
    assert touch_page.locator("#undo").is_disabled()


def test_ctrl_z_in_a_text_field_is_the_texts_own(still_page: Page) -> None:
    written(still_page, PERIOD, "1 mm")
    still_page.focus(PERIOD)
    still_page.keyboard.press("Control+z")
    assert scene_of(still_page) == {"texture": {"period": "1 mm"}}


def test_scenes_come_out_of_links_as_they_went_in(functions: Page) -> None:
    draw = random.Random(11)
    scenes = [{}, {"texture": {"period": "800 \u00b5m"}}, *(drawn_scene(draw) for _ in range(MANY))]
    back = functions.evaluate(
        """async (scenes) => { const {hashOf, sceneIn} = await import("/web/scene/link.js");
             return scenes.map((scene) => [hashOf(scene), sceneIn(hashOf(scene))]); }""",
        scenes,
    )
    for scene, (link, found) in zip(scenes, back, strict=True):
        assert found == scene
        assert set(link.removeprefix("#scene=")) <= {*string.ascii_letters, *string.digits, *"-_"}


def test_an_opened_link_restores_the_scene(comb_page: Page, service: Running) -> None:
    scene = {"texture": {"period": "1 mm"}, "effects": {"inertia": {"mass": "6 g"}}, "scan": {"stroke": {}}}
    comb_page.evaluate("(scene) => ridgewave.state.take(scene)", scene)
    comb_page.click("#share")
    other = comb_page.context.new_page()
    other.goto(comb_page.url)
    other.wait_for_function("() => window.ridgewave !== undefined")
    assert scene_of(other) == scene
    assert other.locator("#field-effects-inertia-mass").input_value() == "6 g"
    other.close()


def test_a_broken_link_is_told_in_one_sentence(still_page: Page) -> None:
    still_page.evaluate("() => { location.hash = '#scene=e30x!'; }")
    told = "document.getElementById('notice').textContent"
    still_page.wait_for_function(f"() => {told}.startsWith('The scene in this link')")
    assert scene_of(still_page) == {}


def test_the_part_that_is_told_makes_the_same_scene_at_the_service(functions: Page) -> None:
    draw = random.Random(13)
    pairs = [(drawn_scene(draw), drawn_scene(draw)) for _ in range(MANY)]
    parts = functions.evaluate(
        """async (pairs) => { const {partBetween} = await import("/web/scene/merge.js");
             return pairs.map(([before, after]) => partBetween(before, after)); }""",
        pairs,
    )
    for (before, after), part in zip(pairs, parts, strict=True):
        reached = {name: section for name, section in merge_patch(before, part).items() if section}
        assert reached == after


def test_a_field_that_is_written_leaves_no_two_that_displace_each_other(functions: Page) -> None:
    draw = random.Random(17)
    numbers = [(path, near_default(node)) for path, node in fields() if len(path) == 2]
    choices = [(path, value) for path, value in numbers if value is not None]
    cases = [(drawn_scene(draw), draw.choice(choices)) for _ in range(MANY)]
    changed = functions.evaluate(
        """async (cases) => { const {withField} = await import("/web/scene/merge.js");
             return cases.map(([scene, [path, value]]) => withField(scene, path, value)); }""",
        cases,
    )
    for (scene, (path, value)), found in zip(cases, changed, strict=True):
        assert at(found, path) == value
        for section, sets in EXCLUSIVE.items():
            given = [names for names in sets if names & found.get(section, {}).keys()]
            assert len(given) <= 1, (scene, path, given)
