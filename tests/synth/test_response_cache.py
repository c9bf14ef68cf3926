"""The cache of responses: its limit, eviction of the least recently used, and one builder at a time."""

from __future__ import annotations

import threading

import pytest

import synth
from synth.response_cache import ResponseCache, bytes_of


class Thing:
    """Takes `size` kilobytes."""

    def __init__(self, size: int, name: str = "") -> None:
        self.content, self.name = bytes(1000 * size), name


def kilobytes(cache: ResponseCache) -> int:
    """Return the size of the entries, without the objects round their content."""
    return cache.used_bytes // 1000


def room(kilobytes: float) -> ResponseCache:
    """Return a cache of this size, and 900 bytes for the objects round the contents."""
    return ResponseCache(int(1000 * kilobytes) + 900)


def test_what_was_built_is_kept() -> None:
    cache = room(1000)
    first = cache.get("a", lambda: Thing(10))
    assert cache.get("a", lambda: Thing(20)) is first
    assert (cache.hits, cache.misses, kilobytes(cache)) == (1, 1, 10)


def test_the_least_recently_used_goes_first() -> None:
    cache = room(30)
    for name in "abc":
        cache.get(name, lambda name=name: Thing(10, name))  # type: ignore[misc]
    assert cache.get("a", lambda: Thing(1)).name == "a"
    cache.get("d", lambda: Thing(10, "d"))
    assert kilobytes(cache) == 30
    assert cache.get("a", lambda: Thing(1)).name == "a"
    assert cache.get("c", lambda: Thing(1)).name == "c"
    assert cache.get("b", lambda: Thing(1, "b again")).name == "b again"


def test_what_is_dropped_while_somebody_uses_it_is_found_again_until_they_let_go() -> None:
    cache = room(20)
    used = cache.get("used", lambda: Thing(20, "used"))
    cache.get("next", lambda: Thing(20, "next"))
    assert cache.get("used", lambda: Thing(20, "twice")) is used
    assert (cache.hits, kilobytes(cache)) == (1, 20)
    del used
    assert cache.get("used", lambda: Thing(20, "again")).name == "again"


def test_the_bound_holds_whatever_comes() -> None:
    cache = room(100)
    for size in (40, 70, 20, 90, 5, 60, 45):
        cache.get(size, lambda size=size: Thing(size))  # type: ignore[misc]
        assert cache.used_bytes <= cache.max_bytes


def test_what_is_larger_than_the_bound_is_handed_out_but_not_kept() -> None:
    cache = room(100)
    small = cache.get("small", lambda: Thing(60))
    assert cache.get("large", lambda: Thing(101, "first")).name == "first"
    assert cache.get("large", lambda: Thing(101, "second")).name == "second"
    assert cache.get("small", lambda: Thing(1)) is small


def test_what_entries_share_counts_once_until_the_last_of_them_has_gone() -> None:
    cache, shared = room(100), bytes(60_000)
    for name in "abc":
        cache.get(name, lambda: [shared])
    assert kilobytes(cache) == 60
    cache.resize(cache.used_bytes - 1)
    assert kilobytes(cache) == 60
    cache.resize(0)
    assert cache.used_bytes == 0


def test_what_two_caches_share_counts_once() -> None:
    one, other, shared = room(100), room(100), bytes(60_000)
    one.get("a", lambda: [shared])
    other.get("b", lambda: [shared, bytes(20_000)])
    assert bytes_of(one, other) // 1000 == 80


def test_a_failed_build_is_told_and_tried_again() -> None:
    cache = room(100)

    def fails() -> Thing:
        raise RuntimeError("not this time")

    for _ in range(2):
        with pytest.raises(RuntimeError, match="not this time"):
            cache.get("a", fails)
    assert cache.get("a", lambda: Thing(7, "a")).name == "a"


def test_two_threads_that_ask_at_once_build_once() -> None:
    cache, started, go_on = room(100), threading.Event(), threading.Event()
    builds: list[str] = []
    got: list[Thing] = []

    def build() -> Thing:
        builds.append(threading.current_thread().name)
        started.set()
        assert go_on.wait(30)
        return Thing(5)

    threads = [threading.Thread(target=lambda: got.append(cache.get("a", build))) for _ in range(4)]
    threads[0].start()
    assert started.wait(30)
    for thread in threads[1:]:
        thread.start()
    other = cache.get("b", lambda: Thing(6, "b"))  # another key does not wait for this build
    go_on.set()
    for thread in threads:
        thread.join(30)
    assert len(builds) == 1
    assert len({id(thing) for thing in got}) == 1 and len(got) == 4
    assert other.name == "b"


def test_a_scene_that_is_opened_twice_is_solved_once_and_explained_in_full() -> None:
    """Calls without a cache share that of the process; the cost of a plan is measured without a cache."""
    scene = synth.parse_scene({"texture": {"period": "0.777 mm"}})
    first = synth.open_voice(scene).solved.spectrum
    assert synth.open_voice(scene).solved.spectrum is first
    assert synth.open_voice(scene, cache=ResponseCache()).solved.spectrum is not first
    cost = synth.explain(scene).cost
    assert cost is not None and cost.setup_seconds > 1e-3
