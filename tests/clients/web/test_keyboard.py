"""The page with a keyboard: the focus is seen and not lost, and the address of the page stays a link to the scene."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from tests.clients.web.conftest import loaded

if TYPE_CHECKING:
    from playwright.sync_api import Page

FOCUS = "() => document.activeElement.id"
TOUCHING = "() => ridgewave.fingers.some(({touching}) => touching)"
COVERED = """() => {
  const one = document.activeElement;
  const {left, top, width} = (one.type === "file" ? one.closest("label") : one).getBoundingClientRect();
  const bar = document.querySelector(".bar");
  if (one === document.body || bar.contains(one) || one.matches(".skip")) return null;
  return top < bar.getBoundingClientRect().bottom ? [one.id || one.textContent, left, top, width] : null;
}"""


def test_the_link_that_skips_to_the_pad_keeps_the_scene_in_the_address(comb_page: Page) -> None:
    comb_page.evaluate("() => ridgewave.state.write(['texture', 'period'], '1 mm')")
    address = comb_page.url
    comb_page.evaluate("() => document.activeElement.blur()")
    comb_page.keyboard.press("Tab")
    assert comb_page.evaluate("() => document.activeElement.className") == "skip"
    comb_page.keyboard.press("Enter")
    assert (comb_page.evaluate(FOCUS), comb_page.url) == ("pad", address)
    comb_page.reload()
    loaded(comb_page)
    assert comb_page.evaluate("() => ridgewave.state.scene") == {"texture": {"period": "1 mm"}}


def test_the_bar_covers_no_control_that_gets_the_focus(comb_page: Page) -> None:
    comb_page.wait_for_function("() => document.getElementById('contact').tabIndex === 0")
    comb_page.focus("#fold")
    covered = []
    for _ in range(30):
        comb_page.keyboard.press("Shift+Tab")
        covered.append(comb_page.evaluate(COVERED))
    assert not [one for one in covered if one]


def test_undo_passes_the_focus_to_redo_when_nothing_is_left_to_undo(comb_page: Page) -> None:
    comb_page.evaluate("() => ridgewave.state.take({})")
    comb_page.evaluate("() => ridgewave.state.write(['texture', 'period'], '1 mm')")
    comb_page.focus("#undo")
    while comb_page.evaluate("() => ridgewave.state.canUndo"):
        comb_page.keyboard.press("Enter")
    assert comb_page.evaluate(FOCUS) == "redo"
    comb_page.keyboard.press("Enter")
    assert comb_page.evaluate(FOCUS) in ("redo", "undo")
    assert comb_page.is_enabled("#undo")


HELD = """([place, name]) => {
  const owner = place === "session" ? ridgewave.session : window;
  const [work, gate] = [owner[name].bind(owner), new Promise((done) => { window.letGo = done; })];
  owner[name] = (...rest) => gate.then(() => work(...rest));
}"""


@pytest.mark.parametrize(
    ("button", "after", "held"),
    [("save-wav", "Download WAV", ["window", "fetch"]), ("record", "Stop recording", ["session", "renew"])],
)
def test_a_button_whose_work_takes_a_while_keeps_the_focus(
    comb_page: Page, button: str, after: str, held: list[str]
) -> None:
    comb_page.evaluate(HELD, held)
    comb_page.focus(f"#{button}")
    comb_page.keyboard.press("Space")
    comb_page.wait_for_function("() => document.activeElement === document.body")
    assert comb_page.is_disabled(f"#{button}")
    comb_page.evaluate("() => letGo()")
    comb_page.wait_for_function("(button) => !document.getElementById(button).disabled", arg=button)
    assert (comb_page.evaluate(FOCUS), comb_page.inner_text(f"#{button}")) == (button, after)


def test_ctrl_z_undoes_wherever_no_text_is_written(comb_page: Page) -> None:
    """On a choice of the accuracy, and on the file that was imported, it did nothing."""
    for focus in (
        "#accuracy input[type=radio]:checked",
        "#import",
        "#open-scene",
        "#load",
        "#texture input:checked",
        "#undo",
    ):
        comb_page.evaluate("() => ridgewave.state.write(['texture', 'period'], '1 mm')")
        comb_page.focus(focus)
        comb_page.keyboard.press("Control+z")
        assert comb_page.evaluate("() => ridgewave.state.scene") == {}, focus


def test_a_removed_item_of_a_list_passes_the_focus_on(comb_page: Page) -> None:
    amplitudes = ["1 um", "2 um", "3 um"]
    comb_page.evaluate("(amplitudes) => ridgewave.state.take({texture: {kind: 'harmonics', amplitudes}})", amplitudes)
    comb_page.evaluate("() => { document.querySelector('#section-texture').open = true; }")
    focused = "() => document.activeElement.getAttribute('aria-label') ?? document.activeElement.textContent"
    comb_page.locator("#section-texture .drop").last.focus()
    for name in ("Remove Amplitudes, 2", "Add"):
        comb_page.keyboard.press("Enter")
        assert comb_page.evaluate(focused) == name
    assert comb_page.evaluate("() => ridgewave.state.scene.texture.amplitudes") == ["1 um"]


def test_an_arrow_puts_the_finger_down_again_unless_space_lifted_it(comb_page: Page) -> None:
    keyboard = comb_page.keyboard
    comb_page.focus("#pad")
    keyboard.press("ArrowRight")
    comb_page.wait_for_function(TOUCHING)
    keyboard.press("Tab")
    assert not comb_page.evaluate(TOUCHING)
    comb_page.focus("#pad")
    keyboard.press("ArrowLeft")
    comb_page.wait_for_function(TOUCHING)
    keyboard.press("Space")
    assert not comb_page.evaluate(TOUCHING)
    keyboard.press("ArrowRight")
    comb_page.wait_for_timeout(50)  # of the steps of the arrow, which a finger in the air makes too
    assert not comb_page.evaluate(TOUCHING)
    keyboard.press("Space")
    comb_page.wait_for_function(TOUCHING)
