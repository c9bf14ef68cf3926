"""A measured vibration beside the model's: the lines of both, the speed that fits, and the level of each line.

Stage   STUDY.
Model   The fundamental of the recording is searched around speed over period, and gives the speed that fits. The
        model's lines at that speed (`steady_outcome`, `simulated_outcome`) are set beside the lines that are found.
        Where the scale of the recording is not known, one gain is chosen: the median of the differences in dB over the
        lines that are found.
Source  Welch spectra and the rule for lines: `line_search`.
Limits  A steady scan on a texture. What the model leaves out, such as the resonance of a sensor, is in the differences.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from synth.arrays import Array
from synth.errors import Fault, InvalidRequest, shown
from synth.scene.merge import merge_patch
from synth.scene.scene import Scene, parse_scene, scene_document
from synth.study.line_search import (
    LOBE,
    Line,
    Spectrum,
    beside_mains,
    fundamental_of,
    lines_at,
    mean_fundamental,
    segment_of,
    spectrum_of,
    spread_of,
)
from synth.study.recording_doubts import MAINS, clipping_of, pause_of
from synth.study.simulated_outcome import FORCE, force_lines
from synth.study.steady_outcome import outcome_of
from synth.study.variables import QUANTITIES

COMPARED = (*QUANTITIES, FORCE)
SEARCH = 0.15  # of the stated speed, to each side
MOST_LINES, PHASES = 64, 1024
FEWEST = 256  # samples of a recording
PERIODS = 2.0  # of the texture, over which the level of a pause is taken at least
ABSENT = 1e-3  # of the strongest line of the model: weaker ones are rounding, or cancelled by the ridges of a comb
STEADY = 0.5  # part of the recording that has most of its power; less is told
OTHER_SPEEDS = (0.95, 1.05, 0.9, 1.1, 0.85, 1.15, 0.8, 1.2)  # over the stated one: nearest first
OFF = 0.005  # of the speed: a larger difference is told


@dataclass(frozen=True, slots=True)
class Compared:
    """One line: as it was measured, and the model's amplitude and the difference (dB), None where there is none."""

    measured: Line
    model: float
    difference: float | None


@dataclass(frozen=True, slots=True)
class Comparison:
    """A recording beside a scene.

    name: of the recording. quantity: of COMPARED. rate: Hz.
    stated_speed, speed: of the scene, and the one that fits, m/s; None where no line is found.
    gain: dB that is added to the recording; None: its scale is known, or nothing can be compared.
    lines: compared lines. spectrum: of the recording, without the gain.
    warnings: sentences.
    """

    name: str
    quantity: str
    rate: float
    stated_speed: float
    speed: float | None
    gain: float | None
    lines: tuple[Compared, ...]
    spectrum: Spectrum
    warnings: tuple[str, ...]

    def document(self) -> dict[str, Any]:
        """Return the comparison as JSON, without its spectrum."""
        lines = [
            asdict(one.measured)
            | {"model": None if math.isnan(one.model) else one.model, "difference_db": one.difference}
            for one in self.lines
        ]
        plain = {name: getattr(self, name) for name in ("name", "quantity", "rate", "stated_speed", "speed")}
        return plain | {"gain_db": self.gain, "lines": lines, "warnings": list(self.warnings)}


def compared(
    scene: Scene, values: Array, rate: float, quantity: str, name: str, *, scaled: bool, told: tuple[str, ...] = ()
) -> Comparison:
    """Return a recording beside `scene`.

    values: one channel, SI if `scaled`. rate: Hz. quantity: one of COMPARED. told: warnings about its file.
    Raises InvalidRequest for a quantity or a recording that cannot be compared, SceneError as `outcome_of` does.
    """
    _check(values, rate, quantity, scene)
    stated = abs(scene.scan.speed)
    centre = stated / scene.texture.period
    spectrum, warnings = spectrum_of(values - np.mean(values), rate), [*told, *clipping_of(values)]
    if pause := pause_of(values, rate, PERIODS / centre, segment_of(len(values), rate)):
        warnings.append(pause)
    elif spectrum.steady < STEADY:
        part = 100.0 * spectrum.steady
        warnings.append(f"The level varies: most of the power is in {part:.2g} % of the recording. Cut it to the scan.")
    top = min(scene.output.bandwidth_hz, 0.45 * rate)
    count = max(1, min(MOST_LINES, int(top / centre)))
    fundamental, tried, measured, spread = _lines(spectrum, centre, count)
    if not any(one.found for one in measured):
        expected = lines_at(spectrum, centre, count, tried)
        lines, why = tuple(Compared(one, math.nan, None) for one in expected), _why_none(spectrum, expected, stated)
        return Comparison(name, quantity, rate, stated, None, None, lines, spectrum, (*warnings, why))
    warnings += spread
    speed = fundamental * scene.texture.period
    if abs(speed - stated) > OFF * stated:
        off = 100.0 * (speed / stated - 1.0)
        fits = f"The lines fit a speed of {1e3 * speed:.4g} mm/s, {off:+.2g} % off the stated one"
        warnings.append(f"{fits}: the speed, the period or the rate of the recording is another.")
    document = merge_patch(scene_document(scene), {"scan": {"speed": speed}, "output": {"bandwidth": "full"}})
    sizes = _model(parse_scene(document), quantity, fundamental, count)
    modelled = sizes > ABSENT * np.max(sizes)
    differences = [
        20.0 * math.log10(one.amplitude / size) if one.found and has and one.amplitude > 0.0 else None
        for one, size, has in zip(measured, sizes.tolist(), modelled.tolist(), strict=True)
    ]
    absent = [str(one.number) for one, has in zip(measured, modelled.tolist(), strict=True) if one.found and not has]
    if absent:
        which = f"Line {absent[0]} is" if len(absent) == 1 else f"Lines {', '.join(absent[:-1])} and {absent[-1]} are"
        warnings.append(f"{which} not in the model (60 dB below its strongest line, or less), and not compared.")
    gain = None
    if not scaled:
        known = [one for one in differences if one is not None]
        gain = -float(np.median(known)) if known else None
        differences = [None if one is None else one + (gain or 0.0) for one in differences]
        if gain is None:
            warnings.append("No line of the model is found, so no gain is fitted.")
    lines = tuple(Compared(*pair) for pair in zip(measured, sizes.tolist(), differences, strict=True))
    return Comparison(name, quantity, rate, stated, speed, gain, lines, spectrum, tuple(warnings))


