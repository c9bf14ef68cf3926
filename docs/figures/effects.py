"""Draws what each effect does, with it and without it: effect-NAME.svg and .png for docs/effects.md.

    python -m docs.figures.effects [FOLDER]

Every scene is the default scene at full band, changed where the figure says so. Needs the extra `plots`. The same
versions draw the same bytes.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, NullFormatter

from clients.figure_look import BLUE, FAINT, GREEN, INK, LOOK, RED, Real, new_figure, saved
from synth import Voice, open_voice, parse_scene
from synth.effects.simulation.steps import HEIGHT, ROWS
from synth.motion.scan_motion import ScanMotion
from synth.plan.effect_choice import stiffness_round

Settings = Mapping[str, Any]
HERE = Path(__file__).resolve().parent
RATE = 48000
PERIOD, SPEED, LOAD = 0.8e-3, 0.08, 0.3  # m, m/s, N: of the default scene
TURN = round(RATE * PERIOD / SPEED)  # frames of a texture period
MASS = 5e-3  # kg, of a whole finger
WHOLE: Settings = {"mass": MASS, "damping": 3.0, "stiffness": 0.0}


def main(folder: Path = HERE) -> None:
    """Write the figures of every effect into `folder`."""
    for name, draw in FIGURES.items():
        with matplotlib.rc_context(LOOK):
            saved(draw(), folder, f"effect-{name}")


def voice_of(effects: Settings, *channels: str, **sections: Any) -> Voice:
    """Return a voice of the default scene with `effects`, its `channels`, and other `sections`."""
    output = {"channels": [{"quantity": name} for name in channels or ("displacement",)], "bandwidth": "full"}
    return open_voice(parse_scene({"effects": dict(effects), "output": output} | sections))


def rendered(voice: Voice, frames: int) -> Real:
    """Return the next frames in SI units, float64 [frames, channels]."""
    return np.asarray(voice.render(frames) * np.array(voice.full_scale), dtype=np.float64)


def with_and_without(name: str, colour: str) -> tuple[tuple[Settings, str, str], tuple[Settings, str, str]]:
    """Return effects, colour and name of the two lines of a comparison."""
    return ({}, FAINT, "without"), ({name: {}}, colour, name)


def panels(*widths: float, height: float = 2.7) -> tuple[Figure, list[Axes]]:
    """Return a figure with panels side by side."""
    figure = new_figure(7.4, height)
    return figure, list(figure.subplots(1, len(widths), width_ratios=widths))


def titled(axes: Axes, title: str, across: str, up: str) -> None:
    """Write the title of a panel and the names of its axes."""
    axes.set_title(title, loc="left", fontsize=8.5, color=INK)
    axes.set_xlabel(across)
    axes.set_ylabel(up)


def named(axes: Axes, **where: Any) -> None:
    """Show the names of the lines."""
    axes.legend(frameon=False, fontsize=7.5, handlelength=1.6, borderaxespad=0.2, labelcolor=INK, **where)


def plain_log(axes: Axes, ticks: tuple[float, ...]) -> None:
    """Make the horizontal axis logarithmic, with plain numbers at `ticks`."""
    axes.set_xscale("log")
    axes.set_xticks(ticks)
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _place: f"{value:g}"))
    axes.xaxis.set_minor_formatter(NullFormatter())


# -- the shape of the contact


def contact_growth() -> Figure:
    """Return length of the contact and peak-to-peak of z over the load, without and with the effect."""
    figure, (left, right) = panels(1.0, 1.25)
    loads = np.geomspace(0.05, 2.0, 161)
    for effects, colour, name in with_and_without("contact_growth", BLUE):
        voices = [voice_of(effects, scan={"load": float(load)}) for load in loads]
        lengths = [
            contact_of(voice).geometry_at(load).contact_length for voice, load in zip(voices, loads, strict=True)
        ]
        moves = [voice.plan.response["channels"][0]["peak_to_peak"] for voice in voices]
        left.plot(loads, 1e3 * np.array(lengths), color=colour, linewidth=1.3, label=name)
        right.plot(loads, 1e6 * np.array(moves), color=colour, linewidth=1.1, label=name)
    for axes in (left, right):
        plain_log(axes, (0.05, 0.1, 0.2, 0.5, 1.0, 2.0))
        axes.set_ylim(bottom=0.0)
    titled(left, "length of the contact", "load (N)", "L (mm)")
    titled(right, "how far the finger moves, peak to peak", "load (N)", "z (µm)")
    named(left, loc="lower right")
    return figure


def contact_of(voice: Voice) -> Any:
    """Return the contact that a voice was prepared with."""
    contact = voice.solved.contact
    assert contact is not None
    return contact


def curvature() -> Figure:
    """Return the pressure along the contact at one instant, and z in time, without and with the effect."""
    figure = new_figure(7.4, 2.9)
    grid = figure.add_gridspec(2, 2, width_ratios=(1.5, 1.0))
    upper = figure.add_subplot(grid[0, 0])
    lower, right = figure.add_subplot(grid[1, 0], sharex=upper, sharey=upper), figure.add_subplot(grid[:, 1])
    for axes, (effects, colour, name) in zip((upper, lower), with_and_without("curvature", BLUE), strict=True):
        voice = voice_of(effects, **SHALLOW)
        places, pressure = pressures(contact_of(voice), 0.25, voice.scene.scan.load)
        axes.fill_between(1e3 * places, pressure, color=colour, linewidth=0.6)
        axes.set_ylabel("N/m")
        z = rendered(voice, 2 * TURN + 1)[:, 0]
        right.plot(1e3 * np.arange(len(z)) / RATE, 1e6 * z, color=colour, linewidth=1.3, label=name)
    upper.set_xlim(-1.5, 11.5)
    upper.set_ylim(bottom=0.0)
    upper.tick_params(labelbottom=False)
    titled(upper, "force along the finger at one instant, 0.5 N in all", "", "N/m")
    lower.set_xlabel("place along the finger (mm)")
    titled(right, "how the finger moves", "time (ms)", "z (µm)")
    right.margins(x=0.0, y=0.2)
    named(right, loc="upper right", ncols=2, columnspacing=1.0)
    return figure


SHALLOW = {"texture": {"amplitude": "4 um"}, "scan": {"load": "0.5 N"}}
"""A scene in which every ridge of a flat finger touches."""


def pressures(contact: Any, phase: float, load: float) -> tuple[Real, Real]:
    """Return places (m) along the finger, and the force for a length (N/m) at each; phase: turns of the texture."""
    geometry = contact.geometry_at(load)
    length, middle = geometry.contact_length, 0.5 * contact.geometry.contact_length
    inside = np.linspace(0.0, length, 4001)
    heights = np.array([float(geometry.heights(place, phase)) for place in inside])
    z = float(contact.approach(np.array([phase]), load)[0][0])
    depth = np.maximum(heights - 0.5 * contact.dome * (inside - 0.5 * length) ** 2 - z, 0.0)
    return middle - 0.5 * length + inside, contact.stiffness_at(load) / length * depth


# -- the balance of forces


def inertia() -> Figure:
    """Return acceleration, its spectrum with the resonance of a whole finger, and such a finger that is thrown off."""
    figure, (left, middle, right) = panels(1.0, 1.0, 1.0)
    whole: tuple[Settings, str, str] = ({"inertia": WHOLE}, BLUE, "whole finger")
    for effects, colour, name in (*with_and_without("inertia", RED), whole):
        voice = voice_of(effects, "acceleration")
        sound = rendered(voice, 100 * TURN)[:, 0]
        left.plot(1e3 * np.arange(TURN + 1) / RATE, sound[: TURN + 1], color=colour, linewidth=1.0, label=name)
        level = 2.0 / len(sound) * np.abs(np.fft.rfft(sound))[100::100]
        frequencies = RATE / TURN * np.arange(1, len(level) + 1)
        felt = frequencies <= FELT_HZ
        middle.plot(frequencies[felt], level[felt], "o-", color=colour, markersize=3.0, linewidth=0.8)
        thrown = rendered(voice_of(effects, **THROWN), 4 * JUMPS)[-JUMPS - 1 :, 0]
        right.plot(1e3 * np.arange(len(thrown)) / RATE, 1e6 * thrown, color=colour, linewidth=1.1)
    resonance = np.sqrt(stiffness_round(contact_of(voice), LOAD) / MASS) / (2.0 * np.pi)
    middle.axvline(resonance, color=INK, linewidth=0.6, linestyle=(0, (4, 3)), zorder=0)
    middle.set_yscale("log")
    middle.set_ylim(top=8.0)
    middle.annotate(f"resonance, {resonance:.0f} Hz", (resonance, 0.98), (4, 0), xycoords=("data", "axes fraction"),
                    textcoords="offset points", fontsize=7.5, color=INK, va="top")  # fmt: skip
    titled(left, "acceleration", "time (ms)", "m/s²")
    titled(middle, "its harmonics", "frequency (Hz)", "amplitude (m/s²)")
    titled(right, "thrown off by ridges, 0.1 N", "time (ms)", "z (µm)")
    left.set(xlim=(0.0, 10.0), xticks=(0.0, 5.0, 10.0))
    left.set_ylim(top=42.0)
    right.margins(x=0.0)
    named(left, loc="upper center", labelspacing=0.25)
    return figure


FELT_HZ = 1500.0  # of the harmonics, the largest drawn: a fingertip feels up to about 1000 Hz
THROWN = {"texture": {"period": "0.5 mm"}, "scan": {"speed": "0.1 m/s", "load": "0.1 N"}}
"""A scene whose texture has the period of the ridges: a finger with a mass is thrown off it."""
JUMPS = 4 * 240  # frames of four of its periods


def viscous_skin() -> Figure:
    """Return z over a period at rising speeds, and what a period loses over the speed."""
    figure, (left, right) = panels(1.0, 1.0)
    viscous: Settings = {"viscous_skin": {}}
    left.plot(*over_a_period({}, SPEED), color=FAINT, linewidth=1.3, label="without, any speed")
    for speed, colour in ((0.02, GREEN), (0.08, BLUE), (0.32, RED)):
        left.plot(*over_a_period(viscous, speed), color=colour, linewidth=1.1, label=f"{1e3 * speed:g} mm/s")
    speeds = np.geomspace(0.002, 0.64, 18)
    for effects, colour, name in LOSSES:
        right.plot(1e3 * speeds, [1e6 * lost(effects, speed) for speed in speeds], "o-", color=colour, markersize=2.2,
                   linewidth=1.1, label=name)  # fmt: skip
    plain_log(right, (2.0, 10.0, 50.0, 200.0, 600.0))
    titled(left, "how the finger moves", "place on the texture (mm)", "z (µm)")
    titled(right, "work lost in each period of the texture", "speed (mm/s)", "µJ")
    left.margins(x=0.0)
    named(left, loc="lower center", labelspacing=0.25)
    named(right, loc="upper left")
    return figure


LOSSES: tuple[tuple[Settings, str, str], ...] = (
    ({}, FAINT, "without"),
    ({"viscous_skin": {}}, BLUE, "kelvin_voigt"),
    ({"viscous_skin": {"model": "three_time_constants"}}, RED, "three_time_constants"),
)


def over_a_period(effects: Settings, speed: float) -> tuple[Real, Real]:
    """Return places (mm) over a period of the texture and z (um) there."""
    frames = round(RATE * PERIOD / speed)
    z = rendered(voice_of(effects, scan={"speed": speed}), frames + 1)[:, 0]
    return 1e3 * PERIOD * np.linspace(0.0, 1.0, frames + 1), 1e6 * z


def lost(effects: Settings, speed: float) -> float:
    """Return the work (J) of the force on the slopes over a period."""
    frames = round(RATE * PERIOD / speed)
    exact = PERIOD * RATE / frames  # m/s, for a whole number of frames a period
    voice = voice_of({**effects, "tangential": {"friction_coefficient": 0}}, scan={"speed": exact})
    return float(np.mean(rendered(voice, frames)[:, 1])) * PERIOD


def adhesion() -> Figure:
    """Return z over a load that falls to a pull and rises again, and z of a scan meanwhile."""
    figure, (left, right) = panels(1.2, 1.0)
    loads = 1e-3 * np.concatenate([np.linspace(PRESS, PULL, STEPS), np.linspace(PULL, PRESS, STEPS)])
    voice = voice_of({"adhesion": {}}, scan={"load": 1e-3 * PRESS})
    pressed = np.linspace(0.02, PRESS, 200)
    elastic = [float(contact_of(voice).approach(np.zeros(1), 1e-3 * load)[0][0]) for load in pressed]
    z = 1e6 * heights_along(voice, loads)
    left.plot(pressed, 1e6 * np.array(elastic) - z.max(), color=FAINT, linewidth=1.3, label="without")
    for part, colour, name in ((slice(STEPS), RED, "load falls"), (slice(STEPS, None), BLUE, "load rises")):
        left.plot(1e3 * loads[part], z[part] - z.max(), color=colour, linewidth=1.1, label=f"adhesion, {name}")
    titled(left, "pulled off, and pulled in", "load (mN)", "z, from where it let go (µm)")
    named(left, loc="lower left")
    for lowest, (effects, colour, name) in zip((0.0, PULL), with_and_without("adhesion", RED), strict=True):
        times = FALL * (PRESS - np.linspace(PRESS, lowest, 9))
        points = [[float(t), SPEED * float(t), 1e-3 * (PRESS - float(t) / FALL)] for t in times]
        moved = rendered(voice_of(effects, scan={"trajectory": points}), round(RATE * FALL * (PRESS - lowest)))[:, 0]
        falling = PRESS - np.arange(len(moved)) / (RATE * FALL)
        right.plot(falling, 1e6 * moved, color=colour, linewidth=0.9, label=name)
    titled(right, "a scan while the load falls", "load (mN)", "z, about its mean (µm)")
    right.set_xlim(PRESS, PULL)
    right.margins(y=0.2)
    named(right, loc="upper right", ncols=2, columnspacing=1.0)
    return figure


PRESS, PULL, STEPS = 20.0, -12.0, 3201  # mN, mN: ends of the ramp; steps of each half
FALL = 4e-3  # s a mN, for the load of the scan


def heights_along(voice: Voice, loads: Real) -> Real:
    """Return z (m) of a finger that stands still, at each of `loads` (N) in turn."""
    effects = voice.solved.effects
    assert effects is not None and effects.simulation is not None
    stepper, rows = effects.simulation.simulation.stepper, np.empty((ROWS, len(loads)))
    state: Any = stepper.start(0, loads[0], 0.0, 1.0 / RATE)
    stepper.run(state, np.zeros(len(loads), np.uint64), loads, rows)
    return np.asarray(rows[HEIGHT])


def propagation() -> Figure:
    """Return the gain over frequency at each place, and the acceleration at the contact and at the nail."""
    figure, (left, right) = panels(1.0, 1.25)
    hertz = np.geomspace(5.0, 1000.0, 400)
    for place, colour in (("nail", BLUE), ("skin", GREEN), ("wrist", RED)):
        left.plot(hertz, np.abs(way_of(place).gain(hertz)), color=colour, linewidth=1.3, label=place)
    plain_log(left, (5, 20, 50, 100, 225, 1000))
    left.set_yscale("log")
    titled(left, "amplitude over that at the contact", "frequency (Hz)", "|G|")
    named(left, loc="center left", bbox_to_anchor=(0.0, 0.35))
    moved = rendered(open_voice(parse_scene({"effects": {"propagation": {}}})), TURN + 1)
    time = 1e3 * np.arange(TURN + 1) / RATE
    for column, colour, name in ((0, FAINT, "at the contact"), (1, BLUE, "at the nail")):
        right.plot(time, moved[:, column], color=colour, linewidth=1.3, label=name)
    titled(right, "acceleration, 1 kHz of band", "time (ms)", "m/s²")
    right.margins(x=0.0, y=0.2)
    named(right, loc="upper right", ncols=2, columnspacing=1.0)
    return figure


def way_of(place: str) -> Any:
    """Return the way from the contact to a place of the effect `propagation`."""
    effects = voice_of({"propagation": {"place": place}}).solved.effects
    assert effects is not None
    stage: Any = effects.stages[0]
    return stage.way


def stick_slip() -> Figure:
    """Return the way of the skin behind the hand on wet glass, and its friction at two speeds."""
    figure, (left, right) = panels(1.0, 1.25)
    frames = RATE // 10
    time = 1e3 * np.arange(frames + 1) / RATE
    for speed, colour in ((0.01, BLUE), (0.08, GREEN)):
        scene = parse_scene({
            "texture": {"amplitude": 0.0},
            "scan": {"speed": speed, "load": "0.5 N"},
            "effects": {"stick_slip": {"surface": "wet_glass"}},
        })  # fmt: skip
        name = f"{1e3 * speed:.0f} mm/s"
        right.plot(time, rendered(open_voice(scene), frames + 1)[:, 1] / 0.5, color=colour, linewidth=1.2, label=name)
        if speed < 0.05:
            hand, skin = (ScanMotion(scene, hand=led).at(0, frames + 1).position for led in (True, False))
            left.plot(time, 1e3 * (hand - hand[0]), color=FAINT, linewidth=1.2, label="hand")
            left.plot(time, 1e3 * (skin - skin[0]), color=colour, linewidth=1.3, label="skin")
    titled(left, "way on wet glass at 10 mm/s", "time (ms)", "mm")
    named(left, loc="upper left")
    titled(right, "force of friction over the load", "time (ms)", "")
    right.set_ylim(0.0, 1.0)
    named(right, loc="upper right", ncols=2, columnspacing=1.0)
    for axes in (left, right):
        axes.set_xlim(0.0, 100.0)
    return figure


def tangential() -> Figure:
    """Return the force of the slopes, and the whole force for two laws of friction."""
    figure, (left, right) = panels(1.0, 1.0)
    time = 1e3 * np.arange(2 * TURN + 1) / RATE
    left.axhline(0.0, color=FAINT, linewidth=0.6, linestyle=(0, (4, 3)))
    left.plot(time, 1e3 * force(friction_coefficient=0), color=GREEN, linewidth=1.2)
    for settings, colour, name in (({}, BLUE, "Coulomb, g = 1"), ({"pressure_exponent": 0.8}, RED, "g = 0.8")):
        whole = 1e3 * force(**settings)
        right.axhline(float(np.mean(whole[: 2 * TURN])), color=FAINT, linewidth=0.6, linestyle=(0, (4, 3)))
        right.plot(time, whole, color=colour, linewidth=1.2)
        right.annotate(name, (20.0, whole.min()), (0, -3), textcoords="offset points", fontsize=7.5, color=colour,
                       ha="right", va="top")  # fmt: skip
    titled(left, "force on the slopes of the texture: no mean", "time (ms)", "mN")
    titled(right, "with friction on top", "time (ms)", "mN")
    for axes in (left, right):
        axes.set_xlim(0.0, 20.0)
        axes.set_xticks(np.arange(0.0, 21.0, 5.0))
    right.set_ylim(bottom=102.0)
    return figure


def force(**settings: Any) -> Real:
    """Return the tangential force (N) over two periods of the default scene."""
    return rendered(voice_of({"tangential": settings}), 2 * TURN + 1)[:, 1]


FIGURES: Mapping[str, Callable[[], Figure]] = {
    draw.__name__: draw
    for draw in (adhesion, contact_growth, curvature, inertia, propagation, stick_slip, tangential, viscous_skin)
}

if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else HERE)
