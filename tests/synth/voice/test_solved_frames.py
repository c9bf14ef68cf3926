"""Recordings solved at their frames: band, derivatives, mean over the load, any blocks, and when this is used."""

from __future__ import annotations

import itertools
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.special import erfc

from synth.contact.scene_contact import contact_of
from synth.plan.frame_plan import FramePlan
from synth.plan.prepare import prepare
from synth.response.demand import Demand
from synth.response.spectrum import solve_spectrum
from synth.sampling import frame_solver
from synth.sampling.frame_solver import edge_of
from synth.scene.scene import Scene
from synth.voice.live_voice import LiveVoice
from synth.voice.solved_frames import SolvedFrames
from synth.voice.voice import open_voice
from tests.reference.stiffness_oracle import contact_in_metres
from tests.synth.engine_cases import QUANTITIES, physical, scene_of, touch_of

RATE = 8000
ALL = {"channels": [{"quantity": name, "full_scale": 1} for name in QUANTITIES], "sample_rate": RATE}
FINGER = {"contact_length": "1.2 mm"}  # few ridges: quick to solve
POINTS = [[0, 0, 0.3], [0.1, 6e-3, 0.4], [0.2, 1e-2, 0.25], [0.3, 8e-3, 0.3]]


def steady(speed: float, oversampling: int, **sections: Any) -> tuple[SolvedFrames, Scene]:
    """Return a steady scan that is solved at its frames, as a recording would be."""
    scene = scene_of(
        finger=FINGER, scan={"speed": speed, "load": 0.3}, output=ALL, accuracy={"tolerance": 1e-6}, **sections
    )
    solved = prepare(scene)
    channels = tuple(replace(channel, full_scale=1.0) for channel in solved.channels)
    plan = FramePlan(oversampling, 1, (0.0,) * 3, 1.0, 0.0)
    return SolvedFrames(replace(solved, channels=channels), plan, contact_of(scene).heights), scene


def test_a_steady_scan_is_its_series_through_the_filter() -> None:
    frames, scene = steady(0.0613, 128)
    out = np.empty((6000, 3), np.float32)
    frames.read(0, out)
    turns, count = 0.0613 / scene.texture.period, 52
    series = solve_spectrum(contact_of(scene), 0.3, Demand(count, (0, 1, 2), 1e-7), count).harmonics
    n = np.arange(1, count + 1)
    half, width = edge_of(1.0)
    gain = 0.5 * erfc((n * turns / RATE - half) / width)
    angles = 2j * np.pi * turns * np.outer(np.arange(6000) / RATE, n)
    for order in range(3):
        wanted = 2.0 * np.real(np.exp(angles) @ (series[1:] * gain * (2j * np.pi * n * turns) ** order))
        error = np.max(np.abs(out[:, order] - wanted))
        assert error <= 2e-6 * np.ptp(wanted), QUANTITIES[order]


def test_the_filter_keeps_below_040_and_loses_above_049() -> None:
    half, width = edge_of(1.0)
    assert 0.5 * erfc((0.40 - half) / width) == pytest.approx(1.0, abs=2e-9)
    assert 0.5 * erfc((0.49 - half) / width) <= 2e-9


def recorded(**sections: Any) -> Scene:
    """Return a recording."""
    return scene_of(finger=FINGER, **({"scan": {"trajectory": POINTS}, "output": ALL} | sections))


