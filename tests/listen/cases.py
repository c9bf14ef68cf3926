"""The hard cases to listen to: what each renders, and what a listener should and should not hear."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from synth import LiveVoice, Motion, open_voice, parse_scene
from synth.arrays import Block
from synth.scene.scene import Scene

RATE = 48000
BLOCK = 480


@dataclass(frozen=True, slots=True)
class Sound:
    """A render: value / full_scale float32 [frames, channels], with its scene and full scales."""

    scene: Scene
    samples: Block
    full_scale: tuple[float, ...]
    quantities: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Case:
    """A scene (JSON), what to listen for, and whether a hand or a change moves it rather than its own scan."""

    name: str
    listen_for: str
    scene: dict[str, object]
    motion: str = ""


@dataclass(frozen=True, slots=True)
class Pair:
    """An effect to hear: a scene without it and with it, at one full scale, and what the effect makes audible."""

    effect: str
    scene: dict[str, dict[str, object]]
    full_scale: float
    before: str
    after: str
    settings: dict[str, object] = field(default_factory=dict)

    def cases(self) -> tuple[Case, Case]:
        """Return the case without the effect and the one with it."""
        output = {"full_scale": self.full_scale, **self.scene.get("output", {})}
        scene: dict[str, object] = {**self.scene, "output": output}
        after = {**scene, "effects": {self.effect: self.settings}}
        return Case(f"{self.effect}-before", self.before, scene), Case(f"{self.effect}-after", self.after, after)


def trajectory(*points: tuple[float, float, float]) -> dict[str, object]:
    """Return a scan of recorded points (s, m, N)."""
    return {"trajectory": [list(point) for point in points]}


HARD_CASES = (
    Case(
        "sweep",
        "A finger that speeds up from rest to 1 m/s in 4 s: a tone that rises and grows, without whistles that fall "
        "while it rises (aliases) and without steps in its colour (levels).",
        {"texture": {"period": "2 mm"}, "output": {"duration": 4.0, "full_scale": 900.0}},
        "sweep",
    ),
    Case(
        "press",
        "A steady hand presses from nothing to 1.8 N and lets go, in 4 s: it begins and ends in silence without a "
        "click, and its colour changes smoothly.",
        {"output": {"duration": 4.0, "full_scale": 300.0}},
        "press",
    ),
    Case(
        "change",
        "A live voice whose texture changes after 1 s and whose speed changes after 2 s: two cross-fades, no click.",
        {"output": {"duration": 3.0}},
        "change",
    ),
    Case(
        "turn",
        "A slow rub with short turns: each turn sounds like the one before, and mirrored; no click at rest.",
        {"scan": {"stroke": {"length": "10 mm", "speed": "40 mm/s", "load": "0.3 N", "turn_time": "40 ms"}}},
    ),
    Case(
        "touch-and-lift",
        "Four short touches: each fades in and out with the load; silence, not noise, between them.",
        {
            "scan": trajectory(*((0.125 * n, 0.01 * n, 0.3 * (n % 4 in (1, 2))) for n in range(17))),
            "output": {"duration": 2.2, "full_scale": 300.0},
        },
    ),
    Case(
        "locked",
        "The texture has the period of the ridges: the finger rides over it nearly whole, loud and dull.",
        {"texture": {"period": "0.5 mm"}},
    ),
    Case(
        "full-contact",
        "A soft skin on a shallow texture touches everywhere: a pure tone, one sinusoid.",
        {
            "finger": {"ridge_amplitude": "2 um", "youngs_modulus": "10 kPa"},
            "texture": {"period": "3 mm", "amplitude": "2 um"},
            "scan": {"load": "5 N"},
            "output": {"quantity": "displacement"},
        },
    ),
    Case(
        "cancelled",
        "Whole numbers of both periods under a heavy touch: the motion cancels. Silence with a warning, not noise.",
        {
            "finger": {"ridge_amplitude": "2 um", "youngs_modulus": "10 kPa"},
            "texture": {"period": "1 mm", "amplitude": "2 um"},
            "scan": {"load": "5 N"},
        },
    ),
    Case(
        "barely-touching",
        "0.1 mN, below the load at which the finger counts as lifted: faint, thin, no hiss.",
        {"scan": {"load": "0.1 mN"}, "output": {"full_scale": 10.0}},
    ),
    Case(
        "near-the-band",
        "The fundamental stands at 16 kHz: one clean tone at the edge of hearing, nothing below it.",
        {"texture": {"period": "0.05 mm"}, "scan": {"speed": "0.8 m/s"}},
    ),
    Case(
        "low-rate",
        "The default scene at 8 kHz: duller than at 48 kHz, no tones that do not belong to it.",
        {"output": {"sample_rate": 8000}},
    ),
)

FALLING = tuple((0.1 * n, 0.008 * n, 0.002 * (10 - n)) for n in range(11))
RISING = tuple((0.1 * n, 0.008 * n, 0.05 * 1.35**n) for n in range(11))

PAIRS = (
    Pair(
        "adhesion",
        {"scan": trajectory(*FALLING), "output": {"quantity": "displacement"}},
        2e-6,
        "A light touch, 20 mN, is lifted within 1 s: a thin tone that changes with the load and ends where it does.",
        "Surfaces attract each other: the same tone, lower in colour towards the end, and louder there, since the "
        "finger is held to the last. It is let go softly, without a click.",
    ),
    Pair(
        "contact_growth",
        {"scan": trajectory(*RISING), "output": {"duration": 1.0, "bandwidth": 2000.0}},
        50.0,
        "A press from 0.05 N to 1 N in 1 s over a contact of one length: the colour changes slowly and evenly.",
        "The contact grows: the tone swells and sinks several times, as its ends pass ridges. No steps.",
    ),
    Pair(
        "curvature",
        {"texture": {"amplitude": "4 um"}, "scan": {"load": "0.5 N"}},
        1.0,
        "Hard edges at the ends of the contact: a tone of 100 Hz.",
        "The ends fade: the tone of 100 Hz is all but gone. What is left is thin and bright, the ridges at the ends "
        "that touch and leave; no hiss.",
    ),
    Pair(
        "inertia",
        {},
        30.0,
        "The default scene, quasi-static: bright, a buzz of sharp clicks 100 times a second.",
        "On the pulp: hardly softer, 3 % less of each tone below 1 kHz; no ringing, and no buzz that is rounded off.",
    ),
    Pair(
        "propagation",
        {},
        8.0,
        "One channel: the acceleration at the contact, a bright buzz, 100 times a second.",
        "Two channels: the first is the sound before, sample for sample; the second is the nail: the same buzz, duller "
        "and about as loud by its own full scale. No click where it begins.",
    ),
    Pair(
        "stick_slip",
        {"texture": {"period": "0.3 mm", "amplitude": "5 um"}, "scan": {"speed": "10 mm/s", "load": "0.5 N"}},
        1.3,
        "A slow scan of a fine texture: a quiet, even tone of 33 Hz and its harmonics.",
        "Two channels. The finger sticks and slips 40 times a second: the first is a chirp in each slip and silence "
        "between, the second, the force, a saw of 40 Hz.",
    ),
    Pair(
        "tangential",
        {"output": {"quantity": "displacement"}},
        2e-6,
        "One channel: how far the finger moves, a tone of 100 Hz.",
        "Two channels: the first is the sound before, sample for sample; the second is the force across the texture, "
        "brighter, on a level that is not heard (but seen, and a thump where playing begins and ends).",
    ),
    Pair(
        "viscous_skin",
        {"accuracy": {"tolerance": 1e-2}},
        50.0,
        "The default scene, elastic: a buzz of sharp clicks 100 times a second.",
        "Viscous skin: a harder, louder buzz, since skin that comes back late leaves sharp corners; no hiss between.",
    ),
)
"""Every effect, before and after."""

CASES = (*HARD_CASES, *(case for pair in PAIRS for case in pair.cases()))


def rendered(case: Case) -> Sound:
    """Return the sound of `case`."""
    scene = parse_scene(case.scene)
    frames = round(scene.output.duration * scene.output.sample_rate)
    if case.motion == "change":
        return _changed(scene, frames)
    voice = open_voice(scene)
    motion = {"": lambda _frames: None, "sweep": sweep, "press": press}[case.motion](frames)
    samples = voice.render(frames, motion)
    return Sound(scene, samples, voice.full_scale, voice.quantities)


def sweep(frames: int) -> Motion:
    """Return a finger that speeds up evenly from rest to 1 m/s at 0.3 N."""
    rate = RATE / frames
    t = np.arange(frames) / RATE
    return Motion.of(frames, speed=rate * t, speed_rate=rate, load=0.3, load_rate=0.0, load_bend=0.0)


def press(frames: int) -> Motion:
    """Return a finger at 80 mm/s whose load swells to 1.8 N and back to nothing: 1.8 N sin^2."""
    turn = math.pi * RATE / frames
    angle = turn * np.arange(frames) / RATE
    return Motion.of(
        frames,
        speed=0.08,
        speed_rate=0.0,
        load=1.8 * np.sin(angle) ** 2,
        load_rate=1.8 * turn * np.sin(2.0 * angle),
        load_bend=3.6 * turn**2 * np.cos(2.0 * angle),
    )


def _changed(scene: Scene, frames: int) -> Sound:
    """Return a live voice in blocks, its texture changed after a third and its speed after two thirds."""
    fixed = {"output": {"duration": scene.output.duration, "full_scale": None}}
    voice = LiveVoice(scene)
    changes = {
        frames // 3: {"texture": {"period": "1.5 mm"}},
        2 * frames // 3: {"texture": {"period": "1.5 mm"}, "scan": {"speed": "40 mm/s"}},
    }
    blocks = []
    for frame in range(0, frames, BLOCK):
        if frame in changes:
            voice.apply(voice.prepare(parse_scene(fixed | changes[frame])))
        blocks.append(voice.render(BLOCK))
    return Sound(scene, np.concatenate(blocks), voice.full_scale, voice.quantities)
