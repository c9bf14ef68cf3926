"""The plots of the page: what their files hold agrees with `ridgewave render` of the same motion."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree

import numpy as np
import numpy.typing as npt
import pytest

from synth.perception.threshold import threshold_displacement
from synth.voice.recording import Recording
from tests.clients.web.browser import visited
from tests.clients.web.conftest import link_to, loaded
from tests.clients.web.exported_plots import SVG, Table, exported, read_csv, read_image, read_png, read_svg, scene_hash

if TYPE_CHECKING:
    from playwright.sync_api import Page

    from tests.service.harness import Running

RATE = 48000.0
SCENE = {
    "texture": {"kind": "grating", "period": "0.8 mm", "height": "30 um"},
    "scan": {"speed": "60 mm/s", "load": "0.5 N"},
}
WINDOW = (1, -1.942604, 1.340318, -0.440811, 0.043097)  # HFT90D of Heinzel et al.
RECORDING = "() => document.getElementById('record').textContent === 'Stop recording'"
RECORDED = "() => !document.getElementById('save-recording').disabled"
FROZEN = ".plot-toolbar[data-plot={}] [data-action=freeze][aria-pressed=true]"


@dataclass
class Stroke:
    """A stroke that was recorded and frozen: its files, and its samples (SI) as they were sent and solved exactly."""

    files: dict[str, dict[str, bytes]]
    sent: npt.NDArray[np.float64]
    exact: npt.NDArray[np.float64]
    scene: dict[str, Any]
    plan: dict[str, Any]


def press(page: Page, plot: str, action: str) -> None:
    page.click(f".plot-toolbar[data-plot={plot}] [data-action={action}]")


@pytest.fixture(scope="module")
def stroke(kept_touch_page: Page, service: Running) -> Stroke:
    """Return the automatic stroke, 60 mm/s at 0.5 N, frozen after a second and exported."""
    page = kept_touch_page
    with visited(page, service.url + link_to(SCENE)):
        loaded(page)
        page.click("#record")
        page.wait_for_function(RECORDING)
        page.click("#stroke")
        page.wait_for_function("() => ridgewave.fingers[0]?.source?.played > 60000")
        for plot in ("waveform", "spectrum"):
            press(page, plot, "freeze")
            page.wait_for_selector(FROZEN.format(plot))
        files = {
            plot: {kind: exported(page, plot, kind) for kind in ("CSV", "SVG", "PNG")}
            for plot in ("waveform", "spectrum")
        }
        page.select_option(".plot-toolbar[data-plot=spectrum] select", "spectrogram")
        page.wait_for_function("() => document.querySelector('.plot-over[aria-label*=spectrogram]') !== null")
        files["spectrogram"] = {kind: exported(page, "spectrum", kind) for kind in ("CSV", "SVG")}
        plan = page.evaluate("() => ridgewave.fingers[0].connection.ready.plan")
        page.click("#stroke")
        page.click("#record")
        page.wait_for_function(RECORDED)
        with page.expect_download() as download:
            page.click("#save-recording")
        document = json.loads(download.value.path().read_text())
    scale = 1e4 * document["full_scale"][0]  # so large that the limiter never acts
    samples = []
    for exact in (False, True):
        replay = Recording({**document, "full_scale": [scale]}).open(exact=exact)
        samples.append(np.asarray(scale * replay.render(replay.frames)[:, 0], np.float64))
    return Stroke(files, samples[0], samples[1], document["scene"], plan)


def of_plot(stroke: Stroke, plot: str) -> Table:
    return read_csv(stroke.files[plot]["CSV"])


def test_the_waveform_as_csv_has_the_samples_of_render(stroke: Stroke) -> None:
    table = of_plot(stroke, "waveform")
    frames = table.columns["frame"].astype(int)
    values = table.columns["acceleration_m/s2"]
    assert len(values) >= 2000 and np.all(np.diff(frames) == 1)
    assert np.allclose(np.diff(table.columns["time_s"]), 1 / RATE, rtol=1e-6)
    wanted = stroke.sent[frames]
    assert np.ptp(wanted) > 0.05
    assert np.abs(values - wanted).max() < 1e-6 * np.abs(stroke.sent).max(), "to the rounding of float32"
    error, tolerance = table.header["estimated_error"]["acceleration"], 1e-3
    solved = stroke.exact[frames]
    assert 0 < error < 0.03
    bound = (error + tolerance) * np.ptp(stroke.exact)
    assert np.abs(values - solved).max() < bound, "the error that the file tells, and that of `render --exact`"


def test_the_waveform_as_svg_has_them_to_a_hundredth_of_a_pixel(stroke: Stroke) -> None:
    table = of_plot(stroke, "waveform")
    header, (line, *_) = read_svg(stroke.files["waveform"]["SVG"])
    times, values = table.columns["time_s"], table.columns["acceleration_m/s2"]
    inside = (line[:, 0] > times[0] - 0.5 / RATE) & (line[:, 0] < times[-1] + 0.5 / RATE)
    seen = line[inside]
    up, across = header["axes"]["up"], header["axes"]["across"]
    pixel = abs((up["high"] - up["low"]) / (up["to"] - up["from"]))
    second = (across["high"] - across["low"]) / (across["to"] - across["from"])
    assert len(seen) == len(times)
    assert np.abs(seen[:, 0] - times).max() < 0.01 * second
    assert np.abs(seen[:, 1] - values).max() < 0.01 * pixel
    frames = table.columns["frame"].astype(int)
    assert np.abs(seen[:, 1] - stroke.sent[frames]).max() < 0.011 * pixel


def flat_top(samples: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Return the amplitudes of sinusoids at the bins of `samples`."""
    turns = 2 * np.pi * np.arange(len(samples)) / len(samples)
    window = sum(part * np.cos(order * turns) for order, part in enumerate(WINDOW))
    return np.asarray(2 / len(samples) * np.abs(np.fft.rfft(window * samples)))


