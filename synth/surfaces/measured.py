"""The kind `profile`: heights along a line, measured or computed elsewhere.

Stage   SURFACES.
Model   The heights are at equal distances `spacing`, with straight lines between neighbours and from the last back to
        the first. So the period is their number times the spacing. At phase 0 the first height is at x = 0.
        The heights may be in a local file, which the command line and Python read, but a service does not. `.npy`:
        one array of one dimension, any real numbers. `.csv`, `.txt`: one number per line. Heights in m.
Source  The heights are given; straight lines between them are a choice.
Limits  The mean line is subtracted. The shape between two heights is unknown, so a shape that matters needs several
        points. The corners between the straight lines are heard where the band reaches them.
        A file holds up to 1,000,000 heights. A scene's document holds up to 65,536 heights itself. For more heights it
        holds the path of the file, so such a scene can be read only where that file exists.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Hashable, Mapping
from dataclasses import dataclass
from functools import cached_property
from hashlib import blake2b
from pathlib import Path
from typing import Annotated, Any, NoReturn

import numpy as np
from pydantic import Field

from synth.errors import Fault, SceneError, shown
from synth.scene.quantity import Dimension
from synth.scene.rules import Fields, Quantity, QuantityList, Refusal, Rule, refusal, refused
from synth.scene.section import Section, without
from synth.scene.texture_registry import STEEPEST, Kind
from synth.surfaces.profile import Array, Bounds, Profile, places_of, turns_of
from synth.surfaces.surface_data import surface_at

LARGEST_HEIGHT = 0.01  # m above or below the zero of the instrument; the profile itself is 2 mm high at most
MOST_INLINE = 65_536  # heights in a scene: 1.4 MB of text; a larger document is unwieldy to send
MOST_HEIGHTS = 1_000_000  # in a file: 1 m at 1 um; the solver's work grows with their number
LARGEST_FILE = 64 * 2**20  # bytes: a million heights as text are 25 MB
FORMS = "a file of this machine: .npy of one dimension, or .csv or .txt with one number a line, in m"


@dataclass(frozen=True, eq=False)
class MeasuredProfile(Profile):
    """Straight lines between heights.

    points: heights, m, float64 [n], two or more, about any level.
    spacing: distance between neighbours, m.
    phase: rad.
    """

    points: Array
    spacing: float
    phase: float = 0.0
    kind = "profile"

    @property
    def period(self) -> float:  # type: ignore[override]
        """Number of heights times their spacing (m)."""
        return len(self.points) * self.spacing

    @cached_property
    def key(self) -> Hashable:
        """A digest of the heights, the spacing and the phase."""
        digest = blake2b(np.ascontiguousarray(self.points, np.float64).tobytes(), digest_size=16).hexdigest()
        return self.kind, digest, len(self.points), self.spacing, self.phase

    @cached_property
    def about_mean(self) -> Array:
        """The heights (m) about their mean line, with the first repeated at the end: float64 [n + 1]."""
        level = np.asarray(self.points, np.float64) - np.mean(self.points)
        return np.append(level, level[0])

    def heights(self, places: Array) -> Array:
        """Return the heights (m) at `places` (m)."""
        count = len(self.points)
        at = turns_of(places, self.period, self.phase) * count
        before = np.minimum(at.astype(np.int64), count - 1)
        low, high = self.about_mean[before], self.about_mean[before + 1]
        return np.asarray(low + (at - before) * (high - low))

    @cached_property
    def _slopes(self) -> Array:
        return np.diff(self.about_mean) / self.spacing

    @property
    def bounds(self) -> Bounds:
        """Exact bounds; the curvature is infinite, unless the profile is flat."""
        slope = float(np.max(np.abs(self._slopes)))
        return Bounds(float(self.about_mean.min()), float(self.about_mean.max()), slope, math.inf if slope else 0.0)

    @cached_property
    def corners(self) -> Array:
        """Places (m) of all heights, since each may be a corner."""
        return places_of(np.arange(len(self.points)) / len(self.points), self.period, self.phase)

    @cached_property
    def rms(self) -> tuple[float, float]:
        """Rq (m) and rms slope of the straight pieces, in closed form."""
        low, high = self.about_mean[:-1], self.about_mean[1:]
        square = float(np.mean(low * low + low * high + high * high)) / 3.0
        return math.sqrt(square), math.sqrt(float(np.mean(self._slopes**2)))


class Heights(tuple[float, ...]):
    """Heights in m, whose hash is computed only once.

    path: of the file that they came from, or "".
    """

    path: str = ""

    def __hash__(self) -> int:
        """Return the hash of the values."""
        known = self.__dict__.get("_hash")
        if known is None:
            known = self.__dict__["_hash"] = super().__hash__()
        return int(known)


class HeightFile(Rule):
    """The path of a file of heights."""

    allowed = FORMS

    def read(self, value: object) -> str:
        """Return the path."""
        if isinstance(value, str) and 0 < len(value) <= 4096:
            return value
        raise refused(self.allowed, 'Write a path, such as "heights.csv".')

    def schema(self) -> dict[str, Any]:
        """Return a schema that permits null only: the schema describes the service, which refuses every path."""
        return {"anyOf": []}


class HeightList(QuantityList):
    """The heights, as a list or as read from a file."""

    def read(self, value: object) -> Heights:
        """Return the heights in m."""
        return value if isinstance(value, Heights) else Heights(super().read(value))

    def length_hint(self, count: int) -> str:
        """Return a hint about the number of heights, and about files where the list is too long."""
        more = " On the command line texture.file takes up to 1000000." if count > self.most else ""
        return f"The list has {count}.{more}"


class MeasuredFields(Section):
    """Heights along a line."""

    heights: Annotated[
        tuple[float, ...] | None,
        HeightList(Quantity(Dimension.LENGTH, -LARGEST_HEIGHT, LARGEST_HEIGHT), 2, MOST_INLINE),
    ] = Field(default=None, description="profile: heights at equal distances; the last connects to the first.")
    file: Annotated[str | None, HeightFile()] = Field(
        default=None, description="profile: instead of heights, a file that holds them. Only the command line reads it."
    )


def _made(values: Mapping[str, Any]) -> MeasuredProfile:
    points, spacing = points_of(values)
    if values["ends"] == "mirror":
        points = np.concatenate([points, points[-2:0:-1]])
    return MeasuredProfile(points, spacing, values["phase"])


def points_of(values: Mapping[str, Any]) -> tuple[Array, float]:
    """Return the heights (m) of a valid texture, and their spacing (m)."""
    if values["surface"] is None:
        return np.array(values["heights"]), values["spacing"]
    data = surface_at(values["surface"])
    assert data is not None, "the scene was checked where the surface was known"
    return data.heights.astype(float), data.spacing[0]


def _refusals(values: Mapping[str, Any], given: Fields) -> list[Refusal]:
    if "file" in given:
        hint = "A service does not read files. Write the heights, or use the command line."
        return [refusal(["file"], given["file"], "nothing here: only the command line and Python read files", hint)]
    if "surface" in given:
        found = surface_refusals(given, 1)
        if found:
            return found
    elif "heights" not in given:
        hint = 'Write a list such as [0, "20 um", 0, "-20 um"]; on the command line, file=PATH.'
        return [refusal(["heights"], None, "a list of heights", hint)]
    level, spacing = points_of(values)
    if not 1e-6 <= len(level) * spacing <= 1.0:
        allowed = "a period (heights times spacing) of 1 um to 1 m"
        return [refusal(["spacing"], given.get("spacing"), allowed, f"It is {len(level) * spacing:g} m.")]
    last = level[-1] if values["ends"] == "mirror" else level[0]
    slopes = np.abs(np.append(level, last)[1:] - level) / spacing
    worst = int(np.argmax(slopes))
    if slopes[worst] <= STEEPEST:
        return []
    between = f"from height {worst} to {worst + 1}"
    hint = f"The slope {between} is {slopes[worst]:.4g}. Remove the step or the spike, or correct spacing."
    if worst == len(level) - 1:
        between = "from the last height back to the first"
        hint = f'The slope {between} is {slopes[worst]:.4g}. Remove the trend, or write ends "mirror".'
    field = "surface" if "surface" in given else "heights"
    return [refusal([field], given[field], f"slopes of {STEEPEST:g} at most", hint)]


def surface_refusals(given: Fields, dimensions: int) -> list[Refusal]:
    """Refuse a surface that is given twice, unknown to this process, or of another number of dimensions."""
    for other in ("heights", "rows", "spacing", "spacing_across"):
        if other in given:
            return [
                refusal([other], given[other], "nothing beside surface", "The surface has its own heights and spacing.")
            ]
    data = surface_at(str(given["surface"]))
    if data is None:
        hint = "Import it here first: an address is known only where its surface was imported or read."
        return [refusal(["surface"], given["surface"], "the address of a surface that is known here", hint)]
    if data.heights.ndim != dimensions:
        kind = "profile" if data.heights.ndim == 1 else "heightmap"
        return [refusal(["surface"], given["surface"], f"{dimensions} dimension(s)", f'Write texture.kind "{kind}".')]
    return []


def heights_of_file(fields: Mapping[str, Any]) -> dict[str, Any]:
    """Return the `fields` of a texture with `file` replaced by its heights. Raises SceneError and OSError."""
    path = fields.get("file")
    if not isinstance(path, str) or not path:
        return dict(fields)
    if fields.get("heights") is not None:
        _refuse(Path(path), "heights or file, not both", "Leave one out.")
    heights = Heights(read_heights(Path(path)).tolist())
    heights.path = str(Path(path).absolute())
    return {name: value for name, value in fields.items() if name != "file"} | {"heights": heights}


def written(fields: Mapping[str, Any], values: Mapping[str, Any]) -> dict[str, Any]:
    """Return the document of a texture; where there are many heights, with the path of their file instead.

    fields: of the texture.
    values: the same fields as numbers in SI units.
    """
    heights = values["heights"]
    if values["surface"] is not None:
        return without(fields, "heights", "spacing")
    if isinstance(heights, Heights) and len(heights) > MOST_INLINE:
        return {**fields, "heights": None, "file": heights.path}
    return dict(fields)


def read_heights(path: Path) -> Array:
    """Return the heights (m), float64 [n], of a file. Raises SceneError and OSError."""
    if path.suffix not in (".npy", ".csv", ".txt"):
        _refuse(path, FORMS, "Save the heights as one of these.")
    if not path.is_file():
        _refuse(path, "a file that exists", "Check the path; it is relative to the folder you are in.")
    if path.stat().st_size > LARGEST_FILE:
        _refuse(path, f"a file of at most {LARGEST_FILE} bytes", f"At most {MOST_HEIGHTS} heights.")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # an empty file
            if path.suffix == ".npy":
                found: np.ndarray[Any, Any] = np.lib.format.open_memmap(
                    path, mode="r"
                )  # allocates no memory for a false size in the header
            else:
                found = np.loadtxt(path, ndmin=1, max_rows=MOST_HEIGHTS + 1)
    except (ValueError, EOFError) as error:
        _refuse(path, FORMS, f"It cannot be read ({str(error)[:120]}).")
    if found.ndim != 1 or found.dtype.kind not in "fiu":
        _refuse(path, FORMS, f"It contains {found.dtype} of {found.ndim} dimensions. Keep only the heights.")
    if not 2 <= len(found) <= MOST_HEIGHTS:
        held = f"{len(found)}" if len(found) <= MOST_HEIGHTS else "more"
        _refuse(path, f"2 to {MOST_HEIGHTS} heights", f"It contains {held}.")
    heights = np.asarray(found, np.float64)
    wrong = np.flatnonzero(~(np.abs(heights) <= LARGEST_HEIGHT))
    if len(wrong):
        hint = f"Height {wrong[0]} is {heights[wrong[0]]:g} m. Fill gaps, and write metres."
        _refuse(path, f"heights of {-LARGEST_HEIGHT:g} m to {LARGEST_HEIGHT:g} m", hint)
    return heights


def _refuse(path: Path, allowed: str, hint: str) -> NoReturn:
    raise SceneError([Fault("/texture/file", shown(str(path)), allowed, hint)])


KIND = Kind(
    "profile",
    MeasuredFields,
    _made,
    shared=("spacing", "surface", "ends"),
    steep="heights",
    refusals=_refusals,
    pairs=(("heights", "file"), ("heights", "surface"), ("spacing", "surface")),
    local=heights_of_file,
    written=written,
)
