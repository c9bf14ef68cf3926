"""Importing a measured surface on the page: measured first, kept under a name, played, renamed and deleted."""

from __future__ import annotations

import io
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from PIL import Image

from tests.clients.web.browser import kept_page, visited
from tests.clients.web.conftest import link_to, loaded
from tests.clients.web.page_service import serving_pages
from tests.clients.web.test_accessibility import NARROW, violations
from tests.clients.web.test_page import stroke_pad, told
from tests.service.harness import START, Running, kept_engine, roomy_settings, until

if TYPE_CHECKING:
    from playwright.sync_api import Browser, FilePayload, Page

HEIGHTS = 20.0 * np.sin(2.0 * np.pi * np.arange(400) / 40)  # um, every 5 um
SCAN: FilePayload = {
    "name": "Turned metal.csv",
    "mimeType": "text/csv",
    "buffer": "\n".join(map(str, HEIGHTS)).encode(),
}
REFUSED = "status of (409|422)"  # what Chromium logs of a fault
KEEP = "dialog button.primary"
SCENE = "() => ridgewave.state.scene"
DROP = """({name, text}) => {
  const dataTransfer = new DataTransfer();
  dataTransfer.items.add(new File([text], name));
  const event = (kind) => new DragEvent(kind, {dataTransfer, bubbles: true, cancelable: true});
  const pad = document.getElementById("pad");
  const taken = !pad.dispatchEvent(event("dragover"));
  return [taken, document.body.hasAttribute("data-dropping"), !pad.dispatchEvent(event("drop"))];
}"""


@pytest.fixture(scope="module")
def own(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Running]:
    """The service with a data folder of its own."""
    folder = tmp_path_factory.mktemp("data")
    with serving_pages(kept_engine(), data_folder=folder, **roomy_settings()) as running:
        until(lambda: running.service.warm, START)
        yield running


@pytest.fixture(scope="module")
def kept(chromium: Browser) -> Iterator[Page]:
    with kept_page(chromium, viewport={"width": 1280, "height": 900}) as page:
        yield page


@pytest.fixture
def page(kept: Page, own: Running) -> Iterator[Page]:
    """The page with the finger of the paper, whose tables take a tenth of a fingertip's time; nothing imported."""
    kept.emulate_media(reduced_motion="reduce")
    with visited(kept, own.url + link_to({})) as watch:
        watch.allow(REFUSED)
        loaded(kept)
        yield kept
    for texture in stored(own):
        own.client.delete(f"/v1/textures/{texture['name']}").raise_for_status()


def stored(own: Running) -> list[dict[str, Any]]:
    return [entry for entry in own.client.get("/v1/textures").json()["textures"] if entry["stored"]]


def imported(own: Running, name: str = "cloth", **changed: str) -> dict[str, Any]:
    """Import the scan without the page."""
    fields = {"unit": "um", "pixel": "5 um", "name": name, **changed}
    answer = own.client.post("/v1/textures", files={"file": ("scan.csv", SCAN["buffer"])}, data=fields)
    assert answer.status_code == 201, answer.text
    return dict(answer.json())


def chosen(page: Page, file: FilePayload = SCAN) -> None:
    """Choose a file beside the menu and return when the service has answered."""
    page.set_input_files("#import", file)
    answered(page)


def answered(page: Page) -> None:
    text = "(document.querySelector('dialog [role=status]')?.textContent ?? '')"
    page.wait_for_function(f"() => /^(?!Reading)./.test({text})")


def measured(page: Page, **given: str) -> None:
    """Enter options, and return when Keep can be pressed.

    Each change has the service read the file anew, in a process of its own: of these options the last one does.
    """
    *others, (last, value) = given.items()
    for name, text in others:
        page.locator(f"#import-{name}").evaluate("(option, text) => { option.value = text; }", text)
    option = page.locator(f"#import-{last}")
    option.fill(value)
    option.press("Tab")
    page.wait_for_selector(f"{KEEP}:enabled")


def faults(page: Page) -> dict[str, str]:
    """Return the shown faults by the option that they stand beside."""
    found: dict[str, str] = page.evaluate(
        """() => Object.fromEntries([...document.querySelectorAll("dialog [aria-invalid=true]")].map((control) =>
             [control.name, document.getElementById(control.id + "-fault").textContent]))"""
    )
    return found


def yours(page: Page) -> list[str]:
    found: list[str] = page.evaluate(
        "() => [...document.querySelectorAll('optgroup[label=Yours] option')].map(({value}) => value)"
    )
    return found


def test_a_chosen_file_is_measured_kept_under_a_name_that_no_other_has_and_played(page: Page, own: Running) -> None:
    imported(own, "cloth", pixel="7 um")
    chosen(page)
    measured(page, unit="um", pixel="5 µm")
    text = page.inner_text("dialog .import-found")
    for shown in ("400 points over 2 mm", "Rq 14.14 µm", "40 µm", "rms slope", "um, given", "Nothing is kept yet"):
        assert shown in text
    assert page.locator("dialog img").evaluate("(image) => image.decode().then(() => image.naturalWidth)") > 0
    measured(page, name="cloth")
    assert [entry["name"] for entry in stored(own)] == ["cloth"]
    page.click(KEEP)
    page.wait_for_selector("#import-name[aria-invalid=true]")
    assert "exists already" in faults(page)["name"]
    measured(page, name="my-turned-metal")
    page.click(KEEP)
    told(page, "my-turned-metal is kept")
    (entry,) = (entry for entry in stored(own) if entry["name"] != "cloth")
    assert (entry["name"], yours(page)) == ("my-turned-metal", ["cloth", "my-turned-metal"])
    assert page.input_value("#texture") == "my-turned-metal" and page.locator("dialog").count() == 0
    assert page.evaluate(SCENE) == entry["scene"]
    stroke_pad(page)
    assert page.evaluate("() => ridgewave.fingers[0].scene.held") == entry["scene"]


