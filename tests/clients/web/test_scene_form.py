"""Every field of a scene has a control with valid output."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

from synth.errors import SceneError
from synth.scene.effects_section import declaration, effect_names
from synth.scene.finger_section import KINDS
from synth.scene.scene import parse_scene
from synth.scene.texture_registry import kinds, kinds_with
from tests.clients.web.form import PERIOD, REFUSED, at, scene_of, tile, written
from tests.clients.web.random_scenes import fields, near_default, options

if TYPE_CHECKING:
    from playwright.sync_api import Page

    from tests.clients.web.browser import Watch

OF_THREE = {f"{name}_{what}" for name in ("short", "middle", "long") for what in ("time", "weight")}
"""Fields of "viscous_skin" that only one of its models has."""

WRITE = """(every) => every.map(([path, text, model]) => {
  const form = ridgewave.state;
  form.take({});
  if (path.length === 3) choose(path.slice(0, 2), "on, with settings");
  if (model) choose([...path.slice(0, 2), "model"], model);
  const element = document.querySelector(`[data-path="${path.join(".")}"]`);
  const menu = element.querySelector("select");
  const scenes = [];
  const keep = () => scenes.push(form.scene);
  if (text !== null) {
    if (menu) choose(path, "a number");
    const input = element.querySelector("input[type=text]");
    input.value = text;
    input.dispatchEvent(new Event("change", {bubbles: true}));
    keep();
    const slider = element.querySelector("input[type=range]");
    if (slider) slider.dispatchEvent(new Event("change", {bubbles: true})), keep();
  }
  const labels = [...(menu?.options ?? [])].map(({textContent}) => textContent);
  for (const label of labels.filter((_, place) => labels.length < 20 || place % 6 === 0)) { // of the catalogue a sixth
    choose(path, label);
    if (!["a number", "points"].includes(label)) keep();
  }
  const faults = [...element.querySelectorAll(".fault:not([hidden])")].map(({textContent}) => textContent);
  form.take({});
  return {scenes, faults};
  function choose(steps, label) {
    const menu = document.querySelector(`[data-path="${steps.join(".")}"] select`);
    menu.value = [...menu.options].findIndex(({textContent}) => textContent === label);
    menu.dispatchEvent(new Event("change", {bubbles: true}));
  }
})"""


@pytest.fixture(scope="module")
def answers(kept_still_page: Page) -> dict[tuple[str, ...], Any]:
    """Return what the control of each field wrote and told: all at once, since the page then draws itself once."""
    asked = []
    for path, node in fields():
        number = near_default(node)
        model = "three_time_constants" if path[-1] in OF_THREE else None
        asked.append([list(path), None if number is None else shown(path, number), model])
    return dict(zip(dict(fields()), kept_still_page.evaluate(WRITE, asked), strict=True))


def test_every_field_of_the_schema_has_a_control(still_page: Page) -> None:
    boxes = "document.querySelectorAll('[data-path]')"
    there = set(still_page.evaluate(f"() => [...{boxes}].map((field) => field.dataset.path)"))
    assert there == {".".join(path) for path, _ in fields()}


def test_every_control_has_a_label_and_a_description(still_page: Page) -> None:
    boxes = still_page.evaluate(
        """() => [...document.querySelectorAll('[data-path]')].map((field) => [field.dataset.path,
             document.getElementById(field.querySelector('label').htmlFor) !== null,
             document.getElementById(`field-${field.dataset.path.replaceAll(".", "-")}-hint`).textContent])"""
    )
    sentences = {".".join(path): node["description"] for path, node in fields()}
    for path, labelled, hint in boxes:
        assert labelled, path
        assert hint.startswith(" ".join(sentences[path].replace("`", "").split())), path


@pytest.mark.parametrize("path", [path for path, _ in fields()], ids=".".join)
def test_the_service_accepts_what_a_control_writes(answers: Any, path: tuple[str, ...]) -> None:
    number, answer = near_default(dict(fields())[path]), answers[path]
    assert answer["faults"] == []
    assert number is None or any(at(scene, path) is not None for scene in answer["scenes"])
    for scene in answer["scenes"]:
        parse_scene(of_its_kind(scene, path))


KINDS_NEED: dict[str, dict[str, Any]] = {
    "profile": {"heights": [0.0, 0.0]},
    "heightmap": {"rows": [[0.0, 0.0], [0.0, 0.0]]},
}
FIELDS_NEED: dict[str, dict[str, Any]] = {
    "phases": {"amplitudes": [1e-5]},
    "ramp": {"height": 0.0},
    "edge_radius": {"height": 0.0},
    "longest": {"period": 1e-3, "shortest": 1e-4},
    "shortest": {"period": 1e-3},
    "rms_slope": {"period": 1e-4},
}


def of_its_kind(scene: Any, path: tuple[str, ...]) -> Any:
    """Return the scene with the kind of texture or finger that has the field, and what the field needs."""
    if path[0] == "finger" and scene.get("finger"):
        kind = next((kind for kind, one in KINDS.items() if path[-1] in one.fields), "comb")
        return scene | {"finger": {"kind": kind, **scene["finger"]}}
    if path[0] != "texture" or not scene.get("texture"):
        return scene
    kind = scene["texture"].get("kind") or next(iter(kinds_with(path[-1])), "sinusoid")
    company = KINDS_NEED.get(kind, {}) | FIELDS_NEED.get(path[-1], {})
    return scene | {"texture": {"kind": kind, **company, **scene["texture"]}}


def shown(path: tuple[str, ...], number: float) -> str:
    """Return a number with its unit, as a person writes it."""
    unit = dict(fields())[path].get("x-unit") or ("m/s^2" if path == ("output", "full_scale") else "")
    return f"{number!r} {unit}".strip()


READ = {"0.9 mm": "0.9 mm", "0.9mm": "0.9 mm", "900": "900 um", "900 \u00b5m": "900 um", "9e-4 m": "9e-4 m"}


def test_a_number_is_read_with_its_unit(still_page: Page) -> None:
    for text, value in READ.items():
        written(still_page, PERIOD, text)
        assert scene_of(still_page) == {"texture": {"period": value}}
        parse_scene(scene_of(still_page))
        still_page.click("#undo")  # a bare number has the unit of the last


def test_what_is_out_of_range_is_told_and_not_written(still_page: Page) -> None:
    fault = still_page.locator(f"{PERIOD}-fault")
    for text in ("2 m", "0.9 kPa", "wide", "0 mm", "-1 mm"):
        written(still_page, PERIOD, text)
        assert fault.inner_text() == "Enter a value from 1 um to 1 m, such as 800 um.", text
        assert still_page.locator(PERIOD).get_attribute("aria-invalid") == "true"
        assert scene_of(still_page) == {}
        written(still_page, PERIOD, "1 mm")
        assert not fault.is_visible()
        still_page.click("#undo")


def test_the_band_has_full_on_its_menu(still_page: Page) -> None:
    menu = still_page.locator('[data-path="output.bandwidth"] select')
    assert menu.locator("option").all_text_contents() == ["default (1 kHz)", "a number", "full"]
    still_page.evaluate(
        """() => { document.querySelector('[data-path="output.bandwidth"]').closest("details").open = true; }"""
    )
    menu.select_option(label="full")
    assert scene_of(still_page) == {"output": {"bandwidth": "full"}}
    menu.select_option(label="default (1 kHz)")
    assert scene_of(still_page) == {}


def test_an_emptied_field_has_its_default_again(still_page: Page) -> None:
    written(still_page, PERIOD, "1 mm")
    written(still_page, PERIOD, "")
    assert scene_of(still_page) == {}
    assert still_page.locator(PERIOD).get_attribute("placeholder") == "800 um"


def test_what_was_written_is_never_taken_for_the_default(still_page: Page) -> None:
    shown = still_page.evaluate(
        """() => {
          const asked = {texture: {period: "1 mm"}, output: {channels: [{quantity: "velocity"}]}};
          ridgewave.state.take(asked);
          ridgewave.state.setDefaults(asked, {texture: {period: 1e-3, amplitude: 3e-5},
            output: {channels: [{quantity: "velocity", full_scale: 0.25}]}});
          const placeholder = (path) => document.querySelector(`[data-path="${path}"] input[type=text]`).placeholder;
          const written = placeholder("output.channels.0.full_scale");
          ridgewave.state.write(["texture", "period"], undefined);
          return [written, placeholder("texture.period"), placeholder("texture.amplitude")];
        }"""
    )
    assert shown == ["250 mm/s", "800 um", "30 um"]


def test_a_texture_of_the_catalogue_shows_its_own_numbers(still_page: Page) -> None:
    still_page.check(tile("grating-2mm-157um"))
    still_page.wait_for_function("() => document.querySelector('#field-texture-period').placeholder === '2 mm'")
    assert scene_of(still_page) == {"texture": {"kind": "grating-2mm-157um"}}


def visible(page: Page, section: str) -> set[str]:
    """Return the names of the fields that the form shows in a section, opened or not."""
    boxes = f"document.querySelectorAll('[data-path^=\"{section}.\"]')"
    shown = f"[...{boxes}].filter((one) => !one.closest('[hidden]')).map((one) => one.dataset.path.split('.'))"
    return {name for name, *inner in page.evaluate(f"() => {shown}.map((path) => path.slice(1))") if not inner}


@pytest.mark.parametrize("kind", KINDS)
def test_the_form_shows_the_fields_of_the_finger_and_offers_the_effects_that_it_has(
    still_page: Page, kind: str
) -> None:
    still_page.evaluate("(kind) => ridgewave.state.take({finger: {kind}})", kind)
    assert visible(still_page, "finger") == set(KINDS[kind].fields)
    offered = visible(still_page, "effects")
    for name in effect_names():
        scene = {"finger": {"kind": kind}, "effects": {name: {}}}
        if name in offered:
            parse_scene(scene)
        else:
            with pytest.raises(SceneError):
                parse_scene(scene)
    absent: dict[str, list[str]] = {}  # kinds of finger -> the effects that need one of them
    for name in (name for name in effect_names() if name not in offered):
        absent.setdefault(" or ".join(declaration(name).fingers), []).append(name.replace("_", " ").capitalize())
    told = " ".join(f"Only with finger kind {kinds}: {', '.join(names)}." for kinds, names in absent.items())
    assert still_page.locator("#section-effects-absent").text_content() == told


@pytest.mark.parametrize("kind", [*kinds(), "grating-1mm-31um"])
def test_the_form_shows_the_fields_of_the_texture(still_page: Page, kind: str) -> None:
    still_page.evaluate("(texture) => ridgewave.state.take({texture})", {"kind": kind, **KINDS_NEED.get(kind, {})})
    named = kinds().get(kind) or kinds()["sinusoid"]
    assert visible(still_page, "texture") == {"kind", "phase", "youngs_modulus", "poisson_ratio", *named.names}
    assert visible(still_page, "effects") == {*effect_names()}
    assert not still_page.locator("#section-effects-absent").text_content()


def test_a_field_that_the_scene_should_not_have_is_shown_until_it_is_removed(watched_page: tuple[Page, Watch]) -> None:
    page, watch = watched_page
    watch.allow(REFUSED)
    page.evaluate("() => ridgewave.state.write(['effects', 'curvature'], {})")
    page.wait_for_function("() => !document.getElementById('field-effects-curvature-fault').hidden")
    assert 'finger.kind "comb"' in page.locator("#field-effects-curvature-fault").inner_text()
    straight = " or ".join(name for name, kind in KINDS.items() if kind.straight)
    assert (page.locator("#field-finger-kind-hint").text_content() or "").endswith(f"Curvature needs {straight}.")
    page.select_option("#field-effects-curvature", label="off")
    assert "curvature" not in visible(page, "effects")


def test_a_word_that_the_kind_implies_is_the_default_of_its_menu(touch_page: Page) -> None:
    first = "document.querySelector('#field-finger-pattern option').textContent"
    touch_page.wait_for_function(f"() => {first} === 'default (loop)'")
    touch_page.evaluate("() => ridgewave.state.take({})")
    touch_page.wait_for_function(f"() => {first} === 'none'")


def test_a_roughness_takes_the_place_of_an_amplitude(still_page: Page) -> None:
    written(still_page, "#field-texture-amplitude", "5 um")
    written(still_page, "#field-texture-roughness", "4 um")
    assert scene_of(still_page) == {"texture": {"roughness": "4 um"}}


def test_what_only_the_service_can_refuse_stands_beside_the_field(watched_page: tuple[Page, Watch]) -> None:
    touch_page, watch = watched_page
    watch.allow(REFUSED)
    written(touch_page, "#field-output-fade", "1.5 s")
    touch_page.locator("#field-output-fade-fault").wait_for()
    assert "duration" in touch_page.locator("#field-output-fade-fault").inner_text()
    written(touch_page, "#field-output-duration", "4 s")
    touch_page.locator("#field-output-fade-fault").wait_for(state="hidden")


def test_words_of_a_field_are_all_in_its_menu(still_page: Page) -> None:
    menus = still_page.evaluate(
        """() => Object.fromEntries([...document.querySelectorAll("[data-path]")].map((field) => [field.dataset.path,
             [...(field.querySelector("select")?.options ?? [])].map((one) => one.textContent)]))"""
    )
    for path, node in fields():
        words = {str(word) for option in options(node) for word in option.get("enum", [])}
        assert words <= set(menus[".".join(path)]), path