def test_displacement_follows_the_oracle_over_position_and_load() -> None:
    """The scan is so slow that the part cut off by the band is below the permitted error."""
    points = [[0, 0, 0.2], [0.15, 1.5e-3, 0.4], [0.25, 2.6e-3, 0.5], [0.4, 4.2e-3, 0.3]]
    scene = scene_of(finger=FINGER, scan={"trajectory": points}, output=ALL, accuracy={"tolerance": 1e-4})
    voice = open_voice(scene)
    assert voice.plan.response["method"] == "solved frames"
    found = physical(voice, 3200)
    some = np.arange(40, 3200, 331)
    motion = voice._motion.at(0, 3200)
    theta = motion.position[some] / scene.texture.period
    period = np.arange(256) / 256
    for frame, phase in zip(some, theta, strict=True):
        load = float(motion.samples[2, frame])
        height = contact_in_metres(touch_of(scene), np.append(period, phase), load).approach
        wanted = height[-1] - np.mean(height[:-1])
        assert found[frame, 0] == pytest.approx(float(wanted), abs=1e-3 * float(np.ptp(height)))


def test_derivatives_are_those_of_the_displacement() -> None:
    """At eight times the rate and an eighth of the band, differences of the displacement are its derivatives."""
    output = {"channels": ALL["channels"], "sample_rate": 8 * RATE, "bandwidth": 0.4 * RATE}
    found = physical(open_voice(recorded(output=output)), 16000)[1000:-1000]
    rate = 8 * RATE
    slope = (8 * (found[3:-1, 0] - found[1:-3, 0]) - (found[4:, 0] - found[:-4, 0])) * rate / 12
    bend = (8 * (found[3:-1, 1] - found[1:-3, 1]) - (found[4:, 1] - found[:-4, 1])) * rate / 12
    assert np.max(np.abs(slope - found[2:-2, 1])) <= 2e-3 * np.ptp(found[:, 1])
    assert np.max(np.abs(bend - found[2:-2, 2])) <= 2e-3 * np.ptp(found[:, 2])


def test_a_tighter_tolerance_comes_nearer() -> None:
    scan = {"trajectory": [[0, 0, 0.3], [0.05, 3e-3, 0.4], [0.1, 5e-3, 0.25], [0.15, 4e-3, 0.3]]}
    exact = open_voice(recorded(scan=scan, accuracy={"tolerance": 1e-5})).render(1200).astype(float)
    for tolerance in (1e-2, 1e-3, 1e-4):
        voice = open_voice(recorded(scan=scan, accuracy={"tolerance": tolerance}))
        assert voice.plan.response["method"] == "solved frames"
        error = np.max(np.abs(voice.render(1200) - exact), axis=0) / np.ptp(exact, axis=0)
        assert np.all(error <= tolerance)
        assert all(error[i] <= voice.plan.estimated_error[name] for i, name in enumerate(QUANTITIES))


def test_blocks_do_not_matter_and_any_frame_can_be_sought() -> None:
    scene = recorded()
    whole = open_voice(scene).render(9000)
    voice = open_voice(scene)
    cuts = [0, 1, 2, 480, 4095, 4096, 4097, 9000]
    parts = [voice.render(b - a) for a, b in itertools.pairwise(cuts)]
    assert np.array_equal(np.concatenate(parts), whole)
    voice.seek(4000)
    assert np.array_equal(voice.render(1000), whole[4000:5000])


def test_a_finger_that_has_left_is_exact_silence() -> None:
    points = [[0, 0, 0.3], [0.1, 6e-3, 0.0], [0.2, 1e-2, 0.0], [0.3, 8e-3, 0.3]]
    voice = open_voice(scene_of(finger=FINGER, scan={"trajectory": points}, output=ALL))
    assert voice.plan.response["method"] == "solved frames"
    block = voice.render(4000)
    loads = voice._motion.at(0, 4000).samples[2]
    assert (loads == 0.0).any()
    assert not block[loads == 0.0].any()
    assert block[loads > 0.01].any()
    size = np.abs(block[block != 0.0])
    assert np.isfinite(block).all() and size.min() >= 1.17e-38


def test_a_stream_reads_a_table_where_a_file_is_solved_at_its_frames() -> None:
    """A stream has deadlines."""
    scene = recorded(output={"sample_rate": RATE, "bandwidth": 600})
    assert open_voice(scene).plan.response["method"] == "solved frames"
    assert LiveVoice(scene).plan.response["method"] == "response table"


