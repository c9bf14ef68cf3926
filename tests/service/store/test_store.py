"""The store: names belong to owners, surfaces to their content, and a change is whole or absent."""

from __future__ import annotations

import os
import resource
import signal
import sqlite3
import threading
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from service.store.store import Quota, Store, StoreFull
from service.store.stored_texture import StoredTexture
from service.store.texture_database import FILE
from service.store.texture_names import name_from_file
from synth.errors import CannotRender, InvalidRequest, NameTaken
from synth.surfaces.surface_data import SurfaceData
from tests.few import thorough

RNG = np.random.default_rng(2)
REPORT = {"file": "scan.csv", "rq": 1e-6}
FREE = Quota()


def surface(points: int = 50) -> SurfaceData:
    return SurfaceData(RNG.normal(size=points).astype(np.float32) * 1e-6, (5e-6,))


@pytest.fixture
def store(tmp_path: Path) -> Store:
    return Store(tmp_path / "data")


def test_nothing_is_made_until_something_is_kept(store: Store) -> None:
    assert store.textures("") == [] and store.find("", "cloth") is None and store.surface("0" * 64) is None
    assert not store.folder.exists()


def test_a_kept_surface_comes_back_bit_for_bit(store: Store) -> None:
    area = SurfaceData(RNG.normal(size=(7, 9)).astype(np.float32), (5e-6, 1e-5))
    kept = store.keep("me", "cloth", area, "heightmap", REPORT, FREE)
    found = Store(store.folder).surface(kept.address)
    assert found is not None and found.spacing == area.spacing
    np.testing.assert_array_equal(found.heights, area.heights)
    assert kept.texture == {"kind": "heightmap", "surface": area.address}
    assert store.find("me", "cloth") == kept and store.textures("me") == [kept]


def test_a_texture_belongs_to_its_owner(store: Store) -> None:
    store.keep("me", "cloth", surface(), "profile", REPORT, FREE)
    assert store.find("you", "cloth") is None and store.textures("you") == []
    assert store.rename("you", "cloth", "mine") is None and not store.delete("you", "cloth")
    document = {"texture": {"kind": "cloth"}}
    assert store.named(document, "you") == document and store.named(document, "me") != document


def test_a_surface_stays_until_its_last_name_is_deleted(store: Store) -> None:
    shared = surface()
    for owner in ("me", "you"):
        store.keep(owner, "cloth", shared, "profile", REPORT, FREE)
    with sqlite3.connect(store.folder / FILE) as database:
        assert database.execute("SELECT count(*) FROM surfaces").fetchone() == (1,)
    assert store.delete("me", "cloth") and not store.delete("me", "cloth")
    with sqlite3.connect(store.folder / FILE) as database:
        assert database.execute("SELECT count(*) FROM surfaces").fetchone() == (1,)
    store.delete("you", "cloth")
    with sqlite3.connect(store.folder / FILE) as database:
        assert database.execute("SELECT count(*) FROM surfaces").fetchone() == (0,)


def test_deleting_gives_the_disk_back(store: Store) -> None:
    store.keep("", "large", surface(2_000_000), "profile", REPORT, FREE)
    store.keep("", "small", surface(), "profile", REPORT, FREE)
    store.delete("", "large")
    assert sum(path.stat().st_size for path in store.folder.iterdir()) < 1_000_000


def test_a_name_is_never_overwritten_and_keeping_again_is_the_same(store: Store) -> None:
    first = surface()
    kept = store.keep("", "cloth", first, "profile", REPORT, FREE)
    assert store.keep("", "cloth", first, "profile", {"file": "other"}, FREE) == kept
    with pytest.raises(NameTaken, match="exists already"):
        store.keep("", "cloth", surface(), "profile", REPORT, FREE)
    store.keep("", "felt", surface(), "profile", REPORT, FREE)
    with pytest.raises(NameTaken):
        store.rename("", "felt", "cloth")


