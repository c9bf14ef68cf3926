"""The edge of a band in files: the gain of a frequency, whatever the source of z.

Stage   SAMPLING. `sampling.frame_solver` and `sampling.decimation` read it.
Model   At a band B below that of the rate, a frequency f has the gain erfc((f / B - HALF) / WIDTH) / 2. It is 1 to 1e-3
        up to 0.92 B, and below 1e-3 from B on. In time the filter is a sinc under the window exp(-(pi WIDTH B t)^2).
        Where only the rate limits the band, at B = 0.40 of it, the gain is that of FULL_HALF and FULL_WIDTH: 1 to 1e-9
        up to 0.40 of the rate, and below 1e-9 above 0.49.
Source  design, section 4: a constant scan has no component at B or above, so no other source may have one either. HALF
        and WIDTH are this project's choice. A steeper edge rings longer: files look 2 / (WIDTH B) ahead and back.
Limits  The series of a constant scan ends at B abruptly: it keeps in full what lies between 0.92 B and B.
"""

from __future__ import annotations

from synth.scene.output_section import BAND

HALF, WIDTH = 0.96, 0.018  # of the band: half amplitude, and width of the edge
FULL_HALF, FULL_WIDTH = 0.445, 0.0105  # parts of the rate, where it limits the band
WHOLE_TO = 0.92  # of the band: up to here the gain is 1 to 1e-3


def edge_of(scale: float) -> tuple[float, float]:
    """Return half amplitude and width of the edge, as parts of the rate.

    scale: the band, as a part of the whole band of the rate.
    """
    return (FULL_HALF, FULL_WIDTH) if scale >= 1.0 else (HALF * BAND * scale, WIDTH * BAND * scale)
