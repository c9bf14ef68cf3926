"""What a study records of a scene: the names of its numbers, with their dimensions, units and descriptions.

Stage   STUDY, the base of the others.
"""

from __future__ import annotations

from dataclasses import dataclass

QUANTITIES = ("displacement", "velocity", "acceleration")
UNITS = ("m", "m/s", "m/s^2")
LINE, QUANTITY = "line", "quantity"


@dataclass(frozen=True, slots=True)
class Variable:
    """One result.

    unit: SI; "" for a ratio. Of a quantity: the power of 1/s by which its unit is m.
    along: its dimension beyond the scenes: LINE, QUANTITY or "".
    """

    name: str
    unit: str
    along: str
    description: str


VARIABLES = (
    Variable("rms", "", QUANTITY, "root mean square over a period"),
    Variable("peak", "", QUANTITY, "largest magnitude over a period"),
    Variable("crest_factor", "", QUANTITY, "peak over rms"),
    Variable("spectral_centroid", "Hz", QUANTITY, "mean frequency of the lines, weighted by their power"),
    Variable("error", "", QUANTITY, "largest error of the waveform, relative to its peak-to-peak"),
    Variable("line_amplitude", "m", LINE, "amplitude of displacement at n times the fundamental"),
    Variable("line_phase", "rad", LINE, "phase of this line over the place of the texture"),
    Variable("fundamental", "Hz", "", "speed over the period of the texture"),
    Variable("contact_fraction", "", "", "part of the contact length that touches, mean over a period"),
    Variable("patches", "", "", "places that touch at a time, mean over a period"),
    Variable("mean_pressure", "Pa", "", "load over the area that touches"),
    Variable("largest_pressure", "Pa", "", "largest pressure in the contact over a period"),
    Variable("ridges", "", "", "tau, eq. 7: contact length over ridge period"),
    Variable("period_ratio", "", "", "Lambda, eq. 7: texture period over ridge period"),
    Variable("amplitude_ratio", "", "", "A, eq. 7: texture amplitude over ridge amplitude"),
    Variable("group_load", "", "", "W, eq. 7: load over k a1 lambda1 / L"),
    Variable("sensation_level", "dB", "", "strongest line of the whole finger over the detection threshold"),
    Variable("sa1_level", "dB", "", "strongest wave of the spatial pattern over the threshold of SA1"),
    Variable("ra_level", "dB", "", "strongest line of the skin's vibration over the threshold of RA"),
    Variable("pc_level", "dB", "", "strongest line of the skin's vibration over the threshold of PC"),
    Variable("sa1_drive", "1/s", "", "rate of the strain of the pattern, behind the low-pass of SA1"),
    Variable("ra_drive", "1/s", "", "rate of the strain of the vibration, behind the low-pass of RA"),
    Variable("pc_drive", "1/s", "", "rate of the strain of the vibration, behind the low-pass of PC"),
    Variable("intensity", "", "", "of the skin's vibration, in thresholds"),
    Variable("pacinian_power", "", "", "of the skin's vibration: sum of (amplitude / threshold of PC)^2"),
    Variable("spatial_variation", "", "", "of the pattern over places, standard deviation in thresholds of SA1"),
    Variable("components", "", "", "lines of RA or PC that are felt beside the others, the larger number"),
)
"""NaN where a number is not known or has no meaning."""


def unit_of(variable: Variable, quantity: int) -> str:
    """Return the unit of a variable; quantity: index in QUANTITIES, for those that depend on it."""
    return UNITS[quantity] if variable.name in ("rms", "peak") else variable.unit


def shape_of(variable: Variable, lines: int) -> tuple[int, ...]:
    """Return the shape of a variable of one scene."""
    return {LINE: (lines,), QUANTITY: (len(QUANTITIES),), "": ()}[variable.along]
