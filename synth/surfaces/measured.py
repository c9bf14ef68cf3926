"""The kind `profile`: heights along a line, measured or computed elsewhere.

Stage   SURFACES.
Model   The heights are at equal distances `spacing`, with straight lines between neighbours. At phase 0 the first
        height is at x = 0. `ends` states how the surface continues beyond its ends:
        join    A straight line connects the last height to the first. The period is the number of heights times
                the spacing.
        mirror  The surface continues as its mirror image, without a step. The period is twice its length.
        The heights are listed, named by their content (`surface_data`), or in a local file. The command line and
        Python read such a file; a service does not. `.npy`: one array of one dimension, any real numbers. `.csv`,
        `.txt`: one number per line. Heights in m.
Source  The heights are given; straight lines between them are a choice.
Limits  The mean line is subtracted. The shape between two heights is unknown, so a shape that matters needs several
        points. The corners between the straight lines are heard if the band is wide enough.
        A scene's document holds up to 65,536 heights itself. More heights, up to 2,000,000 and 10 m, are named by their
        content, as float32. Such a scene can be read only where these heights are known, or their file exists.
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
from pydantic_core import PydanticCustomError

from synth.errors import Fault, SceneError, shown
from synth.response_cache import kept
from synth.scene.quantity import Dimension
from synth.scene.rules import Fields, Quantity, QuantityList, Refusal, Rule, refusal, refused, words_of
from synth.scene.section import Section, without
from synth.scene.texture_registry import SPACING, STEEPEST, USUAL_SPACING, Kind
from synth.surfaces.profile import Array, Bounds, Profile, places_of, turns_of
from synth.surfaces.surface_data import Heights as Heights32
from synth.surfaces.surface_data import SurfaceData, remember, surface_at

LARGEST_HEIGHT = 0.01  # m above or below the zero of the instrument; the profile itself is 2 mm high at most
MOST_INLINE = 65_536  # heights in a scene: 1.4 MB of text; a larger document is unwieldy to send
MOST_HEIGHTS = 2_000_000  # of a surface: 10 m at 5 um; memory and set-up grow with their number
LONGEST = 10.0  # m; solvers hold the whole surface in memory, 32 MB per metre at 5 um with mirrored ends
LARGEST_FILE = 64 * 2**20  # bytes: two million heights as text are 50 MB
MIRROR = "mirror"
FORMS = "a file of this machine: .npy of one dimension, or .csv or .txt with one number a line, in m"


@dataclass(frozen=True, eq=False)
class MeasuredProfile(Profile):
    """Straight lines between heights.

    points: heights of a period, m, float32 or float64 [n], two or more, about any level.
    spacing: distance between neighbours, m.
    phase: rad.
    """

    points: Array | Heights32
    spacing: float
    phase: float = 0.0
    kind = "profile"
    straight = True

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
        level = np.asarray(self.points, np.float64) - np.mean(self.points, dtype=np.float64)
        return np.append(level, level[0])

    def heights(self, places: Array) -> Array:
        """Return the heights (m) at `places` (m)."""
        count = len(self.points)
        at = turns_of(places, self.period, self.phase) * count
        before = np.minimum(at.astype(np.int64), count - 1)
        low, high = self.about_mean[before], self.about_mean[before + 1]
        return np.asarray(low + (at - before) * (high - low))

    @property
    def _slopes(self) -> Array:
        return np.diff(self.about_mean) / self.spacing

    @cached_property
    def bounds(self) -> Bounds:
        """Exact bounds. The curvature is infinite unless the profile is flat."""
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
    """Heights in m. Their hash is computed only once."""

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
        if isinstance(value, list | tuple) and value and isinstance(value[0], list | tuple):
            raise refused(self.allowed, 'Write rows of heights as texture.rows, with texture.kind "heightmap".')
        return value if isinstance(value, Heights) else Heights(super().read(value))

    def length_hint(self, count: int) -> str:
        """Return a hint about the number of heights, and about files where the list is too long."""
        more = (
            f" On the command line and in Python texture.file takes up to {MOST_HEIGHTS}." if count > self.most else ""
        )
        return f"{super().length_hint(count)}{more}"


class MeasuredFields(Section):
    """Heights along a line."""

    heights: Annotated[
        tuple[float, ...] | None,
        HeightList(Quantity(Dimension.LENGTH, -LARGEST_HEIGHT, LARGEST_HEIGHT), 2, MOST_INLINE),
    ] = Field(default=None, description="profile: heights at equal distances.")
    file: Annotated[str | None, HeightFile()] = Field(
        default=None,
        description="profile: instead of heights, a file that holds them. Only the command line and Python read it.",
    )


def _made(values: Mapping[str, Any]) -> MeasuredProfile:
    if values["surface"] is None:
        return MeasuredProfile(_period(np.array(values["heights"]), values["ends"]), values["spacing"], values["phase"])
    return _of_surface(values["surface"], values["ends"], values["phase"])


@kept  # without it, each check of a scene would make a long surface again
def _of_surface(address: str, ends: str | None, phase: float) -> MeasuredProfile:
    data = surface_at(address)
    assert data is not None, "the scene was checked where the surface was known"
    return MeasuredProfile(_period(data.heights, ends), data.spacing[0], phase)


def _period(level: np.ndarray[Any, Any], ends: str | None) -> np.ndarray[Any, Any]:
    """Return the heights of a period of a surface with these `ends`."""
    return np.concatenate([level, level[-2:0:-1]]) if ends == MIRROR else level


def _refusals(values: Mapping[str, Any], given: Fields) -> list[Refusal]:
    if "file" in given and "surface" not in given:
        hint = "A service does not read files. Write the heights, or use the command line or Python."
        return [refusal(["file"], given["file"], "nothing here: only the command line and Python read files", hint)]
    if "surface" in given:
        return _surface_refusals(values, given)
    if "heights" not in given:
        hint = 'Write a list such as [0, "20 um", 0, "-20 um"]; on the command line and in Python, file=PATH.'
        return [refusal(["heights"], None, "a list of heights", hint)]
    return _shape_refusals("heights", np.array(values["heights"]), values["spacing"], values["ends"], given)


def _surface_refusals(values: Mapping[str, Any], given: Fields) -> list[Refusal]:
    """Refuse what `surface_refusals` refuses, too many heights, and a given spacing that is not the surface's."""
    data = surface_at(values["surface"])
    own = data is None or data.spacing[0] == values["spacing"]
    found = surface_refusals(without(given, "spacing") if own else given, 1)
    if found or data is None:
        return found
    if not 2 <= len(data.heights) <= MOST_HEIGHTS:
        where = ["surface"]
        return [refusal(where, values["surface"], f"2 to {MOST_HEIGHTS} heights", f"It has {len(data.heights)}.")]
    return _shape_refusals("surface", data.heights, data.spacing[0], values["ends"], given)


