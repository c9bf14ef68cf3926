"""The heights of a set of maps: the height of a displacement map from the slopes of a normal map.

Stage   SURFACES, from files.
Model   Slopes have no unit, so a normal map gives heights in pixels. The displacement d has another unit, in which a
        pixel is unknown. The factor s makes the slopes of s d nearest to those of the normals (least squares):

            s = sum q^2 Re(conj(D) N) / sum q^2 |D|^2

        over the waves q of both maps that are longer than 16 pixels, or than 8 if these have a smaller residual. D and
        N are the Fourier series of d and of the integrated normals. The residual is the rms of the slopes that s d
        leaves, relative to those of the normals. The level of d has no influence: mid-grey or black may be zero.
        Where the name does not say whether green points up, the direction with the smaller residual is taken: of the
        fit, or, without a displacement, of the integration.
Source  Least squares; integration: `normal_map`.
Limits  Shorter waves are left out of the fit: there the noise of JPEG is as large as the slopes, and programs that make
        normals of a displacement smooth it. With 8 pixels alone the heights of gentle JPEG maps (rms slope 0.02) would
        be 8 % too small, with 16 they are 2 %.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from synth.surfaces.readers.normal_map import integrated
from synth.surfaces.readers.surface_file import Heights, Slopes, refuse_file

LONGER = (16.0, 8.0)  # pixels: the slopes of central differences are 3 and 10 % too small there
WORST = 0.9  # residual from which two maps have nothing in common; 1 is no correlation at all
DOUBTFUL = 0.5  # of the residual: the other direction of green explains a map so much better that a note tells


@dataclass(frozen=True, eq=False)
class FoundHeights:
    """Heights in pixels.

    heights: about their mean [rows, columns].
    green: "up" or "down", as the normals were read.
    curl: the part of the normals' slopes that no heights have, as rms relative to all.
    residual: of the fit of a displacement map, or None.
    notes: sentences for the user.
    """

    heights: Heights
    green: str
    curl: float
    residual: float | None
    notes: tuple[str, ...] = ()


def of_normals(slopes: tuple[Slopes, Slopes], green: str) -> FoundHeights:
    """Return the heights of a normal map alone. slopes: along x and down the rows, as if green pointed up."""
    along, down = slopes
    heights, up_curl, down_curl = integrated(along, down, (1.0, 1.0))
    curls = {"up": up_curl, "down": down_curl}
    known = green or min(curls, key=lambda one: curls[one])
    if known == "down":
        heights = integrated(along, -down, (1.0, 1.0))[0]
    other = curls["down" if known == "up" else "up"]
    notes = [] if green else [f"The name of the normal map does not say where green points. It was read as {known}"]
    if green and other < DOUBTFUL * curls[known]:
        notes.append(
            f"No surface has {100.0 * curls[known]:.2g} % of the slopes, and {100.0 * other:.2g} % if green pointed "
            f"{'down' if known == 'up' else 'up'}: the name of the normal map may be wrong"
        )
    return FoundHeights(heights, known, curls[known], None, tuple(notes))


def of_both(displacement: Heights, slopes: tuple[Slopes, Slopes], green: str) -> FoundHeights:
    """Return the heights of a displacement map with the factor that the normals give.

    Raises InvalidRequest for maps of different shapes, and for maps that contradict each other.
    """
    if displacement.shape != slopes[0].shape:
        shapes = " and ".join(f"{shape[1]} x {shape[0]}" for shape in (displacement.shape, slopes[0].shape))
        hint = "Download both with the same number of pixels, or remove one of the two."
        refuse_file(f"a displacement map and a normal map of {shapes} pixels", "maps of one size", hint)
    tried = [of_normals(slopes, one) for one in ((green,) if green else ("up", "down"))]
    fits = [fitted(displacement, one.heights) for one in tried]
    best = min(range(len(fits)), key=lambda number: fits[number][1])
    (factor, residual), normals = fits[best], tried[best]
    if not (factor > 0.0 and residual < WORST):
        hint = "Are they of one material, and of one set? Write height to use the displacement map alone."
        value = f"normals and displacement that contradict each other ({100.0 * residual:.0f} % of the slopes differ)"
        refuse_file(value, "maps of one surface", hint)
    heights = factor * (displacement - np.mean(displacement))
    return FoundHeights(heights, normals.green, normals.curl, residual, normals.notes if green else ())


def fitted(displacement: Heights, heights: Heights) -> tuple[float, float]:
    """Return the factor that brings the slopes of a displacement map nearest to those of `heights`, and the residual.

    The factor is 0 and the residual 1 where one of the two is flat.
    """
    rows, columns = heights.shape
    of_x, of_y = np.fft.rfftfreq(columns), np.fft.fftfreq(rows)[:, np.newaxis]
    square = of_x**2 + of_y**2
    one, two = np.fft.rfft2(displacement), np.fft.rfft2(heights)
    found = [(0.0, 1.0)]
    for longer in LONGER:
        weight = 2.0 * square * (square <= longer**-2)
        weight[:, 0] *= 0.5
        own, both = float(np.sum(weight * np.abs(one) ** 2)), float(np.sum(weight * (one.conj() * two).real))
        other = float(np.sum(weight * np.abs(two) ** 2))
        if own * other:
            found.append((both / own, math.sqrt(max(0.0, 1.0 - both**2 / (own * other)))))
    return min(found, key=lambda one: one[1])
