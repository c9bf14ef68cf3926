"""The plan and the accuracy control: simulated effects, reasons, costs, measurements."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree

import numpy as np
import pytest

from tests.clients.web.drawn_views import opened
from tests.clients.web.exported_plots import SVG, exported, read_png, read_svg, scene_hash, value_of

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

PLAN: dict[str, Any] = {
    "simulated": [
        {"name": "contact response", "reason": "It is read from a table."},
        {
            "name": "inertia",
            "reason": "It is heavy.",
            "settings": {},
            "price": {"ns_per_frame": 320.0, "memory_bytes": 6.1e6},
        },
    ],
    "left_out": [
        {"name": "adhesion", "reason": "The scene does not call for it.", "effect_on_output": None},
        {"name": "contact_growth", "reason": "It moves too little.", "effect_on_output": 5.5e-5},
    ],
    "response": {"method": "harmonics", "solver": "exact solver", "fundamental_hz": 100.0, "harmonics": 191},
    "estimated_error": {"acceleration": 5.4e-4},
    "cost": {"setup_seconds": 0.012, "ns_per_frame": 65.0, "times_real_time": 320.0, "memory_bytes": 98000},
    "warnings": ["It is <b>loud</b>."],
}


def test_the_plan_tells_what_why_and_at_what_cost(pictures: Page) -> None:
    pictures.evaluate("(plan) => views.plan.show(plan)", PLAN)
    told = pictures.inner_text("#plan")
    wanted = (
        "inertia",
        "It is heavy.",
        "320 ns per frame, 6.1 MB",
        "adhesion",
        "changes nothing",
        "contact growth",
        "changes the output by 6e−5",
        "0.054 %",
        "12 ms",
        "320 × real time",
        "98 kB",
        "It is <b>loud</b>.",
    )
    for words in wanted:
        assert words in told, words
    pictures.evaluate("(plan) => views.plan.show(plan)", {key: value for key, value in PLAN.items() if key != "cost"})
    assert "real time" not in pictures.inner_text("#plan")


def test_the_plan_tells_the_contact_of_a_scene(pictures: Page) -> None:
    contact = {
        "stiffness": 3.3e5,
        "contact_fraction": 0.25,
        "rms": {"acceleration": 1.5, "displacement": 2e-6},
        "sensation_level_db": 31.4,
        "groups": None,
    }
    pictures.evaluate("(plan) => views.plan.show(plan)", PLAN | {"response": PLAN["response"] | contact})
    told = pictures.inner_text("#plan")
    for words in ("330 kN/m", "25 %", "acceleration, rms", "1.5 m/s²", "2 µm", "31 dB"):
        assert words in told, words
    unknown = dict.fromkeys(contact)
    pictures.evaluate("(plan) => views.plan.show(plan)", PLAN | {"response": PLAN["response"] | unknown})
    assert "stiffness" not in pictures.inner_text("#plan")


def test_the_tolerance_is_chosen_by_keyboard_and_its_cost_stands_beside_it(plain: Page) -> None:
    plain.evaluate(
        """(plan) => { views.answers["/v1/explain"] = plan; window.changes = [];
        views.accuracy.addEventListener("change", (event) => changes.push(event.detail.tolerance));
        views.accuracy.show({texture: {period: 0.001}, accuracy: {tolerance: 0.01}}); }""",
        PLAN,
    )
    plain.wait_for_function("() => document.querySelector('#accuracy dl').innerText.includes('12 ms')")
    slider = plain.get_by_role("slider")
    assert slider.get_attribute("aria-valuetext") == "1 % of peak-to-peak"
    slider.press("ArrowLeft")
    plain.get_by_label("imperceptible").check()
    plain.get_by_label("exact, to round-off").check()
    assert plain.evaluate("() => changes") == [0.0079, "imperceptible", "exact"]
    assert slider.is_disabled()
    plain.wait_for_function("() => views.asked.at(-1)?.body.accuracy.tolerance === 'exact'")
    assert plain.evaluate("() => views.asked.at(-1)") == {
        "method": "POST",
        "path": "/v1/explain",
        "body": {"texture": {"period": 0.001}, "accuracy": {"tolerance": "exact"}},
    }


def test_the_errors_under_a_hand_stand_beside_those_of_the_set_speed(plain: Page) -> None:
    plain.evaluate("(plan) => { views.answers['/v1/explain'] = plan; views.accuracy.show({}); }", PLAN)
    plain.wait_for_function("() => document.querySelector('#accuracy dl').innerText.includes('12 ms')")
    plain.evaluate("(plan) => views.accuracy.hand(plan)", {"estimated_error": {"acceleration": 0.13}})
    told = plain.inner_text("#accuracy dl")
    assert "error at the set speed, acceleration" in told and "error under a hand, acceleration\n13 %" in told


def test_a_refusal_is_told_in_its_own_sentence(pictures: Page) -> None:
    pictures.evaluate(
        """() => { views.answers["/v1/accuracy"] = new views.Explained("A measurement runs: try again in 20 s."); }"""
    )
    pictures.get_by_role("button", name="Measure all methods").click()
    pictures.wait_for_function("() => document.querySelector('[role=status]').textContent.startsWith('A measure')")
    assert pictures.get_by_role("button", name="Measure all methods").is_enabled()


def test_an_answer_that_was_overtaken_counts_no_more(plain: Page) -> None:
    told = plain.evaluate(
        """async (plan) => {
          const told = [];
          views.accuracy.addEventListener("plan", ({detail}) => told.push(detail.scene.texture.period));
          views.accuracy.addEventListener("refused", ({detail}) => told.push(detail.sentence));
          const asking = [];
          const ask = (period, answer) => {
            views.answers["/v1/explain"] = answer;
            views.accuracy.show({texture: {period}});
            asking.push(views.accuracy.predict());
          };
          const late = [];
          ask(1, new Promise((answer) => late.push(() => answer(plan))));
          ask(2, new Promise((_, refuse) => late.push(() => refuse(new views.Explained("That scene is refused.")))));
          ask(3, plan);
          await asking[2];
          for (const come of late) come();
          await Promise.all(asking);
          ask(4, new views.Explained("This scene is refused."));
          await asking[3];
          return told;
        }""",
        PLAN,
    )
    assert told == [3, "This scene is refused."]
    assert plain.inner_text("#accuracy [role=status]") == "This scene is refused."


def test_a_measurement_is_drawn_where_it_belongs_and_told_as_a_table(pictures: Page, repository: Path) -> None:
    measured = json.loads((repository / "docs/figures/accuracy-default/accuracy.json").read_text("utf-8"))
    pictures.evaluate("(measured) => { views.answers['/v1/accuracy'] = measured; }", measured)
    pictures.get_by_role("button", name="Measure all methods").click()
    pictures.wait_for_selector(".error-plot .ring")
    assert pictures.locator(".accuracy-table tbody tr").count() == len(measured["methods"])
    assert pictures.locator("tr[aria-current] th").text_content() == measured["chosen"]
    found = pictures.evaluate(
        """() => [...document.querySelectorAll('.error-plot .point')].map((point) => [
        point.textContent.split(': error')[0], Number(point.getAttribute('cx')), Number(point.getAttribute('cy'))])"""
    )
    places = {method: (x, y) for method, x, y in found}
    rows = measured["methods"]
    cost = np.log([row["setup_seconds"] / measured["duration"] + row["seconds_per_second"] for row in rows])
    error = np.log([row["max_error"] for row in rows])
    drawn = np.array([places[row["method"]] for row in rows])
    for values, along in ((cost, drawn[:, 0]), (error, drawn[:, 1])):
        line = np.polynomial.Polynomial.fit(values, along, 1)
        assert np.abs(line(values) - along).max() < 1e-6
    assert np.corrcoef(cost, drawn[:, 0])[0, 1] > 0.999
    assert np.corrcoef(error, drawn[:, 1])[0, 1] < -0.999
    ring = pictures.locator("circle.ring")
    assert tuple(float(ring.get_attribute(name) or "nan") for name in ("cx", "cy")) == places[measured["chosen"]]
    assert measured["chosen"] in str(pictures.get_attribute(".error-plot", "aria-label"))


@pytest.mark.parametrize("width", [360, 900])
def test_nothing_is_wider_than_the_screen(chromium: Browser, pictures_url: str, width: int, repository: Path) -> None:
    measured = json.loads((repository / "docs/figures/accuracy-default/accuracy.json").read_text("utf-8"))
    with opened(chromium, pictures_url, viewport={"width": width, "height": 700}) as page:
        page.evaluate("(plan) => views.plan.show(plan)", PLAN)
        page.evaluate("(measured) => views.accuracy.draw(measured)", measured)
        page.wait_for_selector(".error-plot .ring")
        page.click("summary")
        assert page.evaluate("() => document.documentElement.scrollWidth") <= width


@pytest.fixture
def measured_plot(plain: Page, repository: Path) -> tuple[Page, dict[str, Any]]:
    """Return a page with the plot of the default scene's measurement, and what the engine measured."""
    measured = json.loads((repository / "docs/figures/accuracy-default/accuracy.json").read_text("utf-8"))
    plain.evaluate("(measured) => views.accuracy.draw(measured)", measured)
    plain.wait_for_selector(".plot-toolbar[data-plot=error] button")
    plain.wait_for_selector(".error-plot .ring")
    return plain, measured


