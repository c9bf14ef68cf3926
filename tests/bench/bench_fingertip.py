"""Fingertips on textures along a line: what new ones cost, and their true error beside the told one.

Model: solutions of a texture that is new under a finger that is known, of a new finger, and of `explain`, in processor
    time; the memory of ten textures under one finger. Then renders at 1e-3 beside brute force: all textures of the
    catalogue along a line, at three loads and speeds in turn, and random scenes, in all three quantities, at 1 kHz and,
    every other one with few harmonics, in the full band. A ratio is the true error over the told error and the doubt
    about brute force together.
Limits: the comparison takes about half a minute a scene; quick leaves all but six out.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from time import process_time
from typing import Any

import numpy as np

import ridgewave as rw
from synth.contact.scene_contact import contact_of
from synth.scene.catalogue import catalogue_kinds
from synth.scene.texture_registry import kinds
from tests.bench.timing import Figure, figure
from tests.synth.contact.fingertip_study import random_scene, render_errors

PHASES, TEXTURES = 256, 10
LOADS, SPEEDS = (0.1, 0.3, 1.0), ("40 mm/s", "80 mm/s", "160 mm/s")
RANDOM, QUICK = 130, 6
TOLERANCE = 1e-3
SLOWEST = 12.0  # Hz: periods of the texture a second; below it brute force in the full band takes many minutes
FASTEST = 500.0  # Hz: beyond it, 1 kHz leaves nothing or one harmonic


def figures(quick: bool) -> list[Figure]:
    """Return the lines of costs and of errors."""
    return [*costs(), *errors(QUICK if quick else None)]


def costs() -> list[Figure]:
    """Return what a new texture, a new finger and a new plan cost, and the memory of ten textures."""
    textures = on_a_line()
    some = textures[:: len(textures) // TEXTURES][:TEXTURES]
    near, nearer = ([1e3 * solved_in(name, coarser) for name in some] for coarser in (1.0, 0.25))
    new = [solved_in(textures[0], 1.0, seed=seed) for seed in (1, 2, 3)]
    held = 1e-6 * sum(tip(name, 1.0).grid.nbytes for name in some)
    asked = ({"finger": {"kind": "fingertip", "seed": seed}, "texture": {"kind": some[seed]}} for seed in (5, 6, 7))
    explained = [1e3 * seconds(partial(rw.explain, scene)) for scene in asked]
    how = f"{PHASES} phases under a known finger, {TEXTURES} textures"
    return [
        figure("a new texture, error of some 1e-2", near, "ms", 15.0, how),
        figure("a new texture, error of some 1e-3", nearer, "ms", 60.0, how),
        figure("a new finger", new, "s", 0.5, textures[0]),
        figure("memory of ten textures", [held], "MB", 100.0, "usual distances"),
        figure("explain of a new fingertip", explained, "ms", 60.0, "at the default tolerance"),
    ]


def errors(most: int | None) -> list[Figure]:
    """Return how the true error lies to the told one, and how many textures keep the tolerance; most: of scenes."""
    scans = [{"load": load, "speed": speed} for load in LOADS for speed in SPEEDS]
    named = [
        {"finger": {"kind": "fingertip"}, "texture": {"kind": name}, "scan": scans[number % len(scans)]}
        for number, name in enumerate(on_a_line())
    ]
    told, ratios = [], []
    for number, asked in enumerate([*named, *(random_scene(seed) for seed in range(RANDOM))][:most]):
        scene = rw.parse_scene(asked)
        turns = scene.scan.speed / scene.texture.period
        wide = turns > (SLOWEST if number % 2 else FASTEST)
        found = render_errors(asked, TOLERANCE, bandwidth="full" if wide else "1 kHz")
        ratios.append(max(one.true / (one.told + one.doubt) for one in found))
        if asked in named:
            told.append(max(one.told for one in found))
        print(asked["texture"].get("kind", "sinusoid"), *found, flush=True)
    how, kept = f"{len(ratios)} scenes", 100.0 * float(np.mean(np.array(told) <= TOLERANCE))
    return [
        figure("true error over told and doubt", ratios, "", 1.0, how),
        figure("largest of them", [max(ratios)], "", 1.0, how),
        figure("textures that keep 1e-3", [kept], "%", None, f"of {len(told)}"),
    ]


def on_a_line() -> list[str]:
    """Return the textures of the catalogue that do not vary across."""
    return [name for name, kind in catalogue_kinds().items() if not kinds()[kind].of_area]


def tip(name: str, coarser: float, **finger: Any) -> Any:
    """Return the contact of a fingertip on a texture of the catalogue."""
    scene = rw.parse_scene({"finger": {"kind": "fingertip", **finger}, "texture": {"kind": name}})
    return contact_of(scene, coarser=coarser)


def solved_in(name: str, coarser: float, **finger: Any) -> float:
    """Return the processor time of solving a contact that is new, s; see `tip`."""
    return seconds(lambda: tip(name, coarser, **finger).approach(np.arange(PHASES) / PHASES, 0.3))


def seconds(work: Callable[[], object]) -> float:
    """Return the processor time of `work`, s."""
    began = process_time()
    work()
    return process_time() - began
