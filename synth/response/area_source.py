"""z of a live voice over an area: from a layered table in the finger's own direction, solved in any other.

Stage   RESPONSE.
Model   A layered table holds z at every place and load for one direction of the finger, that of its line. For a finger
        in another direction z is solved, with larger cells where that is needed (`area_path`). Within TURNED of the
        table's direction the two are cross-faded, so that z has no step when the finger begins to turn.
Source  design, section 1.
Limits  The errors of the table, and of the solutions where the finger is turned.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from synth.arrays import Array
from synth.contact.area_path import AreaContact
from synth.contact.geometry import Geometry
from synth.contact.line import Line
from synth.response.layered_table import LayeredTable
from synth.surfaces.height_field import HeightField

TURNED = math.radians(1.0)  # from the table's direction: beyond it only solved z is used; less is heard as a step


@dataclass(frozen=True, slots=True)
class AreaSource:
    """z over an area, for `direct_reader`.

    table: of the finger on its line.
    contact: the same finger, to be solved in other directions.
    """

    table: LayeredTable
    contact: AreaContact

    @property
    def line(self) -> Line:
        """Where the finger stands, and its direction."""
        return self.contact.line

    @property
    def geometry(self) -> Geometry:
        """The surfaces."""
        return self.contact.geometry

    @property
    def texture(self) -> HeightField:
        """The surface."""
        texture = self.contact.geometry.profile
        assert isinstance(texture, HeightField)
        return texture

    def heights(self, phases: Array, loads: Array, path: Array | None = None) -> Array:
        """Return z (m) at each of `phases` (turns) and `loads` (N, above 0), on its line or along a path.

        path: how far the texture has moved across (m), and the direction of the finger (rad) [2, phases].
        """
        if path is None:
            return self.table.heights(phases, np.zeros(len(phases)), loads)
        z = self.table.heights(phases, (path[0] + self.line.y) / self.texture.across, loads)
        part = np.minimum(np.abs(path[1] - self.line.direction) / TURNED, 1.0) * (not self.contact.of_any_direction)
        turned = part > 0.0
        if turned.any():
            some = part[turned]
            solved = self.contact.heights(phases[turned], loads[turned], np.ascontiguousarray(path[:, turned]))
            z[turned] += some * some * (3.0 - 2.0 * some) * (solved - z[turned])
        return z

    def mean(self, roots: Array) -> Array:
        """Return the mean of z over the surface (m) at loads of the cube roots `roots` (N^(1/3))."""
        return self.table.mean(np.asarray(roots) ** 3)
