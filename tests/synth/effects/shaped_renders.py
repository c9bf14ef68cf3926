"""Whole renders of contacts whose shape follows the load, against an oracle of one phase and one load at a time."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from synth import open_voice, parse_scene
from synth.scene.scene import Scene
from tests.reference.moving_oracle import Harmonics
from tests.synth.effects.whole_renders import below, check_quantities
from tests.synth.engine_cases import Real, physical

RATE = 8000
PHASES = 256  # of a period: harmonics that fold back onto the lowest of them are below 1e-4 of them
MEAN_PHASES = 128  # of a moving load's mean
REACH = 24  # frames that the comparing filter looks at to each side

Approach = Callable[[float, float], float]
"""z (m) at theta (turns) and load (N)."""


def check_steady(scene: Scene, approach: Approach, phases: int = PHASES) -> None:
    """Assert that displacement and velocity of a steady scan err by no more than the plan says."""
    sign = np.copysign(1.0, scene.scan.speed)
    z = [approach(float(sign * i / phases), scene.scan.load) for i in range(phases)]
    fundamental = abs(scene.scan.speed) / scene.texture.period
    several = [Harmonics(np.fft.rfft(z[::part]) / len(z[::part]), fundamental) for part in (1, 2)]
    own, frames = {}, np.arange(800)
    limit = scene.output.band_limit
    for order, quantity in enumerate(("displacement", "velocity", "acceleration")):
        fine, coarse = (one.signal(order, frames, scene.output.sample_rate, limit) for one in several)
        own[quantity] = 0.3 * float(np.max(np.abs(fine - coarse)) / np.ptp(fine))  # folding falls as the power -2.5
    assert own["displacement"] <= 1e-3
    check_quantities(scene, (several[0],), own)


def motion(seconds: float = 0.12) -> tuple[list[list[float]], Callable[[Real], tuple[Real, Real]]]:
    """Return a recording of varying speed and load, and the same as a function of time: position (m), load (N)."""

    def at(t: Real) -> tuple[Real, Real]:
        return 5e-3 * t / seconds + 4e-4 * np.sin(40 * t), 0.35 + 0.2 * np.sin(30 * t)

    points = np.arange(round(seconds * 2000) + 1) / 2000
    return np.stack([points, *at(points)], axis=1).tolist(), at


def check_moving(effects: dict[str, Any], approach: Approach, tolerance: float = 3e-3) -> None:
    """Assert that displacement where speed and load vary is the oracle's, about its mean at each load."""
    points, at = motion()
    output = {"quantity": "displacement", "sample_rate": RATE, "bandwidth": "full", "full_scale": 1e-5}
    scene = parse_scene({"scan": {"trajectory": points}, "effects": effects, "output": output})
    voice = open_voice(scene)
    found = physical(voice, 450)[:, 0]
    place, load = at(np.arange(900) / (2 * RATE))
    z = np.array([approach(p / scene.texture.period, w) for p, w in zip(place.tolist(), load.tolist(), strict=True)])
    contact, phases = voice.solved.contact, np.arange(MEAN_PHASES) / MEAN_PHASES
    assert contact is not None  # whose approach is held to the same oracle elsewhere; its mean bends with the load
    about = z - np.array([np.mean(contact.approach(phases, w)[0]) for w in load.tolist()])
    ours, truth = below(found, 1, reach=REACH), below(about, 2, reach=REACH)[: len(found) - 2 * REACH]
    error = float(np.max(np.abs(ours - truth)) / np.ptp(truth))
    assert error <= tolerance
