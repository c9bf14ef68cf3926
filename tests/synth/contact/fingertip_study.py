"""Renders of fingertips beside brute force: random scenes, and the error of each quantity beside the told one."""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

import ridgewave as rw
from synth.contact.geometry import Geometry
from synth.contact.stiffness import Stiffness
from synth.response.demand import curves
from synth.scene.finger_section import Finger
from synth.scene.scene import Scene
from synth.surfaces import profile_of
from synth.surfaces.ridge_field import PATTERNS
from tests.reference.fingertip_oracle import Points, Print, footprint_depth
from tests.synth.surfaces.texture_cases import random_texture

KINDS = ("sinusoid", "harmonics", "grating", "rough", "profile")
QUANTITIES = ("displacement", "velocity", "acceleration")
RATE = 8000
TOGETHER = 64  # phases that are solved together
COLUMNS, ROWS, WAVE = 512, 150, 64  # of brute force: per ridge, and columns per wave of the texture
PROBED = 64  # phases at which fewer points tell which points may touch
SMALLER = 0.7  # factor on the columns and rows of brute force whose change tells how far to trust it
MORE_PHASES = 4  # times the phases at which the render's series is judged: few fold back then


def random_scene(seed: int) -> dict[str, Any]:
    """Return a random fingertip on a random texture of kind number `seed` modulo their number."""
    random = np.random.default_rng([19, seed])
    kind = KINDS[seed % len(KINDS)]
    finger = {
        "kind": "fingertip",
        "ridge_period": float(random.uniform(0.4e-3, 0.6e-3)),
        "ridge_amplitude": float(random.uniform(20e-6, 60e-6)),
        "contact_length": float(random.uniform(2e-3, 6e-3)),
        "contact_width": float(random.uniform(2e-3, 6e-3)),
        "pattern": PATTERNS[int(random.integers(3))],
        **{name: float(random.uniform(0.0, 0.5)) for name in ("spacing_spread", "direction_spread", "height_spread")},
        "seed": int(random.integers(1_000_000)),
    }
    sinusoid = {"period": float(random.uniform(0.2e-3, 4e-3)), "amplitude": float(random.uniform(2e-6, 30e-6))}
    texture = sinusoid if kind == "sinusoid" else random_texture(kind, random)
    scan = {"load": float(10.0 ** random.uniform(-1.5, 0.5)), "speed": float(random.uniform(0.05, 0.2))}
    return {"finger": finger, "texture": texture, "scan": scan}


@dataclass(frozen=True)
class Found:
    """The error of a quantity of a render, relative to its peak-to-peak.

    true: against brute force.
    told: by the plan.
    doubt: change of brute force with fewer points and fewer phases.
    """

    quantity: str
    true: float
    told: float
    doubt: float


def render_errors(
    asked: dict[str, Any], tolerance: float, *, bandwidth: Any = 1000.0, many: float = 1.0
) -> list[Found]:
    """Return the errors of displacement, velocity and acceleration of a steady scene.

    many: factor on the columns and rows of brute force.
    """
    channels = [{"quantity": one} for one in QUANTITIES]
    output = {"channels": channels, "sample_rate": RATE, "duration": 0.05, "bandwidth": bandwidth}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", rw.RenderWarning)
        sound = rw.render({**asked, "output": output, "accuracy": {"tolerance": tolerance}})
    assert sound.plan is not None
    scene = rw.parse_scene(sound.scene)
    turns = scene.scan.speed / scene.texture.period
    highest = max(1, math.ceil(scene.output.band_limit / turns) - 1)
    count = 1 << max(8, (8 * highest).bit_length())
    most = brute_heights(scene, MORE_PHASES * count, many)
    few, some, fine = (series_of(most[::step], highest) for step in (MORE_PHASES, 2, 1))
    rough = series_of(brute_heights(scene, count, SMALLER * many), highest)
    doubted = few - rough, fine - some
    times, n = np.arange(len(sound.values)) / RATE, np.arange(1, highest + 1)
    waves = np.exp(2j * math.pi * np.outer(turns * times, n))
    found = []
    for place, quantity in enumerate(QUANTITIES):
        wanted = 2.0 * (waves @ (fine[1:] * (2j * math.pi * turns * n) ** place)).real
        extent = float(np.ptp(curves(fine, place, count))) * turns**place
        doubt = sum(float(np.max(np.abs(curves(one, place, count)))) for one in doubted) * turns**place
        true = float(np.max(np.abs(sound.values[:, place] - wanted)))
        told = sound.plan.estimated_error.get(quantity, 0.0)
        found.append(Found(quantity, true / extent, told, doubt / extent))
    return found


def series_of(z: Any, highest: int) -> Any:
    """Return harmonics 0 to `highest` of z (m); the mean counts as 0."""
    series = np.fft.rfft(z)[: highest + 1] / len(z)
    series[0] = 0.0
    return series


def brute_heights(scene: Scene, count: int, many: float) -> Any:
    """Return z (m) from brute force at `count` phases of a period."""
    profile, load = profile_of(scene), max(scene.scan.load, scene.scan.lift_load)
    law, finger = Stiffness.of_scene(scene), scene.finger
    wave = math.pi * (profile.extent[1] - profile.extent[0]) / max(profile.slope_bound, 1e-9)
    depth, indentation, ridge = _depth(finger, law), law.indentation(load), finger.ridge_period
    finest = 2.0 ** math.ceil(math.log2(WAVE / min(wave, profile.period)))  # columns per m
    assert finger.contact_length is not None
    size = finger.contact_length, finger.width
    every = _points(finger, depth, -1.0, 1.0 / max(ridge / 16.0, max(size) / 400.0), 1.0 / (ridge / 8.0))
    seen = every.approach(profile.heights, np.arange(PROBED) / PROBED * profile.period, indentation)
    room = 0.02 * (profile.extent[1] - profile.extent[0]) + 0.5e-6
    lowest = float(np.min(seen)) - profile.extent[1] - room
    step = 2.0 ** math.floor(math.log2(abs(lowest)))  # rounded, so that scenes share their points
    points = _points(
        finger, depth, math.floor(8.0 * lowest / step) * step / 8.0, many * max(COLUMNS / ridge, finest),
        many * ROWS / ridge,
    )  # fmt: skip
    places = np.arange(count) / count * profile.period
    parts = (places[first : first + TOGETHER] for first in range(0, count, TOGETHER))
    return np.concatenate([points.approach(profile.heights, some, indentation) for some in parts])


def _depth(finger: Finger, law: Stiffness) -> float:
    """Return the depth (m) of the paraboloid at the edge of the footprint."""
    assert finger.contact_length is not None
    flat = Geometry(finger.ridge_amplitude, finger.ridge_period, 0.0, finger.ridge_period, 0.0, finger.contact_length)
    own = Stiffness.of_contact(flat, law.contact_modulus, finger.contact_width)
    return footprint_depth(finger.ridge_amplitude, (law if finger.ridge_amplitude == 0.0 else own).indentation(1.0))


@lru_cache(6)
def _points(finger: Finger, depth: float, lowest: float, columns: float, rows: float) -> Points:
    """Return the points of a finger above `lowest`, so that scenes with one finger share them."""
    ridges = Print(
        finger.ridge_period, finger.ridge_amplitude, finger.pattern or "loop", finger.spacing_spread or 0.0,
        finger.direction_spread or 0.0, finger.height_spread or 0.0, finger.seed or 0,
    )  # fmt: skip
    assert finger.contact_length is not None
    return Points.of(ridges, (finger.contact_length, finger.width), depth, lowest, columns, rows)
