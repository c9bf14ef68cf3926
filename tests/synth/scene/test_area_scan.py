"""Scans over an area: the ends of their fields, recorded points of five numbers, and what they cannot stand beside."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import ridgewave as rw
from synth.errors import Fault, SceneError
from synth.scene.line_scan import along_x, as_written, turned_on_line
from synth.scene.scan_section import LINE
from synth.scene.scene import Scene, parse_scene, scene_document
from tests.few import paired

ENDS = {"y": 10.0, "heading": 1000.0, "direction": 1000.0}
POINTS = [
    [0.0, 0.0, 0.0, 0.0, 0.3],
    [0.1, "8 mm", "3 mm", "10 deg", 0.3],
    [0.2, 0.016, 0.006, 0.3, 0.4],
    [0.3, 0.02, 0.01, 0.3, 0.4],
]


def over_dots(scan: dict[str, Any]) -> Scene:
    """Return a scene on dots."""
    return parse_scene({"texture": {"kind": "dots"}, "scan": scan})


def faults(scan: dict[str, Any], texture: dict[str, Any] | None = None) -> tuple[Fault, ...]:
    """Return the faults of a scene."""
    with pytest.raises(SceneError) as refused:
        parse_scene({"texture": {"kind": "dots"} if texture is None else texture, "scan": scan})
    return tuple(refused.value.faults)


@pytest.mark.parametrize("name", LINE)
@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_both_ends_are_accepted_and_what_is_beyond_is_refused_by_name(name: str, sign: float) -> None:
    end = sign * ENDS[name]
    scene = over_dots({name: end})
    assert getattr(scene.scan, name) == end
    assert parse_scene(scene_document(scene)) == scene
    for beyond in (math.nextafter(end, sign * math.inf), math.nan, sign * math.inf):
        (fault,) = faults({name: beyond})
        assert fault.pointer == f"/scan/{name}"
        assert fault.hint


@pytest.mark.parametrize(("name", "sign"), paired(LINE, [-1.0, 1.0]))
def test_both_ends_render(name: str, sign: float) -> None:
    short = {
        "finger": {"contact_length": "1 mm"},
        "texture": {"kind": "dots"},
        "scan": {name: sign * ENDS[name]},
        "output": {"duration": 0.01},
        "accuracy": {"tolerance": 0.03},
    }
    assert np.isfinite(rw.render(short).values).all()


@pytest.mark.parametrize("name", LINE)
def test_a_texture_of_lines_takes_them_too(name: str) -> None:
    scene = parse_scene({"scan": {name: 0.1}})
    assert getattr(scene.scan, name) == 0.1
    assert parse_scene(scene_document(scene)) == scene
    assert scene.scan.turned == (name == "direction")
    assert parse_scene({"scan": {name: 0.0}}) == parse_scene({})


@pytest.mark.parametrize("finger", ["comb", "fingertip", "probe"])
def test_on_a_texture_of_lines_only_a_turned_comb_or_fingertip_leaves_x(finger: str) -> None:
    for scan in ({"y": 1.0}, {"heading": 1.0}, {"direction": 1.0}, {"direction": -math.tau}, {"trajectory": POINTS}):
        scene = parse_scene({"finger": {"kind": finger}, "scan": scan})
        turns = scan.get("direction") == 1.0 or "trajectory" in scan
        assert turned_on_line(scene) == (turns and finger != "probe")
        if turned_on_line(scene):
            assert along_x(scene) == scene
            continue
        reduced = along_x(scene)
        assert reduced.scan.along_x and not reduced.scan.turned and reduced.scan.y == 0.0
        assert as_written(reduced) == scene and scene_document(reduced) == scene_document(scene)
        assert along_x(reduced) == reduced


def test_points_of_five_numbers_are_read_in_si_and_written_back() -> None:
    scan = over_dots({"trajectory": POINTS}).scan
    assert scan.trajectory is not None
    assert np.allclose(scan.trajectory[1], (0.1, 0.008, 0.003, math.radians(10.0), 0.3), rtol=1e-12)
    assert scan.speed == pytest.approx(math.hypot(0.008, 0.003) / 0.1)
    assert scan.load == 0.4
    assert over_dots(scene_document(over_dots({"trajectory": POINTS}))["scan"]).scan == scan


def test_points_of_five_numbers_stand_alone() -> None:
    (fault,) = faults({"trajectory": POINTS, "heading": 0.1})
    assert (fault.pointer, fault.allowed) == ("/scan/heading", "not beside points over an area")
    (fault,) = faults({"trajectory": [*POINTS[:3], [0.3, 0.02, 0.4]]})
    assert fault.pointer == "/scan/trajectory/3"
    (fault,) = faults({"trajectory": [*POINTS[:3], [0.3, 0.02, 3.0, 0.0, 0.4]]})
    assert "10 m/s at most" in fault.allowed
    (fault,) = faults({"trajectory": [*POINTS[:3], [0.3, 0.02, 0.0, math.nan, 0.4]]})
    assert fault.pointer == "/scan/trajectory/3/3"


@pytest.mark.parametrize("finger", ["comb", "fingertip", "probe"])
def test_a_map_that_varies_only_across_is_felt_by_a_finger_that_crosses_it(finger: str) -> None:
    """It is the map that varies along x, scanned along x, turned by a quarter."""
    wave = 20e-6 * np.cos(np.arange(40) * math.tau / 40)
    output = {"duration": 0.05, "sample_rate": 8000, "bandwidth": 500, "quantity": "displacement"}
    size = {"probe": {}, "comb": {"contact_length": "1.5 mm"}, "fingertip": {"contact_length": "3 mm"}}[finger]
    base = {"finger": {"kind": finger} | size, "output": output, "accuracy": {"tolerance": 1e-2}}
    found = []
    for rows, scan in (
        (np.tile(wave, (40, 1)), {}),
        (np.tile(wave[:, np.newaxis], 40), {"heading": "90 deg", "direction": "90 deg"}),
    ):
        texture = {"kind": "heightmap", "rows": rows, "spacing": 20e-6, "ends": "join"}
        scene = rw.parse_scene(base, texture=texture, scan=scan)
        found.append((rw.render(scene), rw.explain(scene)))
    (along, plan), (across, turned) = found
    assert turned.response["stiffness"] == pytest.approx(plan.response["stiffness"])
    assert turned.response["rms"] is None and plan.response["rms"]
    assert not any("not felt" in text for text in turned.warnings)
    assert across.rms[0] == pytest.approx(along.rms[0], rel=1e-2)