def test_what_the_file_does_not_state_is_asked_for_beside_its_field(page: Page, own: Running) -> None:
    chosen(page)
    assert set(faults(page)) == {"unit", "pixel"}
    assert "the file does not state its unit" in faults(page)["unit"]
    assert page.evaluate("() => document.activeElement.id") == "import-unit"
    assert page.is_disabled(KEEP)
    page.fill("#import-pixel", "5 parsec")
    page.keyboard.press("Tab")
    page.wait_for_function("() => document.querySelector('#import-pixel-fault').textContent.includes('parsec')")
    measured(page, unit="um", pixel="5 um")
    assert faults(page) == {} and page.input_value("#import-name") == "turned-metal"
    page.fill("#import-name", "No Name")
    page.click(KEEP)
    page.wait_for_selector("#import-name[aria-invalid=true]")
    page.keyboard.press("Escape")
    page.wait_for_selector("dialog", state="detached")
    assert page.evaluate("() => document.activeElement.id") == "import" and stored(own) == []


def test_every_option_reaches_the_service_and_axe_finds_nothing_serious(page: Page, own: Running) -> None:
    grey = np.add.outer(np.arange(12), 2.0 * np.arange(20) + 20.0 * np.sin(np.arange(20))).astype(np.uint8)
    written = io.BytesIO()
    Image.fromarray(grey).save(written, "PNG")
    page.evaluate("() => ridgewave.state.write(['output', 'bandwidth'], 100)")  # in a wider band it is slow to plan
    chosen(page, {"name": "leather.png", "mimeType": "image/png", "buffer": written.getvalue()})
    assert set(faults(page)) == {"height", "pixel"}
    assert violations(page, "dialog") == []
    page.set_viewport_size({"width": NARROW["width"], "height": NARROW["height"]})
    measured(page, level="curvature", missing="fill", height="100 um", pixel="20 um, 30 um")
    assert violations(page, "dialog") == []
    width = "() => document.querySelector('dialog').scrollWidth - document.querySelector('dialog').clientWidth"
    assert page.evaluate(width) == 0
    measured(page, name="hide")
    text = page.inner_text("dialog .import-found")
    assert "400 µm × 360 µm, 20 × 12 points" in text and "Sq, Sa" in text and "curvature" in text
    page.click(KEEP)
    told(page, "hide is kept")
    (entry,) = stored(own)
    report = entry["report"]
    assert (report["level"], report["missing"]["rule"], report["spacing"]) == ("curvature", "fill", [2e-5, 3e-5])
    page.click("#texture-sources summary")
    assert violations(page, "main") == []
    page.set_viewport_size({"width": 1280, "height": 900})


def test_a_dropped_file_opens_the_import_and_one_that_is_no_surface_says_why(page: Page) -> None:
    assert page.evaluate(DROP, {"name": "noise.png", "text": "no picture"}) == [True, True, True]
    answered(page)
    assert page.inner_text("#import-title") == "Import noise.png"
    assert page.get_attribute("body", "data-dropping") is None
    text = page.inner_text("dialog [role=status]")
    assert "a file of no known format. Allowed: text, NPY, PNG" in text and page.is_disabled(KEEP)
    page.click("dialog button:has-text('Cancel')")
    page.wait_for_selector("dialog", state="detached")


def test_a_texture_is_renamed_and_deleted_where_it_is_described(page: Page, own: Running) -> None:
    imported(own, "cloth")
    imported(own, "wool", pixel="7 um")
    page.reload()
    loaded(page)
    page.select_option("#texture", "cloth")
    page.click("#texture-sources summary")
    page.wait_for_function("() => document.querySelector('#texture-sources').textContent.includes('14.14 µm')")
    scene = page.evaluate(SCENE)
    page.fill("#own-name", "wool")
    page.keyboard.press("Enter")
    page.wait_for_function("() => document.querySelector('#own-name-fault').textContent.includes('exists already')")
    page.fill("#own-name", "silk")
    page.keyboard.press("Enter")
    told(page, "cloth is now called silk")
    assert (yours(page), page.input_value("#texture")) == (["silk", "wool"], "silk")
    assert page.evaluate(SCENE) == scene and page.is_visible("#own-delete")
    page.once("dialog", lambda dialog: dialog.dismiss())
    page.click("#own-delete")
    assert {entry["name"] for entry in stored(own)} == {"silk", "wool"}
    page.once("dialog", lambda dialog: dialog.accept())
    page.click("#own-delete")
    told(page, "silk is deleted")
    assert (yours(page), page.input_value("#texture"), page.evaluate(SCENE)) == (["wool"], "sinusoid", {})
    assert page.is_hidden("#texture-sources")


def test_a_link_to_a_name_shows_the_surface_in_menu_and_form(page: Page, own: Running) -> None:
    scene = imported(own, "cloth")["scene"]
    page.goto(own.url + link_to({"texture": {"kind": "cloth", "phase": "1 rad"}}))
    page.reload()
    loaded(page)
    assert page.evaluate(SCENE) == {"texture": {**scene["texture"], "phase": "1 rad"}}
    assert page.input_value("#texture") == "cloth"
    shown = "(id) => { const one = document.getElementById(id); return one.selectedOptions?.[0].text ?? one.value; }"
    assert page.evaluate(shown, "field-texture-kind") == "profile"
    assert page.evaluate(shown, "field-texture-surface") == scene["texture"]["surface"]
    page.wait_for_function("() => document.querySelector('#plan li') !== null")
    assert page.locator("#form .fault:visible").count() == 0
