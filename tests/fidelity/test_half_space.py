"""Springs and a half-space: the solver against Hertz, and the table and the claims of docs/fidelity.md."""

from __future__ import annotations

import re

import numpy as np
import pytest

from synth.contact.fingertip import FingertipContact
from tests.few import thorough
from tests.fidelity.half_space import (
    COLUMNS,
    LOADS,
    NEEDED,
    SURFACES,
    contact_on,
    half_space_depth,
    pressed_half_space,
    row,
)
from tests.fidelity.test_fidelity import PAGE

QUICK = ("comb", "flat", 0.3), ("fingertip", "flat", 0.3)  # the others take most of a minute
ROWS = [(kind, name, load) for kind in COLUMNS for name in SURFACES for load in LOADS]


def numbers(line: str) -> list[float]:
    """Return the numbers of a row: area, approach and, of a wavy surface, motion, of springs and of a half-space."""
    return [float(value) for cell in line.split("|")[4:] for value in re.findall(r"[\d.]+", cell)]


def page_row(kind: str, name: str, load: float) -> list[float]:
    (found,) = [line for line in PAGE.splitlines() if line.startswith(f"| {kind} | {name} | {load:g} |")]
    return numbers(found)


def test_the_half_space_is_that_of_hertz_under_a_sphere() -> None:
    pytest.importorskip("ContactMechanics", reason=NEEDED)
    radius, modulus, load, size = 22e-3, 135e3, 1.0, 14e-3
    contact = (3.0 * load * radius / (4.0 * modulus)) ** (1.0 / 3.0)
    x = size * ((np.arange(200) + 0.5) / 200 - 0.5)
    sphere = -(x[:, np.newaxis] ** 2 + x**2) / (2.0 * radius)
    ((area, z),) = pressed_half_space([sphere], (size, size), modulus, load)
    assert area == pytest.approx(np.pi * contact**2, rel=1e-2)
    assert np.max(sphere) - z == pytest.approx(contact**2 / radius, rel=1e-2)


@pytest.mark.parametrize(("kind", "name", "load"), [one if one in QUICK else thorough(*one) for one in ROWS])
def test_a_row_of_the_page_is_what_the_command_prints(kind: str, name: str, load: float) -> None:
    pytest.importorskip("ContactMechanics", reason=NEEDED)
    assert numbers(row(kind, name, SURFACES[name], load)) == pytest.approx(page_row(kind, name, load), rel=0.06)


@pytest.mark.parametrize(("place", "kind"), [(place, kind) for place in (0, 2, 4) for kind in COLUMNS])
def test_the_ratios_that_the_page_tells_are_those_of_its_rows(place: int, kind: str) -> None:
    """Place 0 is the area, 2 the approach, 4 the motion."""
    found = [page_row(kind, name, load) for name in SURFACES for load in LOADS]
    ratios = [one[place + 1] / one[place] for one in found if len(one) > place]
    assert f"{kind} {min(ratios):.2g} to {max(ratios):.2g} times" in " ".join(PAGE.split())


def test_the_curvatures_that_the_page_tells() -> None:
    contact = contact_on("fingertip", None)
    assert isinstance(contact, FingertipContact)
    springs, solid = (0.5 * 5.0**2 / (1e3 * depth) for depth in (contact.footprint.depth, half_space_depth(contact)))
    assert f"a radius of {springs:.0f} mm on the springs, of {solid:.0f} mm on the half-space" in " ".join(PAGE.split())
