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
    vectors = pixels.astype(np.float64) / 127.5 - 1.0
    length = np.sqrt(np.sum(vectors**2, axis=2))
    other = float(np.mean((np.abs(length - 1.0) > UNIT_WITHIN) | (vectors[:, :, 2] <= 0.0)))
    if other > MOST_OTHER:
        refuse_file(
            f"a picture in colour ({100 * other:.0f} % of its pixels are not unit vectors)",
            "a grey displacement map, or a normal map",
            "A photograph has no heights. Save a displacement map as grey.",
        )
    outwards = np.maximum(vectors[:, :, 2], 1.0 / STEEPEST)
    along_x = np.clip(-vectors[:, :, 0] / outwards, -STEEPEST, STEEPEST)
    down = np.clip(vectors[:, :, 1] / outwards, -STEEPEST, STEEPEST)  # rows run down, and green points up
    aspect = 1.0 if spacing is None else spacing[1] / spacing[0]
    heights, residual = integrated(along_x, down, (1.0, aspect))
    _, of_down = integrated(along_x, -down, (1.0, aspect))
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


def integrated(along_x: Heights, along_y: Heights, spacing: tuple[float, float]) -> tuple[Heights, float]:
    """Return the periodic heights, of mean 0, whose slopes are nearest to the given ones, and the residual.

    along_x, along_y: slopes [rows, columns], along the columns' and the rows' direction.
    spacing: distance between columns, then rows, in the unit of the heights.
    The residual is the rms of what is left of the slopes, less their means, relative to the rms of the slopes.
    """
    rows, columns = along_x.shape
    in_x = 2.0 * np.pi * np.fft.rfftfreq(columns, spacing[0])[np.newaxis, :]
    in_y = 2.0 * np.pi * np.fft.fftfreq(rows, spacing[1])[:, np.newaxis]
    if columns % 2 == 0:
        in_x[0, -1] = 0.0  # the slope of the highest wave is not a real wave on these points
    if rows % 2 == 0:
        in_y[rows // 2, 0] = 0.0
    of_x, of_y = np.fft.rfft2(along_x), np.fft.rfft2(along_y)
    square = in_x**2 + in_y**2
    square[square == 0.0] = np.inf
    waves = -1j * (in_x * of_x + in_y * of_y) / square
    heights = np.fft.irfft2(waves, s=(rows, columns))
    left_x = along_x - np.mean(along_x) - np.fft.irfft2(1j * in_x * waves, s=(rows, columns))
    left_y = along_y - np.mean(along_y) - np.fft.irfft2(1j * in_y * waves, s=(rows, columns))
    size = float(np.mean(along_x**2) + np.mean(along_y**2))
    left = float(np.mean(left_x**2) + np.mean(left_y**2))
    return heights, float(np.sqrt(left / size)) if size else 0.0