def test_the_plan_says_how_and_how_near() -> None:
    plan = open_voice(recorded()).plan
    assert [part.name for part in plan.simulated] == ["contact response", "solved frames"]
    assert plan.response["method"] == "solved frames"
    assert all(0.0 < error <= 1e-3 for error in plan.estimated_error.values())
    assert not plan.warnings


def test_a_hand_takes_over_where_the_recording_stands() -> None:
    from synth.motion.motion import Motion

    scene = recorded(output={"sample_rate": RATE, "bandwidth": 600, "quantity": "displacement", "full_scale": 1e-5})
    voice = open_voice(scene)
    if voice.plan.response["method"] != "solved frames":
        pytest.fail("the scene was meant to be solved at its frames")
    before = voice.render(800).astype(float)
    load = float(voice._motion.at(800, 1).samples[2, 0])
    after = voice.render(16, Motion.of(16, load=load, speed=0.0)).astype(float)
    assert np.max(np.abs(after - before[-1])) <= 0.1 * np.ptp(before)


def test_many_solutions_a_frame_are_made_in_small_chunks(monkeypatch: pytest.MonkeyPatch) -> None:
    """Working memory is limited to 2 million solutions, or to the margins of the filter where those are more."""
    frames, _scene = steady(2.0, 1500)
    assert 0 <= 2**21 // 1500 - 2 * 280 - frames.chunk < 280
    assert frames.memory_bytes < 210e6
    whole, _scene = steady(2.0, 64)
    assert 0 <= 4096 - whole.chunk < 280
    monkeypatch.setattr(frame_solver, "TOGETHER", 2**17)  # solved quickly
    small, _scene = steady(2.0, 64)
    assert 0 <= 2**17 // 64 - 2 * 280 - small.chunk < 280
    out, long = np.empty((1000, 3), np.float32), np.empty((1000, 3), np.float32)
    small.read(0, out)
    whole.read(0, long)
    assert np.max(np.abs(out - long)) <= 1e-5 * np.max(np.abs(long), initial=0.0)


def test_a_narrow_band_takes_solutions_in_proportion_and_sounds_as_a_wide_one_cut_alike() -> None:
    output = {"channels": ALL["channels"], "sample_rate": 8 * RATE, "bandwidth": 600}
    narrow = open_voice(recorded(output=output))
    assert narrow.solved.frames is not None and narrow.solved.frames.stride > 8
    scaled = open_voice(recorded(output=output | {"sample_rate": RATE}))
    found, wanted = physical(narrow, 8 * 2400)[::8], physical(scaled, 2400)
    assert np.max(np.abs(found - wanted) / np.ptp(wanted, axis=0)) <= 2e-3


def test_a_load_that_swings_through_full_contact_keeps_the_told_error_of_the_acceleration() -> None:
    """The mean that displacement leaves out has kinks there. A load that passes its knots quickly hears their error."""
    times = np.arange(1601) / RATE
    points = np.stack([times, 0.021 * times, 1.64 + 0.91 * np.sin(145.0 * times + 5.34)], axis=1).tolist()
    finger = {"contact_length": "3 mm", "ridge_amplitude": "5.2 um"}
    parts = {"finger": finger, "texture": {"period": "0.536 mm", "amplitude": "4.5 um"}, "scan": {"trajectory": points}}
    output = {"quantity": "acceleration", "sample_rate": RATE, "full_scale": 100}
    found, exact = (
        open_voice(scene_of(**parts, output=output, accuracy={"tolerance": tolerance})) for tolerance in (1e-3, 1e-5)
    )
    missed = np.max(np.abs(physical(found, 1600) - physical(exact, 1600))[240:-240])
    told, response = found.plan.estimated_error["acceleration"], found.plan.response["channels"][0]
    assert missed <= told * response["peak_to_peak"] and told <= 1e-3
