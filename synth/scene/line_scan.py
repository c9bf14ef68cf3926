"""What a scan over an area is on a texture that varies along x only.

Stage: 1 (SCENE), read by the plan.
Model: the place across changes nothing. While the finger keeps the direction of the x axis, the scan is the one along
x: a recording of the places along x, or the cosine of the heading times a constant scan or a stroke. A probe is round,
so that its direction changes nothing. A comb or a fingertip that is turned meets the texture as an area, and stays
turned: its constant scan or stroke is along x too, its recording is a path.
"""

from __future__ import annotations

import math
from typing import Any

from pydantic import PrivateAttr

from synth.scene.point_spacing import largest_speed
from synth.scene.rules import Fields
from synth.scene.scan_section import Scan
from synth.scene.scene import Scene
from synth.scene.texture_registry import kinds

ACROSS = 1e-12  # least cosine of a heading: a smaller one is that of a right angle, rounded


class ScanAlongX(Scan):
    """A scan along x in place of another scan, as which it is written."""

    _written: Scan = PrivateAttr()

    def document(self) -> dict[str, Any]:
        """Return the scan as it was written."""
        return self._written.document()


def as_written(scene: Scene) -> Scene:
    """Return `scene` with the scan that was written."""
    scan = scene.scan
    return scene.model_copy(update={"scan": scan._written}) if isinstance(scan, ScanAlongX) else scene


def turned_on_line(scene: Scene) -> bool:
    """Return whether a finger is turned on a texture along a line, so that the texture is an area to it."""
    return scene.scan.turned and not scene.finger.traits.round and not kinds()[scene.texture.kind].of_area


def along_x(scene: Scene) -> Scene:
    """Return `scene` with a scan along x if its texture is a line; a turned finger keeps its direction."""
    scan, turned = scene.scan, turned_on_line(scene)
    plain = scan.along_x and (turned or not scan.turned) and scan.y == 0.0
    if plain or kinds()[scene.texture.kind].of_area or (turned and scan.trajectory is not None):
        return scene
    fields = {name: getattr(scan, name) for name in Scan.model_fields} | _along_x(scan)
    found = ScanAlongX.model_construct(
        **fields | {"y": 0.0, "heading": 0.0, "direction": scan.direction if turned else 0.0}
    )
    found._written = scan
    return scene.model_copy(update={"scan": found})


def _along_x(scan: Scan) -> Fields:
    """Return the fields of the motion along x."""
    if scan.trajectory is not None:
        if len(scan.trajectory[0]) == 3:
            return {}
        points = tuple((time, 0.0 - x, load) for time, x, _y, _direction, load in scan.trajectory)
        return {"trajectory": points, "speed": largest_speed(points)}
    part = math.cos(scan.heading)
    part = part if abs(part) > ACROSS else 0.0
    stroke = None
    if scan.stroke is not None and part:
        lengths = {"length": part * scan.stroke.length, "speed": part * scan.stroke.speed}
        stroke = scan.stroke.model_copy(update=lengths)  # below 0 for a heading against x
    return {"speed": part * scan.speed, "stroke": stroke}
