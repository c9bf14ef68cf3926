"""The picture of a contact: the two surfaces, the height of the finger, and the patches in which they touch.

Stage   2 (PLAN), for display only. Rendering does not use it.
Model   The overlap of the surfaces is h(x) - z, with

            h(x) = texture(x - p) + finger(x)
            texture(s) = a2 cos(2 pi s / lambda2 + phi)
            finger(x) = - a1 cos(2 pi x / lambda1) - (x - xc)^2 / (2 R)

        The parabola applies to a round finger only. At phase i of n, p = i lambda2 / n. The exact solver gives z of
        eq. 1. The surfaces touch where h > z; the force per metre of length is k / L times (h - z). The samples of h
        are spaced SAMPLES_A_PERIOD to a period, with one more on each crest and in each valley between them. An edge
        of a patch is where h - z changes sign between two samples. It is found by bisection.
Source  Fagiani & Barbieri (2016), eqs 1, 2, 4, 5; shapes as in `contact.growing_contact`, `contact.curved_contact`.
Limits  The patches carry the load to 1e-7, or to 1e-4 for a round or growing finger, which is solved on segments. The
        picture is for one load and a finger at rest. Effects that change z over time, or by attraction, are left out
        and listed. x is that of eq. 2. A contact grows about the middle of its nominal length, so a grown contact
        begins below 0. Of a fingertip, the picture has the line through its middle, as far as it touches at any
        phase, and a ridge more on both sides; x = 0 is the end of its nominal length. The line is a spline, with an
        error of 2e-12 m, but of up to 0.3 um within 7 um of a kink (the core of a loop or a whorl, the end of a ridge
        of no height). The error of an edge is 1e-9 of the distance between samples. A patch or a gap can be missed
        where h has two extremes between two samples.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from synth.arrays import Array
from synth.contact.geometry import Geometry
from synth.contact.load_balance import Contact
from synth.contact.scene_contact import contact_of
from synth.effects.effect import Kind, ShapeEffect
from synth.errors import Fault, InvalidRequest
from synth.plan.effect_choice import asked, effect_called
from synth.plan.prepare import prepare
from synth.response_cache import ResponseCache
from synth.scene.effects_section import FrozenMapping
from synth.scene.scene import Scene

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline

    from synth.contact.fingertip import FingertipContact

POINTS, MOST_POINTS, FEWEST_POINTS = 2048, 8192, 16
PHASES, MOST_PHASES = 256, 1024
MOST_CELLS = 1 << 25  # solver cells of all phases, about 0.3 s; more would delay other requests
MOST_PATCHES = 1 << 16  # patches of all phases, 3 MB of JSON; for more, the picture has null
MOST_PATCHES_A_PHASE = 1 << 13  # 40 MB of samples
SAMPLES_A_PERIOD = 64  # samples of h per period; fewer would miss narrow patches where two surfaces nearly cancel
KNOTS_A_RIDGE = 256  # of the line through the middle of a fingertip; they take a tenth of a picture's time
CHUNK = 1 << 18  # samples of h in memory at a time, 2 MB per array
NEAR = 1.0 / 32.0  # of the distance between samples: parabolas through heights so near give an extreme to 1e-9 of it
HALVINGS = 30  # bisections of the distance between samples: leaves 1e-9 of it
DIGITS = 9  # digits of heights and edges in the picture

Phase = list[float]


def picture(
    scene: Scene, points: int | None = None, phases: int | None = None, cache: ResponseCache | None = None
) -> dict[str, Any]:
    """Return the picture of `scene` at the load of its scan, as the JSON document of `/v1/picture`.

    points: number of heights of each surface; None for POINTS.
    phases: number of phases; None for PHASES, or fewer if so many would cost too much.

    The document has lengths in metres, over x of eq. 2:
    texture: heights over one period, without its end.
    finger: heights over the contact, with both ends.
    response: heights z at each phase, and the foundation k / L (N/m^2), which is None at zero load.
    touching: the rising begins and ends of the patches of each phase; None if there are too many patches.
    left_out: the names of effects that are not in the picture.

    Raises InvalidRequest for numbers out of range, for phases that would cost too much, and if neither surface has a
    height. Raises SceneError, with pointers into the scene, for a shape that cannot be solved.
    """
    points = POINTS if points is None else points
    _check(points, phases)
    contact = _contact_of(scene, cache)
    load = max(scene.scan.load, 0.0)
    pressed = contact.geometry_at(load)
    nominal = contact.geometry
    surfaces = surfaces_of(contact, pressed.contact_length)
    chosen = _affordable(contact.work_at(load), phases)
    turns = np.arange(chosen) / max(chosen, 1)
    approach = contact.approach(turns, load)[0] if chosen else np.empty(0)
    texture = nominal.texture(np.arange(points) * (nominal.texture_period / points))
    touching = patches(surfaces, turns, approach) if load > 0.0 else ([],) * chosen
    begin, length = surfaces.shown(touching)
    finger = surfaces.finger(np.linspace(begin, begin + length, points))
    return {
        "texture": {"period": nominal.texture_period, "heights": _rounded(texture)},
        "finger": {"begin": begin, "length": length, "heights": _rounded(finger)},
        "response": {
            "load": load,
            "foundation": contact.stiffness_at(load) / pressed.contact_length if load > 0.0 else None,
            "heights": approach.tolist(),
        },
        "touching": None if touching is None else [_rounded(edges) for edges in touching],
        "left_out": [name for name in scene.effects if effect_called(name).kind != Kind.SHAPE],
    }


@dataclass(frozen=True, slots=True)
class Surfaces:
    """The two surfaces over begin <= x <= begin + length.

    geometry: the nominal contact.
    begin: first x of the contact, m.
    length: length of the contact, m.
    dome: curvature 1 / R of the finger about the middle, 1/m.
    """

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
        """Return the height of the finger (m) at x = `places` (m)."""
        from_middle = places - 0.5 * self.geometry.contact_length
        return np.asarray(self.geometry.finger(places) - 0.5 * self.dome * from_middle**2)

    def shown(self, touching: tuple[Phase, ...] | None) -> tuple[float, float]:
        """Return begin and length (m) of the contact in the picture. touching: the result of `patches`."""
        return self.begin, self.length

    def overlap(self, places: Array, turns: Array, approach: Array) -> Array:
        """Return h - z (m).

        places: x, m.
        turns: displacement of the texture, texture periods.
        approach: z, m.
        """
        moved = places - turns * self.geometry.texture_period
        return np.asarray(self.geometry.texture(moved) + self.finger(places) - approach)


@dataclass(frozen=True, slots=True)
class MiddleLine(Surfaces):
    """The two surfaces along the line of a fingertip through its middle.

    line: height of the fingertip (m) over x (m), a spline: reading the field of ridges at every sample is too slow.
    """

    line: CubicSpline

    @classmethod
    def of_tip(cls, tip: FingertipContact) -> MiddleLine:
        """Return the surfaces over all points of `tip`; x = 0 is the end of its nominal length."""
        from scipy.interpolate import CubicSpline

        from synth.contact.footprint import REACH

        nominal = tip.geometry.contact_length
        length, begin = REACH * nominal, 0.5 * nominal * (1.0 - REACH)
        count = math.ceil(KNOTS_A_RIDGE * length / tip.field.period) + 1
        places = np.linspace(begin, begin + length, count)
        line = CubicSpline(places, tip.middle_line(places - 0.5 * nominal))
        return cls(tip.geometry, begin, length, 0.0, line)

    def finger(self, places: Array) -> Array:
        """Return the height of the fingertip (m) at x = `places` (m)."""
        return np.asarray(self.line(places))

    def shown(self, touching: tuple[Phase, ...] | None) -> tuple[float, float]:
        """Return begin and length (m) of what touches at any phase, with a ridge on both sides; all if nothing does."""
        found = [phase for phase in touching or () if phase]
        if not found:
            return self.begin, self.length
        ridge = self.geometry.ridge_period
        begin = max(self.begin, min(phase[0] for phase in found) - ridge)
        end = min(self.begin + self.length, max(phase[-1] for phase in found) + ridge)
        return begin, end - begin


def surfaces_of(contact: Contact, length: float) -> Surfaces:
    """Return the surfaces of `contact` over the `length` (m) that its solver spans, about the middle."""
    nominal = contact.geometry.contact_length
    if not contact.of_one_line:
        from synth.contact.fingertip import FingertipContact

        if isinstance(contact, FingertipContact):  # a comb on an area is its line y = 0
            return MiddleLine.of_tip(contact)
    return Surfaces(contact.geometry, 0.0 if length == nominal else 0.5 * (nominal - length), length, contact.dome)


def patches(surfaces: Surfaces, turns: Array, approach: Array) -> tuple[Phase, ...] | None:
    """Return the patches of each phase: begin, end, begin, end, ... (m), rising. Return None if there are too many.

    turns: displacement of the texture, texture periods, [phases].
    approach: z, m, [phases].
    """
    likely = math.ceil(surfaces.length / surfaces.shortest) + 1  # patches per phase
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
    """Return the patches of some phases.

    turns, approach: as of `patches`, [phases, 1].
    count: number of samples over the contact.
    """
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
    """Return x (m) and h - z (m) at the samples and at the extremes between them, both [phases, 2 samples - 1].

    Each sample except the last is followed by the extreme of h before the next sample, or, if there is none, by the
    sample itself again. An extreme is that of the parabola through a sample and its neighbours. It is then refined
    with a parabola through nearer points.
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
    """Return the extreme of the parabola through three heights, in steps from the middle one; 0 for a straight line."""
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
    contact = contact_of(scene)
    shapes = list(asked(scene, Kind.SHAPE))
    if any(auto for _effect, _settings, auto in shapes):
        kept = {effect.name: scene.effects[effect.name] for effect, _settings, _auto in shapes}
        solved = prepare(scene.model_copy(update={"effects": FrozenMapping(kept)}), cache)
        return contact if solved.contact is None else solved.whole
    for effect, settings, _auto in shapes:
        assert isinstance(effect, ShapeEffect)
        contact = effect.shaped(contact, settings).covering(scene.scan.load)
    return contact


def _affordable(cells: int, phases: int | None) -> int:
    """Return the number of phases that are solved. Raises InvalidRequest if `phases` would cost too much.

    cells: cells of the solver per phase.
    """
    most = max(1, MOST_CELLS // cells)
    if phases is None:
        return min(PHASES, most)
    if phases > most:
        hint = "Request fewer phases, or choose a coarser surface: this contact contains very many periods."
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


def _rounded(lengths: Any) -> list[float]:
    """Return lengths (m) rounded to DIGITS digits."""
    return [float(f"{length:.{DIGITS}g}") for length in lengths]
