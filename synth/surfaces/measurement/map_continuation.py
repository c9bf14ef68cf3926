"""How a set of maps goes on below its pixel: the Hurst exponent and the shortest of its synthetic waves.

Stage   SURFACES, from files.
Model   The level of the synthetic waves is that of the map's own at its pixel (`pixel_spectrum`). One number is left,
        the Hurst exponent. It is given, or follows from an rms slope that is given, or from the roughness map: alpha =
        roughness^2 is the rms slope, in two dimensions, of the facets that scatter light. That is alpha / sqrt(2) along
        each axis. The spectrum has this slope from the pixel down to FACETS.
Source  Beckmann & Spizzichino 1963: slopes are Gaussian, and alpha^2 = 2 <slope^2> of each axis. alpha = roughness^2:
        glTF 2.0, appendix B. FACETS is this project's.
Limits  alpha is tuned by eye in many sets. What it gives is an upper bound on the slopes that a finger meets. It is one
        number for the whole map.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from synth.errors import InvalidRequest
from synth.scene.quantity import Dimension, show_quantity
from synth.surfaces.continued import (
    MOST_POINTS,
    POINTS_A_WAVE,
    SHORTEST,
    Continuation,
    finest_of,
    grids,
    level_of,
    shortest_that_fits,
    slope_sums,
    synthetic_slope,
)
from synth.surfaces.measurement.import_options import ImportOptions
from synth.surfaces.measurement.import_units import option_fault
from synth.surfaces.pixel_spectrum import hurst_of, slope_down_to
from synth.surfaces.readers.surface_file import Heights
from synth.surfaces.surface_data import SurfaceData

FACETS = 1e-6  # m; unverified default: the shortest wave that scatters light as a facet, some two wavelengths of light
WITHIN = 1e-3  # of a slope: an asked one that is farther from the range is refused
FINEST = 2.2  # pixels: a note tells of a map whose waves end at longer ones
NEARLY = 1.1  # times SHORTEST: a note tells of longer ones
ROUNDED = 4  # digits of a Hurst exponent: the slope changes by less than 1e-3

Found = tuple[dict[str, Any] | None, list[str]]


def continuation(heights: Heights, pixel: float, ends: str, options: ImportOptions, alpha: float | None) -> Found:
    """Return the synthetic waves below the pixel, as the report has them, or None; and notes about them.

    heights: m, with distances of `pixel` (m). ends: "join" or "mirror".
    alpha: of the roughness map, or None.
    Raises InvalidRequest for an rms slope that no self-affine spectrum from this pixel on has, and for waves that are
    too short for the size of the map.
    """
    data = SurfaceData(heights.astype(np.float32), (pixel, pixel))
    shortest = _shortest(data, ends, options)
    if options.slope == 0.0:
        return None, []
    if options.slope is None and options.hurst is None and alpha is None:
        return None, ["Its waves end at two pixels: the set has no roughness map. hurst or slope continues them"]
    part = f"A part of {_length(_widest_part(pixel, SHORTEST))}"
    is_large = options.shortest is None and shortest > NEARLY * SHORTEST
    if shortest >= POINTS_A_WAVE * pixel * (1.0 - 1e-9):
        reached = f"No waves were added: those of its map reach down to {_length(2.0 * pixel)}"
        return None, [f"{reached}, and the surface is too large for more. {part} has them" if is_large else reached]
    if not level_of(data, ends):
        return None, ["No waves were added: its map is flat at its pixel, and nothing can be continued"]
    hurst, notes = _hurst(data, ends, shortest, options, alpha)
    if (finest := finest_of(data, ends)) > FINEST * pixel:
        gap = f"The map has hardly any waves from {_length(finest)} to {_length(2.0 * pixel)}, two pixels"
        notes.append(f"{gap}: it was enlarged or smoothed. They stay absent. The synthetic waves go on from others")
    one = Continuation(round(hurst, ROUNDED), shortest)
    range_of = " to ".join(f"{synthetic_slope(data, ends, replace(one, hurst=end)):.3g}" for end in (1.0, 0.0))
    slope = synthetic_slope(data, ends, one)
    notes.append(
        f"Its waves from {_length(2.0 * pixel)}, two pixels, to {_length(shortest)} are synthetic: Hurst exponent "
        f"{one.hurst:.3g}, rms slope {slope:.3g} along each axis. "
        f"With exponents from 1 to 0 it would be {range_of} for this map"
    )
    if is_large:
        missing = f"Waves from {_length(shortest)} to {_length(SHORTEST)} are missing, since the surface is too large"
        notes.append(f"{missing}. {part} has them")
    source = "roughness map" if options.slope is None and options.hurst is None else "given"
    found = {"longest": 2.0 * pixel, "shortest": shortest, "hurst": one.hurst, "rms_slope": slope, "seed": one.seed}
    return found | {"source": source, "alpha": alpha}, notes


def fields_of(synthetic: dict[str, Any]) -> dict[str, Any]:
    """Return the synthetic waves of a report as fields of a scene's texture."""
    return {f"synthetic_{name}": synthetic[name] for name in ("hurst", "shortest", "seed")}


