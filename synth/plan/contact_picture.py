"""The surfaces of a scene, the height of the finger over them, and where they touch: what is drawn of a contact.

Stage   2 (PLAN), for people: nothing that is heard comes from here.
Model   h(x) = texture(x - p) + finger(x), texture(s) = a2 cos(2 pi s / lambda2 + phi), finger(x) = - a1 cos(2 pi x /
        lambda1) - (x - xc)^2 / (2 R), the parabola of a round finger alone. At phase i of n, p = i lambda2 / n. z is
        that of eq. 1, by the exact solver. They touch where h > z, with k / L newtons a metre for each metre of h - z.
        An edge is where h - z changes its sign between two samples, halved until it stands still. Samples lie
        SAMPLES_A_PERIOD to a period, and on the crests and in the valleys between them.
Source  Fagiani & Barbieri (2016), eqs 1, 2, 4, 5; shapes as in `contact.growing_contact`, `contact.curved_contact`.
Limits  what touches carries the load to 1e-7, of a round or growing finger to 1e-4: it is solved on segments. One load,
        standing still: what moves z with time, or by attraction, is left out and named. x is that of eq. 2,
        so a contact that has grown about the middle of its nominal length begins below 0. Edges err by 1e-9 of a
        sample's distance; a patch or a gap may be missed where h turns twice between two samples.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from synth.arrays import Array
from synth.contact.geometry import Geometry
from synth.contact.load_balance import Contact
from synth.contact.stiffness import Stiffness
from synth.effects.effect import Kind, ShapeEffect
from synth.errors import Fault, InvalidRequest
from synth.plan.effect_choice import asked, effect_called
from synth.plan.preparation import prepare
from synth.response.response_cache import ResponseCache
from synth.scene.effects_section import FrozenMapping
from synth.scene.scene import Scene

POINTS, MOST_POINTS, FEWEST_POINTS = 2048, 8192, 16
PHASES, MOST_PHASES = 256, 1024
MOST_CELLS = 1 << 25  # of the solver, all phases together: some 0.3 s; more would keep others waiting
MOST_PATCHES = 1 << 16  # of all phases together: 3 MB of JSON; more is told as null
MOST_PATCHES_A_PHASE = 1 << 13  # 40 MB of samples
SAMPLES_A_PERIOD = 64  # of h, where patches are sought; fewer would miss narrow ones where two surfaces nearly cancel
CHUNK = 1 << 18  # samples of h held at a time, 2 MB each array
NEAR = 1.0 / 32.0  # of a sample's distance: parabolas through so near heights turn within 1e-9 of where h does
HALVINGS = 30  # of a sample's distance: leaves 1e-9 of it
DIGITS = 9  # of heights and edges as they are told

Phase = list[float]


def picture(
    scene: Scene, points: int | None = None, phases: int | None = None, cache: ResponseCache | None = None
) -> dict[str, Any]:
    """Return the picture of `scene` at the load of its scan, as the JSON document of `/v1/picture`.

    Lengths are in metres, over x of eq. 2. Heights of the texture are over one period, its end left out; those of the
    finger over the contact, both ends in; those of the response are z at each phase. foundation: k / L (N/m^2), None
    at no load. touching: begins and ends of the patches of each phase, rising; None where they are too many. left_out:
    names of effects.
    points: None for POINTS. phases: None for PHASES, or as many as are cheap. Raises InvalidRequest for numbers out of
    range, for phases that would cost too much, and where neither surface has a height; CannotRender for a shape that
    cannot be solved.
    """
    points = POINTS if points is None else points
    _check(points, phases)
    contact = _contact_of(scene, cache)
    load = max(scene.scan.load, 0.0)
    pressed = contact.geometry_at(load)
    nominal = contact.geometry
    length = pressed.contact_length
    begin = 0.0 if length == nominal.contact_length else 0.5 * (nominal.contact_length - length)
    surfaces = Surfaces(nominal, begin, length, contact.dome)
    chosen = _affordable(contact.work_at(load), phases)
    turns = np.arange(chosen) / max(chosen, 1)
    approach = contact.approach(turns, load)[0] if chosen else np.empty(0)
    texture = nominal.texture(np.arange(points) * (nominal.texture_period / points))
    finger = surfaces.finger(np.linspace(begin, begin + length, points))
    touching = patches(surfaces, turns, approach) if load > 0.0 else ([],) * chosen
    return {
        "texture": {"period": nominal.texture_period, "heights": _told(texture)},
        "finger": {"begin": begin, "length": length, "heights": _told(finger)},
        "response": {
            "load": load,
            "foundation": contact.stiffness_at(load) / length if load > 0.0 else None,
            "heights": approach.tolist(),
        },
        "touching": None if touching is None else [_told(edges) for edges in touching],
        "left_out": [name for name in scene.effects if effect_called(name).kind != Kind.SHAPE],
    }


@dataclass(frozen=True, slots=True)
class Surfaces:
    """The two surfaces over begin <= x <= begin + length (m); dome: 1 / R (1/m) about the middle."""

    geometry: Geometry
    begin: float
    length: float
    dome: float

    @property
    def shortest(self) -> float:
        """The shortest period (m) of a surface that has a height."""
        geometry = self.geometry
        both = (geometry.ridge_amplitude, geometry.ridge_period), geometry.equivalent
        return min(period for amplitude, period in both if amplitude > 0.0)

    def finger(self, places: Array) -> Array:
        """Return the finger (m) at x = `places` (m)."""
        from_middle = places - 0.5 * self.geometry.contact_length
        return np.asarray(self.geometry.finger(places) - 0.5 * self.dome * from_middle**2)

    def overlap(self, places: Array, turns: Array, approach: Array) -> Array:
        """Return h - z (m) at x = `places` (m), where the texture has moved by `turns` periods under z = `approach`."""
        moved = places - turns * self.geometry.texture_period
        return np.asarray(self.geometry.texture(moved) + self.finger(places) - approach)


def patches(surfaces: Surfaces, turns: Array, approach: Array) -> tuple[Phase, ...] | None:
    """Return where the surfaces touch at each phase: begin, end, begin, end, ... (m), rising; None for too many.

    turns, approach: [phases], in texture periods and m.
    """
    likely = math.ceil(surfaces.length / surfaces.shortest) + 1  # patches of a phase
    if likely > MOST_PATCHES_A_PHASE or likely * len(turns) > MOST_PATCHES:
        return None
    count = max(4, math.ceil(SAMPLES_A_PERIOD * surfaces.length / surfaces.shortest)) + 1
    found: list[Phase] = []
    rows = max(1, CHUNK // (2 * count))
    for first in range(0, len(turns), rows):
        here = slice(first, first + rows)
        found += _patches(surfaces, turns[here, np.newaxis], approach[here, np.newaxis], count)
    return tuple(found)


def _patches(surfaces: Surfaces, turns: Array, approach: Array, count: int) -> list[Phase]:
    """Return the patches of some phases; turns, approach: [phases, 1]; count: samples over the contact."""
    end = surfaces.begin + surfaces.length
    places, heights = _sampled(surfaces, turns, approach, np.linspace(surfaces.begin, end, count))
    touches = heights > 0.0
    row, left = np.nonzero(touches[:, 1:] != touches[:, :-1])
    low, high = places[row, left], places[row, left + 1]
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        as_low = (surfaces.overlap(middle, turns[row, 0], approach[row, 0]) > 0.0) == touches[row, left]
        low, high = np.where(as_low, middle, low), np.where(as_low, high, middle)
    inner = np.split(0.5 * (low + high), np.searchsorted(row, np.arange(1, len(turns))))
    return [
        [surfaces.begin] * bool(first) + between.tolist() + [end] * bool(last)
        for first, between, last in zip(touches[:, 0], inner, touches[:, -1], strict=True)
    ]


def _sampled(surfaces: Surfaces, turns: Array, approach: Array, samples: Array) -> tuple[Array, Array]:
    """Return x (m) and h - z (m) at `samples` and, behind each but the last, where h turns in the cell that it begins.

    Both are [phases, 2 samples - 1]. Where h does not turn, the sample stands twice. A turning point is that of the
    parabola through a sample and its neighbours, then that of the same through nearer ones.
    """
    step = samples[1] - samples[0]
    heights = surfaces.overlap(samples, turns, approach)
    offset = _vertex(heights[:, :-2], heights[:, 1:-1], heights[:, 2:])
    places, values = (np.empty((len(turns), 2 * len(samples) - 1)) for _ in range(2))
    places[:, 0::2], values[:, 0::2] = samples, heights
    places[:, 1::2], values[:, 1::2] = samples[:-1], heights[:, :-1]
    row, middle = np.nonzero(np.abs(offset) < 1.0)
    part, here, near = offset[row, middle], samples[middle + 1], NEAR * step
    turn, z = turns[row, 0], approach[row, 0]
    around = [surfaces.overlap(here + part * step + shift, turn, z) for shift in (-near, 0.0, near)]
    found = here + part * step + np.clip(_vertex(*around), -1.0, 1.0) * near
    cell = middle + (found >= here)
    found = np.clip(found, samples[cell], samples[cell + 1])
    places[row, 2 * cell + 1], values[row, 2 * cell + 1] = found, surfaces.overlap(found, turn, z)
    return places, values


def _vertex(before: Array, here: Array, behind: Array) -> Array:
    """Return where the parabola through three heights turns, in steps from the middle one; 0 for a straight line."""
    bend = before - 2.0 * here + behind
    rise = 0.5 * (behind - before)
    return np.asarray(np.divide(-rise, bend, out=np.full_like(bend, 0.0), where=bend != 0.0))


def _contact_of(scene: Scene, cache: ResponseCache | None) -> Contact:
    """Return the contact of `scene` in the shape that its plan has."""
    geometry = Geometry.of_scene(scene)
    if geometry.height_scale == 0.0:
        hint = "Give the ridges or the texture a height."
        fault = Fault("/scene/finger/ridge_amplitude", "0.0", "above 0 m where texture.amplitude is 0 m", hint)
        raise InvalidRequest([fault])
    contact = Contact.of(geometry, Stiffness.of_scene(scene))
    shapes = list(asked(scene, Kind.SHAPE))
    if any(auto for _effect, _settings, auto in shapes):
        kept = {effect.name: scene.effects[effect.name] for effect, _settings, _auto in shapes}
        solved = prepare(scene.model_copy(update={"effects": FrozenMapping(kept)}), cache)
        return contact if solved.contact is None else solved.contact
    for effect, settings, _auto in shapes:
        assert isinstance(effect, ShapeEffect)
        contact = effect.shaped(contact, settings)
    return contact


def _affordable(cells: int, phases: int | None) -> int:
    """Return how many phases are solved of a contact of so many cells; InvalidRequest for more than are cheap."""
    most = max(1, MOST_CELLS // cells)
    if phases is None:
        return min(PHASES, most)
    if phases > most:
        hint = "Ask for fewer, or for a coarser surface: this contact holds very many periods."
        raise InvalidRequest([Fault("/phases", str(phases), f"0 to {most} for this scene", hint)])
    return phases


def _check(points: int, phases: int | None) -> None:
    faults = []
    if not FEWEST_POINTS <= points <= MOST_POINTS:
        faults.append(Fault("/points", str(points), f"{FEWEST_POINTS} to {MOST_POINTS}", f"{POINTS} is the default."))
    if phases is not None and not 0 <= phases <= MOST_PHASES:
        faults.append(Fault("/phases", str(phases), f"0 to {MOST_PHASES}", f"{PHASES} is the default."))
    if faults:
        raise InvalidRequest(faults)


def _told(lengths: Any) -> list[float]:
    """Return lengths (m) with DIGITS digits."""
    return [float(f"{length:.{DIGITS}g}") for length in lengths]
