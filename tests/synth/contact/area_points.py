"""Points of a finger over an area, drawn anew: for brute force beside the cells of the engine."""

from __future__ import annotations

from typing import Any

import numpy as np

from synth.contact.area_contact import CombOnArea
from synth.contact.area_solver import BEFORE, ROW, WIDE
from synth.contact.fingertip import FingertipContact
from synth.surfaces.height_field import HeightField
from tests.reference import area_oracle
from tests.reference.fingertip_oracle import Print


def points_of(found: FingertipContact | CombOnArea, direction: float = 0.0) -> tuple[Any, Any, Any, float]:
    """Return x, y and height (m) of points of a turned finger, and the area of a point over A0.

    Those of a comb are all over its square. Those of a fingertip lie in the cells of the solver.
    """
    ridges = found.geometry
    if isinstance(found, CombOnArea):
        return area_oracle.comb(
            ridges.contact_length, ridges.ridge_amplitude, ridges.ridge_period, direction, found.line.y
        )
    return cells_drawn_anew(found, direction)


def cells_drawn_anew(found: FingertipContact | CombOnArea, direction: float) -> tuple[Any, Any, Any, float]:
    """Return x, y and height (m) of points in every cell of a turned finger [cells, points], and the area of a point.

    The places of the cells are those of the solver; the heights are drawn anew.
    """
    grid, texture = found.grid_at(direction), found.geometry.profile
    assert isinstance(texture, HeightField)
    step, there = grid.texture.step, grid.finger[:, 0] > -1e20
    column = grid.places[:, :1] - BEFORE + np.arange(WIDE)
    row = np.broadcast_to(grid.places[:, 1:2], column.shape)
    beside, beyond = area_oracle.inside((step[0], ROW * step[1]))
    x = (grid.begin[0] * texture.period + column * step[0])[there][:, np.newaxis] + beside
    y = (grid.begin[1] * texture.across + row * step[1])[there][:, np.newaxis] + beyond
    share = grid.cell / len(beside)
    middle = 0.0 if isinstance(found, FingertipContact) else 0.5 * found.geometry.contact_length
    turned = (x - middle + 1j * y) * np.exp(-1j * direction)  # in the frame of the finger
    u, v = turned.real, turned.imag
    if isinstance(found, FingertipContact):
        field, foot = found.field, found.footprint
        spreads = field.spacing_spread, field.direction_spread, field.height_spread
        print_ = Print(field.period, field.amplitude, field.pattern, *spreads, field.seed)
        ridges = print_.heights(u.ravel(), v.ravel()).reshape(u.shape)
        return x, y, ridges - foot.depth * ((2 * u / foot.length) ** 2 + (2 * v / foot.width) ** 2), share
    surfaces = found.geometry
    heights = -surfaces.ridge_amplitude * np.cos(2 * np.pi * (u + middle) / surfaces.ridge_period)
    return x, y, heights, share
