"""Importing a measured surface on the page: measured first, kept under a name, played, renamed and deleted."""

from __future__ import annotations

import io
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from PIL import Image

from service.compute.import_process import Imports
from tests.clients.web.browser import visited
from tests.clients.web.conftest import DRAWER, WIDE, link_to, loaded
from tests.clients.web.form import CHOSEN, tile
from tests.clients.web.test_accessibility import NARROW, violations
from tests.clients.web.test_page import stroke_pad, told
from tests.service.harness import Running, outcome_here
from tests.synth.surfaces.maps.map_sets import CASES, made, surface

if TYPE_CHECKING:
    from playwright.sync_api import FilePayload, Page

HEIGHTS = 20.0 * np.sin(2.0 * np.pi * np.arange(400) / 40)  # um, every 5 um
SCAN: FilePayload = {
    "name": "Turned metal.csv",
    "mimeType": "text/csv",
    "buffer": "\n".join(map(str, HEIGHTS)).encode(),
}
REFUSED = "status of (409|422)"  # what Chromium logs of a fault
KEEP = "dialog button.primary"
SCENE = "() => ridgewave.state.scene"
FOCUS = "() => document.activeElement.id"
DROP = """({name, text}) => {
  const dataTransfer = new DataTransfer();
  dataTransfer.items.add(new File([text], name));
  const event = (kind) => new DragEvent(kind, {dataTransfer, bubbles: true, cancelable: true});
  const pad = document.getElementById("pad");
  const taken = !pad.dispatchEvent(event("dragover"));
  return [taken, document.body.hasAttribute("data-dropping"), !pad.dispatchEvent(event("drop"))];
}"""


@pytest.fixture
def page(kept_touch_page: Page, service: Running, monkeypatch: pytest.MonkeyPatch) -> Iterator[Page]:
    """The page with the finger of the paper, whose tables take a tenth of a fingertip's time; nothing imported."""
    monkeypatch.setattr(Imports, "_outcome", outcome_here)
    kept_touch_page.emulate_media(reduced_motion="reduce")
    with visited(kept_touch_page, service.url + link_to({})) as watch:
        watch.allow(REFUSED)
        watch.allow("status of 404 .*/picture")  # asked for under a name that has changed meanwhile
        loaded(kept_touch_page)
        kept_touch_page.evaluate(DRAWER)
        yield kept_touch_page
    kept_touch_page.set_viewport_size(WIDE)
    for texture in stored(service):
        service.client.delete(f"/v1/textures/{texture['name']}").raise_for_status()


def stored(service: Running) -> list[dict[str, Any]]:
    return [entry for entry in service.client.get("/v1/textures").json()["textures"] if entry["stored"]]


def imported(service: Running, name: str, pixel: str) -> dict[str, Any]:
    """Import the scan without the page, and return its partial scene."""
    fields = {"unit": "um", "pixel": pixel, "name": name}
    answer = service.client.post("/v1/textures", files={"file": ("scan.csv", SCAN["buffer"])}, data=fields)
    assert answer.status_code == 201, answer.text
    return dict(answer.json()["scene"])


def chosen(page: Page, file: FilePayload = SCAN) -> None:
    """Choose a file beside the menu and return when the service has answered."""
    page.set_input_files("#import", file)
    answered(page)


def answered(page: Page) -> None:
    text = "(document.querySelector('dialog [role=status]')?.textContent ?? '')"
    page.wait_for_function(f"() => /^(?!Reading)./.test({text})")