def test_the_spectrum_as_csv_and_svg_is_that_of_render(stroke: Stroke) -> None:
    table = of_plot(stroke, "spectrum")
    end = table.header["first_frame"] + 48000
    wanted = flat_top(stroke.sent[end - 16384 : end])
    frequencies, amplitudes = table.columns["frequency_Hz"], table.columns["acceleration_m/s2"]
    bins = np.rint(frequencies * 16384 / RATE).astype(int)
    assert np.allclose(bins * RATE / 16384, frequencies) and frequencies[0] < 14 and frequencies[-1] > 4990
    assert np.abs(amplitudes - wanted[bins]).max() < 1e-5 * wanted.max()
    threshold, over = table.columns["threshold_m/s2"], table.columns["over_threshold_dB"]
    felt = (frequencies > 20) & (frequencies < 900)
    expected = threshold_displacement(frequencies[felt]) * (2 * np.pi * frequencies[felt]) ** 2
    assert threshold[felt] == pytest.approx(expected, rel=0.035), "0.3 dB, between its 100 points"
    assert over[felt] == pytest.approx(20 * np.log10(amplitudes[felt] / threshold[felt]), abs=1e-6)
    header, (line, *_) = read_svg(stroke.files["spectrum"]["SVG"])
    up = header["axes"]["up"]
    seen = line[(line[:, 0] > frequencies[0] - 1) & (line[:, 0] < frequencies[-1] + 1)]
    visible = amplitudes > up["low"]
    pixel = np.log(up["high"] / up["low"]) / abs(up["to"] - up["from"])
    assert len(seen) == len(frequencies)
    assert np.abs(np.log(seen[visible, 1] / wanted[bins][visible])).max() < 0.02 * pixel


def test_the_spectrogram_as_csv_is_that_of_render(stroke: Stroke) -> None:
    table = of_plot(stroke, "spectrogram")
    times = np.unique(table.columns["time_s"])
    values = table.columns["acceleration_m/s2"].reshape(len(times), -1)
    end = table.header["first_frame"] + 48000
    assert len(times) >= 30 and np.allclose(np.diff(times), 1024 / RATE)
    for time, row in list(zip(times, values, strict=True))[-20:]:
        middle = end + round(time * RATE)
        wanted = flat_top(stroke.sent[middle - 2048 : middle + 2048])[: len(row)]
        assert np.abs(row - wanted)[1:].max() < 1e-4 * values.max()