def _shortest(data: SurfaceData, ends: str, options: ImportOptions) -> float:
    """Return the shortest wave (m): that of the options, or the shortest one that a finger needs and memory permits."""
    if options.shortest is None:
        return shortest_that_fits(data, ends)
    longest = POINTS_A_WAVE * data.spacing[0]
    if options.shortest >= longest * (1.0 - 1e-9):
        allowed = f"less than {_length(longest)}, two pixels: synthetic waves are shorter than those of the map"
        raise InvalidRequest([option_fault("shortest", _length(options.shortest), allowed, "slope 0 adds no waves.")])
    if math.prod(grids(data, ends, options.shortest)[1].counts) > MOST_POINTS:
        allowed = f"{_length(1.001 * _least(data, ends))} at least for a surface of this size"
        hint = f"Write a longer one, or a part of at most {_length(_widest_part(data.spacing[0], options.shortest))}."
        raise InvalidRequest([option_fault("shortest", _length(options.shortest), allowed, hint)])
    return options.shortest


def _least(data: SurfaceData, ends: str) -> float:
    """Return the shortest wave (m) that memory permits."""
    points = math.prod(grids(data, ends, 1e9)[0].counts)
    return POINTS_A_WAVE * data.spacing[0] / max(1, math.floor(math.sqrt(MOST_POINTS / points)))


def _hurst(
    data: SurfaceData, ends: str, shortest: float, options: ImportOptions, alpha: float | None
) -> tuple[float, list[str]]:
    """Return the Hurst exponent, and notes."""
    level = level_of(data, ends)
    if options.hurst is not None:
        return options.hurst, []
    if options.slope is not None:
        sums = slope_sums(data, ends, shortest)
        least, most = sums.slope(level, 1.0), sums.slope(level, 0.0)
        if not least * (1.0 - WITHIN) <= options.slope <= most * (1.0 + WITHIN):
            hint = "Write a slope between them, or hurst in its place, such as 0.8. Slope 0 adds no waves."
            allowed = (
                f"{least:.3g} to {most:.3g} for this map: of the smoothest and the roughest self-affine waves (Hurst "
                "exponents 1 and 0) that begin with the height of the map's own shortest waves"
            )
            raise InvalidRequest([option_fault("slope", f"{options.slope:g}", allowed, hint)])
        return hurst_of(options.slope, lambda one: sums.slope(level, one)), []
    assert alpha is not None
    waves, facets = grids(data, ends, shortest)[0], alpha / math.sqrt(2.0)

    def to_facets(hurst: float) -> float:
        return slope_down_to(level, hurst, waves, FACETS)

    return hurst_of(facets, to_facets), [_by_roughness(alpha, facets, (to_facets(1.0), to_facets(0.0)))]


def _by_roughness(alpha: float, facets: float, ends: tuple[float, float]) -> str:
    """Return a note about the rule of the roughness map. ends: least and greatest slope that the spectrum can have."""
    rule = f"By its roughness map (alpha {alpha:.3g}) the rms slope from the pixel to {_length(FACETS)} is {facets:.3g}"
    if facets < ends[0]:
        rule += f". The map is steeper at its pixel: it goes on with {ends[0]:.3g}, the least"
    elif facets > ends[1]:
        rule += f". From the map's spectrum at its pixel on it is {ends[1]:.3g} at most"
    return f"{rule}: an unverified default, and an upper bound. slope or hurst replaces it"


def _widest_part(pixel: float, shortest: float) -> float:
    """Return the side (m) of the largest part, with mirrored ends, whose waves can reach down to `shortest` (m)."""
    finer = math.ceil(POINTS_A_WAVE * pixel / shortest - 1e-9)
    return (math.isqrt(MOST_POINTS) // finer // 2 + 1) * pixel


def _length(metres: float) -> str:
    return show_quantity(float(f"{metres:.3g}"), Dimension.LENGTH)