def measured(page: Page, **given: str) -> None:
    """Enter options, and return when Keep can be pressed.

    Each change has the service read the file anew: of these options the last one does.
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
        "() => [...document.querySelectorAll('[aria-label=Yours] input')].map(({value}) => value)"
    )
    return found


def test_a_chosen_file_is_measured_kept_under_a_name_that_no_other_has_and_played(page: Page, service: Running) -> None:
    imported(service, "cloth", "7 um")
    chosen(page)
    measured(page, unit="um", pixel="5 µm")
    text = page.inner_text("dialog .import-found")
    for shown in ("400 points over 2 mm", "Rq 14.14 µm", "40 µm", "rms slope", "um, given", "Nothing is kept yet"):
        assert shown in text
    assert page.locator("dialog img").evaluate("(image) => image.decode().then(() => image.naturalWidth)") > 0
    measured(page, name="cloth")
    assert [entry["name"] for entry in stored(service)] == ["cloth"]
    page.click(KEEP)
    page.wait_for_selector("#import-name[aria-invalid=true]")
    assert "exists already" in faults(page)["name"]
    assert page.evaluate(FOCUS) == "import-name"
    measured(page, name="my-turned-metal")
    page.click(KEEP)
    told(page, "my-turned-metal is kept")
    (entry,) = (entry for entry in stored(service) if entry["name"] != "cloth")
    assert (entry["name"], yours(page)) == ("my-turned-metal", ["cloth", "my-turned-metal"])
    assert page.evaluate(CHOSEN) == "my-turned-metal" and page.locator("dialog").count() == 0
    assert page.evaluate(SCENE) == entry["scene"]
    stroke_pad(page)
    assert page.evaluate("() => ridgewave.fingers[0].scene.held") == entry["scene"]


def test_unequal_steps_are_resampled_and_the_columns_are_shown(page: Page) -> None:
    text = b"X [um]\tZ [um]\n0\t0\n1\t2\n2.3\t4.6\n4.1\t8.2\n6\t12\n"
    chosen(page, {"name": "stylus.txt", "mimeType": "text/plain", "buffer": text})
    assert set(faults(page)) == {"resample"} and "resample = " in faults(page)["resample"]
    measured(page, resample="0.5 um")
    told_of = page.inner_text("dialog .import-found")
    for shown in ("13 points", "X: x in um; Z: height in um", "separated by tabs", "Resampled linearly"):
        assert shown in told_of
    page.keyboard.press("Escape")
    page.wait_for_selector("dialog", state="detached")


def test_what_the_file_does_not_state_is_asked_for_beside_its_field(page: Page, service: Running) -> None:
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
    assert page.evaluate("() => document.activeElement.id") == "import" and stored(service) == []


def test_every_option_reaches_the_service_and_axe_finds_nothing_serious(page: Page, service: Running) -> None:
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
    (entry,) = stored(service)
    report = entry["report"]
    assert (report["level"], report["missing"]["rule"], report["spacing"]) == ("curvature", "fill", [2e-5, 3e-5])
    page.click("[data-tab=feel]")
    page.click("#texture-sources summary")
    assert violations(page, "main") == []


def test_name_and_keep_are_in_view_on_a_small_screen(page: Page, tmp_path: Path) -> None:
    """Also before anything is scrolled, and above a long report."""
    page.set_viewport_size({"width": 1280, "height": 720})
    content = made(CASES["Poly Haven, packed, ZIP"], surface(1), tmp_path).read_bytes()
    chosen(page, {"name": "wall.zip", "mimeType": "application/zip", "buffer": content})
    measured(page, width="80 mm")
    page.locator("dialog").evaluate("(dialog) => dialog.scrollTo(0, 0)")
    for control in ("#import-name", KEEP):
        box = page.locator(control).bounding_box()
        assert box is not None and box["y"] > 0.0 and box["y"] + box["height"] <= 720.0
    page.locator(KEEP).click(trial=True)  # nothing covers it


def test_a_dropped_file_opens_the_import_and_one_that_is_no_surface_says_why(page: Page) -> None:
    assert page.evaluate(DROP, {"name": "noise.txt", "text": "no numbers"}) == [True, True, True]
    answered(page)
    assert page.inner_text("#import-title") == "Import noise.txt"
    assert page.get_attribute("body", "data-dropping") is None
    text = page.inner_text("dialog [role=status]")
    assert "no numbers in the first 300 lines. Allowed: a text file of numbers" in text and page.is_disabled(KEEP)
    page.click("dialog button:has-text('Cancel')")
    page.wait_for_selector("dialog", state="detached")


def test_a_texture_is_renamed_and_deleted_where_it_is_described(page: Page, service: Running) -> None:
    imported(service, "cloth", "5 um")
    imported(service, "wool", "7 um")
    page.reload()
    loaded(page)
    page.evaluate(DRAWER)
    page.check(tile("cloth"))
    page.click("#texture-sources summary")
    page.wait_for_function("() => document.querySelector('#texture-sources').textContent.includes('14.14 µm')")
    scene = page.evaluate(SCENE)
    page.fill("#own-name", "wool")
    page.keyboard.press("Enter")
    page.wait_for_function("() => document.querySelector('#own-name-fault').textContent.includes('exists already')")
    page.fill("#own-name", "silk")
    page.keyboard.press("Enter")
    told(page, "cloth is now called silk")
    assert (yours(page), page.evaluate(CHOSEN)) == (["silk", "wool"], "silk")
    assert page.evaluate(SCENE) == scene and page.is_visible("#own-delete")
    page.wait_for_function("() => document.activeElement.id === 'own-name'")
    page.once("dialog", lambda dialog: dialog.dismiss())
    page.click("#own-delete")
    assert {entry["name"] for entry in stored(service)} == {"silk", "wool"}
    page.once("dialog", lambda dialog: dialog.accept())
    page.click("#own-delete")
    told(page, "silk is deleted")
    assert (yours(page), page.evaluate(CHOSEN), page.evaluate(SCENE)) == (["wool"], "sinusoid", {})
    assert page.evaluate("() => document.activeElement.value") == "sinusoid"
    assert page.is_hidden("#texture-sources")


def test_a_link_to_a_name_shows_the_surface_in_menu_and_form(page: Page, service: Running) -> None:
    scene = imported(service, "cloth", "5 um")
    page.goto(service.url + link_to({"texture": {"kind": "cloth", "phase": "1 rad"}}))
    page.reload()
    loaded(page)
    page.evaluate(DRAWER)
    assert page.evaluate(SCENE) == {"texture": {**scene["texture"], "phase": "1 rad"}}
    assert page.evaluate(CHOSEN) == "cloth"
    shown = "(id) => { const one = document.getElementById(id); return one.selectedOptions?.[0].text ?? one.value; }"
    assert page.evaluate(shown, "field-texture-kind") == "profile"
    assert page.evaluate(shown, "field-texture-surface") == scene["texture"]["surface"]
    page.wait_for_function("() => document.querySelector('#plan li') !== null")
    assert page.locator("#form .fault:visible").count() == 0


def test_a_sinusoid_can_be_chosen_after_an_imported_texture_and_each_choice_is_undone(
    page: Page, service: Running
) -> None:
    """After an import the field `surface` stayed, which a sinusoid does not have: the scene was refused."""
    imported(service, "cloth", "5 um")
    page.reload()
    loaded(page)
    page.evaluate(DRAWER)
    page.check(tile("cloth"))
    cloth = page.evaluate(SCENE)
    page.check(tile("sinusoid"))
    assert page.evaluate(SCENE) == {} and page.evaluate(CHOSEN) == "sinusoid"
    for button, scene, name in (("undo", cloth, "cloth"), ("redo", {}, "sinusoid"), ("undo", cloth, "cloth")):
        page.click(f"#{button}")
        assert (page.evaluate(SCENE), page.evaluate(CHOSEN)) == (scene, name)
    page.click("#texture-sources summary")
    page.wait_for_load_state("networkidle")  # its picture is asked for before it is gone
    page.once("dialog", lambda dialog: dialog.accept())
    page.click("#own-delete")
    told(page, "cloth is deleted")
    page.click("#undo")
    assert (page.evaluate(SCENE), page.evaluate(CHOSEN)) == (cloth, "")
    assert "not in the list" in page.inner_text("#texture-about")


def test_a_zip_file_with_a_set_of_maps_has_options_of_its_own(page: Page, service: Running, tmp_path: Path) -> None:
    content = made(CASES["Poly Haven, packed, ZIP"], surface(1), tmp_path).read_bytes()
    asked: list[str] = []
    page.on("request", lambda request: asked.append(request.url) if "/textures?dry_run" in request.url else None)
    chosen(page, {"name": "wall.zip", "mimeType": "application/zip", "buffer": content})
    assert "width of the sample first" in page.inner_text("dialog [role=status]") and faults(page) == {}
    assert page.evaluate(FOCUS) == "import-width" and page.is_disabled(KEEP) and not asked
    assert page.locator("dialog [name=unit]").count() == 0
    measured(page, width="80 mm", slope="0.03")
    assert "256 × 256 points over 80 mm × 80 mm" in page.inner_text("dialog [role=status]")
    report = page.inner_text("dialog dl.report")
    assert "are synthetic" in report and "the normals give the height" in report and "a height was given" not in report
    measured(page, slope="", hurst="0.8", shortest="200 µm")
    assert "to 200 um are synthetic: Hurst exponent 0.8" in page.inner_text("dialog dl.report")
    assert not stored(service)
    page.keyboard.press("Escape")