def _lines(spectrum: Spectrum, centre: float, count: int) -> tuple[float, int, list[Line], list[str]]:
    """Return the fundamental (Hz), how many were tried around `centre`, its lines, and a sentence where they spread."""
    fundamental, tried = fundamental_of(spectrum, (1.0 - SEARCH) * centre, (1.0 + SEARCH) * centre, count)
    measured = lines_at(spectrum, fundamental, count, tried)
    if not spread_of(spectrum, measured):
        return fundamental, tried, measured, []
    fundamental = mean_fundamental(spectrum, fundamental, measured)
    measured = lines_at(spectrum, fundamental, count, tried)
    return fundamental, tried, measured, [_spread(spread_of(spectrum, measured))]


def _spread(worst: tuple[Line, float] | None) -> str:
    """Return a sentence on lines that are spread; worst: the line that loses most, and its loss (dB)."""
    lost = "those of high numbers are too low"
    if worst is not None:
        lost = f"line {worst[0].number} is at least {worst[1]:.1f} dB too low"
    varied = "The speed or the level varied, and the fitted speed is a mean."
    return f"The lines are spread: {lost}, and near ones mix. {varied} Cut the recording to a part of even speed."


def _why_none(spectrum: Spectrum, expected: list[Line], stated: float) -> str:
    """Return a sentence on a recording without lines. expected: its lines at the stated speed (m/s)."""
    near, mains = LOBE * spectrum.bin, " and ".join(f"{base:g}" for base in MAINS)
    left_out = [str(one.number) for one in expected if one.mains]
    ends = "the speed is not fitted, and nothing is compared."
    if len(left_out) < len(expected):
        which = f" (of the stated speed, number {', '.join(left_out)})" if left_out else ""
        return f"No line stands out of the noise, beside multiples of {mains} Hz, left out as mains hum{which}: {ends}"
    count = np.arange(1, len(expected) + 1)
    others = [float(f"{stated * part:.2g}") for part in OTHER_SPEEDS]
    hum = [np.mean(beside_mains(np.asarray(expected[0].frequency * one / stated * count), near)) for one in others]
    found = f"Every line of the stated speed, {expected[0].frequency:.4g} Hz and its multiples, is"
    says = f"{found} within {near:.2g} Hz of a multiple of {mains} Hz, and left out as mains hum: {ends}"
    return f"{says} Record at another speed, such as {1e3 * others[int(np.argmin(hum))]:g} mm/s."


def _model(scene: Scene, quantity: str, fundamental: float, count: int) -> Array:
    """Return the amplitudes of the model's lines, SI."""
    if quantity == FORCE:
        return force_lines(scene, count)
    lines = outcome_of(scene, PHASES, count)["line_amplitude"]
    return np.asarray(lines * (2.0 * math.pi * fundamental * np.arange(1, count + 1)) ** QUANTITIES.index(quantity))


def _check(values: Array, rate: float, quantity: str, scene: Scene) -> None:
    faults = []
    if quantity not in COMPARED:
        allowed = f"one of {', '.join(COMPARED)}"
        faults.append(Fault("/quantity", shown(quantity), allowed, "Write the quantity of the recording."))
    if values.ndim != 1 or len(values) < FEWEST or not np.all(np.isfinite(values)):
        allowed = f"one channel of at least {FEWEST} finite samples"
        faults.append(Fault("/recording", f"an array of shape {values.shape}", allowed, "Choose a channel."))
    if not 10.0 <= rate <= 1e7:
        faults.append(Fault("/rate", shown(rate), "10 to 10,000,000 Hz", "Write the sample rate of the recording."))
    if scene.scan.speed == 0.0:
        faults.append(Fault("/scan/speed", "0", "a speed other than 0", "Write the speed of the measurement."))
    if faults:
        raise InvalidRequest(faults)
