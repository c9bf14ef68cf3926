"""What the page's pictures show is what they were given: positions, heights, amplitudes, thresholds, patches, costs."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from synth.threshold import threshold_displacement
from tests.clients.web.sight_page import chromium, opened, served

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

RATE = 48000
PERIOD, RIDGE, LENGTH = 0.8e-3, 0.5e-3, 10e-3  # m
Lines = list[list[float]]
ORDERS = {"displacement": 0, "velocity": 1, "acceleration": 2}

AMPLITUDES = "(samples) => Array.from(new sight.Transform(samples.length).amplitudes(samples))"
LINE = "(samples) => sight.largestLine(new sight.Transform(samples.length).amplitudes(samples), 48000)"
PUSH = """async ({name, lines, fullScale, quantity, blocks, block, begin}) => {
  const picture = sight[name];
  await sight.drawn(picture.panel, () => {
    for (let index = 0; index < blocks; index++) {
      picture.push(sight.sinusoids(lines, 48000, block, begin + index * block), fullScale, quantity, 48000);
    }
  });
  const {largest, ...drawn} = picture.drawn;
  return {...drawn, largest};
}"""


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with chromium() as one:
        yield one


@pytest.fixture(scope="module")
def url() -> Iterator[str]:
    with served() as address:
        yield address


@pytest.fixture(params=[1, 2], ids=["one pixel", "two pixels"])
def page(request: pytest.FixtureRequest, browser: Browser, url: str) -> Iterator[Page]:
    """Yield the page on a screen of one or two device pixels a CSS pixel."""
    with opened(browser, url, device_scale_factor=request.param) as one:
        yield one


@pytest.fixture
def plain(browser: Browser, url: str) -> Iterator[Page]:
    with opened(browser, url) as one:
        yield one


def push(page: Page, name: str, lines: Lines, quantity: str = "acceleration", **other: Any) -> dict[str, Any]:
    """Push sinusoids [Hz, of full scale, rad] and return what was drawn."""
    told = {"name": name, "lines": lines, "quantity": quantity}
    usual = {"fullScale": 36.0, "blocks": 60, "block": 480, "begin": 0}
    drawn: dict[str, Any] = page.evaluate(PUSH, told | usual | other)
    return drawn


def label_of(page: Page, name: str, wanted: str) -> str:
    """Return the text alternative of a picture, once it holds `wanted`."""
    handle = page.wait_for_function(
        "([name, wanted]) => { const told = document.getElementById(name).getAttribute('aria-label') ?? '';"
        " return told.includes(wanted) ? told : null; }",
        arg=[name, wanted],
    )
    return str(handle.json_value())


@pytest.mark.parametrize("size", [4, 8, 64, 1024, 16384])
def test_transform_is_that_of_numpy(plain: Page, size: int) -> None:
    samples = np.random.default_rng(size).normal(size=size)
    found = plain.evaluate(
        "(samples) => { const {real, imaginary} = new sight.Transform(samples.length).complex(samples);"
        " return [Array.from(real), Array.from(imaginary)]; }",
        samples.tolist(),
    )
    expected = np.fft.rfft(samples)
    assert np.allclose(np.array(found[0]) + 1j * np.array(found[1]), expected, rtol=0, atol=1e-12 * size)


def test_a_size_that_is_no_power_of_two_is_refused(plain: Page) -> None:
    told = plain.evaluate("() => { try { new sight.Transform(12); } catch (error) { return error.message; } }")
    assert "power of two" in told


@pytest.mark.parametrize("amplitude", [1e-9, 0.3, 2e4])
@pytest.mark.parametrize("frequency", [100.0, 123.456, 1000.7, 7777.7])
def test_a_sinusoid_shows_as_its_amplitude(plain: Page, amplitude: float, frequency: float) -> None:
    samples = amplitude * np.cos(2 * np.pi * frequency * np.arange(16384) / RATE + 0.7)
    line = plain.evaluate(LINE, samples.tolist())
    assert line["amplitude"] == pytest.approx(amplitude, rel=1e-3)
    assert line["frequency"] == pytest.approx(frequency, abs=0.05)


def test_a_small_line_beside_a_large_one_keeps_its_height(plain: Page) -> None:
    time = np.arange(16384) / RATE
    samples = np.cos(2 * np.pi * 200.3 * time) + 1e-4 * np.cos(2 * np.pi * 400.9 * time)
    amplitudes = np.array(plain.evaluate(AMPLITUDES, samples.tolist()))
    near = slice(round(380 * 16384 / RATE), round(420 * 16384 / RATE))
    assert amplitudes[near].max() == pytest.approx(1e-4, rel=0.02)


@pytest.mark.parametrize("quantity", ORDERS)
def test_the_spectrum_draws_a_sinusoid_where_it_is_and_as_high_as_it_is(page: Page, quantity: str) -> None:
    drawn = push(page, "spectrum", [[250.0, 0.5], [1234.0, 0.01]], quantity, fullScale=2e-3)
    frequencies, amplitudes = np.array(drawn["frequencies"]), np.array(drawn["amplitudes"])
    highest = int(np.argmax(amplitudes))
    assert frequencies[highest] == pytest.approx(250.0, rel=0.01)
    assert amplitudes[highest] == pytest.approx(1e-3, rel=1e-3)
    second = amplitudes[frequencies > 1000.0].max()
    assert second == pytest.approx(2e-5, rel=1e-3)
    assert drawn["low"] < 2e-5 < 1e-3 < drawn["high"]
    assert "250 Hz" in label_of(page, "spectrum", "250 Hz")


@pytest.mark.parametrize("quantity", ORDERS)
def test_the_threshold_is_converted_into_the_quantity(plain: Page, quantity: str) -> None:
    frequencies = np.geomspace(1.0, 1000.0, 200)
    displacement = threshold_displacement(frequencies)
    plain.evaluate(
        "(curve) => sight.spectrum.threshold(curve)",
        {"name": "fingertip", "frequencies": frequencies.tolist(), "displacement": displacement.tolist()},
    )
    drawn = push(plain, "spectrum", [[100.0, 0.5]], quantity, fullScale=1e-3)
    expected = displacement * (2 * np.pi * frequencies) ** ORDERS[quantity]
    assert np.allclose(np.array(drawn["threshold"]), np.stack([frequencies, expected], axis=1), rtol=1e-12)
    level = 20 * np.log10(0.5e-3 / np.interp(100.0, frequencies, expected))
    side = "above" if level > 0 else "below"
    label_of(plain, "spectrum", f"{abs(level):.0f} dB {side} what is just felt")


def test_a_force_has_no_threshold(plain: Page) -> None:
    curve = {"name": "fingertip", "frequencies": [1, 10], "displacement": [1e-6, 1e-6]}
    plain.evaluate("(curve) => sight.spectrum.threshold(curve)", curve)
    assert push(plain, "spectrum", [[100.0, 0.5]], "tangential_force")["threshold"] == []


def test_harmonics_are_marked_where_they_belong(plain: Page) -> None:
    plain.evaluate("() => sight.spectrum.mark([100, 200, 300, 400, 500, 100000])")
    marks = push(plain, "spectrum", [[100.0, 0.5]])["marks"]
    assert [mark["frequency"] for mark in marks] == [100, 200, 300, 400, 500]
    assert [mark["label"] for mark in marks] == ["u/λ 100 Hz", "2", "3", "4", "5"]
    places = np.array([mark["x"] for mark in marks])
    octaves = np.log2([1, 2, 3, 4, 5])
    assert np.allclose(places - places[0], octaves * (places[1] - places[0]), atol=1e-6)
    width = plain.evaluate("() => sight.spectrum.panel.width")
    left, right = 72.0, width - 12.0
    assert places[0] == pytest.approx(left + (right - left) * np.log(10.0) / np.log(500.0))
    plain.evaluate("() => sight.spectrum.mark([])")
    assert push(plain, "spectrum", [[100.0, 0.5]])["marks"] == []


@pytest.mark.parametrize("quantity", ORDERS)
def test_the_waveform_is_in_physical_units(page: Page, quantity: str) -> None:
    drawn = push(page, "waveform", [[97.3, 0.5]], quantity, fullScale=2e-3)
    times, values = np.array(drawn["times"]), np.array(drawn["values"])
    column = 0.05 / 700  # s: the range of the samples in a pixel is drawn
    expected = 1e-3 * np.sin(2 * np.pi * 97.3 * times)  # from a rising crossing on
    assert np.abs(values - expected).max() < 1e-3 * 2 * np.pi * 97.3 * column
    assert drawn["peak"] == pytest.approx(1e-3, rel=1e-4)
    label_of(page, "waveform", "50 % of the full scale")


def test_the_waveform_stands_still_at_constant_speed(plain: Page) -> None:
    lines = [[101.7, 0.2, 0.3], [305.1, 0.25, 1.1], [508.5, 0.2, 2.0], [1017.0, 0.1, 0.5]]  # several crossings a period
    traces, begin = [], 0
    for blocks in (60, 3, 7, 11, 2, 17):
        drawn = push(plain, "waveform", lines, blocks=blocks, block=479, begin=begin)
        begin += blocks * 479
        even = np.linspace(0.001, 0.045, 300)
        traces.append(np.interp(even, drawn["times"], drawn["values"]))
    for trace in traces[1:]:
        assert np.abs(trace - traces[0]).max() < 0.02 * np.ptp(traces[0])


def test_the_time_shown_follows_the_frequency_in_steps(plain: Page) -> None:
    expect = "(frequencies) => frequencies.map((one) => { sight.waveform.expect(one); return sight.waveform.span; })"
    spans = plain.evaluate(expect, [100.0, 150.0, 60.0, 30.0, 40.0, 2000.0, 0.0])
    assert spans == pytest.approx([0.05, 0.05, 0.05, 0.2, 0.2, 0.005, 0.25])


def test_a_small_vibration_is_magnified_and_the_axis_says_so(plain: Page) -> None:
    assert push(plain, "waveform", [[100.0, 0.9]])["range"] == pytest.approx(36.0 * 1.12)
    plain.evaluate("() => sight.waveform.push(new Float32Array(1), 1, 'velocity', 48000)")  # another scale begins anew
    drawn = push(plain, "waveform", [[100.0, 0.01]], blocks=120)
    deadline = plain.evaluate("() => performance.now() + 10000")
    while drawn["range"] > 1.0 and plain.evaluate("() => performance.now()") < deadline:
        drawn = push(plain, "waveform", [[100.0, 0.01]], blocks=10)
    assert 0.36 < drawn["range"] < 36.0 * 0.05


def texture(points: int = 512) -> list[float]:
    """Return a period that is no sinusoid, so that a mirrored or shifted picture is another one (m)."""
    turns = np.arange(points) / points
    heights = 20e-6 * np.cos(2 * np.pi * turns + 0.4) + 6e-6 * np.cos(4 * np.pi * turns)
    return [float(height) for height in heights]


SHOW = (
    "async ([heights, period, zoom]) => { const {surface} = sight; await sight.drawn(surface.panel, () => {"
    " surface.show({heights, period, contactLength: 0.01}); surface.zoom(zoom); }); }"
)


@pytest.mark.parametrize("zoom", [6e-6, 2.3e-5, 1.1e-4])
def test_the_scale_bar_is_as_long_as_it_says(page: Page, zoom: float) -> None:
    page.evaluate(SHOW, [texture(), PERIOD, zoom])
    bar = page.evaluate("() => sight.surface.drawn.bar")
    leading = float(f"{bar['length']:.3e}".split("e")[0])
    assert leading in (1.0, 2.0, 5.0)
    ratio = page.evaluate("() => devicePixelRatio")
    wide = int(bar["pixels"]) + 20
    box = [bar["left"] - 10, bar["top"], wide, 1]
    row = page.evaluate("(box) => sight.pixels(document.getElementById('surface'), ...box)", box)
    pixels = np.array(row).reshape(int(ratio), -1, 4)[0, :, :3]
    ink = page.evaluate("() => getComputedStyle(document.documentElement).getPropertyValue('--ink').trim()")
    wanted = np.array([int(ink[place : place + 2], 16) for place in (1, 3, 5)])
    dark = int(np.count_nonzero(np.abs(pixels - wanted).max(axis=1) < 30))
    assert abs(dark / ratio - bar["length"] / zoom) <= 1.0


@pytest.mark.parametrize("zoom", [8e-6, 2.2e-5])
def test_the_heights_drawn_are_the_heights_given(page: Page, zoom: float) -> None:
    heights = np.array(texture())
    page.evaluate(SHOW, [heights.tolist(), PERIOD, zoom])
    width, ratio = page.evaluate("() => [sight.surface.panel.width, devicePixelRatio]")
    row = np.array(page.evaluate("([w]) => sight.pixels(document.getElementById('surface'), 0, 10, w, 1)", [width]))
    light = row.reshape(int(ratio), -1, 4)[0, :, 0].astype(float)
    x = (np.arange(light.size) + 0.5) * zoom / ratio
    at = np.interp(x / PERIOD % 1.0, np.append(np.arange(512), 512) / 512, np.append(heights, heights[0]))
    slope = np.gradient(at)
    level = np.clip((at - heights.min()) / np.ptp(heights) + 0.28 * slope / np.abs(slope).max(), 0.0, 1.0)
    valley, crest = light[np.argmin(at)], light[np.argmax(at)]
    assert crest - valley > 120
    assert np.abs(light - (valley + level * (crest - valley)))[1:-1].max() < 8.0


def test_fingers_move_without_a_drawing(plain: Page) -> None:
    plain.evaluate(SHOW, [texture(), PERIOD, 2e-5])
    told = plain.evaluate(
        """async () => { const {surface} = sight; const before = surface.panel.drawings;
        surface.touch([0.004, {position: 0.006, across: 0.25}]);
        await new Promise(requestAnimationFrame); await new Promise(requestAnimationFrame);
        const place = document.getElementById('surface').getBoundingClientRect();
        const marks = [...document.querySelectorAll('.touches > i')].filter((mark) => !mark.hidden);
        const boxes = marks.map((mark) => mark.getBoundingClientRect());
        const middles = boxes.map(({x, y, width, height}) =>
          [x + width / 2 - place.x, y + height / 2 - place.y, width]);
        surface.touch([]);
        const left = [...document.querySelectorAll('.touches > i')].filter((mark) => mark.offsetWidth).length;
        return {middles, height: place.height, drawings: surface.panel.drawings - before, left}; }"""
    )
    assert told["drawings"] == 0
    assert np.allclose(told["middles"][0], [200.0, told["height"] / 2, 500.0], atol=0.1)
    assert np.allclose(told["middles"][1], [300.0, told["height"] / 4, 500.0], atol=0.1)
    assert told["left"] == 0


def test_the_pad_is_zoomed_by_keys_and_wheel(plain: Page) -> None:
    plain.evaluate(SHOW, [texture(), PERIOD, 2e-5])
    plain.evaluate(
        "() => { window.zooms = []; document.getElementById('surface')"
        ".addEventListener('zoom', (event) => zooms.push(event.detail.metresPerPixel)); }"
    )
    plain.focus("#surface")
    plain.keyboard.press("+")
    plain.keyboard.press("-")
    plain.keyboard.press("-")
    plain.hover("#surface")
    plain.mouse.wheel(0, -100)
    plain.wait_for_function("() => zooms.length === 4")
    step = 2**0.25
    assert np.allclose(plain.evaluate("() => zooms"), [2e-5 / step, 2e-5, 2e-5 * step, 2e-5])
    plain.keyboard.press("0")
    assert plain.evaluate("() => sight.surface.metresPerPixel") == pytest.approx(PERIOD / 36)


def picture(phases: int) -> dict[str, Any]:
    """Return a picture as `POST /v1/picture` answers it: two cosines, an approach of its own, and the patches."""
    points = 2048
    s, x = np.arange(points) * PERIOD / points, np.linspace(0.0, LENGTH, points)
    fine = np.linspace(0.0, LENGTH, 400_001)
    turns = np.arange(phases) / phases
    z = 46e-6 + 5e-6 * np.cos(2 * np.pi * turns)
    touching = []
    for turn, height in zip(turns, z, strict=True):
        overlap = 20e-6 * np.cos(2 * np.pi * (fine / PERIOD - turn)) - 40e-6 * np.cos(2 * np.pi * fine / RIDGE) > height
        edges = np.flatnonzero(np.diff(np.concatenate([[0], overlap.astype(int), [0]])))
        touching.append(fine[np.minimum(edges, fine.size - 1)].tolist())
    return {
        "texture": {"period": PERIOD, "heights": (20e-6 * np.cos(2 * np.pi * s / PERIOD)).tolist()},
        "finger": {"begin": 0.0, "length": LENGTH, "heights": (-40e-6 * np.cos(2 * np.pi * x / RIDGE)).tolist()},
        "response": {"load": 0.3, "foundation": 1e6, "heights": z.tolist()},
        "touching": touching,
        "left_out": [],
    }


LIT = """async ([picture, phase]) => { const {contact} = sight; const {panel} = contact;
  await sight.drawn(panel, () => { contact.show(picture); contact.at(phase); });
  return {drawn: contact.drawn, width: panel.width, ratio: panel.ratio,
    row: sight.pixels(panel.canvas, 0, panel.height - 35, panel.width, 1)}; }"""


@pytest.mark.parametrize("index", [0, 5, 13])
def test_what_is_lit_is_what_touches(page: Page, index: int) -> None:
    given = picture(16)
    told = page.evaluate(LIT, [given, 3 + index / 16])
    edges = np.array(given["touching"][index]).reshape(-1, 2)
    assert np.allclose(told["drawn"]["patches"], edges, atol=1e-12)
    assert told["drawn"]["z"] == given["response"]["heights"][index]
    row = np.array(told["row"]).reshape(int(told["ratio"]), -1, 4)[0, :, :3].astype(float)
    glow, dull = np.array([0xE8, 0x59, 0x0C]), np.array([0xE8, 0xEC, 0xF0])
    share = np.clip((row - dull) @ (glow - dull) / ((glow - dull) @ (glow - dull)), 0.0, 1.0)
    wide = (told["width"] - 24.0) * told["ratio"]
    edges_drawn = 12.0 * told["ratio"] + edges / LENGTH * wide
    pixel = np.arange(row.shape[0])
    covered = np.zeros(row.shape[0])
    for begin, end in edges_drawn:
        covered += np.clip(np.minimum(end, pixel + 1) - np.maximum(begin, pixel), 0.0, 1.0)
    inside = slice(round(12 * told["ratio"]), round(12 * told["ratio"] + wide))
    assert np.abs(share - covered)[inside].max() < 0.1
    label_of(page, "contact", f"{len(edges)} places touch")


def test_between_two_phases_the_patches_are_those_of_the_heights(plain: Page) -> None:
    coarse, fine = picture(16), picture(32)
    told = plain.evaluate(LIT, [coarse, 7 / 32])
    edges = np.array(fine["touching"][7]).reshape(-1, 2)
    assert np.allclose(told["drawn"]["patches"], edges, atol=3e-6)
    blind = plain.evaluate(LIT, [coarse | {"touching": None}, 6 / 32])
    assert np.allclose(blind["drawn"]["patches"], np.array(fine["touching"][6]).reshape(-1, 2), atol=3e-6)


def test_the_vertical_exaggeration_is_stated_and_true(plain: Page) -> None:
    drawn = plain.evaluate(LIT, [picture(16), 0.0])["drawn"]
    assert drawn["up"] == pytest.approx(drawn["factor"] * drawn["across"])
    label_of(plain, "contact", f"{drawn['factor']} times larger than lengths")


def test_nothing_is_drawn_while_nothing_changes(plain: Page) -> None:
    plain.evaluate(LIT, [picture(16), 0.25])
    again = plain.evaluate(
        """async () => { const {contact} = sight; const before = contact.panel.drawings;
        for (let turn = 0; turn < 10; turn++) { contact.at(0.25); await new Promise(requestAnimationFrame); }
        return contact.panel.drawings - before; }"""
    )
    assert again == 0


def test_pictures_have_a_role_and_a_text_from_the_beginning(plain: Page) -> None:
    for name in ("waveform", "spectrum", "contact"):
        label_of(plain, name, "yet")
        assert plain.get_attribute(f"#{name}", "role") == "img"


def test_a_text_alternative_changes_twice_a_second_at_most(plain: Page) -> None:
    changes = plain.evaluate(
        """async () => { const panel = sight.waveform.panel; let changes = 0;
        new MutationObserver(() => changes++).observe(panel.canvas, {attributeFilter: ["aria-label"]});
        const end = performance.now() + 1800;
        for (let count = 0; performance.now() < end; count++) {
          panel.say(`text ${count}`); await new Promise(requestAnimationFrame); }
        return changes; }"""
    )
    assert 1 <= changes <= 5


def test_colours_follow_the_scheme(plain: Page) -> None:
    def ink() -> Any:
        return plain.evaluate("() => sight.contact.panel.colour('ink')")

    light = ink()
    plain.emulate_media(color_scheme="dark")
    plain.wait_for_function("(light) => sight.contact.panel.colour('ink') !== light", arg=light)
    assert ink() == "#e8edf2"


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
    "response": {"method": "cubic table", "solver": "exact solver", "fundamental_hz": 100.0, "harmonics": 191},
    "estimated_error": {"acceleration": 5.4e-4},
    "cost": {"setup_seconds": 0.012, "ns_per_frame": 65.0, "times_real_time": 320.0, "memory_bytes": 98000},
    "warnings": ["It is <b>loud</b>."],
}


def test_the_plan_tells_what_why_and_at_what_cost(plain: Page) -> None:
    plain.evaluate("(plan) => sight.plan.show(plan)", PLAN)
    told = plain.inner_text("#plan")
    wanted = (
        "inertia",
        "It is heavy.",
        "320 ns a frame, 6.1 MB",
        "adhesion",
        "costs nothing",
        "contact growth",
        "would change 6e−5",
        "0.054 %",
        "12 ms",
        "320 × real time",
        "98 kB",
        "It is <b>loud</b>.",
    )
    for words in wanted:
        assert words in told, words
    plain.evaluate("(plan) => sight.plan.show(plan)", {key: value for key, value in PLAN.items() if key != "cost"})
    assert "real time" not in plain.inner_text("#plan")


def test_the_tolerance_is_chosen_by_keyboard_and_its_cost_stands_beside_it(plain: Page) -> None:
    plain.evaluate(
        """(plan) => { sight.answers["/v1/explain"] = plan; window.changes = [];
        sight.accuracy.addEventListener("change", (event) => changes.push(event.detail.tolerance));
        sight.accuracy.show({texture: {period: 0.001}, accuracy: {tolerance: 0.01}}); }""",
        PLAN,
    )
    plain.wait_for_function("() => document.querySelector('#accuracy dl').innerText.includes('12 ms')")
    slider = plain.get_by_role("slider")
    assert slider.get_attribute("aria-valuetext") == "1 % of peak to peak"
    slider.press("ArrowLeft")
    plain.get_by_label("imperceptible").check()
    plain.get_by_label("exact: to round-off").check()
    assert plain.evaluate("() => changes") == [0.0079, "imperceptible", "exact"]
    assert slider.is_disabled()
    plain.wait_for_function("() => sight.asked.at(-1)?.body.accuracy.tolerance === 'exact'")
    assert plain.evaluate("() => sight.asked.at(-1)") == {
        "method": "POST",
        "path": "/v1/explain",
        "body": {"texture": {"period": 0.001}, "accuracy": {"tolerance": "exact"}},
    }


def test_a_refusal_is_told_in_its_own_sentence(plain: Page) -> None:
    plain.evaluate("""() => { sight.answers["/v1/accuracy"] = new Error("A measurement runs: try again in 20 s."); }""")
    plain.get_by_role("button", name="Measure every method").click()
    plain.wait_for_function("() => document.querySelector('[role=status]').textContent.startsWith('A measure')")
    assert plain.get_by_role("button", name="Measure every method").is_enabled()


def test_a_measurement_is_drawn_where_it_belongs_and_told_as_a_table(plain: Page, repository: Path) -> None:
    measured = json.loads((repository / "docs/figures/accuracy-default/accuracy.json").read_text("utf-8"))
    plain.evaluate("(measured) => { sight.answers['/v1/accuracy'] = measured; }", measured)
    plain.get_by_role("button", name="Measure every method").click()
    plain.wait_for_selector(".error-plot .ring")
    assert plain.locator(".accuracy-table tbody tr").count() == len(measured["methods"])
    assert plain.locator("tr[aria-current] th").text_content() == measured["chosen"]
    found = plain.evaluate(
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
    ring = plain.locator("circle.ring")
    assert tuple(float(ring.get_attribute(name) or "nan") for name in ("cx", "cy")) == places[measured["chosen"]]
    assert measured["chosen"] in str(plain.get_attribute(".error-plot", "aria-label"))


@pytest.mark.parametrize("width", [360, 900])
def test_nothing_is_wider_than_the_screen(browser: Browser, url: str, width: int, repository: Path) -> None:
    measured = json.loads((repository / "docs/figures/accuracy-default/accuracy.json").read_text("utf-8"))
    with opened(browser, url, viewport={"width": width, "height": 700}) as page:
        page.evaluate("(plan) => sight.plan.show(plan)", PLAN)
        page.evaluate("(measured) => sight.accuracy.draw(measured)", measured)
        page.wait_for_selector(".error-plot .ring")
        page.click("summary")
        assert page.evaluate("() => document.documentElement.scrollWidth") <= width
