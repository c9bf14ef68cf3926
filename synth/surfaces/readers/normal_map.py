"""Normal maps: colours that are the directions of a surface. The slopes are integrated to heights.

Stage   SURFACES, from files.
Model   A colour c is the unit vector n = 2 c - 1, with red along x, green along y and blue outwards. The slopes
        -n_x / n_z and -n_y / n_z have no unit, so the heights have that of the distance between pixels. The heights
        whose slopes are nearest to those of the map, in the least squares, are found by one division in the Fourier
        domain. Green points up in the image, as in glTF and OpenGL, or down, as in DirectX.
Source  Frankot & Chellappa 1988, A method for enforcing integrability in shape from shading
        algorithms, IEEE PAMI 10(4).
Limits  The heights are periodic over the map, as those of tiles are, and have no mean slope. The residual is the rms
        of the slopes that no heights have, of all slopes. Slopes above STEEPEST are cut. 8 bits are 0.4 % of a slope.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from synth.surfaces.readers.surface_file import Heights, SurfaceFile, refuse_file

Slopes = np.ndarray[Any, np.dtype[Any]]

STEEPEST = 20.0  # the steepest slope of a texture; a steeper one is noise of a vector that lies in the surface
UNIT_WITHIN = 0.1  # of the length of a vector: 8 bits alone give 0.007, and compression more
MOST_OTHER = 0.05  # share of the pixels that may be no unit vectors: dust and borders of a map


def surface_of(
    kind: str,
    pixels: np.ndarray[Any, Any],
    spacing: tuple[float, float] | None,
    notes: tuple[str, ...],
) -> SurfaceFile:
    """Return the heights of a normal map, in distances between columns.

    pixels: uint8 [rows, columns, 3].
    spacing: m, or None. It only decides how much wider than high a pixel is.
    Raises InvalidRequest for a picture that is no normal map.
    """
    across, up, outwards = (pixels[:, :, channel].astype(np.float32) / 127.5 - 1.0 for channel in range(3))
    length = np.sqrt(across**2 + up**2 + outwards**2)
    other = float(np.mean((np.abs(length - 1.0) > UNIT_WITHIN) | (outwards <= 0.0)))
    if other > MOST_OTHER:
        refuse_file(
            f"a picture in colour ({100 * other:.0f} % of its pixels are not unit vectors)",
            "a grey displacement map, or a normal map",
            "A photograph has no heights. Save a displacement map as grey.",
        )
    outwards = np.maximum(outwards, 1.0 / STEEPEST)
    along_x = np.clip(-across / outwards, -STEEPEST, STEEPEST)
    down = np.clip(up / outwards, -STEEPEST, STEEPEST)  # rows run down, and green points up
    aspect = 1.0 if spacing is None else spacing[1] / spacing[0]
    heights, residual, of_down = integrated(along_x, down, (1.0, aspect))
    notes = (*notes, f"No heights have {100 * residual:.2g} % of its slopes (rms), the residual of the integration")
    if of_down < 0.5 * residual:
        notes = (
            *notes,
            f"With green pointing down the residual would be {100 * of_down:.2g} %: the map may be for DirectX. "
            "Then invert its green channel",
        )
    return SurfaceFile(
        kind,
        "a normal map, with green pointing up",
        heights,
        np.zeros(heights.shape, bool),
        unit="pixel",
        spacing=spacing,
        spacing_unit=None if spacing is None else "m",
        tagged=True,
        notes=notes,
    )


def integrated(along_x: Slopes, along_y: Slopes, spacing: tuple[float, float]) -> tuple[Heights, float, float]:
    """Return the periodic heights, of mean 0, whose slopes are nearest to the given ones, and two residuals.

    along_x, along_y: slopes [rows, columns], along the columns' and the rows' direction.
    spacing: distance between columns, then rows, in the unit of the heights.
    A residual is the rms of what no heights have of the slopes, less their means, relative to the rms of the slopes.
    The first is that of these slopes, the second would be that with along_y turned round.
    """
    rows, columns = along_x.shape
    in_x = 2.0 * np.pi * np.fft.rfftfreq(columns, spacing[0])[np.newaxis, :]
    in_y = 2.0 * np.pi * np.fft.fftfreq(rows, spacing[1])[:, np.newaxis]
    twice = np.full(in_x.shape, 2.0)  # waves that stand for their negative frequency too
    twice[0, 0] = 1.0
    if columns % 2 == 0:
        in_x[0, -1], twice[0, -1] = 0.0, 1.0  # the slope of the highest wave is not a real wave on these points
    if rows % 2 == 0:
        in_y[rows // 2, 0] = 0.0
    of_x, of_y = np.fft.rfft2(along_x), np.fft.rfft2(along_y)
    square = in_x**2 + in_y**2
    flat = square == 0.0
    square[flat] = np.inf
    # Across the direction of a wave, heights have no slope: what is left of the slopes is their part across it.
    size = float(np.sum(twice * (np.abs(of_x) ** 2 + np.abs(of_y) ** 2)))
    left, turned = (
        float(np.sum(twice * np.abs(in_y * of_x - sign * in_x * of_y) ** 2 / square)) for sign in (1.0, -1.0)
    )
    flat[0, 0] = False  # the mean slopes
    highest = float(np.sum((twice * (np.abs(of_x) ** 2 + np.abs(of_y) ** 2))[flat]))
    heights = np.fft.irfft2(-1j * (in_x * of_x + in_y * of_y) / square, s=(rows, columns))
    if not size:
        return heights, 0.0, 0.0
    return heights, float(np.sqrt((left + highest) / size)), float(np.sqrt((turned + highest) / size))
