"""Waveform and spectrum: amplitudes, harmonics, thresholds, and their text alternatives."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from synth.perception.threshold import threshold_displacement
from tests.clients.web.drawn_views import label_of, push
from tests.few import paired

if TYPE_CHECKING:
    from playwright.sync_api import Page

RATE = 48000
ORDERS = {"displacement": 0, "velocity": 1, "acceleration": 2}

AMPLITUDES = "(samples) => Array.from(new views.FourierTransform(samples.length).amplitudes(samples))"
LINE = "(samples) => views.largestLine(new views.FourierTransform(samples.length).amplitudes(samples), 48000)"


@pytest.mark.parametrize("size", [4, 8, 64, 1024, 16384])
def test_transform_is_that_of_numpy(pictures: Page, size: int) -> None:
    samples = np.random.default_rng(size).normal(size=size)
    found = pictures.evaluate(
        "(samples) => { const {real, imaginary} = new views.FourierTransform(samples.length).complex(samples);"
        " return [Array.from(real), Array.from(imaginary)]; }",
        samples.tolist(),
    )
    expected = np.fft.rfft(samples)
    assert np.allclose(np.array(found[0]) + 1j * np.array(found[1]), expected, rtol=0, atol=1e-12 * size)


def test_a_size_that_is_no_power_of_two_is_refused(pictures: Page) -> None:
    told = pictures.evaluate(
        "() => { try { new views.FourierTransform(12); } catch (error) { return error.message; } }"
    )
    assert "power of two" in told


@pytest.mark.parametrize(("frequency", "amplitude"), paired([100.0, 123.456, 7777.7], [1e-9, 2e4]))
def test_a_sinusoid_shows_as_its_amplitude(pictures: Page, amplitude: float, frequency: float) -> None:
    samples = amplitude * np.cos(2 * np.pi * frequency * np.arange(16384) / RATE + 0.7)
    line = pictures.evaluate(LINE, samples.tolist())
    assert line["amplitude"] == pytest.approx(amplitude, rel=1e-3)
    assert line["frequency"] == pytest.approx(frequency, abs=0.05)


def test_a_small_line_beside_a_large_one_keeps_its_height(pictures: Page) -> None:
    time = np.arange(16384) / RATE
    samples = np.cos(2 * np.pi * 200.3 * time) + 1e-4 * np.cos(2 * np.pi * 400.9 * time)
    amplitudes = np.array(pictures.evaluate(AMPLITUDES, samples.tolist()))
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
def test_the_threshold_is_converted_into_the_quantity(pictures: Page, quantity: str) -> None:
    frequencies = np.geomspace(1.0, 1000.0, 200)
    displacement = threshold_displacement(frequencies)
    pictures.evaluate(
        "(curve) => views.spectrum.threshold(curve)",
        {"name": "fingertip", "frequencies": frequencies.tolist(), "displacement": displacement.tolist()},
    )
    drawn = push(pictures, "spectrum", [[100.0, 0.5]], quantity, fullScale=1e-3)
    expected = displacement * (2 * np.pi * frequencies) ** ORDERS[quantity]
    assert np.allclose(np.array(drawn["threshold"]), np.stack([frequencies, expected], axis=1), rtol=1e-12)
    level = 20 * np.log10(0.5e-3 / np.interp(100.0, frequencies, expected))
    side = "above" if level > 0 else "below"
    label_of(pictures, "spectrum", f"{abs(level):.0f} dB {side} the detection threshold")


def test_a_force_has_no_threshold(pictures: Page) -> None:
    curve = {"name": "fingertip", "frequencies": [1, 10], "displacement": [1e-6, 1e-6]}
    pictures.evaluate("(curve) => views.spectrum.threshold(curve)", curve)
    assert push(pictures, "spectrum", [[100.0, 0.5]], "tangential_force")["threshold"] == []


def test_harmonics_are_marked_where_they_belong(pictures: Page) -> None:
    pictures.evaluate("() => views.spectrum.mark([100, 200, 300, 400, 500, 100000])")
    marks = push(pictures, "spectrum", [[100.0, 0.5]])["marks"]
    assert [mark["frequency"] for mark in marks] == [100, 200, 300, 400, 500]
    assert [mark["label"] for mark in marks] == ["u/λ 100 Hz", "2", "3", "4", "5"]
    places = np.array([mark["x"] for mark in marks])
    octaves = np.log2([1, 2, 3, 4, 5])
    assert np.allclose(places - places[0], octaves * (places[1] - places[0]), atol=1e-6)
    width = pictures.evaluate("() => views.spectrum.panel.width")
    left, right = 72.0, width - 12.0
    assert places[0] == pytest.approx(left + (right - left) * np.log(10.0) / np.log(500.0))
    pictures.evaluate("() => views.spectrum.mark([])")
    assert push(pictures, "spectrum", [[100.0, 0.5]])["marks"] == []


WIDTHS = """(labels) => {
  const { context } = views.spectrum.panel;
  context.font = views.spectrum.panel.font(11);
  return labels.map((label) => context.measureText(label).width);
}"""


def test_the_labels_of_harmonics_do_not_touch(pictures: Page) -> None:
    size = pictures.viewport_size
    assert size is not None
    pictures.set_viewport_size({"width": 462, "height": 800})
    pictures.wait_for_function("() => views.spectrum.panel.width < 440")
    for fundamental in (12.3, 29.6, 99.0):
        pictures.evaluate("(f) => views.spectrum.mark(Array.from({length: 60}, (_, n) => (n + 1) * f))", fundamental)
        told = [mark for mark in push(pictures, "spectrum", [[100.0, 0.5]])["marks"] if mark["label"]]
        wide = np.array(pictures.evaluate(WIDTHS, [mark["label"] for mark in told]))
        begins = np.array([mark["x"] for mark in told]) - 0.5 * wide
        begins[0] = told[0]["x"] - 8.0
        assert len(told) > 2 and np.all(begins[1:] > (begins + wide)[:-1] + 5.0)
    pictures.set_viewport_size(size)


NOTE_WORDS = """() => {
  window.words = [];
  const write = CanvasRenderingContext2D.prototype.fillText;
  CanvasRenderingContext2D.prototype.fillText = function (text, x, y, most = 1e9) {
    const wide = Math.min(this.measureText(text).width, most);
    if (y < 16) window.words.push(this.textAlign === "right" ? [x - wide, x] : [x, x + wide]);
    write.call(this, text, x, y, most);
  };
}"""


@pytest.mark.parametrize("width", [295, 335])
def test_titles_and_legends_do_not_touch_on_a_phone(plain: Page, width: int) -> None:
    size = plain.viewport_size
    assert size is not None
    plain.set_viewport_size({"width": width, "height": 700})
    plain.wait_for_function("() => views.spectrum.panel.width < 320")
    curve = {"name": "fingertip", "frequencies": [1, 1000], "displacement": [1e-6, 1e-7]}
    plain.evaluate("(curve) => views.spectrum.threshold(curve)", curve)
    plain.evaluate(NOTE_WORDS)
    for quantity in ORDERS:
        for view, count in (("spectrum", 3), ("waveform", 2)):
            plain.evaluate("() => { window.words = []; }")
            push(plain, view, [[100.0, 1e-4]], quantity=quantity)
            words = sorted(plain.evaluate("() => window.words")[-count:])
            assert len(words) == count
            assert all(end + 3.0 < begin for (_, end), (begin, _) in pairwise(words)), (quantity, view, words)
    plain.set_viewport_size(size)


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


def test_the_time_shown_follows_the_frequency_in_steps(pictures: Page) -> None:
    expect = "(frequencies) => frequencies.map((one) => { views.waveform.expect(one); return views.waveform.span; })"
    spans = pictures.evaluate(expect, [100.0, 150.0, 60.0, 30.0, 40.0, 2000.0, 0.0])
    assert spans == pytest.approx([0.05, 0.05, 0.05, 0.2, 0.2, 0.005, 0.25])


def test_a_small_vibration_is_magnified_and_the_axis_says_so(plain: Page) -> None:
    assert push(plain, "waveform", [[100.0, 0.9]])["range"] == pytest.approx(36.0 * 1.12)
    plain.evaluate("() => views.waveform.push(new Float32Array(1), 1, 'velocity', 48000)")  # another scale begins anew
    drawn = push(plain, "waveform", [[100.0, 0.01]], blocks=120)
    deadline = plain.evaluate("() => performance.now() + 60000")
    while drawn["range"] > 1.0 and plain.evaluate("() => performance.now()") < deadline:
        drawn = push(plain, "waveform", [[100.0, 0.01]], blocks=10)
    assert 0.36 < drawn["range"] < 36.0 * 0.05


@pytest.mark.parametrize(("amplitude", "words"), [(5e-4, "0.05 % of the full scale"), (5e-6, "no vibration")])
def test_next_to_nothing_is_not_magnified(pictures: Page, amplitude: float, words: str) -> None:
    drawn = push(pictures, "waveform", [[100.0, amplitude]], "velocity", fullScale=3.0, blocks=120)
    assert drawn["range"] >= 3.0
    assert np.abs(drawn["values"]).max() <= 1.001 * 3.0 * amplitude
    label_of(pictures, "waveform", words)


@pytest.mark.parametrize("times", [1.3, 27.0])
def test_what_exceeds_the_full_scale_fits_the_axes(pictures: Page, times: float) -> None:
    for name in ("waveform", "spectrum"):
        drawn = push(pictures, name, [[200.0, times]], "displacement", fullScale=1e-4, blocks=120)
        highest = max(drawn["values"] if name == "waveform" else drawn["amplitudes"])
        assert highest == pytest.approx(1e-4 * times, rel=1e-3)
        assert highest <= drawn["range" if name == "waveform" else "high"] <= 30e-4 * times
    label_of(pictures, "waveform", "to which the sound is limited")
    for name in ("waveform", "spectrum"):
        pictures.evaluate("(name) => views.drawn(views[name].panel, () => views[name].rest())", name)
    drawn = pictures.evaluate("() => [views.waveform.drawn, views.spectrum.drawn]")
    assert drawn[0]["range"] == pytest.approx(1.12e-4) and not any(drawn[0]["values"])
    assert drawn[1]["largest"]["amplitude"] == 0 and drawn[1]["high"] <= 1.001e-4


def test_the_axis_of_the_spectrum_returns_when_the_excess_is_over(pictures: Page) -> None:
    assert push(pictures, "spectrum", [[200.0, 50.0]], "tangential_force", fullScale=0.7)["high"] == 100.0
    deadline = pictures.evaluate("() => performance.now() + 60000")
    high = 100.0
    while high > 1.0 and pictures.evaluate("() => performance.now()") < deadline:
        high = push(pictures, "spectrum", [[200.0, 0.5]], "tangential_force", fullScale=0.7)["high"]
    assert high == 1.0


def test_pictures_have_a_role_and_a_text_from_the_beginning(plain: Page) -> None:
    for name in ("waveform", "spectrum", "contact", "surface"):
        assert "yet" in str(plain.get_attribute(f"#{name}", "aria-label"))
        assert plain.get_attribute(f"#{name}", "role") == "img"


def test_a_text_alternative_changes_twice_a_second_at_most(plain: Page) -> None:
    changes = plain.evaluate(
        """async () => { const panel = views.waveform.panel; let changes = 0;
        new MutationObserver(() => changes++).observe(panel.canvas, {attributeFilter: ["aria-label"]});
        const end = performance.now() + 1100;
        for (let count = 0; performance.now() < end; count++) {
          panel.say(`text ${count}`); await new Promise(requestAnimationFrame); }
        return changes; }"""
    )
    assert 1 <= changes <= 3


def test_colours_follow_the_scheme(plain: Page) -> None:
    def ink() -> Any:
        return plain.evaluate("() => views.contact.panel.colour('ink')")

    light = ink()
    plain.emulate_media(color_scheme="dark")
    plain.wait_for_function("(light) => views.contact.panel.colour('ink') !== light", arg=light)
    assert ink() == "#e8edf2"
