"""A live voice under a hand: first contact, jumps, lifts and changes of scene, without compilation while it plays."""

from __future__ import annotations

import json
import subprocess
import sys
import threading
from typing import Any

import numpy as np
import pytest
from scipy.signal import firwin

from synth.arrays import Block
from synth.motion.motion import Update
from synth.plan.usual_hand import with_full_scale
from synth.response_cache import ResponseCache
from synth.scene.scene import parse_scene
from synth.voice.hand_voice import HandVoice
from synth.voice.limiter import LOOK_AHEAD
from synth.voice.live_voice import CHANGE_TIME
from synth.voice.voice import open_voice
from tests.few import thorough

RATE, BLOCK = 8000, 80
ABOVE = firwin(101, 2500, fs=RATE, pass_zero=False)
CLICK = {"displacement": 0.03, "acceleration": 0.3}  # of full scale; a landing of 0.3 N within a millisecond: 0.27
QUANTITIES = ("displacement", "acceleration")


def scene_of(quantity: str = "displacement", **sections: Any) -> Any:
    output = {"quantity": quantity, "sample_rate": RATE, "bandwidth": 1000}
    return parse_scene({"output": output, **sections})


@pytest.fixture(scope="module")
def cache() -> ResponseCache:
    return ResponseCache()


@pytest.fixture
def voices(cache: ResponseCache) -> Any:
    return lambda scene, **options: HandVoice(scene, cache=cache, **options)


def stroked(voice: HandVoice, blocks: int, first: int = 0, speed: float = 0.08, load: float | None = 0.3) -> Block:
    """Return the blocks of a hand that sends its position before each."""
    made = []
    for number in range(first, first + blocks):
        time = number * BLOCK / RATE
        voice.touch(Update(number, time, speed * time, None, load))
        made.append(voice.render(BLOCK))
    return np.concatenate(made)


def still(voice: HandVoice, blocks: int) -> Block:
    """Return blocks without updates of the hand."""
    return np.concatenate([voice.render(BLOCK) for _ in range(blocks)])


def click(samples: Block) -> float:
    """Return the part above 2.5 kHz, where these scenes have nothing, as the equivalent step of full scale."""
    filtered = np.convolve(samples[:, 0].astype(float), ABOVE, "valid")
    return float(np.max(np.abs(filtered)) / np.max(np.abs(np.cumsum(ABOVE))))


@pytest.mark.parametrize("quantity", QUANTITIES)
def test_without_a_hand_it_is_the_live_voice_of_the_scan(voices: Any, cache: ResponseCache, quantity: str) -> None:
    from synth.voice.live_voice import LiveVoice

    hand = voices(scene_of(quantity))
    plain = LiveVoice(with_full_scale(scene_of(quantity), hand.full_scale), cache=cache)
    assert np.array_equal(hand.render(4000), plain.render(4000))


@pytest.mark.parametrize("quantity", QUANTITIES)
def test_a_hand_that_moves_as_the_scan_does_sounds_as_loud_as_the_scan(voices: Any, quantity: str) -> None:
    scanned = voices(scene_of(quantity)).render(8000)[4000:]
    touched = stroked(voices(scene_of(quantity)), 100)[4000:]
    assert np.sqrt(np.mean(touched**2)) == pytest.approx(
        np.sqrt(np.mean(scanned**2)), rel=0.04
    )  # a hand sounds a part of 1 to 1.4 times the band


@pytest.mark.parametrize("before", [0, 5])
def test_a_hand_at_constant_speed_is_late_by_the_same_time_from_its_first_update_on(voices: Any, before: int) -> None:
    """Whether its first contact comes before the first block or later."""
    voice, expected = voices(scene_of()), open_voice(scene_of()).render(RATE)[:, 0]
    begun = [voice.render(BLOCK) for _ in range(before)]
    played = np.concatenate([*begun, stroked(voice, 100 - before, before)])[:, 0] * voice.full_scale[0]
    expected = expected * open_voice(scene_of()).full_scale[0]

    def late(first: int) -> int:
        part = played[first : first + 800]
        missed = [float(np.sum((part - expected[first - lag : first - lag + 800]) ** 2)) for lag in range(80)]
        return int(np.argmin(missed))

    assert [late(first) for first in (1000, 2000, 4000, 7000)] == [late(7000)] * 4


