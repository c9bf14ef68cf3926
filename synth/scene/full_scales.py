"""Read the full scales of a sound's channels, and write them into its scene.

Stage: 1 (SCENE).
Model: the full scale of a channel has the rule of the field that would give it: `output.full_scale` for a quantity of
    the scene, and the effect's own field for a channel that an effect adds.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from pydantic_core import PydanticCustomError

from synth.errors import Fault, InvalidRequest, shown
from synth.scene.array_values import is_array
from synth.scene.effects_section import declaration, effect_names
from synth.scene.merge import Document, merge_patch
from synth.scene.output_section import FULL_SCALE_RANGES
from synth.scene.rules import Rule, words_of
from synth.scene.section import rule_of


def read_full_scales(given: Any, quantities: Sequence[str]) -> tuple[float, ...]:
    """Return the full scale of each channel, SI.

    given: a number in SI or text with a unit, for all channels; or a list or an array of them, one per channel.
    Raises InvalidRequest, which lists every fault.
    """
    if is_array(given):
        import numpy as np

        given = np.asarray(given).tolist() if np.ndim(given) else given
    several = isinstance(given, list | tuple)
    if several and len(given) != len(quantities):
        allowed = f"a number in SI, or a list of {len(quantities)}, one per channel"
        raise InvalidRequest([Fault("/full_scale", shown(given), allowed, "Write 5.0, for instance.")])
    scales: list[float] = []
    faults: dict[Fault, None] = {}
    for number, quantity in enumerate(quantities):
        value = given[number] if several else given
        try:
            scales.append(float(_rule(quantity).read(value)))  # type: ignore[arg-type]
        except PydanticCustomError as error:
            pointer = f"/full_scale/{number}" if several else "/full_scale"
            faults[Fault(pointer, shown(value), **words_of(error))] = None
    if faults:
        raise InvalidRequest(list(faults))
    return tuple(scales)


def with_full_scales(document: Mapping[str, Any], quantities: Sequence[str], scales: Sequence[float]) -> Document:
    """Return the document of a scene with the full scale (SI) of each channel, those of its effects included."""
    both = list(zip(quantities, scales, strict=True))
    own = [{"quantity": quantity, "full_scale": scale} for quantity, scale in both if quantity in FULL_SCALE_RANGES]
    output = document.get("output") or {}
    change = {"full_scale": own[0]["full_scale"]} if output.get("channels") is None else {"channels": own}
    added = {_adding(quantity): {"full_scale": scale} for quantity, scale in both if quantity not in FULL_SCALE_RANGES}
    return merge_patch(document, {"output": change, **({"effects": added} if added else {})})


def _rule(quantity: str) -> Rule:
    if quantity in FULL_SCALE_RANGES:
        return FULL_SCALE_RANGES[quantity]
    return rule_of(declaration(_adding(quantity)).settings, "full_scale")


def _adding(quantity: str) -> str:
    """Return the name of the effect that adds a channel of `quantity`."""
    return next(name for name in effect_names() if quantity in declaration(name).units)