def test_the_spectrogram_as_svg_has_the_colours_of_its_numbers(stroke: Stroke) -> None:
    table = of_plot(stroke, "spectrogram")
    count = len(np.unique(table.columns["time_s"]))
    values = table.columns["acceleration_m/s2"].reshape(count, -1)
    pixels = read_image(stroke.files["spectrogram"]["SVG"])
    red = pixels[::-1, :, 0].T.astype(float)  # columns of rising frequency
    assert red.shape == values.shape
    shown = (red - red.max()) / (red.min() - red.max())  # 0 to 1 from the ground to the colour of the signal
    with np.errstate(divide="ignore"):
        wanted = np.maximum(0.0, 1.0 + 20.0 * np.log10(values / values.max()) / 60.0)
    assert np.abs(shown - wanted).max() < 0.005, "0.3 dB of 60 dB: half a step of a colour of 8 bits"


def test_every_file_names_the_scene_by_its_hash_and_its_error(stroke: Stroke, service: Running) -> None:
    plan = service.client.post("/v1/explain", json=stroke.scene).json()
    for plot, files in stroke.files.items():
        headers = [read_csv(files["CSV"]).header, read_svg(files["SVG"])[0]]
        if "PNG" in files:
            header, (width, height) = read_png(files["PNG"])
            assert width > 400 and height > 300
            headers.append(header)
        for header in headers:
            assert header["plot"] == plot
            assert header["scene_sha256"] == scene_hash(header["scene"])
            assert header["scene"]["texture"] == plan["scene"]["texture"]
            assert header["response_table"] == stroke.plan["response"].get("table", {}).get("hash")
            assert header["estimated_error"] == stroke.plan["estimated_error"]
            assert 0 < header["estimated_error"]["acceleration"] < 0.03
        text = files["SVG"].decode()
        assert headers[0]["scene_sha256"][:16] in text and "of peak-to-peak" in text


SHOWN = "() => document.querySelectorAll('.plot-over:not([aria-hidden])').length"
STATUS = "([plot, words]) => document.querySelector(`#${plot} + .plot-status`)?.textContent.includes(words)"
TOPS = """() => {
  const views = document.querySelector(".views");
  const top = (one) => one.getBoundingClientRect().top;
  return [...views.querySelectorAll("canvas:not(.plot-over), figcaption, button")].map((one) => top(one) - top(views));
}"""


@pytest.fixture
def stroked_page(kept_touch_page: Page, service: Running) -> Iterator[Page]:
    """Yield the page after a stroke of the mouse that was lifted in motion."""
    page = kept_touch_page
    with visited(page, service.url + link_to(SCENE)):
        loaded(page)
        page.click("#start")
        page.wait_for_function("() => document.getElementById('state').textContent === 'live'")
        page.wait_for_function("() => ridgewave.views.threshold !== null")
        page.evaluate("() => scrollTo(0, 0)")
        touch(page)
        yield page


def touch(page: Page) -> None:
    """Stroke the pad until the spectrum shows it, and lift in motion."""
    page.evaluate("() => scrollTo(0, 0)")
    box = page.locator("#pad").bounding_box()
    assert box is not None
    page.mouse.move(box["x"] + 20, box["y"] + 80)
    page.mouse.down()
    for step in range(400):
        page.mouse.move(box["x"] + 20 + 3 * (step % 100), box["y"] + 80)
        if step > 50 and page.evaluate("() => ridgewave.views.spectrum.drawn?.marks.length > 0"):
            break
    page.evaluate(f"() => {{ window.tops = ({TOPS})(); }}")
    page.mouse.up()