@pytest.mark.parametrize("quantity", QUANTITIES)
def test_the_first_change_of_a_contact_is_in_the_next_block(voices: Any, quantity: str) -> None:
    touched, left = voices(scene_of(quantity)), voices(scene_of(quantity))
    assert np.array_equal(stroked(touched, 20), stroked(left, 20))
    touched.touch(Update(20, 0.2, 0.5, None, 0.3))  # a jump
    one, other = touched.render(BLOCK), left.render(BLOCK)
    changed = np.flatnonzero(one != other)
    ahead = round(LOOK_AHEAD * RATE)
    assert ahead <= changed[0] <= ahead + 2


@pytest.mark.parametrize("quantity", QUANTITIES)
def test_first_contacts_and_jumps_do_not_step(voices: Any, quantity: str) -> None:
    voice = voices(scene_of(quantity))
    found = [still(voice, 50), stroked(voice, 50)]
    for number, place in enumerate((0.3, -0.2, 0.31)):
        voice.touch(Update(1000 + number, 10.0 + number, place, None, 0.3))
        found.append(still(voice, 3 if number == 1 else 30))  # the third arrives during the cross-fade of the second
    assert click(np.concatenate(found)) <= CLICK[quantity]


def test_a_jump_in_the_midst_of_a_cross_fade_waits_and_the_newest_wins(voices: Any) -> None:
    one, other = voices(scene_of()), voices(scene_of())
    for voice in (one, other):
        stroked(voice, 30)
        voice.touch(Update(100, 1.0, 0.7, None, 0.3))
        voice.render(BLOCK)
    one.touch(Update(101, 1.01, -0.9, None, 0.3))  # never heard
    for voice in (one, other):
        voice.touch(Update(102, 1.02, 0.2, None, 0.3))
    frames = round(2 * CHANGE_TIME * RATE) + 10 * BLOCK
    assert np.array_equal(one.render(frames), other.render(frames))


@pytest.mark.parametrize("quantity", QUANTITIES)
def test_a_lift_is_silent_in_the_end_and_the_next_contact_sounds_with_the_last_load(voices: Any, quantity: str) -> None:
    voice = voices(scene_of(quantity))
    stroked(voice, 30)
    voice.lift()
    falling = still(voice, 60)
    assert np.abs(falling[-10 * BLOCK :]).max() == 0.0
    back = stroked(voice, 40, first=90, load=None)
    as_in_a_file = open_voice(scene_of(quantity)).full_scale[0] / voice.full_scale[0]
    assert np.abs(back[-5 * BLOCK :]).max() > 0.3 * as_in_a_file
    assert click(np.concatenate([falling, back])) <= CLICK[quantity]


def test_a_lift_before_the_first_block_is_not_lost(voices: Any) -> None:
    voice = voices(scene_of())
    voice.touch(Update(0, 0.0, 0.2e-3, None, 0.3))
    voice.lift()
    assert not still(voice, 60)[-10 * BLOCK :].any()


def test_a_scene_may_change_under_the_hand(voices: Any) -> None:
    voice = voices(scene_of())
    stroked(voice, 30)
    change = voice.prepare(scene_of(texture={"period": "1.6 mm"}))
    voice.apply(change)
    after = stroked(voice, 100, first=30)[3000:, 0]
    spectrum = np.abs(np.fft.rfft(after * np.hanning(len(after))))
    loudest = np.argmax(spectrum) * RATE / len(after)
    assert loudest == pytest.approx(0.08 / 1.6e-3, abs=2 * RATE / len(after))


def test_a_flat_texture_is_exact_silence_under_a_hand(voices: Any) -> None:
    assert np.abs(stroked(voices(scene_of(texture={"amplitude": 0})), 30)).max() == 0.0