def _shape_refusals(
    field: str, level: np.ndarray[Any, Any], spacing: float, ends: str | None, given: Fields
) -> list[Refusal]:
    """Refuse heights that are too long, too short or too steep; field: the field that holds them."""
    if not 1e-6 <= len(level) * spacing <= LONGEST * (1.0 + 1e-9):
        where = ["surface" if field == "surface" else "spacing"]
        allowed = f"a length (heights times spacing) of 1 um to {LONGEST:g} m"
        return [refusal(where, given.get(where[0]), allowed, f"It is {len(level) * spacing:g} m.")]
    closed = level if ends == MIRROR else np.append(level, level[0])
    slopes = np.abs(np.diff(closed.astype(np.float64))) / spacing
    worst = int(np.argmax(slopes))
    if slopes[worst] <= STEEPEST:
        return []
    between = f"from height {worst} to {worst + 1}"
    hint = f"The slope {between} is {slopes[worst]:.4g}. Remove the step or the spike, or correct spacing."
    if worst == len(level) - 1:
        between = "from the last height back to the first"
        hint = f"The slope {between} is {slopes[worst]:.4g}: the period does not close. "
        hint += f'Remove the trend, or write ends "{MIRROR}".'
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
    """Return the `fields` of a texture with `file` replaced by its heights. Raises SceneError and OSError.

    More than MOST_INLINE heights, or those of a named surface, become a surface that this process knows. `file` then
    stays, as a note.
    """
    path = fields.get("file")
    if not isinstance(path, str) or not path:
        return dict(fields)
    if fields.get("heights") is not None:
        _refuse(Path(path), "heights or file, not both", "Leave one out.")
    named = fields.get("surface")
    if isinstance(named, str) and surface_at(named) is not None:
        return dict(fields)
    heights = read_heights(Path(path))
    if len(heights) <= MOST_INLINE and named is None:
        return {name: value for name, value in fields.items() if name != "file"} | {"heights": heights.tolist()}
    address = remember(SurfaceData(heights.astype(np.float32), (_spacing_of(fields),)))
    if named not in (None, address):
        _refuse(Path(path), "the file that the surface was read from", "It has other heights now. Leave surface out.")
    return {**fields, "surface": address, "file": str(Path(path).absolute())}


def _spacing_of(fields: Mapping[str, Any]) -> float:
    """Return the spacing (m) that `fields` give. Raises SceneError."""
    given = fields.get("spacing")
    try:
        return SPACING.read(USUAL_SPACING if given is None else given)
    except PydanticCustomError as error:
        raise SceneError([Fault("/texture/spacing", shown(given), **words_of(error))]) from error


def written(fields: Mapping[str, Any], values: Mapping[str, Any]) -> dict[str, Any]:
    """Return the document of a texture. For a surface read from a file, it has the spacing and the path of the file.

    fields: of the texture.
    values: the same fields as numbers in SI units.
    """
    if values["surface"] is None:
        return dict(fields)
    kept = without(fields, "heights", "spacing")
    if values["file"] is None:
        return kept
    data = surface_at(values["surface"])
    assert data is not None, "the scene was checked where the surface was known"
    return {**kept, "spacing": data.spacing[0], "file": values["file"]}


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
                )  # maps the file, so a false size in the header allocates no memory
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
