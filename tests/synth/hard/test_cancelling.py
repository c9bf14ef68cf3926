"""Contacts whose length holds whole numbers of both periods: heavy ones cancel, and what is left comes out that small.

Model   A full contact moves by a2 |sinc(L / lambda2)|, nothing for whole numbers; one that is nearly full by what the
        last gaps let through, which falls to nothing as they close.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from synth.contact.stiffness import Stiffness
from synth.motion.motion import Motion
from synth.response_cache import ResponseCache
from synth.scene.scene import Scene
from synth.voice.live_voice import LiveVoice
from synth.voice.voice import open_voice
from tests.few import paired
from tests.reference.stiffness_oracle import contact_in_metres
from tests.reference.synthesis_oracle import synthesise
from tests.synth.engine_cases import QUANTITIES, load_of, physical, scene_of, touch_of
from tests.synth.hard.bounds import FLOOR

TALL = 60e-6  # a1 + a2 of the default scene
LENGTH, HEAVY = 0.01, 30.0  # m; N, which flattens everything here
LIMIT = 2000.0  # Hz
CACHE = ResponseCache()
MAGNIFIED = [  # scales at which a motion of 1e-10 of the amplitude is seen
    {"quantity": name, "full_scale": scale} for name, scale in zip(QUANTITIES, (1e-12, 1e-9, 1e-6), strict=True)
]


def whole(periods: float = 10.0, load: float = HEAVY, **output: Any) -> Scene:
    """Return the default finger, of 20 ridges, on `periods` periods of texture."""
    return scene_of(texture={"period": LENGTH / periods}, scan={"load": load}, output=output)


@pytest.mark.parametrize("off", [1e-2, 1e-4, 1e-6, 1e-8, 1e-10])
def test_a_little_off_whole_periods_moves_by_the_closed_form(off: float) -> None:
    """Down to 1e-11 of the amplitude; the rounding of L / lambda2 is 2e-15 of `off`."""
    scene = whole(10.0 + off, channels=MAGNIFIED, bandwidth=LIMIT)
    wanted = 20e-6 * abs(math.sin(math.pi * off) / (math.pi * (10.0 + off)))
    turns = 2.0 * math.pi * scene.scan.speed / scene.texture.period
    found = np.max(np.abs(physical(open_voice(scene), 4800)), axis=0)
    assert found == pytest.approx(wanted * np.array([1.0, turns, turns**2]), rel=1e-3 + 2e-14 / off)
    touched = contact_in_metres(touch_of(scene), np.arange(64) / 64).approach
    assert float(np.ptp(touched)) / 2 == pytest.approx(wanted, rel=2e-3 + 2e-14 / off)


@pytest.mark.parametrize("part", [0.9, 0.99, 0.999])
def test_a_contact_that_is_nearly_full_moves_as_little_as_the_oracle_says(part: float) -> None:
    """`part` of the indentation that closes every gap: motions of 6e-3 to 4e-6 of the amplitudes."""
    law = Stiffness.of_scene(whole())
    scene = whole(load=load_of(law, part * TALL), channels=MAGNIFIED, bandwidth=LIMIT)
    wanted = synthesise(touch_of(scene), scene.scan.speed, LIMIT, relative_error=1e-4)
    found = physical(open_voice(scene), 2400)
    for channel, quantity in enumerate(QUANTITIES):
        truth = wanted.signal(quantity, np.arange(2400), 48000)
        floor = FLOOR * TALL * (2.0 * math.pi * LIMIT) ** channel
        assert np.max(np.abs(found[:, channel] - truth)) <= 1.2e-3 * wanted.peak_to_peak(quantity) + floor


@pytest.mark.parametrize(("part", "periods"), paired([0.99999, 1.0, 1.00001, 1.5, 100.0], [10.0, 20.0, 40.0]))
def test_where_the_last_gap_closes_nothing_is_left_but_round_off(part: float, periods: float) -> None:
    """Seen through a scale of 1e-12 m: z itself is held to 1e-12 (a1 + a2), the oracle's last gaps to less."""
    law = Stiffness.of_scene(whole(periods))
    scene = whole(periods, load_of(law, part * TALL), channels=MAGNIFIED, bandwidth=LIMIT)
    found = physical(open_voice(scene), 4800)
    left, phases = 0.0, np.arange(4096) / 4096  # the last gaps open for a thousandth of a period
    if part < 1.0:
        truth = contact_in_metres(touch_of(scene), phases, dtype=np.float64).approach
        left = float(np.max(np.abs(truth - truth.mean())))
    assert left < 1e-7 * TALL
    for channel in range(3):
        times = (2.0 * math.pi * LIMIT) ** channel
        assert np.max(np.abs(found[:, channel])) <= (1.1 * left + FLOOR * TALL) * times


@pytest.mark.parametrize(("part", "quantity"), paired([0.9999, 1.0, 100.0], QUANTITIES))
def test_no_automatic_gain_makes_noise_of_what_is_left(part: float, quantity: str) -> None:
    law = Stiffness.of_scene(whole())
    scene = whole(load=load_of(law, part * TALL), quantity=quantity)
    voice = open_voice(scene)
    assert not voice.render(4800).any()
    assert "less than 1 nm" in voice.warnings[0]
    assert ["unusual" in warning for warning in voice.warnings[1:]] == [True] * (scene.scan.load > 20.0)
    live = LiveVoice(scene, cache=CACHE)
    assert not live.render(4800).any()
    streamed = open_voice(scene, cache=CACHE, live=True)
    assert not streamed.render(4800).any()


@pytest.mark.parametrize("quantity", QUANTITIES)
def test_a_hand_that_presses_until_it_cancels_falls_silent(quantity: str) -> None:
    """The scale is that of a usual hand; pressed flat, what is left is under 1e-6 of it."""
    frames, rate = 4000, 8000
    voice = open_voice(whole(10.0, 0.3, quantity=quantity, sample_rate=rate, bandwidth=600.0))
    load = np.interp(np.arange(frames), [0, 1000, 2000, 4000], [0.3, 0.3, HEAVY, HEAVY])
    motion = Motion.of(frames, speed=0.04, speed_rate=0.0, load=load, load_rate=0.0, load_bend=0.0)
    block = voice.render(frames, motion)
    assert np.max(np.abs(block[:1000])) > 0.05
    assert np.max(np.abs(block[2000:])) <= 1e-6
