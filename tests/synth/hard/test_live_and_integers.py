"""Hard cases as they leave: live voices stay within full scale, and integer files hold what the floats round to."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from synth.arrays import Block
from synth.encode.samples import SoundFormat, block_bytes, quantise
from synth.scene.scene import Scene
from synth.voice.limiter import Limiter
from synth.voice.live_voice import LiveVoice
from synth.voice.voice import open_voice
from tests.synth.engine_cases import QUANTITIES, scene_of
from tests.synth.hard.bounds import finite, merged
from tests.synth.hard.test_hands import FRAMES, HANDS, RATE, part_of
from tests.synth.hard.test_scans import touching

QUIET = {"channels": list(QUANTITIES), "sample_rate": RATE, "bandwidth": 600.0}
LOUD = {**QUIET, "channels": [{"quantity": name, "full_scale": 1e-9} for name in QUANTITIES]}
SCENES: dict[str, dict[str, Any]] = {
    "no load": touching(scan_load=0.0),
    "a nanonewton": touching(scan_load=1e-9),
    "a kilonewton": touching(scan_load=1e3),
    "no ridges": touching(finger_ridge_amplitude=0.0),
    "no texture": touching(texture_amplitude=0.0),
    "standing still": touching(scan_speed=0.0),
    "10 m/s": touching(scan_speed=10.0),
    "locked": touching(texture_period=0.5e-3),
    "cancelled": touching(texture_period=1e-3, scan_load=30.0),
    "next to nothing": touching(texture_amplitude=2.3e-308),
    "as high as it goes": touching(finger_ridge_amplitude=1e-3, texture_amplitude=1e-3),
}
SILENT = ("no load", "no texture", "10 m/s", "cancelled")
BITS = {SoundFormat.L16: (16, ">i2"), SoundFormat.WAV16: (16, "<i2")}


def few_ridges(output: dict[str, Any], tolerance: float, sections: dict[str, Any] | None = None) -> Scene:
    """Return a scene that is quick to solve."""
    finger, accuracy = {"contact_length": 2e-3}, {"tolerance": tolerance}
    return scene_of(**merged({"finger": finger, "output": output, "accuracy": accuracy}, sections or {}))


@pytest.mark.parametrize("output", [QUIET, LOUD], ids=["automatic", "far beyond full scale"])
@pytest.mark.parametrize("name", SCENES)
def test_a_live_voice_stays_within_full_scale_from_its_first_frame_to_its_last(
    name: str, output: dict[str, Any]
) -> None:
    voice = LiveVoice(few_ridges(output, 1e-2, SCENES[name]))
    blocks = [voice.render(400)]
    voice.apply(voice.prepare(few_ridges(output, 1e-2)))
    blocks.append(voice.render(1200))
    voice.apply(voice.prepare(few_ridges(output, 1e-2, SCENES[name])))
    blocks.append(voice.render(1200))
    voice.release()
    blocks.append(voice.render(1200))
    whole = np.concatenate(blocks)
    assert finite(whole)
    assert np.max(np.abs(whole)) <= 1.0
    assert np.max(np.abs(whole[600:1500])) > 0.1  # the default scene in the middle of it
    assert voice.finished
    assert not whole[-400:].any()
    if name in SILENT:
        assert not whole[:380].any()


@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("sound_format", BITS)
def test_integers_are_the_floats_rounded_and_clipped(name: str, sound_format: SoundFormat) -> None:
    """By exact arithmetic on the floats: n = round(x 2^15), within -2^15 and 2^15 - 1."""
    bits, layout = BITS[sound_format]
    voice = open_voice(few_ridges(LOUD, 1e-2, SCENES[name]))
    for block in (voice.render(500), limited(voice.render(500))):
        wanted = np.clip(
            np.rint(block.astype(np.longdouble) * 2 ** (bits - 1)), -(2 ** (bits - 1)), 2 ** (bits - 1) - 1
        )
        integers: npt.NDArray[Any] = np.frombuffer(block_bytes(block, sound_format), layout).reshape(block.shape)
        assert np.array_equal(integers, wanted)
        assert np.array_equal(quantise(block, 24), np.clip(np.rint(block.astype(float) * 2**23), -(2**23), 2**23 - 1))


def limited(block: Block) -> Block:
    return Limiter(block.shape[1], RATE).process(block)


@pytest.mark.parametrize("name", HANDS)
def test_a_live_hand_never_passes_full_scale_once_it_is_limited(name: str) -> None:
    """A voice that does not wait plays the nearest rows; whatever they are, the samples are fit."""
    voice = open_voice(few_ridges(LOUD, 3e-2), live=True)
    limiter = Limiter(voice.channels, RATE, 12)
    for first in range(0, FRAMES, 240):
        block = voice.render(240, part_of(HANDS[name], first, first + 240))
        assert finite(block)
        assert np.max(np.abs(limiter.process(block))) <= 1.0


def test_a_long_live_stream_is_the_voice_it_plays() -> None:
    """2 million frames in blocks of 20 ms, then the voice by itself at the same frame, sample for sample."""
    scene = scene_of(scan={"speed": 0.0613}, output={"quantity": "displacement", "sample_rate": 8000})
    live, voice = LiveVoice(scene), open_voice(scene)
    last = live.render(160)
    for _ in range(12_500):
        last = live.render(160)
    voice.seek(160 * 12_500)
    assert np.array_equal(last, voice.render(160))
    assert live.reduction_db == 0.0
