"""Normal maps: images whose colours are the normals of a surface. Their slopes are integrated to heights.

Stage   SURFACES, from files.
Model   A colour c is the unit vector n = 2 c - 1, with red along x, green along y and blue outwards. The slopes
        -n_x / n_z and -n_y / n_z have no unit, so the unit of the heights is the distance between pixels. One division
        in the Fourier domain gives the heights whose slopes are nearest to those of the map (least squares). Green
        points up in the image, as in glTF and OpenGL, or down, as in DirectX. It is read as up.
        JPEG with chroma 4:2:0 keeps the luma Y = 0.299 R + 0.587 G + 0.114 B of each pixel. The differences R - Y,
        G - Y and B - Y are means over 2 x 2 pixels, which the decoder interpolates. So a wave of them is multiplied by
        L = cos(qx / 2)^4 cos(qy / 2)^4, q in radians a pixel: one cosine is the mean, three the interpolation. Red and
        green are slopes times -1 and 1. A wave H of the heights has in them

            R = (L r + (1 - L) u) i H,   G = (L g + (1 - L) u) i H,   r = -qx, g = qy, u = 0.299 r + 0.587 g.

        H is found by least squares. What the decoded slopes have beside it is kept, as far as no heights have it: the
        residual of `integrated` stays what it is.
Source  Frankot & Chellappa 1988, A method for enforcing integrability in shape from shading
        algorithms, IEEE PAMI 10(4). ITU-T T.871 (JFIF): the luma. The interpolation, of 3/4 and 1/4, is that of libjpeg
        and libwebp. The rest is algebra.
Limits  The heights are periodic over the map, as tiles are, and have no mean slope. The residual is the part of the
        slopes that no heights can have, as rms relative to all slopes. Slopes above STEEPEST are clipped. 8 bits are
        0.4 % of a slope. Colours are restored exactly for small slopes. Waves that are folded at the half resolution
        stay. Where both factors nearly vanish, H is held by LEAST. Errors: docs/import.md, measured by
        tests/synth/surfaces/maps/test_halved_colours.py.
"""

from __future__ import annotations

from typing import Any, NoReturn

import numpy as np

from synth.surfaces.readers.surface_file import Heights, Slopes, SurfaceFile, refuse_file

STEEPEST = 20.0  # the largest slope of a texture; larger ones are noise of vectors that are parallel to the surface
UNIT_WITHIN = 0.1  # permitted error of a vector's length: 8 bits alone give 0.007, and compression more
MOST_OTHER = 0.05  # permitted share of pixels that are not unit vectors, such as dust and borders of a map
NEARLY_WITHIN, MOST_FAR = 0.3, 0.2  # the same of a map whose name says what it is: colours of JPEG are means of 2 x 2
RED, GREEN = 0.299, 0.587  # of the luma
LEAST = 0.15  # of r^2 + g^2: least denominator. With 0.05 the noise of JPEG raises the rms slope by 5 %
NOTE = (
    "It keeps its colours at half the resolution. They were restored, but waves of 2 to 4 pixels are wrong by some "
    "half of their height (rms). A normal map as PNG has them"
)


def surface_of(
    kind: str,
    pixels: np.ndarray[Any, Any],
    spacing: tuple[float, float] | None,
    notes: tuple[str, ...],
    halved: tuple[bool, bool] = (False, False),
) -> SurfaceFile:
    """Return the heights of a normal map, in units of the distance between columns.

    pixels: whole numbers without sign, [rows, columns, 3], or real numbers from 0 to 1.
    spacing: m, or None. Only its ratio, the aspect of a pixel, affects the heights.
    halved: whether its colours were kept at half the resolution along x, and along the columns.
    Raises InvalidRequest for a picture that is not even nearly a normal map. `check_unit` is stricter.
    """
    if pixels.shape[2] != 3 or pixels.dtype.kind not in "uf":
        refuse_file(f"{kind} with {pixels.shape[2]} channels of {pixels.dtype}", "grey or RGB", "Save it as grey.")
    half = np.float32(np.iinfo(pixels.dtype).max / 2.0 if pixels.dtype.kind == "u" else 0.5)
    across, up, outwards = (pixels[:, :, channel].astype(np.float32) / half - 1.0 for channel in range(3))
    length = np.sqrt(across**2 + up**2 + outwards**2)
    other, far = (
        float(np.mean((np.abs(length - 1.0) > within) | (outwards <= 0.0))) for within in (UNIT_WITHIN, NEARLY_WITHIN)
    )
    if far > MOST_FAR:
        _refuse_colours(other)
    outwards = np.maximum(outwards, 1.0 / STEEPEST)
    along_x = np.clip(-across / outwards, -STEEPEST, STEEPEST)
    down = np.clip(up / outwards, -STEEPEST, STEEPEST)  # rows run down, and green points up
    aspect = 1.0 if spacing is None else spacing[1] / spacing[0]
    heights, residual, of_down = integrated(along_x, down, (1.0, aspect))
    if any(halved):
        along_x, down = restored(along_x, down, aspect, 1.0 if residual <= of_down else -1.0, halved)
        heights, residual, of_down = integrated(along_x, down, (1.0, aspect))
        notes = (*notes, NOTE)
    return SurfaceFile(
        kind,
        "a normal map, with green pointing up",
        heights,
        np.zeros(heights.shape, bool),
        unit="pixel",
        spacing=spacing,
        spacing_unit=None if spacing is None else "m",
        tagged=True,
        notes=(*notes, *_notes(residual, of_down)),
        slopes=(along_x, down),
        not_unit=other,
    )


