"""Warnings about the level of a file: its automatic full scale may not be that of its own frames.

Stage   2 (PLAN), used by `prepare`.
"""

from __future__ import annotations

from collections.abc import Sequence

from synth.plan.channels import PEAK, ChannelPlan
from synth.plan.effect_choice import outputs_of
from synth.plan.effects_preparation import PreparedEffects
from synth.scene.output_section import Channel
from synth.scene.scene import Scene

OFF_LEVEL = 0.025  # of the peak, so that it is 0.78 to 0.82: a larger error is told as one of the level


def level_of_effects(scene: Scene, effects: PreparedEffects, *, stepped: bool) -> tuple[str, ...]:
    """Return a warning if an automatic full scale of a file with effects is not that of its own frames.

    stepped: as of `Preparation`.
    """
    scan = scene.scan
    if scan.stroke is None and scan.trajectory is None and scan.along_x and not scene.output.fade and not stepped:
        return ()
    automatic: list[str] = [one.quantity for one in scene.output.channel_list if stepped and not one.full_scale]
    given = [scale for effect, settings in outputs_of(scene) for scale in effect.scales(settings)]
    automatic += [one.quantity for one, scale in zip(effects.channels, given, strict=True) if not scale]
    if not automatic:
        return ()
    return (
        f"The full scale of the {_listed(automatic)} is that of steady scanning or of the first seconds of the motion, "
        "because effects are simulated. The file may peak above or below 0.8 of it. Set output.full_scale for a level "
        "of your own.",
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
