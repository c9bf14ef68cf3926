"""`import`: the reader of a file runs in a process of its own, whose crash is told as a fault of the file."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from tests.conftest import RunsRidgewave
from tests.few import thorough
from tests.synth.surfaces.maps.map_sets import CASES, made, surface

HEIGHTS = np.random.default_rng(5).normal(size=(17, 12))


@pytest.mark.parametrize("kind", [60_000, thorough(10), thorough(999)])  # types that the format does not have
def test_a_damaged_file_on_which_its_reader_crashes_is_refused(
    ridgewave: RunsRidgewave, tmp_path: Path, kind: int
) -> None:
    pytest.importorskip("SurfaceTopography", reason="needs the extra surfaces")
    from scipy.io import savemat

    savemat(tmp_path / "scan.mat", {"heights": HEIGHTS})
    whole = (tmp_path / "scan.mat").read_bytes()
    place = whole.index(b"\x09\0\0\0" + (8 * HEIGHTS.size).to_bytes(4, "little"))  # the tag of the heights, as float64
    (tmp_path / "scan.mat").write_bytes(whole[:place] + kind.to_bytes(4, "little") + whole[place + 4 :])
    done = ridgewave("import", "scan.mat", "--unit", "um", "--pixel", "5um", "--dry-run", cwd=tmp_path)
    assert (done.returncode, done.stdout) == (2, b"")
    assert b"reader" in done.stderr and b"Copy it again" in done.stderr


def test_a_picture_and_a_report_come_from_the_process(ridgewave: RunsRidgewave, tmp_path: Path) -> None:
    np.save(tmp_path / "scan.npy", HEIGHTS)
    words = ("import", "scan.npy", "--unit", "um", "--pixel", "5um", "--picture", "scan.png", "--json")
    done = ridgewave(*words)
    found = json.loads(done.stdout)
    assert found["kept"] and found["report"]["points"] == [12, 17] and found["report"]["file"] == "scan.npy"
    assert (tmp_path / "scan.png").read_bytes().startswith(b"\x89PNG")


def test_a_data_folder_that_cannot_be_written_is_named(
    ridgewave: RunsRidgewave, tmp_path: Path, environment: dict[str, str]
) -> None:
    (tmp_path / "file").write_bytes(b"")
    blocked = environment | {"RIDGEWAVE_DATA_FOLDER": str(tmp_path / "file" / "data")}
    np.save(tmp_path / "scan.npy", HEIGHTS)
    done = ridgewave("import", "scan.npy", "--unit", "um", "--pixel", "5um", env=blocked)
    assert done.returncode not in (0, 2) and str(tmp_path / "file" / "data").encode() in done.stderr


def test_a_file_that_cannot_be_read_is_named(ridgewave: RunsRidgewave) -> None:
    done = ridgewave("import", "none.npy", "--unit", "um")
    assert done.returncode == 2 and b"got no file 'none.npy'" in done.stderr


def test_a_word_that_is_not_understood_is_printed_with_what_to_write(ridgewave: RunsRidgewave, tmp_path: Path) -> None:
    (tmp_path / "wear.txt").write_text("Path (mm)\tHeight lost (um)\n0\t1.5\n0.1\t2\n0.2\t1\n")
    done = ridgewave("import", "wear.txt", "--dry-run", cwd=tmp_path)
    assert done.returncode == 2 and b"'lost' is not understood" in done.stderr and b'unit = "mm, um"' in done.stderr
    done = ridgewave("import", "wear.txt", "--dry-run", "--unit", "mm, um", cwd=tmp_path)
    assert done.returncode == 0 and b"'lost' is not understood, was read as heights" in done.stdout + done.stderr


def test_a_folder_of_maps_is_kept_and_its_scene_says_what_is_synthetic(
    ridgewave: RunsRidgewave, tmp_path: Path
) -> None:
    made(CASES["Poly Haven, folder"], surface(0), tmp_path, "wall")
    done = ridgewave("import", "wall", "--width", "80mm", "--slope", "0.02", "--picture", "wall.png", cwd=tmp_path)
    told = (done.stdout + done.stderr).decode()
    assert done.returncode == 0 and "normal map         wall_nor_gl_2k.png" in told and "kept as wall" in told
    assert "are synthetic: Hurst exponent" in told and "Not used: wall_ao_2k.png, wall_diff_2k.jpg" in told
    scene = json.loads(ridgewave("textures", "wall").stdout)
    assert scene["texture"]["ends"] == "join" and scene["texture"]["synthetic_shortest"] == 60e-6
    done = ridgewave("textures", "wall", "--export", "wall.npy", cwd=tmp_path)
    assert done.returncode == 0 and np.load(tmp_path / "wall.npy").shape == (256, 256)