def test_a_lift_freezes_both_plots_and_the_next_touch_shows_the_live_ones(stroked_page: Page) -> None:
    page = stroked_page
    for plot in ("waveform", "spectrum"):
        page.wait_for_selector(FROZEN.format(plot))
        page.wait_for_selector(f"#{plot} ~ .plot-over[aria-label^='frozen at the lift']")
    page.wait_for_function("() => ridgewave.views.waveform.drawn.values.every((value) => value === 0)")
    page.wait_for_timeout(300)  # longer than between two answers
    table = read_csv(exported(page, "spectrum", "CSV")).columns
    level = np.nanmax(table["over_threshold_dB"][(table["frequency_Hz"] >= 10) & (table["frequency_Hz"] <= 1000)])
    said = page.inner_text("#answer")
    assert said.startswith("Near" if abs(level) < 5 else f"{abs(level):.0f} dB"), (said, level)
    frozen = read_csv(exported(page, "waveform", "CSV")).columns["acceleration_m/s2"]
    assert np.ptp(frozen) > 0.01, "what was felt, while the live plot below is at rest"
    assert page.evaluate(TOPS) == page.evaluate("() => tops"), "nothing moves"
    box = page.locator("#pad").bounding_box()
    assert box is not None
    page.mouse.move(box["x"] + 50, box["y"] + 80)
    page.mouse.down()
    page.wait_for_function(f"() => ({SHOWN})() === 0")
    page.mouse.up()


def test_a_button_freezes_until_it_is_pressed_again(stroked_page: Page) -> None:
    page = stroked_page
    page.wait_for_selector(FROZEN.format("waveform"))
    press(page, "waveform", "freeze")
    page.wait_for_function(f"() => ({SHOWN})() === 1")
    press(page, "waveform", "freeze")
    page.wait_for_function(f"() => ({SHOWN})() === 2")
    touch(page)
    assert page.get_attribute(".plot-toolbar[data-plot=waveform] [data-action=freeze]", "aria-pressed") == "true"


def test_the_cursor_tells_place_and_value_by_key_mouse_and_touch(stroked_page: Page) -> None:
    page = stroked_page
    page.wait_for_selector(FROZEN.format("spectrum"))
    page.focus("#spectrum")
    page.keyboard.press("Home")
    page.wait_for_function(STATUS, arg=["spectrum", "Hz: "])
    table = read_csv(exported(page, "spectrum", "CSV"))
    row = int(np.argmax(table.columns["acceleration_m/s2"]))
    frequency, value = table.columns["frequency_Hz"][row], table.columns["acceleration_m/s2"][row]
    box = page.locator("#spectrum").bounding_box()
    assert box is not None
    axes = read_svg(exported(page, "spectrum", "SVG"))[0]["axes"]["across"]
    part = np.log(frequency / axes["low"]) / np.log(axes["high"] / axes["low"])
    x = box["x"] + axes["from"] + part * (axes["to"] - axes["from"])
    reading = "() => ridgewave.views.plots.panel('spectrum').then((one) => one.reading)"
    for kind in ("mouse", "touch"):
        page.mouse.move(1, 1)
        event = {"clientX": x, "clientY": box["y"] + 90, "pointerType": kind, "pointerId": 7}
        page.dispatch_event("#spectrum", "pointerdown" if kind == "touch" else "pointermove", event)
        told = page.evaluate(reading)
        amount, level = f"{float(f'{value:.3g}'):g}", table.columns["over_threshold_dB"][row]
        place, unit = told.split(": ")[0].split(" ")
        told_frequency = float(place) * {"Hz": 1.0, "kHz": 1000.0}[unit]
        assert told_frequency == pytest.approx(float(f"{frequency:.4g}"), rel=1e-6) and "m/s²" in told, told
        assert amount in told.replace("m/s", " m/s") or value < 1.0, told
        assert f"{abs(level):.0f} dB" in told
    page.keyboard.press("Escape")
    page.wait_for_function(f"async () => (await ({reading})()) === ''")


def test_a_zoom_shows_and_exports_the_part_about_the_cursor(stroked_page: Page) -> None:
    page = stroked_page
    page.wait_for_selector(FROZEN.format("waveform"))
    whole = read_csv(exported(page, "waveform", "CSV")).columns["frame"]
    press(page, "waveform", "in")
    half = read_csv(exported(page, "waveform", "CSV")).columns["frame"]
    assert len(half) == pytest.approx(len(whole) / 2, abs=2)
    page.focus("#waveform")
    page.keyboard.press("+")
    quarter = read_csv(exported(page, "waveform", "CSV")).columns["frame"]
    assert len(quarter) == pytest.approx(len(whole) / 4, abs=2)
    page.focus("#waveform")
    page.keyboard.press("0")
    table = read_csv(exported(page, "waveform", "CSV"))
    assert len(table.columns["time_s"]) == 48000, "the last second, which is kept"


