"""The foundation of independent springs (Winkler) and an elastic half-space: `python -m tests.fidelity halfspace`.

Model   A rigid texture is pressed on the ridges of a finger. In the model every point of the finger is a spring of its
        own, with k of eqs 4-5. Here the finger is an elastic half-space of the same contact modulus E*, whose surface
        has the same ridges: a point that is pressed moves its neighbours too. A comb is a block of L by L, and
        carries nothing beyond its ends. A fingertip is round so that it touches over the footprint L0 at 1 N: the
        depth of its paraboloid at the edge of the footprint is 3 w / (8 E* a), a = L0 / 2 (Hertz).
Source  Polonsky & Keer (1999), as the package ContactMechanics solves it; Johnson, Contact Mechanics (1985), sec. 4.2,
        for the paraboloid.
Limits  Contact without friction or adhesion, and small slopes. The points are COLUMNS by ROWS: with half as many again
        along each axis, the area of a fingertip falls by 3 % and its motion changes by 1 %. With twice the rows, areas
        of a comb fall by up to 3 %.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from importlib.util import find_spec
from types import SimpleNamespace
from typing import Any

import numpy as np

from synth.contact.fingertip import FingertipContact
from synth.contact.footprint import REFERENCE_LOAD
from synth.contact.load_balance import Contact
from synth.contact.scene_contact import contact_of
from synth.scene.scene import parse_scene
from tests.fidelity.measures import Section, sinusoid

Real = np.ndarray[Any, np.dtype[np.float64]]

NEEDED = "the half-space needs the extra `halfspace`: pip install '.[halfspace]'"
LOADS = 0.05, 0.3, 1.0, 1.8  # N: the range in which roughness is usefully felt (Fagiani & Barbieri, 2016)
PHASES = 24  # of a period of the texture: the peak-to-peak of the springs is within 3 % of that of 128
COLUMNS, ROWS = {"comb": 1000, "fingertip": 200}, {"comb": 20, "fingertip": 200}  # straight ridges need few rows
REACH = 1.3  # of the points of a fingertip, relative to the contact of a smooth sphere (Hertz)
SURFACES: dict[str, Section | None] = {"flat": None, "wavy": sinusoid(0.8e-3)}  # wavy: that of the default scene


@dataclass(frozen=True)
class Pressed:
    """A texture pressed on a finger.

    area: that touches, m^2, the mean over the phases of the texture.
    approach: of the bodies from the first touch, m, the mean over the phases.
    motion: peak-to-peak of z over the phases, m.
    """

    area: float
    approach: float
    motion: float

    @classmethod
    def of_phases(cls, area: Real, first: Real, z: Real) -> Pressed:
        """Return the means and the motion.

        area: m^2, at each phase.
        first: the height at which the surfaces begin to touch, m, at each phase.
        z: m, at each phase.
        """
        return cls(float(np.mean(area)), float(np.mean(first - z)), float(np.ptp(z)))


def contact_on(kind: str, texture: Section | None) -> Contact:
    """Return the contact of a default finger of `kind`; texture: None is a flat plate."""
    if texture is None:  # eqs 4-5 need a period for a plate too: that of the ridges, as for a fingertip
        ridges = parse_scene({"finger": {"kind": kind}}).finger.ridge_period
        texture = {"period": ridges, "amplitude": 0.0}
    return contact_of(parse_scene({"finger": {"kind": kind}, "texture": texture}))


def on_springs(kind: str, texture: Section | None, load: float) -> Pressed:
    """Return the result of the model at `load` (N)."""
    contact, phases = contact_on(kind, texture), np.arange(PHASES) / PHASES
    first, z = contact.approach(phases, 0.0)[0], contact.approach(phases, load)[0]
    touching = contact.measure(phases, z, load)[1]
    return Pressed.of_phases(touching * contact.geometry.contact_length * contact.width_at(load), first, z)


def on_half_space(kind: str, texture: Section | None, load: float) -> Pressed:
    """Return the result of the same ridges on a half-space at `load` (N)."""
    contact = contact_on(kind, texture)
    x, y, finger = half_space_finger(kind, contact, load)
    size, period = (len(x) * (x[1] - x[0]), len(y) * (y[1] - y[0])), contact.geometry.texture_period
    turns = np.arange(1 if texture is None else PHASES) / PHASES
    under = [finger + contact.geometry.texture(x - turn * period)[:, np.newaxis] for turn in turns]
    area, z = np.transpose(list(pressed_half_space(under, size, contact.stiffness.contact_modulus, load)))
    return Pressed.of_phases(area, np.array([np.max(heights) for heights in under]), z)


def half_space_finger(kind: str, contact: Contact, load: float) -> tuple[Real, Real, Real]:
    """Return x and y (m) and the heights (m) [x, y] of the finger, where it can touch at `load` (N)."""
    length = contact.geometry.contact_length
    reach = length if kind == "comb" else REACH * length * (load / REFERENCE_LOAD) ** (1.0 / 3.0)
    x, y = (reach * ((np.arange(n) + 0.5) / n - 0.5) for n in (COLUMNS[kind], ROWS[kind]))
    if not isinstance(contact, FingertipContact):
        return x, y, np.repeat(contact.geometry.finger(x)[:, np.newaxis], len(y), axis=1)
    depth = half_space_depth(contact)
    apart = (x[:, np.newaxis] ** 2 + y[np.newaxis] ** 2) / (0.5 * length) ** 2
    return x, y, contact.field.heights(x, y) - depth * apart


def half_space_depth(contact: Contact) -> float:
    """Return the height (m) of the paraboloid of a fingertip on a half-space, from its top to the edge of L0."""
    return 3.0 * REFERENCE_LOAD / (4.0 * contact.stiffness.contact_modulus * contact.geometry.contact_length)


def pressed_half_space(
    surfaces: Iterable[Real], size: tuple[float, float], modulus: float, load: float
) -> Iterator[tuple[float, float]]:
    """Yield the area that touches (m^2) and z (m) of a half-space that is pressed by each of some rigid surfaces.

    surfaces: the heights of each, m [x, y], over `size` (m). A surface is solved from the forces of the one before.
    modulus: contact modulus E*, Pa.
    load: N.
    """
    from ContactMechanics import FreeFFTElasticHalfSpace
    from ContactMechanics.Optimization import constrained_conjugate_gradients
    from SurfaceTopography import Topography

    silent = SimpleNamespace(pr=lambda *_told: None, st=lambda *_told, **_how: None)  # its own reads the call stack
    forces = None
    for heights in surfaces:
        solid, surface = FreeFFTElasticHalfSpace(heights.shape, modulus, size), Topography(heights, size)
        found = constrained_conjugate_gradients(
            solid,
            surface,
            external_force=load,
            initial_forces=forces,
            pentol=1e-4 * float(np.std(heights)),
            maxiter=10_000,
            logger=silent,
        )
        assert found.success, found.message
        inside = found.jac[: heights.shape[0], : heights.shape[1]]
        forces = np.zeros_like(found.x)  # of twice the points along each axis, where nothing touches
        forces[: heights.shape[0], : heights.shape[1]] = -inside
        yield float(np.mean(inside > 0.0)) * math.prod(size), -float(found.offset)


def table() -> Iterator[str]:
    """Yield the rows of the table in docs/fidelity.md; SystemExit without the package that it needs."""
    if find_spec("ContactMechanics") is None:
        raise SystemExit(NEEDED)
    yield "| finger | surface | load, N | area, mm^2 | from first touch, um | peak-to-peak of z, um |"
    yield "| --- | --- | --- | --- | --- | --- |"
    for kind, name, load in itertools.product(COLUMNS, SURFACES, LOADS):
        yield row(kind, name, SURFACES[name], load)


def row(kind: str, name: str, texture: Section | None, load: float) -> str:
    """Return one row, of springs and of a half-space in each cell."""
    springs, solid = on_springs(kind, texture, load), on_half_space(kind, texture, load)
    areas = _cell(1e6 * springs.area, 1e6 * solid.area)
    approaches = _cell(1e6 * springs.approach, 1e6 * solid.approach)
    motions = "" if texture is None else _cell(1e6 * springs.motion, 1e6 * solid.motion)
    return f"| {kind} | {name} | {load:g} | {areas} | {approaches} | {motions} |"


def _cell(springs: float, solid: float) -> str:
    return ", ".join(f"{float(f'{value:.2g}'):g}" for value in (springs, solid))