def test_a_scene_that_names_the_surface_is_the_same_after_a_rename(store: Store) -> None:
    store.keep("", "cloth", surface(), "profile", REPORT, FREE)
    before = store.named({"texture": {"kind": "cloth", "phase": 1.0}}, "")
    store.rename("", "cloth", "wool")
    assert store.named({"texture": {"kind": "wool", "phase": 1.0}}, "") == before
    assert before["texture"]["phase"] == 1.0 and store.surface(before["texture"]["surface"]) is not None


@pytest.mark.parametrize(
    "name", ["", "Cloth", "-a", "a" * 65, "../etc", "a/b", "a.b", "a b", "sinusoid", "grating-1mm-31um", "a\0", "ä"]
)
def test_names_that_are_not_allowed(store: Store, name: str) -> None:
    with pytest.raises(InvalidRequest, match="name: got"):
        store.keep("", name, surface(), "profile", REPORT, FREE)
    assert store.find("", name) is None and not store.folder.exists()


@pytest.mark.parametrize(
    ("file", "name"),
    [("Scan 3_b.CSV", "scan-3-b"), ("ÄÖ.x3p", "texture"), ("rough.npy", "my-rough"), ("a" * 99, "a" * 64)],
)
def test_a_name_made_from_a_file(file: str, name: str) -> None:
    assert name_from_file(file) == name


def test_quotas_in_number_and_bytes(store: Store) -> None:
    store.keep("me", "one", surface(), "profile", REPORT, Quota(textures=1))
    with pytest.raises(StoreFull, match="1 textures"):
        store.keep("me", "two", surface(), "profile", REPORT, Quota(textures=1))
    with pytest.raises(StoreFull, match="400 bytes"):
        store.keep("me", "two", surface(), "profile", REPORT, Quota(bytes=399))
    assert [texture.name for texture in store.textures("me")] == ["one"]
    store.keep("you", "two", surface(), "profile", REPORT, Quota(textures=1, bytes=200))


@pytest.mark.parametrize(
    "damage", ["heights = zeroblob(200)", "heights = zeroblob(199)", "heights = 'a'", "shape = '[5'"]
)
def test_a_damaged_surface_is_told_and_not_played_until_it_is_imported_again(store: Store, damage: str) -> None:
    whole = surface()
    kept = store.keep("", "cloth", whole, "profile", REPORT, FREE)
    with closing(sqlite3.connect(store.folder / FILE)) as database, database:
        database.execute(f"UPDATE surfaces SET {damage}")
    with pytest.raises(CannotRender, match=r"damaged\. Import it again"):
        store.surface(kept.address)
    assert store.keep("", "cloth", whole, "profile", REPORT, FREE) == kept
    mended = store.surface(kept.address)
    assert mended is not None and np.array_equal(mended.heights, whole.heights)


def test_a_damaged_report_is_told(store: Store) -> None:
    store.keep("", "cloth", surface(), "profile", REPORT, FREE)
    with closing(sqlite3.connect(store.folder / FILE)) as database, database:
        database.execute("UPDATE textures SET report = '{'")
    with pytest.raises(CannotRender, match="must be whole"):
        store.textures("")


def test_a_file_that_is_no_database_is_told(store: Store) -> None:
    store.folder.mkdir()
    (store.folder / FILE).write_bytes(b"not a database" * 100)
    with pytest.raises(CannotRender, match="cannot be read or kept"):
        store.textures("")


