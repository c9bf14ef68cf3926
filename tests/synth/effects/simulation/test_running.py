"""A simulation along a motion, with a stepper of known z, and its filters from steps to frames."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
from scipy.special import erfc

import ridgewave
from synth import Motion, parse_scene
from synth.arrays import Array
from synth.effects.simulation.hand_steps import phases_after
from synth.effects.simulation.running import (
    PRESS,
    RESPONSE,
    WHOLE,
    Running,
    Signal,
    Simulation,
)
from synth.effects.simulation.steps import ATTACHED, HEIGHT, REACTION, SLOPE_FORCE, Phases
from synth.motion.scan_motion import LIFT_TIME
from synth.sampling.decimation import Decimator
from synth.sampling.frame_solver import WHOLE_TO, edge_of
from synth.scene.output_section import BAND
from synth.scene.scene import Scene

RATE, STEPS = 8000, 4
SIGNALS = tuple(Signal(RESPONSE, order) for order in (0, 1, 2))


@dataclass(frozen=True)
class Known:
    """A stepper with z = 1 um cos(2 pi theta) + 1 um/N w, whose state is the number of steps."""

    attached: float = 1.0
    nbytes: int = 0
    shape: tuple[int, ...] = (0,)
    line: None = None

    def start(self, phase: int, load: float, turns: float, step: float) -> dict[str, int]:
        return {"steps": 0}

    def run(self, state: dict[str, int], phases: Phases, loads: Array, out: Array) -> None:
        state["steps"] += len(phases)
        out[HEIGHT] = 1e-6 * np.cos(2.0 * np.pi * phases.astype(float) / 2.0**64) + 1e-6 * loads
        out[SLOPE_FORCE], out[REACTION], out[ATTACHED] = 0.0, loads, self.attached


def simulation(scene: Scene, held: bool = False, attached: float = 1.0) -> Simulation:
    stepper: Any = Known(attached)
    filters = Decimator.of((0, 1, 2), RATE, STEPS, (0.35, 0.49), 100.0)
    return Simulation(stepper, scene, STEPS, filters, np.zeros_like, 0.0, held, 0.01)


def scene_of(**sections: Any) -> Scene:
    return parse_scene({"output": {"sample_rate": RATE, "bandwidth": "full"}, **sections})


def test_a_constant_scan_is_followed_at_its_frames_with_its_derivatives() -> None:
    scene = scene_of(texture={"period": "1 mm"}, scan={"speed": "0.1 m/s", "load": 0.5})
    rows = Running(simulation(scene), SIGNALS, phase=1 << 61).along(0, 400)
    angle = 2.0 * np.pi * (100.0 * np.arange(400) / RATE + 0.125)
    pulse = 2.0 * np.pi * 100.0
    assert np.max(np.abs(rows[0] - 1e-6 * np.cos(angle) - 0.5e-6)) < 1e-11
    assert np.max(np.abs(rows[1] + 1e-6 * pulse * np.sin(angle))) < 1e-5 * 1e-6 * pulse
    assert np.max(np.abs(rows[2] + 1e-6 * pulse**2 * np.cos(angle))) < 1e-5 * 1e-6 * pulse**2


POINTS = [[0, 0, 0.1], [0.02, 0.001, 0.3], [0.04, 0.003, 0.2], [0.06, 0.004, 0.1]]


@pytest.mark.parametrize("scan", [{}, {"stroke": {}}, {"trajectory": POINTS}])
def test_splits_do_not_matter_and_a_seek_begins_anew(scan: dict[str, Any]) -> None:
    scene = scene_of(scan=scan)
    whole = Running(simulation(scene), SIGNALS).along(0, 300)
    parts = Running(simulation(scene), SIGNALS)
    assert np.array_equal(
        np.concatenate([parts.along(0, 1), parts.along(1, 120), parts.along(121, 179)], axis=1), whole
    )
    assert np.array_equal(parts.along(100, 50), whole[:, 100:150])


def test_steps_run_ahead_by_the_margin_and_back_by_the_settling() -> None:
    run = Running(simulation(scene_of()), SIGNALS)
    run.along(0, 10)
    settling = 80  # frames: 0.01 s
    assert run._state["steps"] == (settling + 2 * run.margin + 9) * STEPS + 1


def test_a_hand_is_late_by_the_margin_and_otherwise_the_same_motion() -> None:
    scene = scene_of(texture={"period": "1 mm"}, scan={"speed": "0.1 m/s", "load": 0.5})
    run = Running(simulation(scene), SIGNALS)
    frames = 400
    t = np.arange(frames) / RATE
    motion = Motion.of(
        frames, speed=0.1 + 0.02 * np.sin(50 * t), speed_rate=np.cos(50 * t), load=0.5 + 0.1 * np.sin(30 * t),
        load_rate=3.0 * np.cos(30 * t), load_bend=-90.0 * np.sin(30 * t),
    )  # fmt: skip
    phases, _after = phases_after(motion, 0, RATE, 1e-3)
    rows = run.after(motion, phases)
    late = run.margin
    turns = (
        np.cumsum(np.concatenate([[0.0], (0.1 + 0.02 * np.sin(50 * t) + 0.5 * np.cos(50 * t) / RATE)[:-1]]))
        / 1e-3
        / RATE
    )
    wanted = 1e-6 * np.cos(2.0 * np.pi * turns) + 1e-6 * motion.samples[2]
    settled = 2 * late
    assert np.max(np.abs(rows[0, settled + late :] - wanted[settled : frames - late])) < 1e-10


def test_the_gate_follows_the_load_and_is_exact_nothing_at_none() -> None:
    points = [[0, 0, 0.0], [0.05, 0.004, 0.2], [0.1, 0.008, 0.2], [0.15, 0.012, 0.0]]
    scene = scene_of(scan={"trajectory": points})
    rows = Running(simulation(scene), SIGNALS).along(0, 2400)
    end = round((0.15 + LIFT_TIME) * RATE) + simulation(scene).filters.margin + 1
    assert np.any(rows[0, :1000])
    assert not np.any(rows[:, end:])


def test_what_holds_the_finger_keeps_it_heard_at_a_pull_and_fades_when_it_lets_go() -> None:
    scene = parse_scene(
        {
            "output": {"sample_rate": RATE, "bandwidth": "full"},
            "scan": {"load": -0.01},
            "effects": {"adhesion": {}},
            "texture": {"period": "1 mm"},
        }
    )
    held = Running(simulation(scene, held=True), SIGNALS).along(0, 100)
    assert np.ptp(held[0]) > 1.9e-6
    let_go = Running(simulation(scene, held=True, attached=0.0), SIGNALS).along(0, 100)
    assert not np.any(let_go)


def test_z_itself_and_a_force_are_signals_of_their_own() -> None:
    scene = scene_of(scan={"load": 0.5})
    rows = Running(replace(simulation(scene), offset=1e-7), (Signal(WHOLE, 0), Signal(PRESS, 0))).along(0, 100)
    about = Running(replace(simulation(scene), offset=1e-7), (Signal(RESPONSE, 0),)).along(0, 100)
    assert np.max(np.abs(rows[0] - (about[0] + 1e-7))) < 1e-12
    assert np.max(np.abs(rows[1] - 0.5)) < 1e-12


FRAMES = 60
BANDS = [(2, 80.0, (0.40, 0.45)), (3, 100.0, (0.35, 0.49)), (12, 110.0, (0.40, 0.45)), (2, 90.0, (0.02, 0.03))]

every = pytest.mark.parametrize(("steps", "attenuation", "band"), BANDS)


def read(filters: Decimator, frequency: float, row: int) -> tuple[Array, Array]:
    """Return filtered frames of a complex oscillation (cycles per frame), and the exact derivative there."""
    count = (FRAMES - 1 + 2 * filters.margin) * filters.steps + 1
    n = np.arange(count) / filters.steps - filters.margin
    y = np.exp(2j * np.pi * frequency * n)
    parts = [filters.read(np.ascontiguousarray(part), row, FRAMES) for part in (y.real, y.imag)]
    order = filters.orders[row]
    wanted = (2j * np.pi * frequency * RATE) ** order * np.exp(2j * np.pi * frequency * np.arange(FRAMES))
    return parts[0] + 1j * parts[1], wanted


@every
@pytest.mark.parametrize("order", [0, 1, 2])
def test_the_pass_band_keeps_its_derivatives_and_slow_motion_all_of_their_digits(
    steps: int, attenuation: float, band: tuple[float, float], order: int
) -> None:
    filters = Decimator.of((order,), RATE, steps, band, attenuation)
    for frequency in np.geomspace(1e-4, band[0], 25):
        found, wanted = read(filters, float(frequency), 0)
        assert np.max(np.abs(found / wanted - 1.0)) < 10.0 ** (-attenuation / 20.0)


@every
def test_the_stop_band_is_gone(steps: int, attenuation: float, band: tuple[float, float]) -> None:
    filters = Decimator.of((0,), RATE, steps, band, attenuation)
    for frequency in np.linspace(band[1], 0.5 * steps, 40):
        found, _wanted = read(filters, float(frequency), 0)
        # the value at the frame is subtracted before the filter and added after it
        assert np.max(np.abs(found)) < 10.0 ** (-attenuation / 20.0)


@pytest.mark.parametrize(("live", "least", "most"), [(False, 0.0, 1e-3), (True, 0.05, 0.2)])
def test_the_gain_at_the_end_of_a_narrow_band_is_told(live: bool, least: float, most: float) -> None:
    band = 100 / 48000, 150 / 48000
    filters = Decimator.of((0, 2), 48000, 2, band, 80.0, live=live)
    gain = 0.0
    for frequency in np.linspace(0.1, 1.0, 10) * band[0]:
        count = 2 * filters.margin * filters.steps + 1
        y = np.cos(2.0 * np.pi * frequency * (np.arange(count) / filters.steps - filters.margin))
        found = filters.read(y, 0, 1)
        gain = max(gain, abs(found[0] - 1.0))
    assert gain <= filters.droop + 1e-4
    assert least <= filters.droop <= most


@pytest.mark.parametrize(("band", "steps", "most"), [(1000.0, 2, 2e-5), (1000.0, 32, 1e-3), (100.0, 16, 1.0)])
def test_a_filter_of_a_file_has_the_edge_that_others_have_or_tells_what_it_misses(
    band: float, steps: int, most: float
) -> None:
    rate, attenuation = 48000, 80.0
    half, width = edge_of(band / rate / BAND)
    kept = WHOLE_TO * band / rate
    made = Decimator.of((0,), rate, steps, (kept, 2.0 * half - kept), attenuation, width=width, live=False)
    places = np.linspace(0.0, 1.1 * band / rate, 45)
    times = np.arange(-made.margin * steps, made.margin * steps + 1) / steps
    gains = np.array([made.taps[0] @ np.cos(2.0 * np.pi * place * times) for place in places])
    missed = float(np.max(np.abs(gains - 0.5 * erfc((places - half) / width))))
    assert missed <= min(most, 1.05 * made.droop + 2e-5), f"{missed:.2e}, told {made.droop:.2e}"


@pytest.mark.parametrize("order", [0, 1, 2])
def test_what_stands_still_is_exactly_still(order: int) -> None:
    filters = Decimator.of((order,), RATE, 2, (0.4, 0.45), 90.0)
    value = 1.0 / 3.0 * 1e-5
    frames = filters.read(np.full((FRAMES - 1 + 2 * filters.margin) * 2 + 1, value), 0, FRAMES)
    assert np.all(frames == (value if order == 0 else 0.0))


def test_a_mass_that_a_fast_force_drives_moves_as_far_as_it_should() -> None:
    """The midpoint rule makes z of a force of frequency f too small. The filter compensates up to the pass band."""
    steps, band = 2, (0.40, 0.45)
    plain = Decimator.of((2,), RATE, steps, band, 90.0)
    made_up = Decimator.of((2,), RATE, steps, band, 90.0, of_mass=True)
    for frequency in (0.01, 0.1, 0.2, 0.3, 0.4):
        x = np.pi * frequency / steps
        moved = x**2 * np.cos(x) / np.sin(x) ** 2  # relative to the exact motion of the mass
        found, wanted = read(made_up, frequency, 0)
        assert np.max(np.abs(moved * found / wanted - 1.0)) < 1e-4
        if frequency >= 0.2:
            found, wanted = read(plain, frequency, 0)
            assert np.max(np.abs(moved * found / wanted - 1.0)) > 1e-3


@pytest.mark.parametrize("wait", [0.025, 12345.0])
def test_a_recording_begins_at_its_first_point_whatever_the_clock(wait: float) -> None:
    rate, ways = 8000, np.arange(6) * 0.02
    finger = {"mass": "5 g", "damping": 3, "stiffness": 0}

    def landed(start: float) -> Array:
        trajectory = [[start + way, 0.1 * way, 0.1] for way in ways.tolist()]
        output = {"quantity": "displacement", "full_scale": 1e-4, "sample_rate": rate, "duration": 0.1}
        scan, texture = {"trajectory": trajectory}, {"period": "0.5 mm"}
        scene = {"texture": texture, "scan": scan, "effects": {"inertia": finger}, "output": output}
        return np.asarray(ridgewave.render(scene).frames[:, 0])

    at_once = landed(0.0)
    assert np.max(np.abs(landed(wait) - at_once)) <= 1e-6 * np.ptp(at_once)
