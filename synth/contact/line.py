"""Where a finger stands on a surface over an area, and the angle by which it is turned.

Stage   CONTACT.
Model   A finger moves along x. On a height field it stands at y, and its length is turned by an angle from x.
Source  design, section 4.
"""

from __future__ import annotations

from typing import NamedTuple


class Line(NamedTuple):
    """Where a finger stands across a height field.

    y: place of its middle, m.
    direction: angle of its length from x, rad, counter-clockwise.
    """

    y: float = 0.0
    direction: float = 0.0


MIDDLE = Line()