@contextmanager
def full_disk() -> Iterator[None]:
    """Within, no file of this process may grow."""
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (0, limits[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)


def test_on_a_full_disk_textures_are_read_and_none_is_kept(store: Store) -> None:
    kept = store.keep("me", "cloth", surface(), "profile", REPORT, FREE)
    with full_disk():
        assert store.textures("me") == [kept] and store.surface(kept.address) is not None
        with pytest.raises(CannotRender, match="must be writable and have room"):
            store.keep("me", "silk", surface(), "profile", REPORT, FREE)
    store.keep("me", "silk", surface(), "profile", REPORT, FREE)
    assert [texture.name for texture in store.textures("me")] == ["cloth", "silk"]


def test_changes_that_are_not_in_the_database_yet_are_not_left_out(store: Store) -> None:
    store.keep("me", "cloth", surface(), "profile", REPORT, FREE)
    (store.folder / f"{FILE}-wal").write_bytes(b"a change")
    with full_disk(), pytest.raises(CannotRender):
        store.textures("me")


def test_writers_and_readers_of_one_folder_take_turns(store: Store) -> None:
    began = threading.Barrier(8)

    def work(number: int) -> int:
        began.wait()
        for index in range(5):
            store.keep("me", f"t-{number}-{index}", surface(), "profile", REPORT, FREE)
            assert store.find("me", f"t-{number}-{index}") is not None
        return len(store.textures("me"))

    with ThreadPoolExecutor(8) as pool:
        assert max(pool.map(work, range(8))) <= 40
    assert len(store.textures("me")) == 40


def test_the_tables_appear_together(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    """Nobody sees a database with some of its tables: before each statement that makes it another process looks."""
    seen: set[int] = set()
    connect = sqlite3.connect

    def look(_: str) -> None:
        with closing(connect(store.folder / FILE)) as other:
            seen.add(other.execute("SELECT count(*) FROM sqlite_master WHERE type = 'table'").fetchone()[0])

    def traced(*where: Any, **options: Any) -> sqlite3.Connection:
        database: sqlite3.Connection = connect(*where, **options)
        database.set_trace_callback(look)
        return database

    monkeypatch.setattr(sqlite3, "connect", traced)
    store.keep("me", "wave", surface(), "profile", REPORT, FREE)
    assert seen == {0, 2}


def test_many_who_make_the_database_at_once_all_get_it(tmp_path: Path) -> None:
    began = threading.Barrier(8, timeout=30.0)

    def work(turn: int) -> StoredTexture | None:
        began.wait()
        return Store(tmp_path / str(turn)).rename("me", "absent", "wave")

    with ThreadPoolExecutor(8) as pool:
        for turn in range(40):
            assert set(pool.map(work, [turn] * 8)) == {None}
            with closing(sqlite3.connect(tmp_path / str(turn) / FILE)) as database:
                assert database.execute("PRAGMA auto_vacuum").fetchone() == (1,)


def _keep_for_ever(folder: Path, number: int, done: int) -> None:
    """Keep texture after texture, and write each number to the descriptor `done` when it is kept."""
    while True:
        heights = np.random.default_rng(number).normal(size=100_000).astype(np.float32)
        Store(folder).keep("", f"texture-{number}", SurfaceData(heights, (5e-6,)), "profile", REPORT, FREE)
        os.write(done, f"{number}\n".encode())
        number += 1


@pytest.mark.parametrize("times", [30, thorough(100)])
def test_imports_that_are_killed_are_whole_or_absent(store: Store, times: int) -> None:
    """Kill -9 at random moments of an endless series of imports, so many times; then look at what is there."""
    first = 0
    for turn in range(times):
        read, write = os.pipe()
        child = os.fork()
        if child == 0:
            try:
                _keep_for_ever(store.folder, first, write)
            finally:
                os._exit(1)  # never back into the test runner
        os.close(write)
        said = os.fdopen(read)
        lines = [said.readline()] if turn % 4 == 0 else []  # killed during its second import
        threading.Event().wait(float(RNG.uniform(0.0, 0.05)))
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
        with said:
            kept = [int(line) for line in (*lines, *said)]
        names = {texture.name: texture for texture in store.textures("")}
        following = max(kept, default=first - 1) + 1
        assert {f"texture-{number}" for number in range(following)} <= set(names)
        assert set(names) <= {f"texture-{number}" for number in range(following + 1)}
        first = following
    with sqlite3.connect(store.folder / FILE) as database:
        assert database.execute("PRAGMA integrity_check").fetchone() == ("ok",)
    for texture in names.values():
        found = Store(store.folder).surface(texture.address)  # which checks the hash of its content
        assert found is not None and found.address == texture.address
    assert first >= times // 4
