"""What a change of scene may not change in a session: rate, channels, quantities and full scale.

Model: the full scale that the first voice chooses is written into the scene, so that all later scenes keep it. A
    partial scene is merged (RFC 7396); each fixed value that it would change is a fault.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, TypeVar

from service.engine import Sounding
from service.problems import Problem
from synth.errors import Fault, SceneError
from synth.scene.merge import merge_patch
from synth.scene.output_section import Output
from synth.scene.scene import Scene, parse_scene, scene_document

Sounds = TypeVar("Sounds", bound=Sounding)


def changed_scene(scene: Scene, patch: Mapping[str, object], full_scale: tuple[float, ...]) -> Scene:
    """Return `scene` changed by `patch`, with the full scale of the session.

    Raises SceneError for an invalid scene, Problem (fixed) for a scene that changes a fixed value.
    """
    changed = parse_scene(merge_patch(_one_quantity(scene_document(scene)), patch))
    faults = [*_fixed_faults(scene.output, changed.output), *_added_faults(scene, changed)]
    if faults:
        raise Problem("fixed", "A session keeps its rate, channels, quantities and full scale.", tuple(faults))
    return with_full_scale(changed, full_scale)


def with_full_scale(scene: Scene, full_scale: tuple[float, ...]) -> Scene:
    """Return `scene` with the full scale of each channel written out, so that changed scenes keep it.

    A silent scene, whose voice has no valid full scale, is returned unchanged.
    """
    output = scene.output.document()
    quantities = [channel.quantity for channel in scene.output.channel_list]
    output["channels"] = [
        {"quantity": name, "full_scale": float(value)} for name, value in zip(quantities, full_scale, strict=False)
    ]
    try:
        read = parse_scene({"output": _without(output, "quantity", "full_scale")}).output  # the rest is read already
    except SceneError:
        return scene
    pinned = scene.model_copy(update={"output": read})
    added = full_scale[len(quantities) :]
    return _with_added_scales(pinned, added) if added else pinned


def open_pinned(scene: Scene, open_voice: Callable[[Scene], Sounds]) -> tuple[Scene, Sounds]:
    """Return `scene` with the full scale that its voice chooses written out, and a voice of it. Slow."""
    voice = open_voice(scene)
    pinned = with_full_scale(scene, tuple(voice.full_scale))
    return pinned, voice if pinned == scene else open_voice(pinned)


def _with_added_scales(scene: Scene, full_scale: tuple[float, ...]) -> Scene:
    from synth.plan.effect_choice import with_added_scales

    return with_added_scales(scene, full_scale)


def _one_quantity(document: dict[str, Any]) -> dict[str, Any]:
    """Return `document` with a single channel as quantity and full scale, so that a change may name either."""
    output = document["output"]
    if len(output.get("channels") or ()) != 1:
        return document
    return document | {"output": _without(output, "channels") | output["channels"][0]}


def _without(section: dict[str, Any], *names: str) -> dict[str, Any]:
    return {name: value for name, value in section.items() if name not in names}


def _fixed_faults(before: Output, after: Output) -> list[Fault]:
    """Return a fault for each fixed value that differs."""
    faults = []
    if after.sample_rate != before.sample_rate:
        faults.append(_fixed("/output/sample_rate", f"{after.sample_rate} Hz", f"{before.sample_rate} Hz"))
    if len(after.channel_list) != len(before.channel_list):
        count = len(before.channel_list)
        return [*faults, _fixed("/output/channels", f"{len(after.channel_list)} channels", f"{count}, as it began")]
    for index, (was, now) in enumerate(zip(before.channel_list, after.channel_list, strict=True)):
        place = f"/output/channels/{index}" if after.channels else "/output"
        if now.quantity != was.quantity:
            faults.append(_fixed(f"{place}/quantity", now.quantity, was.quantity))
        if now.full_scale not in (None, was.full_scale):
            faults.append(_fixed(f"{place}/full_scale", str(now.full_scale), str(was.full_scale)))
    return faults


def _added_faults(before: Scene, after: Scene) -> list[Fault]:
    """Return a fault for each difference in the channels that effects add."""
    from synth.plan.effect_choice import added_quantities, outputs_of

    was, now = (", ".join(added_quantities(scene)) or "no channel" for scene in (before, after))
    if was != now:
        return [_fixed("/effects", f"effects that add {now}", f"effects that add {was}, as it began")]
    faults = []
    for (effect, settings), (_effect, kept) in zip(outputs_of(after), outputs_of(before), strict=True):
        for asked, scale in zip(effect.scales(settings), effect.scales(kept), strict=True):
            if asked not in (None, scale):
                faults.append(_fixed(f"/effects/{effect.name}/full_scale", str(asked), str(scale)))
    return faults


def _fixed(pointer: str, value: str, allowed: str) -> Fault:
    return Fault(pointer, value, allowed, "Leave it out, or open another session.")
