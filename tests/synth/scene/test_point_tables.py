"""Recorded points as tables with names, and on the clocks of trackers."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pandas
import pytest
import xarray

from synth.errors import SceneError
from synth.motion.recorded_motion import RecordedMotion
from synth.scene.scene import Scene, parse_scene, parse_scene_text

T = np.arange(21) / 20
X, LOAD = 0.03 * T**2, 0.2 + 0.1 * T
RIGHT = np.column_stack([T, X, LOAD])
RECORDS = [("w", float), ("x", float), ("t", float)]


def read(points: Any, **texture: Any) -> Scene:
    return parse_scene({"scan": {"trajectory": points}, "texture": texture})


def table(**columns: Any) -> pandas.DataFrame:
    return pandas.DataFrame(columns)


@pytest.mark.parametrize(
    "points",
    [
        pandas.DataFrame(RIGHT),
        table(time=T, load=LOAD, position=X),
        pandas.DataFrame({"Force (N)": LOAD, "Time [s]": T, "x": X}),
        pandas.DataFrame({"f_n": LOAD, "pos_m": X, "time_s": T}),
        table(t=T, load=LOAD, x=X).to_records(index=False),
        np.array([*zip(LOAD, X, T, strict=True)], RECORDS),
        xarray.DataArray(RIGHT[:, ::-1], dims=("n", "part"), coords={"part": ["load", "x", "t"]}),
        xarray.DataArray(RIGHT, dims=("n", "part"), coords={"part": [0, 1, 2]}),
        xarray.Dataset({"load": ("time", LOAD, {"units": "N"}), "x": ("time", X)}, coords={"time": T}),
    ],
    ids=range(9),
)
def test_columns_are_put_in_order_by_their_names(points: Any) -> None:
    scene = read(points)
    np.testing.assert_array_equal(scene.scan.trajectory, RIGHT)
    assert scene.output.duration == 1.0
    assert Scene(scan={"trajectory": points}).scan == scene.scan


def test_columns_over_an_area() -> None:
    points = table(load=LOAD, y=-X, angle=0.1 * T, x=X, t=T)
    found = read(points, kind="dots").scan.trajectory
    np.testing.assert_array_equal(found, np.column_stack([T, X, -X, 0.1 * T, LOAD]))


@pytest.mark.parametrize(
    ("points", "told"),
    [
        (table(a=T, b=X, c=LOAD), "columns a, b, c"),
        (table(t=T, x=X), "columns t, x"),
        (table(t=T, x=X, load=LOAD, note=T), "no others"),
        (table(time=T, x=X, load=LOAD).set_index("time"), "reset_index"),
        (pandas.DataFrame(RIGHT, columns=["t", "x", "x"]), "columns t, x, x"),
        (pandas.DataFrame({"t": T, "x (mm)": X, "load": LOAD}), "Convert it to m"),
        (pandas.DataFrame({"t_ms": T, "x": X, "load": LOAD}), "Convert it to s"),
        (table(t=pandas.to_datetime(T, unit="s"), x=X, load=LOAD), "holds dates"),
        (xarray.Dataset({"load": ("t", LOAD), "x": ("t", X, {"units": "mm"})}, coords={"t": T}), "an array in mm"),
        (xarray.Dataset({"load": ("n", LOAD), "x": ("n", X)}), "columns load, x"),
        (table(time=T, x=X, load=LOAD).to_records(), r"np\.c_\[r\.t, r\.x, r\.w\]"),
    ],
)
def test_a_table_whose_names_make_no_point_is_refused(points: Any, told: str) -> None:
    with pytest.raises(SceneError, match=told) as caught:
        read(points)
    assert [fault.pointer for fault in caught.value.faults] == ["/scan/trajectory"]


@pytest.mark.parametrize("begin", [86399.0, 1.7e9, 1732759318.123457, 9e9])
def test_a_tracker_has_any_clock(begin: float) -> None:
    points = np.add(RIGHT, [begin, 0.0, 0.0])
    scene = read(points)
    assert parse_scene_text(json.dumps({"scan": {"trajectory": points.tolist()}})) == scene
    assert Scene.from_json(scene.json_text()) == scene
    assert scene.output.duration == pytest.approx(1.0, abs=2e-6)
    places = RecordedMotion.of(scene).place.value(T)
    np.testing.assert_allclose(places, RecordedMotion.of(read(RIGHT)).place.value(T), rtol=0, atol=2e-7)


def test_two_points_a_millisecond_apart_are_not_too_close_on_a_clock_since_1970() -> None:
    points = [[1.7e9 + t, x, 0.3] for t, x in [(0.123, 0.0), (0.124, 1e-5), (0.125, 3e-5)]]
    scene = read(points)
    assert [point[0] for point in scene.scan.trajectory or ()] == [0.0, 0.001, 0.002]
    assert not RecordedMotion.of(scene).warnings


@pytest.mark.parametrize(
    ("points", "pointer", "told"),
    [
        (np.add(RIGHT, [1.7e12, 0, 0]), "/scan/trajectory/0/0", "divide a clock in ms by 1000"),
        (RIGHT * [1e6, 1, 1], "/scan/trajectory/2/0", "times are in s"),
        (np.add(RIGHT * [1e6, 1, 1], [1.7e9, 0, 0]), "/scan/trajectory/2/0", "times are in s"),
    ],
)
def test_a_clock_that_is_not_in_seconds_is_one_fault(points: Any, pointer: str, told: str) -> None:
    with pytest.raises(SceneError, match=told) as caught:
        read(points)
    assert [fault.pointer for fault in caught.value.faults] == [pointer]
