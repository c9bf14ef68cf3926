"""The memory that is told is that which objects keep alive."""

from __future__ import annotations

import gc
import tracemalloc
import weakref
from typing import Any

import numpy as np
import pytest

from synth.held_memory import CountsItself, bytes_together, held_by
from synth.response_cache import PARTS, ResponseCache
from synth.scene.scene import parse_scene
from synth.surfaces import profile_of
from synth.surfaces.surface_data import SurfaceData, add_source, remove_source
from synth.voice.hand_voice import HandVoice
from synth.voice.voice import open_voice
from tests.few import paired

MEGABYTE = 1 << 17  # float64
TIP = {"kind": "fingertip", "contact_length": "4 mm"}
COMB = {"contact_length": "2 mm"}
LOOSE = {"accuracy": {"tolerance": 0.03}}


def test_an_array_counts_once_with_all_its_views() -> None:
    array = np.zeros(MEGABYTE)
    alone = held_by(array).bytes
    assert (1 << 20) <= alone < (1 << 20) + 1000
    assert held_by([array, array[5:], {"again": array[::2]}]).bytes < alone + 2000
    assert held_by(array[:1]).bytes == pytest.approx(alone, abs=1000)


def test_closures_attributes_and_partial_sums_are_followed() -> None:
    array = np.zeros(MEGABYTE)

    class Holder:
        __slots__ = ("what",)

    holder = Holder()
    holder.what = lambda: array  # type: ignore[attr-defined]
    assert held_by(holder).bytes > 1 << 20
    assert bytes_together([held_by(holder), held_by(array)]) < (1 << 20) + 5000


def test_numbers_of_a_long_track_count() -> None:
    tracemalloc.start()
    before = tracemalloc.get_traced_memory()[0]
    points = tuple((0.1 * i, 0.2 * i, 0.3 * i) for i in range(10_000))
    taken = tracemalloc.get_traced_memory()[0] - before
    tracemalloc.stop()
    assert held_by(points).bytes == pytest.approx(taken, rel=0.1)


def test_a_cache_is_not_followed() -> None:
    class Shared(CountsItself):
        array = np.zeros(1)

        def __init__(self) -> None:
            self.array = np.zeros(MEGABYTE)

    assert held_by([Shared()]).bytes < 1000


def track(heights: int) -> SurfaceData:
    walk = np.cumsum(np.random.default_rng(3).standard_normal(heights)) * 1e-7
    return SurfaceData((walk - np.linspace(walk[0], walk[-1], heights)).astype(np.float32), (5e-6,))


def waves(points: int) -> SurfaceData:
    x = np.arange(points) / points
    rows = np.cos(2 * np.pi * (7 * x[:, np.newaxis] + 5 * x)) + np.sin(2 * np.pi * 3 * x)
    return SurfaceData((1e-5 * rows).astype(np.float32), (2e-5, 2e-5))


SCENES: dict[str, tuple[dict[str, Any], Any]] = {
    "a comb on a sinusoid": ({}, None),
    "a fingertip on a line": ({"finger": TIP, "texture": {"kind": "grating", "period": "1.01 mm"}}, None),
    "dots": ({"finger": TIP, "texture": {"kind": "dots", "dot_height": "43 um"}}, None),  # in no other test
    "a height map": ({"finger": COMB, "texture": {"kind": "heightmap"}, **LOOSE}, lambda: waves(100)),
    "a track of 0.5 m": ({"finger": COMB, "texture": {"kind": "profile"}, **LOOSE}, lambda: track(100_001)),
}


@pytest.mark.parametrize(("name", "live"), paired(SCENES, [True, False]), ids=str)
def test_the_told_memory_is_what_python_has_allocated_and_is_free_once_the_voice_is(name: str, *, live: bool) -> None:
    document, make = SCENES[name]
    surface = None if make is None else make()
    if surface is not None:
        document = document | {"texture": document["texture"] | {"surface": surface.address}}

    def source(address: str) -> SurfaceData | None:
        return surface if surface is not None and address == surface.address else None

    def opened() -> Any:
        scene, cache = parse_scene(document), ResponseCache(0)
        return HandVoice(scene, cache=cache) if live else open_voice(scene, cache=cache)

    limit = PARTS.max_bytes
    add_source(source)
    PARTS.resize(0)
    try:
        opened()  # kernels, and tables of constants
        gc.collect()
        tracemalloc.start()
        voice = opened()
        gc.collect()
        taken, told = tracemalloc.get_traced_memory()[0], held_by(voice).bytes
        taken += 0 if surface is None else surface.nbytes  # it was there before
        assert 0.8 <= told / taken <= 1.25
        texture = weakref.ref(profile_of(parse_scene(document)))
        assert surface is None or texture() is not None  # the voice uses it
        del voice
        gc.collect()
        assert texture() is None
        assert tracemalloc.get_traced_memory()[0] < max(0.05 * taken, 50_000)
    finally:
        tracemalloc.stop()
        PARTS.resize(limit)
        remove_source(source)


def test_the_told_memory_of_the_cache_is_what_its_entries_keep_alive_also_once_it_is_full() -> None:
    limit, cache = PARTS.max_bytes, ResponseCache(20 << 20)
    PARTS.resize(0)
    PARTS.resize(20 << 20)
    try:
        for period in ("1.5 mm", "1.6 mm", "1.7 mm"):
            open_voice(
                parse_scene({"finger": TIP, "texture": {"kind": "dots", "period": period}}), cache=cache, live=True
            )
            for one in (PARTS, cache):
                assert one.used_bytes <= 20 << 20
                assert one.used_bytes == pytest.approx(held_by(*one.entries).bytes, rel=0.1)
        assert PARTS.used_bytes > 10 << 20
    finally:
        PARTS.resize(limit)