def _notes(residual: float, of_down: float) -> list[str]:
    notes = [f"No heights have {100 * residual:.2g} % of its slopes (rms), the residual of the integration"]
    if of_down < 0.5 * residual:
        notes.append(
            f"With green pointing down the residual would be {100 * of_down:.2g} %: the map may be for DirectX. "
            "Then invert its green channel"
        )
    return notes


def check_unit(found: SurfaceFile) -> None:
    """Raise InvalidRequest for a picture in colour that may be no normal map, where no name says that it is one."""
    if found.not_unit > MOST_OTHER:
        _refuse_colours(found.not_unit)


def _refuse_colours(other: float) -> NoReturn:
    refuse_file(
        f"a picture in colour ({100 * other:.0f} % of its pixels are not unit vectors)",
        "a grey displacement map, or a normal map",
        "A photograph has no heights. Save a displacement map as grey. A rough normal map in JPEG is read from a "
        "folder of its own, as wall_nor_gl.jpg.",
    )


def integrated(along_x: Slopes, along_y: Slopes, spacing: tuple[float, float]) -> tuple[Heights, float, float]:
    """Return the periodic heights, of mean 0, whose slopes are nearest to the given ones, and two residuals.

    along_x, along_y: slopes [rows, columns], from column to column and from row to row.
    spacing: distance between columns, then rows, in the unit of the heights.
    A residual is the part of the slopes, without their means, that no heights can have, as rms relative to the slopes.
    The first is that of these slopes. The second is that with the opposite sign of along_y.
    """
    rows, columns = along_x.shape
    in_x = 2.0 * np.pi * np.fft.rfftfreq(columns, spacing[0])[np.newaxis, :]
    in_y = 2.0 * np.pi * np.fft.fftfreq(rows, spacing[1])[:, np.newaxis]
    twice = np.full(in_x.shape, 2.0)  # weight of a wave that also represents its negative frequency
    twice[0, 0] = 1.0
    if columns % 2 == 0:
        in_x[0, -1], twice[0, -1] = 0.0, 1.0  # at the Nyquist frequency the slope of a real wave is 0 at all points
    if rows % 2 == 0:
        in_y[rows // 2, 0] = 0.0
    of_x, of_y = np.fft.rfft2(along_x), np.fft.rfft2(along_y)
    square = in_x**2 + in_y**2
    flat = square == 0.0
    square[flat] = np.inf
    # A wave of heights has no slope along its crests. So the residual is the part of the slopes along the crests.
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


def restored(
    along_x: Slopes, down: Slopes, aspect: float, green: float, halved: tuple[bool, bool]
) -> tuple[Heights, Heights]:
    """Return the slopes of a normal map along x and down the rows, both as they would be read with green up.

    along_x, down: as decoded [rows, columns]. aspect: height of a pixel in its widths.
    green: 1.0: it points up; -1.0: down. halved: whether the colours were halved along x, and along the columns.
    """
    of_x, of_y = np.fft.rfftfreq(along_x.shape[1])[np.newaxis, :], np.fft.fftfreq(along_x.shape[0])[:, np.newaxis]
    kept = np.cos(np.pi * of_x) ** (4 * halved[0]) * np.cos(np.pi * of_y) ** (4 * halved[1])
    in_red = np.where(of_x < 0.5, -of_x, 0.0)  # at the Nyquist frequency the slope of a real wave is 0 at all points
    in_green = np.where(np.abs(of_y) < 0.5, green * of_y / aspect, 0.0)
    square = in_red**2 + in_green**2
    square[square == 0.0] = np.inf
    luma = (1.0 - kept) * (RED * in_red + GREEN * in_green)
    model_red, model_green = kept * in_red + luma, kept * in_green + luma
    red, green_of = np.fft.rfft2(-along_x), np.fft.rfft2(down)
    waves = (model_red * red + model_green * green_of) / np.maximum(model_red**2 + model_green**2, LEAST * square)
    red -= model_red * waves
    green_of -= model_green * waves
    waves -= (in_red * red + in_green * green_of) / square
    shape = along_x.shape
    return -np.fft.irfft2(red + in_red * waves, s=shape), np.fft.irfft2(green_of + in_green * waves, s=shape)