def test_the_files_of_the_plot_have_the_numbers_of_the_engine(measured_plot: tuple[Page, dict[str, Any]]) -> None:
    page, measured = measured_plot
    lines = exported(page, "error", "CSV").decode().splitlines()
    notes = {name: json.loads(text) for name, _, text in (line[2:].partition(": ") for line in lines if line[0] == "#")}
    rows = list(csv.DictReader(line for line in lines if line[0] != "#"))
    assert notes["scene"] == measured["scene"] and notes["scene_sha256"] == scene_hash(measured["scene"])
    assert [row["method"] for row in rows] == [row["method"] for row in measured["methods"]]
    for row, wanted in zip(rows, measured["methods"], strict=True):
        assert float(row["max_error"]) == wanted["max_error"]
        assert float(row["setup_s"]) == wanted["setup_seconds"]
        assert (row["chosen"] == "true") == (row["method"] == measured["chosen"])
    document = exported(page, "error", "SVG")
    header = read_svg(document)[0]
    assert header["scene_sha256"] == notes["scene_sha256"]
    points = [one for one in ElementTree.fromstring(document).iter(f"{SVG}circle") if "point" in one.get("class", "")]
    errors = value_of(header["axes"]["up"], np.array([float(one.get("cy", "nan")) for one in points]))
    told = {
        (one.findtext(f"{SVG}title") or "").split(": error")[0]: value
        for one, value in zip(points, errors, strict=True)
    }
    for wanted in measured["methods"]:
        if wanted["max_error"] > header["axes"]["up"]["low"]:
            assert told[wanted["method"]] == pytest.approx(wanted["max_error"], rel=1e-9)
    assert read_png(exported(page, "error", "PNG"))[0] == notes


def test_the_plot_is_read_and_zoomed_by_keys(measured_plot: tuple[Page, dict[str, Any]]) -> None:
    page, measured = measured_plot
    page.focus(".error-plot")
    page.keyboard.press("Home")
    page.keyboard.press("Home")
    cost = [row["setup_seconds"] / measured["duration"] + row["seconds_per_second"] for row in measured["methods"]]
    cheapest = measured["methods"][int(np.argmin(cost))]
    page.wait_for_function(
        "(words) => document.querySelector('.error-plot ~ .plot-status').textContent.startsWith(words)",
        arg=f"{cheapest['method']}: error {cheapest['max_error']:.1e}".replace("e-0", "e-"),
    )
    place = "() => Number(document.querySelector('.error-plot .ring').getAttribute('cx'))"
    before = page.evaluate(place)
    page.keyboard.press("+")
    assert page.evaluate(place) != before
    page.focus(".error-plot")
    page.keyboard.press("-")
    assert page.evaluate(place) == pytest.approx(before)
