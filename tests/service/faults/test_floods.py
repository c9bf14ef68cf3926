"""Peers that send as fast as they can wait in the network, and disturb no other stream.

Model: `tests.bench.flood` floods from its own process, beside another stream (`tests.bench.bench_floods` measures the
    same for longer). The test asserts that the other stream misses no block, and that every flooding connection stays
    open, is told once at most, and gets its own sound. In one of `ATTEMPTS` runs the largest gap of the other stream
    is below `GAP_MS`; other work on the machine delays it too.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.bench.bench_floods import GAP_MS, flooded
from tests.bench.flood import KINDS
from tests.service.harness import Child, roomy_environment

ATTEMPTS = 3
SECONDS = 2.0  # of each flood
QUICK = {("pings", 8), ("fragments", 1)}

pytestmark = pytest.mark.alone


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[str, int, Path]]:
    folder = tmp_path_factory.mktemp("floods")
    child = Child("tests.service.serve_zeros", folder, **roomy_environment())
    try:
        yield child.url(), child.process.pid, folder
    finally:
        child.terminate()


@pytest.mark.parametrize(
    ("kind", "connections"),
    [
        pytest.param(kind, connections, marks=[] if (kind, connections) in QUICK else pytest.mark.thorough)
        for kind in KINDS
        for connections in (1, 8)
    ],
)
def test_a_flood_makes_nobody_late_and_waits(served: tuple[str, int, Path], kind: str, connections: int) -> None:
    gaps = []
    for _ in range(ATTEMPTS):
        (gap, missing), peers = flooded(kind, connections, SECONDS, *served)
        assert missing.value == 0
        assert not any(peer["closed"] for peer in peers), peers
        assert all(peer["problems"].get("too-fast", 0) <= 1 and peer["blocks"] for peer in peers), peers
        gaps.append(gap.value)
        if gap.value <= GAP_MS:
            return
    pytest.fail(f"the neighbour's largest gaps, ms: {gaps}")
