"""Every source passes a frequency by the same gain: whole to 0.9 of the band, and nothing from the band on.

The default texture at 80 mm/s has lines at every 100 Hz. The gain of a line is its amplitude at a band of 1 kHz,
relative to a render at full band.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest

from synth import Voice, open_voice, parse_scene
from synth.arrays import Array
from synth.plan.prepare import prepare
from tests.few import paired, thorough

RATE, BAND, LINES = 8000, 1000.0, (900.0, 1000.0, 1100.0, 1300.0)
WANTED = np.array([1.0, 0.0, 0.0, 0.0])
SAME = 1e-3
WINDOW, END = (
    800,
    800,
)  # frames: whole periods of every line, and the end of a render, which the edge of a stroke reaches

SCANS: dict[str, dict[str, Any]] = {
    "constant": {"speed": "80 mm/s", "load": 0.3},
    "stroke": {"stroke": {"length": "160 mm", "speed": "80 mm/s", "load": 0.3}},
    "recording": {"trajectory": [[0, 0, 0.3], [0.8, 0.064, 0.3]]},
}
EFFECTS = ("none", "inertia", "adhesion", "viscous_skin")


@cache
def lines_of(scan: str, effect: str, bandwidth: Any, *, paced: bool = False) -> Array:
    """Return the amplitudes of LINES in the acceleration of a file, or of a live voice that follows its scan."""
    output = {"sample_rate": RATE, "bandwidth": bandwidth, "full_scale": 1.0, "duration": 0.8}
    effects: dict[str, Any] = {} if effect == "none" else {effect: {}}
    scene = parse_scene({"scan": SCANS[scan], "effects": effects, "output": output})
    voice = Voice(prepare(scene, paced=True), paced=True) if paced else open_voice(scene)
    frames = voice.render(round(0.8 * RATE))[-WINDOW - END : -END, 0].astype(float)
    return np.asarray(np.abs(np.fft.rfft(frames))[[round(line * WINDOW / RATE) for line in LINES]])


@pytest.mark.parametrize(("scan", "effect"), paired(SCANS, EFFECTS))
def test_a_file_passes_each_line_by_the_one_gain(scan: str, effect: str) -> None:
    gains = lines_of(scan, effect, BAND) / lines_of("constant", effect, "full")
    assert np.max(np.abs(gains - WANTED)) <= SAME, gains


@pytest.mark.parametrize("effect", ["inertia", thorough("adhesion"), thorough("viscous_skin")])
def test_a_live_scan_that_is_simulated_passes_each_line_by_it_too(effect: str) -> None:
    gains = lines_of("constant", effect, BAND, paced=True) / lines_of("constant", effect, "full", paced=True)
    assert np.max(np.abs(gains - WANTED)) <= SAME, gains


@pytest.mark.parametrize("effect", ["inertia", thorough("viscous_skin")])
def test_an_effect_changes_no_line_below_the_band_but_by_its_cause(effect: str) -> None:
    """A filter faded the lines of simulated scans between 0.92 and 1.00 of the band, which other scans keep."""
    texture = {"kind": "harmonics", "period": "4 mm", "amplitudes": [1e-6] * 49}  # lines at every 20 Hz
    output = {"sample_rate": RATE, "full_scale": 1.0, "duration": 0.2, "quantity": "displacement"}
    lines = {}
    for band in (BAND, 2.0 * BAND):
        scene = parse_scene(
            {
                "texture": texture,
                "effects": {effect: {}},
                "output": output | {"bandwidth": band},
                "accuracy": {"tolerance": 1e-4},
            }
        )
        frames = open_voice(scene).render(WINDOW)[:, 0].astype(float)
        lines[band] = np.fft.rfft(frames)[90:100:2]  # 900 to 980 Hz
    assert np.max(np.abs(lines[BAND] - lines[2.0 * BAND])) <= SAME * np.max(np.abs(lines[BAND]))
