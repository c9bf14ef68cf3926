"""Effects: the cost of a frame, a voice's memory and its set-up, for each effect and for the largest permitted sets;
    the frame and the set-up also for the pulp of a fingertip under a hand.

A scene without effects must not pay for the effects that exist. So two equal voices without effects are timed in turn,
and also one whose scene names every effect as null. Frames, set-up and steps are measured in processor time: they never
wait, and other work on the core does not count.
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable
from functools import partial
from itertools import combinations
from time import thread_time
from typing import Any

import numpy as np

from synth import ResponseCache, Voice, open_voice, parse_scene
from synth.effects.simulation.running import Simulation
from synth.effects.simulation.skin_steps import SkinStepper
from synth.effects.simulation.steps import ROWS
from synth.errors import SceneError
from synth.motion.motion import Motion
from synth.plan.prepare import prepare
from synth.response.phases import phase_step
from synth.scene.effects_section import effect_names
from synth.scene.scene import Scene
from synth.voice.voice import BLOCK
from tests.bench.timing import Figure, alternated, figure

FRAMES = 480  # a live block: 10 ms at 48 kHz
SOUND = 4800  # least frames per repeat: short, so that other work interrupts few of the repeats
FRAME_TIME = 1e9 / 48000  # ns: real time
FASTER = {"viscous_skin": 5.0}  # least permitted speed, in multiples of real time, where it is not AT_LEAST
AT_LEAST = 20.0
STEPS = 1 << 12


def figures(quick: bool) -> list[Figure]:
    """Return the lines of the effects, on one core."""
    lines = []
    for name in effect_names():
        lines += cost(f"{name}, alone", (name,), limit_of(name), quick)
    largest = largest_sets()
    common = set.intersection(*map(set, largest))
    for names in largest:
        title = " + ".join(name for name in names if name not in common)
        lines += cost(f"all, {title}", names, None, quick)
    lines += pulp_under_hand(quick)
    return [*lines, *without_effects(3 if quick else 4001), *steps(3 if quick else 201)]


def scene_with(*names: str) -> Scene:
    """Return the default scene along a stroke, with the effects `names` at their default settings.

    A constant scan costs the same with effects on the balance as without them.
    """
    effects: dict[str, Any] = {name: {} for name in names}
    return parse_scene({"scan": {"stroke": {}}, "effects": effects, "output": {"bandwidth": "full"}})


def opened_live(scene: Scene) -> Voice:
    """Return a voice whose simulation takes no more steps than can be played live."""
    own = ResponseCache()
    return Voice(prepare(scene, own, paced=True), paced=True, cache=own)


def limit_of(name: str) -> float:
    """Return the nanoseconds that a frame may take with one effect, as a whole number."""
    return float(math.floor(FRAME_TIME / FASTER.get(name, AT_LEAST)))


def sets() -> list[tuple[str, ...]]:
    """Return every permitted set of effects of a scene."""
    found = []
    for count in range(1, len(effect_names()) + 1):
        for names in combinations(effect_names(), count):
            try:
                scene_with(*names)
            except SceneError:
                continue
            found.append(names)
    return found


def largest_sets() -> list[tuple[str, ...]]:
    """Return the permitted sets to which no effect can be added."""
    found = sets()
    return [names for names in found if not any(set(names) < set(other) for other in found)]


def cost(title: str, names: tuple[str, ...], limit: float | None, quick: bool) -> list[Figure]:
    """Return the lines of one set of effects: a frame in live blocks and in those of a file, memory and set-up."""
    scene, told = scene_with(*names), "" if len(names) == 1 else f" with {', '.join(names)}"
    repeats, openings = (3, 1) if quick else (21, 3)
    began = thread_time()
    voice = opened_live(scene)
    first = thread_time() - began
    opened = [first] if quick else worked(partial(opened_live, scene), openings)
    lines = []
    for frames in (FRAMES, BLOCK):
        blocks = max(1, SOUND // frames)
        took = worked(partial(rendered, voice, frames, blocks), repeats)
        per_frame = 1e9 / (frames * blocks)
        times = FRAME_TIME / (per_frame * statistics.median(took))
        how = f"blocks of {frames}, {times:.3g} times faster than real time, median of {repeats}"
        lines.append(figure(title, took, "ns/frame", limit, how, scale=per_frame))
    lines.append(figure(title, [voice.memory_bytes / 1e3], "kB", None, f"memory of a voice{told}"))
    how = f"set-up: open_voice, only kernels cached, median of {openings}"
    return [*lines, figure(title, opened, "ms", None, how, scale=1e3)]


def pulp_under_hand(quick: bool) -> list[Figure]:
    """Return the lines of a growing fingertip with pulp under a hand that presses and strokes, and of opening it."""
    scene, title = (
        parse_scene({"finger": {"kind": "fingertip"}, "effects": {"inertia": {}}}),
        "inertia, fingertip, hand",
    )
    repeats, openings = (3, 1) if quick else (201, 5)
    opened = worked(lambda: open_voice(scene, cache=ResponseCache(), live=True), openings)
    voice, motions = open_voice(scene, live=True), pressing_strokes()

    def followed() -> None:
        for motion in motions:
            voice.render(motion.frames, motion)

    took, per_frame = worked(followed, repeats), 1e9 / (FRAMES * len(motions))
    times = FRAME_TIME / (per_frame * statistics.median(took))
    how = f"blocks of {FRAMES}, {times:.3g} times faster than real time, median of {repeats}"
    return [
        figure(title, took, "ns/frame", limit_of("inertia"), how, scale=per_frame),
        figure(title, opened, "ms", None, f"set-up: open_voice, only kernels cached, median of {openings}", scale=1e3),
    ]


def pressing_strokes() -> list[Motion]:
    """Return 100 ms of a hand in blocks: strokes of up to 0.12 m/s, and a load between 0.05 and 0.95 N."""
    t = np.arange(10 * FRAMES) / 48000
    stroke, press = 2.0 * math.pi * 10.0, 2.0 * math.pi * 20.0  # rad/s; whole periods, so that repeats join
    return [
        Motion.of(
            FRAMES,
            speed=0.12 * np.sin(stroke * part),
            speed_rate=0.12 * stroke * np.cos(stroke * part),
            load=0.5 - 0.45 * np.cos(press * part),
            load_rate=0.45 * press * np.sin(press * part),
            load_bend=0.45 * press**2 * np.cos(press * part),
        )
        for part in np.split(t, 10)
    ]


def worked(work: Callable[[], object], repeats: int) -> list[float]:
    """Return the processor time (s) of each of `repeats` runs, after one that does not count."""
    times = []
    for _ in range(1 + repeats):
        began = thread_time()
        work()
        times.append(thread_time() - began)
    return times[1:]


def rendered(voice: Voice, frames: int, blocks: int) -> None:
    """Render some blocks."""
    for _ in range(blocks):
        voice.render(frames)


def without_effects(repeats: int) -> list[Figure]:
    """Return the relative time of two equal voices without effects: built alike, and with every effect null."""
    null = {"effects": dict.fromkeys(effect_names())}
    return [
        against_equal("no effect, twice", {}, "two equal voices", repeats),
        against_equal("no effect, each of them null", null, "every effect named, as null", repeats),
    ]


def against_equal(name: str, document: dict[str, Any], what: str, repeats: int) -> Figure:
    """Return the time of a block of the voice of `document`, relative to a voice of the default scene at full band."""
    full = {"output": {"bandwidth": "full"}}
    voices = open_voice(parse_scene(full)), open_voice(parse_scene(document | full))
    assert abs(voices[0].memory_bytes - voices[1].memory_bytes) < 1000  # the scene names its effects
    blocks = SOUND // FRAMES
    renders: list[list[Callable[[], object]]] = [[partial(voice.render, FRAMES)] * blocks for voice in voices]
    first, second = alternated(renders[0], renders[1], repeats)
    ratios = [other / one for one, other in zip(first, second, strict=True)]
    low, high = np.quantile(ratios, (0.25, 0.75))
    how = f"{what}, blocks of {FRAMES} in turn, half of {repeats} passes between {low:.4f} and {high:.4f}"
    return Figure(name, statistics.median(ratios), min(second) / min(first), "x equal", None, how)


def steps(repeats: int) -> list[Figure]:
    """Return the time of a step of each simulation, relative to the time that the plan assumes."""
    relaxing = parse_scene(
        {"effects": {"viscous_skin": {"model": "three_time_constants"}}, "output": {"bandwidth": "full"}}
    )
    return [
        step_line("step of inertia", scene_with("inertia"), repeats),
        step_line("step of adhesion", scene_with("adhesion"), repeats),
        step_line("point of skin", scene_with("viscous_skin"), repeats),
        step_line("point that relaxes", relaxing, repeats),
    ]


def simulation_of(scene: Scene) -> Simulation:
    """Return the simulation of a scene."""
    effects = prepare(scene, paced=True).effects
    assert effects is not None and effects.simulation is not None
    return effects.simulation.simulation


def step_line(name: str, scene: Scene, repeats: int) -> Figure:
    """Return the line of a step that reads a table, or of a point of skin in a step."""
    simulation = simulation_of(scene)
    stepper, took = simulation.stepper, worked(stepping(simulation), repeats)
    count = STEPS * (stepper.points.count if isinstance(stepper, SkinStepper) else 1)
    assumed = STEPS * stepper.step_time
    how = f"{1e9 * statistics.median(took) / count:.3g} ns against {1e9 * assumed / count:.3g}"
    return figure(
        f"simulation: {name}",
        took,
        "x assumed",
        None,
        f"{how}, median of {repeats} x {STEPS} steps",
        scale=1.0 / assumed,
    )


def stepping(simulation: Simulation) -> Callable[[], None]:
    """Return a function that runs STEPS steps of a simulation, at its scene's speed and load."""
    scan, period = simulation.scene.scan, simulation.scene.texture.period
    step = np.uint64(phase_step(scan.speed, period, simulation.rate))
    loads, rows, offsets = np.full(STEPS, scan.load), np.empty((ROWS, STEPS)), np.arange(STEPS, dtype=np.uint64)
    state: Any = simulation.stepper.start(0, scan.load, scan.speed / period, 1.0 / simulation.rate)
    begun = np.zeros(1, np.uint64)

    def run() -> None:
        with np.errstate(over="ignore"):
            phases = begun + step * (offsets + np.uint64(1))
        begun[0] = phases[-1]
        simulation.stepper.run(state, phases, loads, rows)

    return run
