"""The panel of the table, the hint beside swatches, and the table on a phone."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from tests.clients.web.browser import headless
from tests.clients.web.headset import DRAW_LITTLE, at_the_table, iwer_script, three_folder

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page, Playwright

    from tests.service.harness import Running

SMALL = {"width": 200, "height": 160}  # px
PHONE = {"width": 390, "height": 844}  # px
BUTTONS = {"softer": 150, "harder": 430, "quieter": 730, "louder": 1010, "mute": 1300}  # px of 1440, their middles
ON_SCREEN = """(place) => {
  const {room} = ridgewave;
  const {left, top, width, height} = document.querySelector("#view").getBoundingClientRect();
  const {x, y} = place.project(room.camera);
  return [left + (x + 1) / 2 * width, top + (1 - y) / 2 * height];
}"""
OF_BUTTON = """(x) => {
  const {room, panel} = ridgewave;
  panel.mesh.updateWorldMatrix(true, false);
  return new room.three.Vector3((x / 1440 - 0.5) * 0.36, (0.5 - 340 / 440) * 0.11, 0);
}"""
BETWEEN = """() => {
  const [first, second] = ridgewave.room.layout.places;
  return {x: (first.x + second.x) / 2 - 0.001, z: first.z};
}"""


@pytest.fixture(scope="module")
def browser(playwright: Playwright) -> Iterator[Browser]:
    with headless(playwright, webgl=True) as chromium:
        yield chromium


@pytest.fixture(scope="module")
def three(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return three_folder(tmp_path_factory.mktemp("three"))


@pytest.fixture(scope="module")
def table(browser: Browser, service: Running, three: Path) -> Iterator[Page]:
    with at_the_table(browser, service.url, three) as (page, _):
        yield page


@pytest.fixture(scope="module")
def headset(
    browser: Browser, service: Running, three: Path, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Page]:
    iwer = iwer_script(tmp_path_factory.mktemp("npm"))
    with at_the_table(browser, service.url, three, iwer, viewport=SMALL) as (page, _):
        page.click("#enter:enabled")
        page.wait_for_function("() => ridgewave.tips.length === 2")
        yield page
        page.evaluate("() => { tools.session?.end(); }")
        page.wait_for_function("() => !ridgewave.session")


def gain(page: Page) -> float:
    return float(page.evaluate("() => Number(document.querySelector('#volume').value)"))


def test_a_mouse_presses_the_buttons_of_the_panel_and_touches_nothing(table: Page) -> None:
    before = gain(table)
    place = f"(x) => ({ON_SCREEN})(ridgewave.panel.mesh.localToWorld(({OF_BUTTON})(x)))"
    for action, change in (("louder", 0.1), ("quieter", 0.0)):
        table.mouse.click(*table.evaluate(place, BUTTONS[action]))
        assert gain(table) == pytest.approx(before + change)
    for pressed in ("true", "false"):
        table.mouse.click(*table.evaluate(place, BUTTONS["mute"]))
        assert table.get_attribute("#silence", "aria-pressed") == pressed
    stiffness = table.evaluate("() => ridgewave.fingertips.stiffness")
    table.mouse.click(*table.evaluate(place, BUTTONS["harder"]))
    assert table.evaluate("() => ridgewave.fingertips.stiffness") == 2 * stiffness
    table.mouse.click(*table.evaluate(place, BUTTONS["softer"]))
    assert table.evaluate("() => ridgewave.touches") == []


def test_a_mouse_that_presses_beside_the_swatches_is_told_the_nearest(table: Page) -> None:
    place = f"""() => {{
      const {{x, z}} = ({BETWEEN})();
      const {{room}} = ridgewave;
      return ({ON_SCREEN})(room.table.localToWorld(new room.three.Vector3(x, 0, z)));
    }}"""
    table.mouse.move(*table.evaluate(place))
    table.mouse.down()
    table.wait_for_function(
        "() => document.querySelector('#touch').textContent.startsWith('No texture here. Nearest: ')"
    )
    assert table.evaluate("() => ridgewave.room.swatches[0].material.emissive.getHex()") == 0xE8590C
    assert table.evaluate("() => ridgewave.touches") == []
    table.mouse.up()
    table.wait_for_function("() => document.querySelector('#touch').textContent === ''")


def test_a_fingertip_presses_a_button_once_until_it_has_left(headset: Page) -> None:
    before = gain(headset)
    report: dict[str, Any] = headset.evaluate(
        """async (place) => {
          const {room, panel} = ridgewave;
          const {right} = tools.device.controllers;
          const at = (ahead) => room.onTable(panel.mesh.localToWorld(
            new room.three.Vector3((place / 1440 - 0.5) * 0.36, (0.5 - 340 / 440) * 0.11, ahead)));
          const put = async (ahead) => {
            const {radius} = tools.tip("right controller");
            const {x, y, z} = at(ahead);
            await tools.put(right, "right controller", {x, y: y - radius, z});
          };
          const gains = [];
          for (const ahead of [0.05, 0.004, 0.001, 0.05, 0.004]) {
            await put(ahead);
            await tools.frames(2);
            gains.push(Number(document.querySelector("#volume").value));
          }
          await put(0.05);
          return gains;
        }""",
        BUTTONS["louder"],
    )
    assert report == pytest.approx([before, before + 0.1, before + 0.1, before + 0.1, before + 0.2])


def test_a_ray_presses_the_button_at_which_it_points(headset: Page) -> None:
    before = gain(headset)
    headset.evaluate(
        """async (place) => {
          const {room, panel} = ridgewave;
          const {right} = tools.device.controllers;
          const {Vector3, Quaternion} = room.three;
          const at = (ahead) => panel.mesh.localToWorld(
            new Vector3((place / 1440 - 0.5) * 0.36, (0.5 - 340 / 440) * 0.11, ahead));
          const [to, from] = [at(0), at(0.3)];
          right.position.set(from.x, from.y, from.z);
          const turn = new Quaternion().setFromUnitVectors(new Vector3(0, 0, -1), to.sub(from).normalize());
          right.quaternion.set(turn.x, turn.y, turn.z, turn.w);
          await tools.frames(3);
          right.updateButtonValue("trigger", 1);
          await tools.frames(3);
          right.updateButtonValue("trigger", 0);
          await tools.frames(3);
        }""",
        BUTTONS["quieter"],
    )
    assert gain(headset) == pytest.approx(before - 0.1)


def test_on_a_phone_the_labels_are_large_and_a_finger_moves_the_table(
    browser: Browser, service: Running, three: Path
) -> None:
    with at_the_table(browser, service.url, three, viewport=PHONE, has_touch=True) as (page, _):
        page.evaluate(DRAW_LITTLE)
        left, right = (
            page.evaluate(
                f"""(side) => {{
                  const {{room}} = ridgewave;
                  const {{x, z}} = room.layout.places.at(-1);
                  const end = new room.three.Vector3(x + side * 0.07, -0.008, z + 0.04);
                  return ({ON_SCREEN})(room.table.localToWorld(end));
                }}""",
                side,
            )
            for side in (-1, 1)
        )
        wide = right[0] - left[0]
        assert len({round(place["x"], 6) for place in page.evaluate("() => ridgewave.room.layout.places")}) == 2
        assert wide > 110, "84 of 768 pixels of a label are 12 px of the screen"
        assert left[0] > 0 and right[0] < PHONE["width"]
        front = "() => ridgewave.room.camera.position.z"
        before = page.evaluate(front)
        page.evaluate(
            """() => {
              const view = document.querySelector("#view");
              const {left, top, width, height} = view.getBoundingClientRect();
              const send = (type, y) => view.dispatchEvent(new PointerEvent(type, {
                pointerId: 1, pointerType: "touch", button: 0, clientX: left + width / 2, clientY: top + y * height}));
              view.setPointerCapture = () => {};
              send("pointerdown", 0.5); send("pointermove", 0.7); send("pointerup", 0.7);
            }"""
        )
        page.wait_for_function("(before) => ridgewave.room.camera.position.z < before - 0.02", arg=before)
