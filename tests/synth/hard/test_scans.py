"""Steady scans at the ends of what a scene allows, one row a scan: the oracle's samples, or silence that says why."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pytest

from synth.scene.scene import Scene
from synth.voice.voice import open_voice
from tests.few import few
from tests.reference.stiffness_oracle import contact_in_metres
from tests.synth.engine_cases import Real, physical, scene_of, touch_of
from tests.synth.hard.bounds import ALL, TINY, check_fit, check_steady

TOLERANCE = 1e-3
FRAMES = 4096


@dataclass(frozen=True)
class Scanned:
    """A steady scan: its sections, rate and bandwidth (Hz), and whether its oracle takes a second or so."""

    sections: dict[str, dict[str, Any]] = field(default_factory=dict)
    rate: int = 48000
    bandwidth: float | str = 2000.0
    oracle: bool = True

    @property
    def scene(self) -> Scene:
        """All three quantities, in SI units."""
        return scene_of(
            output={**ALL, "sample_rate": self.rate, "bandwidth": self.bandwidth},
            accuracy={"tolerance": TOLERANCE}, **self.sections,
        )  # fmt: skip


def touching(**fields: float) -> dict[str, dict[str, Any]]:
    """Return the sections that hold `fields`, each named as section_field."""
    sections: dict[str, dict[str, Any]] = {}
    for name, value in fields.items():
        section, _, rest = name.partition("_")
        sections.setdefault(section, {})[rest] = value
    return sections


SCANS: dict[str, Scanned] = {
    "a nanonewton": Scanned(touching(scan_load=1e-9)),
    "a nanonewton that is not faded": Scanned(touching(scan_load=1e-9, scan_lift_load=1e-6)),
    "a feather": Scanned(touching(scan_load=1e-3)),
    "a kilonewton": Scanned(touching(scan_load=1e3)),
    "no ridges": Scanned(touching(finger_ridge_amplitude=0.0)),
    "no ridges, pressed hard": Scanned(touching(finger_ridge_amplitude=0.0, scan_load=5.0)),
    "a texture of a millionth of the ridges": Scanned(touching(finger_ridge_amplitude=1e-3, texture_amplitude=1e-9)),
    "a texture of a million times the ridges": Scanned(touching(finger_ridge_amplitude=1e-9, texture_amplitude=1e-3)),
    "locked": Scanned(touching(texture_period=0.5e-3)),
    "a millionth off locked": Scanned(touching(texture_period=0.5e-3 * (1 + 1e-6))),
    "opposite and as high": Scanned(
        touching(texture_period=0.5e-3, texture_amplitude=40e-6, texture_phase=math.pi)
    ),
    "opposite and as high, a millionth off locked": Scanned(
        touching(texture_period=0.5e-3 * (1 + 1e-6), texture_amplitude=40e-6, texture_phase=math.pi)
    ),
    "half the period of the ridges": Scanned(touching(texture_period=0.25e-3)),
    "a metre": Scanned(touching(texture_period=1.0, texture_amplitude=1e-3, scan_speed=10.0), bandwidth=300.0),
    "shorter than a ridge": Scanned(touching(finger_contact_length=1e-4)),
    "the shortest": Scanned(
        touching(finger_contact_length=1e-5, finger_ridge_period=1e-2, texture_period=1.0, scan_speed=10.0),
        bandwidth=300.0,
        oracle=False,  # pressed in by 2e9 times its height: z itself leaves the oracle 1e-7 of it in float64
    ),
    "1000 ridges": Scanned(touching(finger_ridge_period=1e-5), oracle=False),
    "10,000 periods": Scanned(
        touching(texture_period=1e-6, texture_amplitude=1e-7, scan_speed=1e-4), oracle=False
    ),
    "10 m/s": Scanned(touching(scan_speed=10.0), bandwidth="full"),
    "backwards": Scanned(touching(scan_speed=-0.08)),
    "backwards at 10 m/s": Scanned(touching(scan_speed=-10.0), bandwidth="full"),
    **{f"{rate} Hz": Scanned(touching(scan_speed=rate * 1.03e-5), rate, "full")
       for rate in (1000, 8000, 11025, 44100, 96000, 192000)},
    "the lowest bandwidth": Scanned(touching(scan_speed=0.9 * 0.8e-3), 1000, 1.0),
}  # fmt: skip


@pytest.mark.parametrize("name", few(SCANS, 5))
def test_a_hard_scan_is_that_of_the_oracle_and_within_its_bounds(name: str) -> None:
    scene = SCANS[name].scene
    voice = open_voice(scene)
    block = voice.render(FRAMES)
    check_fit(voice, block)
    assert np.max(np.abs(block[:, 0])) > 0.0
    if SCANS[name].oracle:
        check_steady(scene, TOLERANCE, FRAMES)


SILENT: dict[str, tuple[Scanned, str]] = {
    "no load": (Scanned(touching(scan_load=0.0)), "0 N"),
    "the smallest load": (Scanned(touching(scan_load=5e-324)), "0 N"),
    "no texture": (Scanned(touching(texture_amplitude=0.0)), "no height"),
    "neither": (Scanned(touching(finger_ridge_amplitude=0.0, texture_amplitude=0.0)), "no height"),
    "10 m/s at 8 kHz": (Scanned(touching(scan_speed=10.0), 8000, "full"), "above the band"),
    "10 m/s backwards at 8 kHz": (Scanned(touching(scan_speed=-10.0), 8000, "full"), "above the band"),
    "at the very end of the band": (
        Scanned(touching(texture_period=1e-3, scan_speed=3.2), 8000, "full"), "above the band",
    ),
    "at the very end of the bandwidth": (
        Scanned(touching(texture_period=1e-3, scan_speed=0.5), 8000, 500.0), "above the band",
    ),
    "the finest texture at the highest speed": (
        Scanned(touching(texture_period=1e-6, scan_speed=10.0), 192000, "full"), "above the band",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", SILENT)
def test_what_does_not_move_is_silent_at_any_scale_and_says_why(name: str) -> None:
    scanned, reason = SILENT[name]
    scene = scanned.scene
    automatic = scene_of(output={"sample_rate": scanned.rate, "bandwidth": scanned.bandwidth}, **scanned.sections)
    for voice in (open_voice(scene), open_voice(automatic)):
        assert not voice.render(1000).any()
        voice.seek(10**12)
        assert not voice.render(10).any()
        assert any(reason in warning for warning in voice.warnings)
        assert voice.plan.left_out[0].name == "contact response" and not voice.plan.simulated
        assert reason in voice.plan.left_out[0].reason
        assert not voice.plan.simulated


@pytest.mark.parametrize("speed", [3.19, 3.2])
def test_the_band_ends_at_two_fifths_of_the_rate(speed: float) -> None:
    """3.2 m/s on 1 mm is 3200 Hz, 0.40 of 8 kHz: that is not below; 1 % slower is."""
    voice = open_voice(scene_of(texture={"period": 1e-3}, scan={"speed": speed}, output={**ALL, "sample_rate": 8000}))
    assert bool(voice.render(1000).any()) == (speed < 3.2)


def slow(speed: float) -> tuple[Scene, Real]:
    scene = Scanned(touching(scan_speed=speed), bandwidth="full").scene
    return scene, physical(open_voice(scene), 256)


@pytest.mark.parametrize("speed", [0.0, -0.0, 5e-324, -2.3e-308, 1e-300, 1e-9, -1e-9])
def test_the_slowest_scans_stand_where_the_oracle_says_and_move_with_its_slope(speed: float) -> None:
    """dz/dt is the oracle's dz/dtheta times u / lambda2; where that is below every float32, it is exactly nothing."""
    scene, found = slow(speed)
    theta = np.concatenate([[0.0], np.arange(256) / 256])
    contact = contact_in_metres(touch_of(scene), theta, dtype=np.float64)
    place, slope = contact.approach - np.mean(contact.approach[1:]), contact.phase_slope
    assert np.max(np.abs(found[:, 0] - place[0])) <= TOLERANCE * np.ptp(place)
    wanted, extent = (part * speed / scene.texture.period for part in (slope[0], np.ptp(slope)))
    assert np.max(np.abs(found[:, 1] - wanted)) <= TOLERANCE * abs(extent) + TINY
    if abs(speed) < 1e-200:
        assert np.all(found[:, 0] == found[0, 0])
        assert not found[:, 1:].any()


@pytest.mark.thorough
def test_a_hundred_thousand_periods_in_the_contact() -> None:
    """The finest texture under the longest contact: 1.6 million cells a phase, more than there is time to solve well.

    The work is bounded, the samples are within their bounds, and the plan tells the error that is left.
    """
    sections = touching(finger_contact_length=0.1, texture_period=1e-6, texture_amplitude=1e-7, scan_speed=1e-4)
    voice = open_voice(Scanned(sections, bandwidth="full").scene)
    check_fit(voice, voice.render(FRAMES))
    late = [quantity for quantity, error in voice.plan.estimated_error.items() if error > TOLERANCE]
    assert late
    assert all(any(quantity in warning for warning in voice.warnings) for quantity in late)
