"""Slopes of normal maps whose colours were kept at half the resolution, as in most JPEG pictures.

Stage   SURFACES, from files.
Model   JPEG with chroma 4:2:0 keeps the luma Y = 0.299 R + 0.587 G + 0.114 B of each pixel. The differences R - Y,
        G - Y and B - Y are means over 2 x 2 pixels, which the decoder interpolates. So a wave of them is multiplied by
        L = cos(qx / 2)^4 cos(qy / 2)^4, q in radians a pixel: one cosine is the mean, three the interpolation. Red and
        green are slopes times -1 and 1. A wave H of the heights has in them

            R = (L r + (1 - L) u) i H,   G = (L g + (1 - L) u) i H,   r = -qx, g = qy, u = 0.299 r + 0.587 g.

        H is found by least squares. What the decoded slopes have beside it is kept, as far as no heights have it: the
        residual of `normal_map.integrated` stays what it is.
Source  ITU-T T.871 (JFIF): the luma. The interpolation, of 3/4 and 1/4, is that of libjpeg and libwebp. The rest is
        algebra.
Limits  Exact for small slopes. Waves that are folded at the half resolution stay. Where both factors nearly vanish, H
        is held by LEAST. Errors: docs/import.md, measured by tests/synth/surfaces/maps/test_halved_colours.py.
"""

from __future__ import annotations

import numpy as np

from synth.surfaces.readers.surface_file import Heights, Slopes

RED, GREEN = 0.299, 0.587  # of the luma
LEAST = 0.15  # of r^2 + g^2: least denominator. With 0.05 the noise of JPEG raises the rms slope by 5 %
NOTE = (
    "It keeps its colours at half the resolution. They were restored, but waves of 2 to 4 pixels are wrong by some "
    "half of their height (rms). A normal map as PNG has them"
)


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
