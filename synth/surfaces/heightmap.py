"""The kind `heightmap`: heights over an area, imported or written in the scene.

Stage   SURFACES. This module declares the kind; `measured_area` computes its heights.
Model   A scene holds up to MOST_INLINE heights itself, as rows along the scan, or the address of an imported surface.
Limits  MOST_POINTS heights.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

import numpy as np
from pydantic import Field, ValidationError

from synth.response_cache import kept
from synth.scene.quantity import Dimension
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
from synth.surfaces.measured import LARGEST_HEIGHT, MOST_INLINE, surface_refusals
from synth.surfaces.measured_area import MeasuredArea
from synth.surfaces.surface_data import SurfaceData, surface_at

MOST_POINTS = 1 << 24  # of a map: 64 MB; 4,096 x 4,096
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


def _data(values: Mapping[str, Any]) -> SurfaceData:
    if values["surface"] is not None:
        found = surface_at(values["surface"])
        assert found is not None, "the scene was checked where the surface was known"
        return found
    spacing = values["spacing"]
    return SurfaceData(np.array(values["rows"], np.float32), (spacing, values["spacing_across"] or spacing))


def _made(values: Mapping[str, Any]) -> MeasuredArea:
    return _area(_data(values), values["ends"] or "mirror", values["phase"])


@kept
def _area(data: SurfaceData, ends: str, phase: float) -> MeasuredArea:
    """Return the surface. The last few are cached with their bounds and Rq, which take 40 ns per height."""
    return MeasuredArea(data, ends, phase)


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
    area = _made(values)
    longest = max(area.period, area.across)
    if not 1e-6 <= longest <= LONGEST:
        named = field if field == "surface" else "spacing"
        return [refusal([named], given.get(named), f"periods of 1 um to {LONGEST:g} m", f"One is {longest:g} m.")]
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