def test_a_against_b_tells_the_difference_of_their_levels_over_threshold(stroked_page: Page) -> None:
    page = stroked_page
    page.wait_for_selector(FROZEN.format("spectrum"))
    levels = [highest(read_csv(exported(page, "spectrum", "CSV")))]
    page.click("#slot-b")
    page.evaluate("() => ridgewave.state.write(['texture', 'height'], 10e-6)")
    page.wait_for_function("() => ridgewave.session.soundStatus === 'current'")
    page.wait_for_function("() => !document.querySelector('[data-stale]')")
    touch(page)
    page.wait_for_selector(FROZEN.format("spectrum"))
    levels.append(highest(read_csv(exported(page, "spectrum", "CSV"))))
    page.select_option(".plot-toolbar[data-plot=spectrum] select", "comparison")
    apart = levels[1] - levels[0]
    assert abs(apart) > 1.0, "a third of the height"
    words = f"B is {abs(apart):.1f} dB {'lower' if apart < 0 else 'higher'} over threshold than A."
    page.wait_for_selector(f".plot-over[aria-label*='{words}']")
    table = read_csv(exported(page, "spectrum", "CSV"))
    assert table.names == ["frequency_Hz", "A_m/s2", "B_m/s2", "threshold_m/s2"]
    assert table.header["A"]["scene_sha256"] != table.header["B"]["scene_sha256"]
    drawing = ElementTree.fromstring(exported(page, "spectrum", "SVG"))
    texts = [(float(one.get("x", "0")), "".join(one.itertext())) for one in drawing.iter(f"{SVG}text")]
    said = " ".join(text for _, text in texts)
    assert words in said and all(table.header[slot]["scene_sha256"][:16] in said for slot in "AB")
    width = float(drawing.get("width", "0"))
    assert all(x + 4.5 * len(text) < width for x, text in texts if x < 10), "nothing is cut off"
    assert table.header["transform"] == {"window": "HFT90D", "frames": 16384}


def highest(table: Table) -> float:
    """Return the largest level over threshold, dB, of a spectrum."""
    return float(np.nanmax(table.columns["over_threshold_dB"]))


def test_nothing_of_it_is_loaded_before_its_first_use(kept_touch_page: Page, service: Running) -> None:
    page = kept_touch_page
    asked: list[str] = []
    page.on("request", lambda request: asked.append(request.url))
    with visited(page, service.url + link_to(SCENE)):
        loaded(page)
        assert [url.rsplit("/", 1)[1] for url in asked if "/plots/" in url] == ["toolbar.js"]
        page.click(".plot-toolbar[data-plot=waveform] [data-action=csv]")
        page.wait_for_function(STATUS, arg=["waveform", "nothing to export"])
        assert not any("spectrogram" in url or "comparison" in url for url in asked)


def test_tools_that_do_not_load_are_told_and_load_with_the_next_use(kept_touch_page: Page, service: Running) -> None:
    page = kept_touch_page
    for module in ("plots/plot_session.js", "plots/spectrogram_view.js"):
        page.route(f"**/web/{module}", lambda route: route.abort("connectionreset"), times=1)
    told = "() => document.getElementById('notice').textContent.startsWith('Part of the page did not load.')"
    forget = "() => document.getElementById('notice').replaceChildren()"
    with visited(page, service.url + link_to(SCENE)) as watch:
        watch.allow("net::ERR_CONNECTION_RESET")
        loaded(page)
        page.click("#stroke")
        page.wait_for_function("() => ridgewave.fingers[0]?.source?.played > 4800")
        press(page, "spectrum", "freeze")
        page.wait_for_function(told)
        press(page, "spectrum", "freeze")
        page.wait_for_selector(FROZEN.format("spectrum"))

        page.evaluate(forget)
        view = page.locator(".plot-toolbar[data-plot=spectrum] select")
        view.select_option("spectrogram")
        page.wait_for_function(told)
        assert view.input_value() == "spectrum"
        view.select_option("spectrogram")
        page.wait_for_function("() => document.querySelector('.plot-over[aria-label*=spectrogram]') !== null")
