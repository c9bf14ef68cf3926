"""PLAN WARNINGS: unusual values, motions too weak to be felt or beyond any actuator, a cancelled fundamental, levels.

Stage   2 (PLAN).
Model   Each harmonic of the motion is divided by the detection threshold at its frequency (`threshold`). If the sum of
        the squares of these ratios is less than 1, the motion is not felt.
        Harmonics below LOWEST are no vibration and count as unfelt.
        A scan with varying speed also passes lower frequencies, at which more harmonics are in the band. Each harmonic
        of its series is therefore compared with the smallest threshold at or below its frequency in the band. The
        harmonics of a hand, of a simulation, of an area and of a long surface are known at the scan's own speed only,
        and the warning states this.
        A simulated motion is judged by the largest sinusoid that fits into its peak-to-peak. It is therefore reported
        as unfelt only if it is certainly below the threshold.
        The automatic full scale of a file may not be that of its own frames.
Source  Sum of squares: Bensmaia & Hollins (2003), roughness by Pacinian-weighted power. Actuators: a TacHammer Carlton,
        5 g steadily and 25 g in an impulse, as others quote its maker; unverified.
Limits  The threshold is that of one observer, for steady sinusoids. Motions with a varying load, and channels of force,
        are never reported as unfelt. The acceleration is that within the band of the output.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from fractions import Fraction

import numpy as np

from synth.perception.threshold import LARGEST_LINE, threshold_displacement
from synth.plan.channels import PEAK, ChannelPlan
from synth.plan.effect_choice import outputs_of
from synth.plan.effects_preparation import PreparedEffects
from synth.plan.preparation import Preparation
from synth.plan.request import harmonics_in_band
from synth.response.demand import curves, points_for
from synth.scene.doubtful_values import doubts
from synth.scene.output_section import Channel
from synth.scene.scene import Scene
from synth.surfaces import profile_of

GRAVITY = 9.80665  # m/s^2
IMPULSE = 25.0 * GRAVITY  # m/s^2, largest claimed peak of an actuator
STEADY = 5.0 * GRAVITY / math.sqrt(2.0)  # m/s^2 rms, largest claimed steady acceleration
LOWEST = 1.0  # Hz: below it no threshold is known, and a motion is no vibration
CANCELLED = 0.1  # of the strongest line (20 dB): a weaker fundamental is reported; measured ones are the strongest
LARGEST_DENOMINATOR = 12  # of the ratio of the periods in that warning
OFF_LEVEL = 0.025  # of the peak, so that it is 0.78 to 0.82: a larger error is told as one of the level
STEPS = 64  # number of frequencies below each harmonic at which a scan with varying speed is judged


def plan_doubts(solved: Preparation) -> tuple[str, ...]:
    """Return the warnings about a prepared scene."""
    return (*doubts(solved.scene), *_unfelt(solved), *_unmakeable(solved), *_cancelled(solved))


def _cancelled(solved: Preparation) -> tuple[str, ...]:
    """Warn where the equal ridges of a comb cancel the line at u / lambda2, which every measured finger has."""
    if solved.spectrum is None or not solved.scene.finger.traits.straight or solved.spectrum.closed or solved.rests:
        return ()
    scene = solved.scene
    if solved.stretch is not None or scene.texture.period > scene.finger.contact_length:
        return ()  # a stretch has another fundamental; a comb shorter than a period cannot cancel it
    lines = np.abs(solved.spectrum.harmonics[1 : solved.highest + 1])
    if len(lines) < 2 or not lines.max() or lines[0] > CANCELLED * lines.max():
        return ()
    places = scene.texture.period * np.linspace(0.0, 1.0, points_for(solved.highest), endpoint=False)
    own = np.abs(np.fft.rfft(profile_of(scene).heights(places)))[1 : solved.highest + 1]
    if own[0] <= CANCELLED * own.max():
        return ()  # the texture itself has no such line
    ratio = scene.texture.period / scene.finger.ridge_period
    whole = Fraction(ratio).limit_denominator(LARGEST_DENOMINATOR)
    return (
        f"The line at u / lambda2 is missing: the strongest is number {int(np.argmax(lines)) + 1}. The equal ridges of "
        f"a comb cancel it, since lambda2 / lambda1 is near {whole}. No measured finger does this. Write finger.kind "
        '"fingertip", or another finger.ridge_period.',
    )


def _unfelt(solved: Preparation) -> tuple[str, ...]:
    forces = solved.effects is not None and solved.effects.channels
    varies = solved.load_varies and not solved.by_hand
    if solved.spectrum is None or not solved.turns or solved.highest < 1 or varies or forces:
        return ()
    bound = solved.simulated or not solved.scene.scan.along_x  # no series has the lines of the motion
    threshold, own = solved.scene.accuracy.threshold, solved.by_hand or solved.simulated or solved.of_levels
    slower = solved.moving and not own
    count = len(solved.spectrum.harmonics) - 1 if slower else solved.highest
    frequencies = np.minimum(abs(solved.turns) * np.arange(1, count + 1), solved.scene.output.band_limit)
    felt = threshold_displacement(frequencies, threshold)
    if solved.moving:
        lower = np.geomspace(LOWEST, np.maximum(frequencies, LOWEST), STEPS)
        felt = np.minimum(felt, threshold_displacement(lower, threshold).min(axis=0))
    if bound:  # the largest sinusoid that fits into the peak-to-peak of each channel
        held = [one.extent / (2.0 * math.pi * frequencies) ** one.order for one in solved.channels]
        levels = LARGEST_LINE * 0.5 * np.min(held, axis=0) / felt
    else:
        levels = 2.0 * np.abs(solved.steady.held[1 : count + 1]) / felt
    levels = np.where(frequencies < LOWEST, 0.0, levels)
    strongest = int(np.argmax(levels))
    power = float(np.max(levels) if bound else np.sum(levels**2))
    if power >= 1.0:
        return ()
    this = "At the scan's own speed this" if solved.moving and own else "This"
    if levels[strongest] == 0.0:
        return (f"{this} is not felt as a vibration: all of it is below {LOWEST:g} Hz.",)
    below = f"{-20.0 * math.log10(levels[strongest]):.0f} dB"
    at = "" if solved.simulated or solved.moving else f", at {frequencies[strongest]:.3g} Hz,"
    return (f'{this} is not felt: the strongest harmonic{at} is {below} below the detection threshold "{threshold}".',)


def _unmakeable(solved: Preparation) -> tuple[str, ...]:
    channel = next((one for one in solved.channels if one.quantity == "acceleration"), None)
    if solved.spectrum is None or channel is None or not channel.extent:
        return ()
    asked = [one.full_scale for one in solved.scene.output.channel_list if one.quantity == "acceleration"]
    heard = solved.by_hand or harmonics_in_band(solved.scene, 1) > 0  # else the scan's own speed is above the band
    peak, rms = 0.5 * channel.extent if heard else 0.0, 0.0
    if not asked[0]:
        peak = max(peak, PEAK * channel.full_scale)
    if heard and not solved.simulated and not solved.load_varies:
        curve = curves(solved.steady.series(2), 0, 2 * points_for(solved.highest))
        peak, rms = float(np.max(np.abs(curve))), float(np.std(curve))
    if peak <= IMPULSE and rms <= STEADY:
        return ()
    size = f"peaks at {peak:.3g} m/s^2" if peak > IMPULSE else f"is {rms:.3g} m/s^2 rms"
    return (
        f"This is beyond any known actuator: the acceleration {size}. The strongest actuator reaches {IMPULSE:.0f} "
        f"m/s^2 in an impulse and {STEADY:.0f} m/s^2 rms steadily. Reduce output.bandwidth or the speed.",
    )


def level_of_effects(scene: Scene, effects: PreparedEffects, *, stepped: bool) -> tuple[str, ...]:
    """Return a warning if an automatic full scale of a file with effects is not that of its own frames.

    stepped: as of `Preparation`.
    """
    scan = scene.scan
    if scan.stroke is None and scan.trajectory is None and scan.along_x and not scene.output.fade and not stepped:
        return ()
    automatic: list[str] = [one.quantity for one in scene.output.channel_list if stepped and not one.full_scale]
    given = [scale for effect, settings in outputs_of(scene) for scale in effect.scales(settings)]
    added = zip(effects.channels, given, strict=True)
    automatic += [one.quantity for one, scale in added if not scale and (scene.output.fade or not one.of_own_motion)]
    if not automatic:
        return ()
    return (
        f"The full scale of the {_listed(automatic)} is that of steady scanning or of the first seconds of the motion. "
        "The file may peak above or below 0.8 of it. Set output.full_scale for a level of your own.",
    )


def uncertain_level(channels: Sequence[ChannelPlan], listed: Sequence[Channel], *, read: bool) -> tuple[str, ...]:
    """Return a warning if the frames of a file may be off the level that its automatic full scale gives them.

    channels, listed: as planned, and as the scene has them.
    read: whether frames are read from a table, instead of being solved.
    """
    unsure = [
        one.quantity
        for one, asked in zip(channels, listed, strict=True)
        if not asked.full_scale and (read or one.error * one.extent > OFF_LEVEL * PEAK * one.full_scale)
    ]
    if not unsure:
        return ()
    why = "its frames are read at a limited accuracy, as solving them would take too long" if read else "of its error"
    return (
        f"The level of the {_listed(unsure)} is uncertain because {why}. The file may peak above or below 0.8 of its "
        "full scale. Set output.full_scale for a level of your own.",
    )


def _listed(quantities: Sequence[str]) -> str:
    return " and ".join(quantities).replace("_", " ")
