"""Voices: the cost of a frame at constant load, and under a hand whose speed and load change at every frame.

The hand's voice is compared with `numpy.sin` on this machine, in one loop: a block of the voice, then `numpy.sin` of
the same number of float64, a phase ramp of 100 Hz (from 0 to 2 pi 100 over the second). Each has a new output array.
"""

from __future__ import annotations

import statistics
from collections.abc import Callable
from functools import partial

import numpy as np

from synth import Motion, Voice, open_voice, parse_scene
from synth.voice.voice import BLOCK
from tests.bench.timing import Figure, alternated, figure, repeated

FRAMES = 480  # a block: 10 ms at 48 kHz
BLOCKS = 100  # one second
RATE = 48000
SINE_HZ = 100.0
QUICK = 3  # repeats that only show that it runs
LIMIT = 1.2  # x sin
USUAL, FADING = 0.08, 0.6  # m/s; fundamental at which two levels sound, relative to the band

Renders = list[Callable[[], object]]


def figures(quick: bool) -> list[Figure]:
    """Return the lines of the voices, on one core."""
    repeats = QUICK if quick else 400
    return [
        *(against_sine(quantity, repeats) for quantity in ("displacement", "velocity", "acceleration")),
        against_sine("acceleration", repeats, fading=True),
        *steady(repeats),
        *moving(repeats),
    ]


def hand(*, load_varies: bool = True, speed: float = USUAL, sway: float = 0.02) -> list[Motion]:
    """Return a second of a hand's motion in blocks: `speed` +/- `sway` (m/s), 0.25 to 0.35 N."""
    t = np.arange(FRAMES * BLOCKS) / RATE
    swing = 0.05 if load_varies else 0.0
    return [
        Motion.of(
            FRAMES,
            speed=speed + sway * np.sin(6.0 * part),
            speed_rate=6.0 * sway * np.cos(6.0 * part),
            load=0.3 + swing * np.sin(4.0 * part),
            load_rate=4.0 * swing * np.cos(4.0 * part),
            load_bend=-16.0 * swing * np.sin(4.0 * part),
        )
        for part in np.split(t, BLOCKS)
    ]


def hand_blocks(voice: Voice, motions: list[Motion]) -> Renders:
    """Return the renders of each block of `motions`."""
    return [partial(voice.render, motion.frames, motion) for motion in motions]


def sine_blocks() -> Renders:
    """Return `numpy.sin` of the same number of frames as each block."""
    ramp = 2.0 * np.pi * SINE_HZ * np.arange(FRAMES * BLOCKS) / RATE
    return [partial(np.sin, part.copy()) for part in np.split(ramp, BLOCKS)]


def against_sine(quantity: str, repeats: int, *, fading: bool = False) -> Figure:
    """Return the time of a live voice under a hand, relative to `numpy.sin`; fading: where two levels sound."""
    scene = parse_scene({"output": {"quantity": quantity}})
    voice = open_voice(scene, live=True)
    speed = FADING * scene.texture.period * scene.output.bandwidth_hz if fading else USUAL
    renders = hand_blocks(voice, hand(speed=speed, sway=0.0 if fading else 0.02))
    voices, sines = alternated(renders, sine_blocks(), repeats)
    ratios = [one / other for one, other in zip(voices, sines, strict=True)]
    per_frame = 1e9 / (FRAMES * BLOCKS)
    how = (
        f"{per_frame * statistics.median(voices):.2f} ns/frame against {per_frame * statistics.median(sines):.2f}, "
        f"median of {repeats} x {BLOCKS} blocks of {FRAMES} in turn"
    )
    least = min(voices) / min(sines)
    name = f"live voice, {quantity}{', two levels' if fading else ''}"
    return Figure(name, statistics.median(ratios), least, "x sin", LIMIT, how)


def steady(repeats: int) -> list[Figure]:
    """Return the cost of a frame at constant speed and load, in live blocks and in the blocks of a finite render."""
    lines = []
    for quantity in ("displacement", "acceleration"):
        voice = open_voice(parse_scene({"output": {"quantity": quantity, "bandwidth": "full"}}))
        for frames in (FRAMES, BLOCK):
            took = repeated(partial(_many, voice, frames, max(1, FRAMES * BLOCKS // frames)), repeats)
            made = frames * max(1, FRAMES * BLOCKS // frames)
            how = f"blocks of {frames}, median of {repeats}"
            lines.append(figure(f"steady voice, {quantity}", took, "ns/frame", 8.0, how, scale=1e9 / made))
    return lines


def _many(voice: Voice, frames: int, blocks: int) -> None:
    for _ in range(blocks):
        voice.render(frames)


def moving(repeats: int) -> list[Figure]:
    """Return the cost of a frame at constant load and changing speed: under a hand, and along a stroke.

    The motion of a hand is given; the voice of a stroke also computes its motion.
    """
    hands = [under_hand("displacement", 8.0, repeats), under_hand("acceleration", None, repeats)]
    return [*hands, along_stroke(repeats)]


def under_hand(quantity: str, limit: float | None, repeats: int) -> Figure:
    """Return the cost of a frame under a hand with constant load."""
    voice = open_voice(parse_scene({"output": {"quantity": quantity}}), live=True)
    took = repeated(partial(_all, hand_blocks(voice, hand(load_varies=False))), repeats)
    how = f"speed changes, load does not, blocks of {FRAMES}, median of {repeats}"
    return figure(f"hand at constant load, {quantity}", took, "ns/frame", limit, how, scale=1e9 / (FRAMES * BLOCKS))


def along_stroke(repeats: int) -> Figure:
    """Return the cost of a frame of a back-and-forth scan, including its motion."""
    voice = open_voice(parse_scene({"scan": {"stroke": {}}, "output": {"quantity": "displacement"}}))
    took = repeated(partial(_many, voice, FRAMES, BLOCKS), repeats)
    how = f"speed and position computed too, blocks of {FRAMES}, median of {repeats}"
    return figure("stroke, displacement", took, "ns/frame", None, how, scale=1e9 / (FRAMES * BLOCKS))


def _all(renders: Renders) -> None:
    for render in renders:
        render()