@pytest.mark.parametrize(
    "effects", [{}, thorough({"tangential": {"pressure_exponent": 0.8}})], ids=["no effect", "tangential"]
)
def test_hands_on_the_same_texture_share_its_tables(effects: dict[str, Any]) -> None:
    output = {"quantity": "displacement", "sample_rate": RATE, "bandwidth": 1000}
    small, own = {"contact_length": "2 mm"}, ResponseCache()
    one = HandVoice(scene_of(finger=small, effects=effects, output=output), cache=own)
    held = own.used_bytes
    loud = HandVoice(scene_of(finger=small, effects=effects, output=output | {"full_scale": "1 mm"}), cache=own)
    stroked(one, 30)
    stroked(loud, 30, speed=0.2, load=1.5)
    assert own.used_bytes - held < 100_000


def test_24_hands_on_8_scenes_take_64_megabytes_at_most() -> None:
    cache, before = ResponseCache(), threading.active_count()
    hands = [
        HandVoice(scene_of(quantity, finger=SMALL, texture={"period": (5 + number % 8) * 1e-4}), cache=cache)
        for number, quantity in enumerate(["displacement", "velocity", "acceleration"] * 8)
    ]
    for number, hand in enumerate(hands):
        stroked(hand, 3, speed=0.01 * number, load=0.1 * number)
    assert cache.used_bytes <= 64e6
    assert threading.active_count() == before


def test_a_press_is_heard_as_exactly_at_first_as_later(voices: Any) -> None:
    """A new voice and one that has played for long sound the same once their motions agree."""
    fresh, old = voices(scene_of("acceleration")), voices(scene_of("acceleration"))
    stroked(old, 100, load=0.9)
    first, later = (stroked(voice, 60, first=100, load=0.7)[3000:] for voice in (fresh, old))
    assert np.ptp(first) == pytest.approx(np.ptp(later), rel=1e-2)


PROBE = """
import json, os, sys
from synth.motion.motion import Update
from synth.scene.scene import parse_scene
from synth.voice.hand_voice import HandVoice

def compiled():
    kernels = [
        (module.__name__, name, len(kernel.signatures))
        for module in list(sys.modules.values())
        if getattr(module, "__name__", "").startswith("synth.")
        for name, kernel in vars(module).items()
        if hasattr(kernel, "signatures")
    ]
    return {f"{module}.{name}": count for module, name, count in kernels if count}

def played(scene):
    voice = HandVoice(parse_scene(scene))
    before = compiled()
    voice.render(480)
    contacts = [(0.0, None, 0.3), (0.001, None, 0.9), (0.5, None, None), (None, 0.1, 0.2)]
    for number, (place, speed, load) in enumerate(contacts):
        voice.touch(Update(number, 0.01 * number, place, speed, load))
        voice.render(4000)
    voice.lift()
    voice.render(4000)
    voice.touch(Update(9, 1.0, 0.0, None, 0.3))
    voice.render(4000)
    voice.release()
    voice.render(2000)
    after = compiled()
    return sorted(name for name in after if after[name] != before.get(name))

for scene in json.loads(sys.argv[1]):
    if os.fork() == 0:  # a process for each scene, which has imported everything and compiled nothing
        print(json.dumps(played(scene)))
        sys.exit()
    if os.wait()[1]:
        sys.exit("a scene cannot be played")
"""
SMALL = {"contact_length": "1 mm"}
SCENES: dict[str, dict[str, Any]] = {
    "response": {},
    "stroke": {"scan": {"stroke": {}}, "output": {"channels": ["displacement", "velocity"]}},
    "grating": {"texture": {"kind": "grating"}, "effects": {"tangential": {"pressure_exponent": 0.8}}},
    "viscous skin": {"effects": {"viscous_skin": {}}},
    "simulated": {"effects": {"inertia": {}, "tangential": {}}},
}


@pytest.mark.parametrize(
    "names", [("response", "simulated"), thorough(("stroke", "grating", "viscous skin"))], ids=["some", "others"]
)
def test_nothing_is_compiled_while_a_hand_plays(names: tuple[str, ...]) -> None:
    scenes = [{"finger": SMALL} | SCENES[name] for name in names]
    words = [sys.executable, "-c", PROBE, json.dumps(scenes)]
    done = subprocess.run(words, capture_output=True, text=True, timeout=170, check=False)
    assert done.returncode == 0, done.stderr
    assert dict(zip(names, map(json.loads, done.stdout.splitlines()), strict=True)) == {name: [] for name in names}
