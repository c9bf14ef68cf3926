"""Shared by the tests of whole renders: compares a render in SI units with an oracle."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
from scipy.signal import firwin

from synth import open_voice, parse_scene
from synth.scene.scene import Scene
from synth.voice.voice import Voice
from tests.few import thorough
from tests.reference.moving_oracle import Harmonics
from tests.reference.spectral_checks import WINDOW_PERIODS, fit_harmonics
from tests.synth.engine_cases import QUANTITIES, Real, physical

FITTED = 0.495  # of the rate: harmonics up to here are fitted, to separate them from those that are kept
PASSING = 0.40  # of the rate: band that a steady scan keeps

SHORT = {"contact_length": "3 mm"}
"""Few ridges and periods: engine and oracles take a third of the time of the default finger."""

SCENES: dict[str, dict[str, Any]] = {
    "default": {},
    "locked": {"texture": {"period": "0.5 mm"}},
    "wide": {"texture": {"period": "5 mm", "amplitude": "100 um"}},
    "light": {"scan": {"load": "0.02 N"}},
    "heavy": {"scan": {"load": "3 N"}},
    "backwards": {"scan": {"speed": "-80 mm/s"}},
}
"""Scenes in which every effect is compared with its oracle."""
WITH_BANDWIDTH = list(zip(SCENES, itertools.cycle(["full", 1000.0]), strict=False))
"""The name of each scene, and one of two bandwidths."""


def named(*quick: str) -> list[Any]:
    """Return the names of SCENES as parameters of a test; those not in `quick` are marked thorough."""
    return [name if name in quick else thorough(name) for name in SCENES]


def scene_of(name: str, effects: dict[str, Any], rate: int = 8000, **sections: Any) -> Scene:
    """Return a scene of SCENES with `effects` and all three quantities at `rate`."""
    output = {"sample_rate": rate, "channels": list(QUANTITIES), **sections.pop("output", {})}
    return parse_scene({**SCENES[name], **sections, "effects": effects, "output": output})


def kept_band(scene: Scene) -> float:
    """Return the frequency (Hz) up to which a steady scan keeps its tolerance."""
    return min(PASSING * scene.output.sample_rate, scene.output.bandwidth_hz)


def errors_of(scene: Scene, voice: Voice, wanted: dict[str, tuple[Harmonics, int]]) -> dict[str, float]:
    """Return the largest error of each channel below the band limit, without its mean, relative to its peak-to-peak.

    wanted: harmonics of each quantity, and the order of differentiation to apply to them.
    """
    rate, limit = scene.output.sample_rate, kept_band(scene)
    fundamental = next(iter(wanted.values()))[0].fundamental_hz
    count = max(round((WINDOW_PERIODS + 1) * rate / fundamental), 1500)
    frames, found = np.arange(count), physical(voice, count)
    errors = {}
    for column, quantity in enumerate(voice.quantities):
        if quantity in wanted:
            harmonics, order = wanted[quantity]
            truth = harmonics.signal(order, frames, rate, limit)
            fit = fit_harmonics(found[:, column], rate, fundamental, FITTED * rate)
            errors[quantity] = float(np.max(np.abs(fit.signal(frames, limit) - truth)) / np.ptp(truth))
    return errors


def check_quantities(scene: Scene, motion: tuple[Harmonics, ...], own_error: dict[str, float] | float = 0.0) -> Voice:
    """Assert that a steady render errs by no more than its plan reports.

    motion: harmonics of z, z' and z'', or of z alone.
    own_error: relative error of the oracle, for all quantities or for each.
    """
    voice = open_voice(scene)
    orders = {one: order for order, one in enumerate(QUANTITIES)}
    if len(motion) == 1:
        wanted = {one: (motion[0], order) for one, order in orders.items()}
    else:
        wanted = {one: (motion[order], 0) for one, order in orders.items()}
    errors, told = errors_of(scene, voice, wanted), voice.plan.estimated_error
    for quantity, error in errors.items():
        own = own_error if isinstance(own_error, float) else own_error[quantity]
        assert error <= told[quantity] + own, f"{quantity} errs by {error:.2e}, reported {told[quantity]:.2e}"
    return voice


def below(signal: Real, finer: int, part: float = 0.3, reach: int = 24) -> Real:
    """Return the part of a signal below `part` of the rate.

    signal: `finer` samples per frame, from `reach` frames before the first frame to `reach` frames after the last.
    reach: frames of the filter on each side.
    """
    taps = firwin(2 * reach * finer + 1, 2 * part / finer, window=("kaiser", 10.0))
    return np.asarray(np.convolve(signal, taps / np.sum(taps), "valid")[::finer])
