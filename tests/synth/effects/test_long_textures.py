"""A mass on a texture whose period is long against the contact: no table of the energy is fine enough."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from synth import Voice, open_voice, parse_scene
from synth.contact.scene_contact import contact_of
from synth.plan.prepare import prepare
from tests.synth.effects.whole_renders import below
from tests.synth.engine_cases import Real, physical

RATE, FRAMES, BEGUN, REACH = 8000, 160, 40, 24
POINTS, STEP = 3000, 5e-6  # m
SPEED, LOAD = 0.08, 0.3  # m/s, N
OWN_ERROR = 5e-4  # of the oracle, whose force is that of the contact's polyline


def walk() -> list[float]:
    """Return the heights (m) of a random walk that ends where it began."""
    steps = np.random.default_rng(11).normal(0.0, 2e-7, POINTS)
    return list(np.cumsum(steps - np.mean(steps)))


@pytest.mark.thorough
def test_a_file_with_a_mass_on_a_long_texture_errs_by_no_more_than_the_plan_says() -> None:
    """With a table of the energy the error was 0.06 of the peak-to-peak here."""
    scene = parse_scene(
        {
            "finger": {"contact_length": "2 mm"},
            "texture": {"kind": "profile", "heights": walk(), "spacing": STEP, "ends": "join"},
            "effects": {"inertia": {}},
            "output": {"sample_rate": RATE, "bandwidth": "full"},
        }
    )
    contact, pulp = contact_of(scene), scene.effects["inertia"]
    k, period = contact.stiffness_at(LOAD), POINTS * STEP
    phases = np.arange(256) / 256
    rest = float(np.mean(contact.approach(phases, LOAD)[0]))

    def rate(t: float, state: Real) -> list[float]:
        depth, _touching = contact.measure(np.array([SPEED * t / period % 1.0]), state[:1], LOAD)
        held = pulp.damping * state[1] + pulp.stiffness * (state[0] - rest)
        return [state[1], (k * depth[0] - LOAD - held) / pulp.mass]

    times = np.arange(2 * FRAMES) / (2 * RATE)
    start = [float(contact.approach(np.zeros(1), LOAD)[0][0]), 0.0]
    found = solve_ivp(rate, (0.0, times[-1]), start, "DOP853", times, rtol=1e-7, atol=[1e-13, 1e-9], max_step=1e-4)
    voice = open_voice(scene)
    accelerations = np.array([rate(float(t), state)[1] for t, state in zip(times, found.y.T, strict=True)])
    truth = below(accelerations, 2, reach=REACH)[: FRAMES - 2 * REACH]
    apart = (below(physical(voice, FRAMES)[:, 0], 1, reach=REACH) - truth)[BEGUN:]
    error, told = float(np.max(np.abs(apart)) / np.ptp(truth)), voice.plan.estimated_error["acceleration"]
    assert told <= 5e-3
    assert error <= told + OWN_ERROR


def test_a_small_mass_leaves_the_level_of_a_fingertip_on_fine_grain() -> None:
    """The table began with 64 phases: the acceleration was 30 dB too small, and the plan told an error of 1.4."""
    scene = {
        "finger": {"kind": "fingertip"},
        "texture": {"kind": "sandpaper-p1000"},
        "output": {"sample_rate": RATE, "bandwidth": "300 Hz"},
        "accuracy": {"tolerance": 0.01},
    }
    light = {"inertia": {"mass": "1 mg", "damping": "0 N s/m", "stiffness": "0 N/m"}}
    plain, heavy = (
        Voice(prepare(parse_scene({**scene, **effects}), paced=True), paced=True)
        for effects in ({}, {"effects": light})
    )
    told = [voice.plan.estimated_error["acceleration"] for voice in (plain, heavy)]
    wanted, found = (physical(voice, RATE // 4)[RATE // 20 :, 0] for voice in (plain, heavy))
    assert told[1] < 1.1 * told[0], "what the table adds to the error of the cells, which both have"
    (low, high), before, after = (20.0, 270.0), *(np.abs(np.fft.rfft(one)) for one in (wanted, found))
    kept = slice(*(round(hertz * len(wanted) / RATE) for hertz in (low, high)))  # the edges of both bands differ
    level = 10.0 * np.log10(np.sum(after[kept] ** 2) / np.sum(before[kept] ** 2))
    assert abs(level) < 0.5, f"{level} dB"
