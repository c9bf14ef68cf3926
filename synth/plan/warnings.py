"""PLAN DOUBTS: what a careful person questions in a plan: unusual values, motions nobody feels or no actuator makes.

Stage   2 (PLAN), as warnings.
Model   Each harmonic of the motion is compared with the detection threshold of its frequency (`threshold`). Where the
        squares of all of them, each relative to its threshold, add up to less than 1, nobody feels the motion. What is
        below LOWEST is no vibration, and counts as unfelt. A scan that varies its speed passes lower frequencies too:
        a harmonic counts with the smallest threshold at or below its frequency. A simulated motion is judged by the
        largest sinusoid that its peak-to-peak can hold, so that what is called unfelt is surely below the curve.
Source  sum of squares: Bensmaia & Hollins (2003), roughness by Pacinian-weighted power. Actuators: a TacHammer Carlton,
        5 g steadily and 25 g in an impulse, as others quote its maker; unverified.
Limits  the threshold is one observer's, for steady sinusoids. A load that varies is not judged as unfelt, nor are
        channels of force. Acceleration is judged in the band of the output.
"""

from __future__ import annotations

import math

import numpy as np

from synth.perception.threshold import LARGEST_LINE, threshold_displacement
from synth.plan.channels import PEAK
from synth.plan.preparation import Preparation
from synth.response.spectrum import curves, points_for
from synth.scene.doubtful_values import doubts

GRAVITY = 9.80665  # m/s^2
IMPULSE = 25.0 * GRAVITY  # m/s^2, the largest peak that an actuator is said to make
STEADY = 5.0 * GRAVITY / math.sqrt(2.0)  # m/s^2 rms, the most that one is said to make steadily
LOWEST = 1.0  # Hz: below it no threshold is known, and a motion is no vibration
STEPS = 64  # frequencies at which a varying scan is judged below each harmonic


def plan_doubts(solved: Preparation) -> tuple[str, ...]:
    """Return what to question in what was prepared, a sentence each."""
    return (*doubts(solved.scene), *_unfelt(solved), *_unmakeable(solved))


def _unfelt(solved: Preparation) -> tuple[str, ...]:
    forces = solved.effects is not None and solved.effects.channels
    varies = solved.load_varies and not solved.by_hand
    if solved.spectrum is None or not solved.turns or solved.highest < 1 or varies or forces:
        return ()
    frequencies = abs(solved.turns) * np.arange(1, solved.highest + 1)
    threshold = solved.scene.accuracy.threshold
    felt = threshold_displacement(frequencies, threshold)
    if solved.moving:
        lower = np.geomspace(LOWEST, np.maximum(frequencies, LOWEST), STEPS)
        felt = np.minimum(felt, threshold_displacement(lower, threshold).min(axis=0))
    if solved.simulated:  # the largest line that the peak-to-peak of each channel can hold
        held = [one.extent / (2.0 * math.pi * frequencies) ** one.order for one in solved.channels]
        levels = LARGEST_LINE * 0.5 * np.min(held, axis=0) / felt
    else:
        levels = 2.0 * np.abs(solved.steady.series(0)[1:]) / felt
    levels = np.where(frequencies < LOWEST, 0.0, levels)
    strongest = int(np.argmax(levels))
    power = float(np.max(levels) if solved.simulated else np.sum(levels**2))
    if power >= 1.0:
        return ()
    if levels[strongest] == 0.0:
        return (f"Nobody feels this as a vibration: all of it is below {LOWEST:g} Hz.",)
    below = f"{-20.0 * math.log10(levels[strongest]):.0f} dB"
    at = "" if solved.simulated or solved.moving else f", at {frequencies[strongest]:.3g} Hz,"
    return (f'Nobody feels this: the strongest harmonic{at} is {below} below the detection threshold "{threshold}".',)


def _unmakeable(solved: Preparation) -> tuple[str, ...]:
    channel = next((one for one in solved.channels if one.quantity == "acceleration"), None)
    if solved.spectrum is None or channel is None or not channel.extent:
        return ()
    asked = [one.full_scale for one in solved.scene.output.channel_list if one.quantity == "acceleration"]
    peak = 0.5 * channel.extent if asked[0] else max(0.5 * channel.extent, PEAK * channel.full_scale)
    rms = 0.0
    if not solved.simulated and not solved.load_varies:
        curve = curves(solved.steady.series(2), 0, 2 * points_for(solved.highest))
        peak, rms = float(np.max(np.abs(curve))), float(np.std(curve))
    if peak <= IMPULSE and rms <= STEADY:
        return ()
    size = f"peaks at {peak:.3g} m/s^2" if peak > IMPULSE else f"is {rms:.3g} m/s^2 rms"
    return (
        f"No actuator known here makes this: the acceleration {size}; the strongest makes {IMPULSE:.0f} m/s^2 in an "
        f"impulse and {STEADY:.0f} m/s^2 rms steadily. output.bandwidth leaves out what no actuator plays; a slower "
        "scan asks for less.",
    )
