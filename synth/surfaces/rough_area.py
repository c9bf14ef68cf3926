"""The kind `rough_area`: a self-affine surface that varies across too, such as sandpaper, concrete or leather.

Stage   SURFACES. This module declares the kind; `self_affine_area` computes its heights.
Model   The fields are those of the kind `rough`, with the period and the aspect across.
Limits  MOST_ORDERS of the shortest waves per period, along and across.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import Field

from synth.response_cache import kept
from synth.scene.quantity import Dimension, show_quantity
from synth.scene.rules import Fields, Quantity, Refusal, refusal
from synth.scene.texture_registry import Kind
from synth.surfaces.rough import PAIRS, RoughFields, given_twice
from synth.surfaces.self_affine_area import MOST_ORDERS, ROUNDING, SelfAffineArea

USUAL_ORDERS = 64  # shortest waves per period where `shortest` is not given; a choice


class RoughAreaFields(RoughFields):
    """The fields of a rough surface, and its proportions."""

    aspect: Annotated[float | None, Quantity(Dimension.NONE, 0.05, 20.0)] = Field(
        default=1.0, description="rough_area: length of its features across the scan, relative to that along it."
    )


def _lengths(values: Mapping[str, Any]) -> tuple[float, float, float, float]:
    """Return the periods along and across, the longest and the shortest wave (m)."""
    period, aspect = values["period"], values["aspect"]
    across = values["period_across"] or period
    longest = values["longest"] or min(period, across / aspect)
    return period, across, longest, values["shortest"] or period / USUAL_ORDERS


def _made(values: Mapping[str, Any]) -> SelfAffineArea:
    period, across, longest, shortest = _lengths(values)
    height, slope = values["rms_height"] if values["rms_slope"] is None else None, values["rms_slope"]
    lengths = period, across, values["hurst"], height, slope, longest, shortest
    return _kept(*lengths, int(values["seed"]), values["aspect"], values["phase"])


@kept
def _kept(*fields: Any) -> SelfAffineArea:
    """Return the surface. The last few are cached with their waves and bounds, which take up to half a second."""
    return SelfAffineArea(*fields)


def _refusals(values: Mapping[str, Any], given: Fields) -> list[Refusal]:
    found = given_twice(given)
    period, across, longest, shortest = _lengths(values)
    aspect = values["aspect"]
    most = min(period, across / aspect)
    ends = [show_quantity(float(f"{one:.4g}"), Dimension.LENGTH) for one in (most, longest * aspect)]
    least = max(period, across / aspect) / MOST_ORDERS
    field = next((name for name in ("shortest", "longest", "aspect", "period_across") if name in given), "period")
    if longest > most * (1.0 + ROUNDING):
        hint = f"Across the scan, the longest wave would be {ends[1]}. Write longer periods."
        found.append(refusal(["longest"], given.get("longest"), f"at most {ends[0]}", hint))
    elif shortest < least * (1.0 - ROUNDING):
        hint = f"There may be {MOST_ORDERS} waves per period, along and across. Write shorter periods."
        allowed = f"a shortest wave of at least {show_quantity(least, Dimension.LENGTH)}"
        found.append(refusal([field], given.get(field), allowed, hint))
    elif not _made(values).in_band:
        hint = "No wave that fits the periods lies between shortest and longest. Write them further apart."
        found.append(refusal([field], given.get(field), "a shortest wave below the longest", hint))
    return found


KIND = Kind(
    "rough_area",
    RoughAreaFields,
    _made,
    shared=("period", "period_across"),
    defaults={"period": 20e-3},
    steep="rms_height",
    refusals=_refusals,
    pairs=PAIRS,
    of_area=True,
)
