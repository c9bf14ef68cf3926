"""The kind `heightmap`: heights over an area, imported or written in the scene.

Stage   SURFACES. This module declares the kind; `measured_area` computes its heights.
Model   A scene holds up to MOST_INLINE heights itself, as rows along the scan, or the address of an imported surface.
        With `synthetic_hurst` the map is continued below its pixel (`continued`).
Limits  MOST_POINTS heights.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Any

import numpy as np
from pydantic import Field, ValidationError

from synth.response_cache import kept
from synth.scene.quantity import Dimension, show_quantity
from synth.scene.rules import (
    MOST_FAULTS,
    Fields,
    Quantity,
    QuantityList,
    Refusal,
    Rule,
    refusal,
    refusals_of,
    refuse,
    refused,
)
from synth.scene.section import Section, without
from synth.scene.texture_registry import Kind
from synth.surfaces.continued import (
    MOST_POINTS,
    SHORTEST,
    Continuation,
    continued_area,
    grids,
    shortest_that_fits,
    synthetic_slope,
)
from synth.surfaces.measured import LARGEST_HEIGHT, MOST_INLINE, surface_refusals
from synth.surfaces.measured_area import MeasuredArea
from synth.surfaces.surface_data import SurfaceData, surface_at

LONGEST = 1.0  # m, of the period along and across
HEIGHT = Quantity(Dimension.LENGTH, -LARGEST_HEIGHT, LARGEST_HEIGHT)


def _rows_hint(rows: int, lengths: list[int]) -> str:
    """Return what to write instead of `rows` rows of these lengths."""
    if rows == 0 or lengths == [0]:
        return "It is empty. Write at least two rows of two heights."
    found = f"It has {rows} row{'s' if rows > 1 else ''} of {' and '.join(map(str, lengths[:3]))} heights."
    if len(lengths) > 1:
        return f"{found} Write rows of one length."
    small = rows < 2 or lengths[0] < 2
    return f"{found} {'Write at least two rows of two heights.' if small else 'Import larger maps.'}"


class Rows(Rule):
    """Rows of heights, all of one length."""

    unit = "m"
    takes_lists = True
    allowed = f"2 or more rows of 2 or more heights each, {MOST_INLINE} in all, each {HEIGHT.allowed}"

    def read(self, value: object) -> tuple[tuple[float, ...], ...]:
        """Return the rows in m."""
        if not isinstance(value, list | tuple) or not all(isinstance(row, list | tuple) for row in value):
            raise refused(self.allowed, 'Write rows such as [[0, "10 um"], ["20 um", 0]].')
        lengths = {len(row) for row in value}
        if len(value) < 2 or len(lengths) != 1 or min(lengths) < 2 or len(value) * min(lengths) > MOST_INLINE:
            raise refused(self.allowed, _rows_hint(len(value), sorted(lengths)))
        if any(isinstance(height, list | tuple) for row in value for height in row):
            hint = "It has three dimensions: write one map of heights, such as rows[0] or rows[:, :, 0]."
            raise refused(self.allowed, hint)
        row_rule = QuantityList(HEIGHT, 2, MOST_INLINE)
        found: list[tuple[float, ...]] = []
        refusals: list[Refusal] = []
        for number, row in enumerate(value):
            try:
                found.append(row_rule.read(row))
            except ValidationError as error:
                refusals += refusals_of(error, number)
            if len(refusals) > MOST_FAULTS:
                break
        refuse("rows", refusals)
        return tuple(found)

    def schema(self) -> dict[str, Any]:
        """Return the schema of the rows."""
        row = {"type": "array", "items": HEIGHT.schema(), "minItems": 2, "maxItems": MOST_INLINE // 2}
        return {"anyOf": [{"type": "array", "items": row, "minItems": 2, "maxItems": MOST_INLINE // 2}]}


class HeightmapFields(Section):
    """Heights over an area."""

    rows: Annotated[tuple[tuple[float, ...], ...] | None, Rows()] = Field(
        default=None, description="heightmap: rows of heights along the scan, the first one with the smallest y."
    )
    spacing_across: Annotated[float | None, Quantity(Dimension.LENGTH, 1e-9, 0.1, usual=1e-3)] = Field(
        default=None, description="heightmap: distance between neighbouring rows; null: spacing."
    )
    synthetic_hurst: Annotated[float | None, Quantity(Dimension.NONE, 0.0, 1.0)] = Field(
        default=None,
        description="heightmap: Hurst exponent of synthetic waves, which continue the spectrum of the map below its "
        "pixel; null: none.",
    )
    synthetic_shortest: Annotated[float | None, Quantity(Dimension.LENGTH, 1e-6, 0.1)] = Field(
        default=None, description="heightmap: the shortest synthetic wave; null: 60 um."
    )
    synthetic_seed: Annotated[int | None, Quantity(Dimension.NONE, 0, 1_000_000, whole=True)] = Field(
        default=None, description="heightmap: seed of the phases of the synthetic waves; null: 0."
    )


def _data(values: Mapping[str, Any]) -> SurfaceData:
    if values["surface"] is not None:
        found = surface_at(values["surface"])
        assert found is not None, "the scene was checked where the surface was known"
        return found
    spacing = values["spacing"]
    return SurfaceData(np.array(values["rows"], np.float32), (spacing, values["spacing_across"] or spacing))


def continuation_of(values: Mapping[str, Any]) -> Continuation | None:
    """Return how the map with these values of its fields is continued; None: it is not, or has shorter waves itself."""
    if values.get("synthetic_hurst") is None:
        return None
    shortest, seed = values["synthetic_shortest"] or SHORTEST, values["synthetic_seed"] or 0
    if 2.0 * max(_data(values).spacing) <= shortest * (1.0 + 1e-9):
        return None
    return Continuation(values["synthetic_hurst"], shortest, int(seed))


def map_of(values: Mapping[str, Any]) -> tuple[SurfaceData, str]:
    """Return the map with these values of its fields, without synthetic waves, and its ends."""
    return _data(values), values["ends"] or "mirror"


def synthetic_words(values: Mapping[str, Any]) -> str:
    """Return which waves of a texture with these values are synthetic, as sentences; "" for none."""
    one = continuation_of(values)
    if one is None:
        return ""
    data, ends = map_of(values)
    longest, shortest = (
        show_quantity(float(f"{wave:.3g}"), Dimension.LENGTH) for wave in (2.0 * max(data.spacing), one.shortest)
    )
    return (
        f"The waves of the texture from {longest}, two pixels of its map, to {shortest} are synthetic, not measured. "
        f"They continue the spectrum of the map with a Hurst exponent of {one.hurst:.3g} and the seed {one.seed}. "
        f"Their rms slope is {synthetic_slope(data, ends, one):.3g} along each axis."
    )


def _made(values: Mapping[str, Any]) -> MeasuredArea:
    return _area(*map_of(values), values["phase"], continuation_of(values))


@kept
def _area(data: SurfaceData, ends: str, phase: float, one: Continuation | None) -> MeasuredArea:
    """Return the surface. The last few are cached with their bounds and Rq, which take 40 ns per height."""
    return MeasuredArea(data, ends, phase) if one is None else continued_area(data, ends, phase, one)


def _refusals(values: Mapping[str, Any], given: Fields) -> list[Refusal]:
    if "surface" in given:
        found = surface_refusals(given, 2)
        if found:
            return found
    elif "rows" not in given:
        hint = 'Write rows such as [[0, "10 um"], ["20 um", 0]], or import a file.'
        return [refusal(["rows"], None, "rows of heights, or the address of a surface", hint)]
    field = "surface" if "surface" in given else "rows"
    heights = _data(values).heights
    if heights.size > MOST_POINTS or min(heights.shape) < 2:
        allowed = f"2 x 2 to {MOST_POINTS} heights"
        return [refusal([field], given[field], allowed, f"It has {heights.shape[0]} x {heights.shape[1]}.")]
    if found := _synthetic_refusals(values, given):
        return found
    area = _made(values)
    longest = max(area.period, area.across)
    if not 1e-6 <= longest <= LONGEST:
        named = field if field == "surface" else "spacing"
        return [refusal([named], given.get(named), f"periods of 1 um to {LONGEST:g} m", f"One is {longest:g} m.")]
    return []


def _synthetic_refusals(values: Mapping[str, Any], given: Fields) -> list[Refusal]:
    """Refuse synthetic waves that are shorter than the memory has room for."""
    one, field = continuation_of(values), "synthetic_shortest"
    if one is None:
        return []
    data, ends = map_of(values)
    fine = grids(data, ends, one.shortest)[1]
    where = [field] if field in given else ["synthetic_hurst"]
    if math.prod(fine.counts) > MOST_POINTS:
        least = show_quantity(float(f"{1.001 * shortest_that_fits(data, ends):.4g}"), Dimension.LENGTH)
        hint = f"With this one the map would have {fine.counts[1]} x {fine.counts[0]} heights. Or import a part of it."
        return [refusal(where, given[where[0]], f"a shortest wave of {least} at least for this map", hint)]
    return []


def written(fields: Mapping[str, Any], values: Mapping[str, Any]) -> dict[str, Any]:
    """Return the document: with the address of a surface, or with the rows and their distances."""
    return without(fields, "rows", "spacing", "spacing_across") if values["surface"] is not None else dict(fields)


KIND = Kind(
    "heightmap",
    HeightmapFields,
    _made,
    shared=("spacing", "surface", "ends"),
    steep="rows",
    refusals=_refusals,
    pairs=(("rows", "surface"), ("spacing", "surface"), ("spacing_across", "surface")),
    written=written,
    of_area=True,
)
