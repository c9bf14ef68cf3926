"""What no output may pass: bounds that hold whatever the contact does, and the checks that every row makes.

Model   z is the level above which the heights have a given mean, so z(h + c) = z(h) + c, and higher heights give a
        higher z. A texture that moves on by dtheta turns changes no height by more than 2 pi a2 dtheta, so neither does
        z: |dz/dtheta| <= 2 pi a2. With N harmonics, each with a gain of 1 at most, and nu = u / lambda2 turns a second:
        displacement  the sum of 2 |Z_n| is at most a2 sqrt(2) sqrt(sum 1 / n^2) < (pi / sqrt 3) a2 = 1.814 a2
                      (Parseval's 2 sum n^2 |Z_n|^2 <= a2^2, then Cauchy and Schwarz)
        velocity      2 pi a2 nu G(N), G being what N harmonics of a bounded curve may overshoot: Lebesgue's constant,
                      or sqrt(2 N) by Cauchy and Schwarz, whichever is less; a level that fades lies between two
        approach      between a1 + a2, the highest crests, and -(a1 + a2) - w / k, since the mean of max(h - z, 0),
                      w / k, is at least the mean of h - z; what band-limiting adds is that of the displacement
        acceleration  2 pi N nu times that (Bernstein), and 2 pi a2 G(N) / lambda2 times du/dt where the speed changes
Source  Galkin (1971): Lebesgue's constant is at most 1 + (4 / pi^2) log(2 N + 1). Bernstein's inequality: Zygmund,
        Trigonometric Series, X.3.
Limits  for a load that does not change. The tolerance of the scene (of a peak-to-peak, at most twice the bound), 1e-6
        for float32, and the floor of 1e-12 (a1 + a2), carried through the derivatives, come on top.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from synth.arrays import Block
from synth.plan.request import N_MAX, harmonics_below
from synth.scene.scene import Scene
from synth.voice.voice import Voice, open_voice
from tests.reference.stiffness_oracle import stiffness
from tests.reference.synthesis_oracle import synthesise
from tests.synth.engine_cases import QUANTITIES, Real, physical, touch_of

TINY = float(np.finfo(np.float32).tiny)
FLOOR = 1e-12  # of a1 + a2, in displacement (design, section 4)
MOST_DISPLACEMENT = math.pi / math.sqrt(3.0)  # of a2
REMOVED, MOVING_REMOVED = 0.45, 0.49  # of the rate: what no component may pass, at steady and at changing speed
BAND = 0.40  # of the rate: what a bandwidth at this frequency would not narrow
ALL = {"channels": [{"quantity": name, "full_scale": 1.0} for name in QUANTITIES]}


def overshoot(harmonics: int) -> float:
    """Return the largest value that `harmonics` harmonics of a curve between -1 and 1 can have."""
    return min(math.sqrt(2.0 * harmonics), 1.0 + 4.0 / math.pi**2 * math.log(2.0 * harmonics + 1.0))


def largest(scene: Scene, quantity: str) -> float:
    """Return the bound of `quantity` (SI) while `scene` plays its own scan."""
    height, turns = scene.texture.amplitude, abs(scene.scan.speed) / scene.texture.period
    rate, bandwidth = scene.output.sample_rate, scene.output.bandwidth_hz
    if scene.scan.stroke is None and scene.scan.trajectory is None:
        limit = min(REMOVED * rate, bandwidth)
        kept, bend = max(1, harmonics_below(turns, limit)), 0.0
        highest = kept * turns
    else:
        kept, highest = N_MAX, MOVING_REMOVED * min(rate, bandwidth / BAND)
        stroke = scene.scan.stroke
        bend = 0.0 if stroke is None else 3.0 * stroke.speed / stroke.turn_time / scene.texture.period
    order = 0 if quantity == "approach" else QUANTITIES.index(quantity)
    slope = 2.0 * math.pi * height * overshoot(kept)
    allowed = (MOST_DISPLACEMENT * height, slope * turns, slope * (turns * 2.0 * math.pi * highest + bend))[order]
    tolerance = scene.accuracy.tolerance if isinstance(scene.accuracy.tolerance, float) else 3e-2
    floor = FLOOR * (scene.finger.ridge_amplitude + height) * (2.0 * math.pi * highest) ** order
    if quantity == "approach":
        allowed += scene.finger.ridge_amplitude + height + indentation(scene)
    return allowed * (1.0 + 2.0 * tolerance + 1e-6) + floor


def indentation(scene: Scene) -> float:
    """Return the largest w / k (m) of the scan of `scene`."""
    points = scene.scan.trajectory or ()
    touch = replace(touch_of(scene), load=max([scene.scan.load, *(load for _time, _place, load in points)]))
    return stiffness(touch).indentation if touch.ridge_amplitude + touch.texture_amplitude > 0.0 else 0.0


def finite(block: Block | Real) -> bool:
    """Return whether every sample is finite and none would be a denormal float32."""
    size = np.abs(block)
    return bool(np.isfinite(block).all() and not ((size > 0) & (size < TINY)).any())


def check_fit(voice: Voice, block: Block) -> None:
    """Assert that a block of `voice`, on its own scan, is finite, without denormals, and within its bounds."""
    assert block.dtype == np.float32
    assert finite(block)
    for channel, quantity in enumerate(voice.quantities):
        peak = float(np.max(np.abs(block[:, channel].astype(float)), initial=0.0)) * voice.full_scale[channel]
        assert peak <= largest(voice.scene, quantity), quantity


def check_steady(scene: Scene, tolerance: float, frames: int | None = None) -> None:
    """Assert that every channel of a steady scan keeps `tolerance` against the oracle, and its plan's own estimate.

    frames: how many are compared, by default three periods, 2,000 at least.
    """
    voice, rate = open_voice(scene), scene.output.sample_rate
    frames = frames or max(2000, round(3 * rate / max(abs(scene.scan.speed) / scene.texture.period, rate / 500)))
    found = physical(voice, frames)
    wanted = synthesise(touch_of(scene), scene.scan.speed, scene.output.band_limit, relative_error=1e-2 * tolerance)
    tall = scene.finger.ridge_amplitude + scene.texture.amplitude
    highest = 2 * np.pi * abs(wanted.fundamental_hz) * wanted.harmonics.size
    s = min(scene.scan.load / scene.scan.lift_load, 1.0)
    gate = s**3 * (10.0 - 15.0 * s + 6.0 * s**2)
    some = np.arange(0, frames, max(1, frames // 4000))
    for channel, quantity in enumerate(voice.quantities):
        if voice.solved.silence:
            assert "less than 1 nm" in voice.warnings[0]
            assert wanted.peak("displacement") < 1.01e-9
            continue
        extent = wanted.peak_to_peak(quantity)
        error = float(np.max(np.abs(found[some, channel] - gate * wanted.signal(quantity, some, rate))))
        floor = FLOOR * tall * highest ** QUANTITIES.index(quantity)
        assert extent > 0.0
        for allowed in (tolerance, voice.plan.estimated_error[quantity]):
            assert error <= gate * (allowed * extent + floor), quantity


def merged(*documents: dict[str, Any]) -> dict[str, Any]:
    """Return the documents put over each other, object by object."""
    whole: dict[str, Any] = {}
    for document in documents:
        for name, value in document.items():
            held = whole.get(name)
            whole[name] = merged(held, value) if isinstance(held, dict) and isinstance(value, dict) else value
    return whole
