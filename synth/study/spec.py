"""A study as a person writes it: a scene, axes, and how they are combined. It gives its scenes by number.

Stage   STUDY.
Model   {"scene": ..., "axes": {field: values, ...}, "sample": null, "phases": 256, "lines": 32, "skin": false,
         "figure": null, "most_scenes": 200000, "textures": {}}
        Without `sample` every combination of the axes is a scene; the last axis changes first. With it, scenes are
        drawn between the ends of each axis (`samples`). `figure` names what draws it, and changes no number. `textures`
        gives names to textures, for an axis `texture.kind`.
        Fields are merged into the scene as a PATCH request does. Groups come last: contact length, texture and load
        follow from them (`contact.groups`).
Limits  A combination that is no scene is recorded with its reason and does not stop the others.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from copy import deepcopy
from dataclasses import asdict, dataclass, field, replace
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np

from synth.contact.groups import with_groups
from synth.errors import Fault, SceneError, shown
from synth.scene.catalogue import catalogue_names
from synth.scene.merge import merge_patch
from synth.scene.scene import Scene, parse_scene, scene_document
from synth.scene.text import object_from_text
from synth.scene.texture_registry import kinds
from synth.study.axes import GROUPS, Axis, read_axis
from synth.study.samples import LARGEST, POINTS, Sample, read_sample, whole_number
from synth.study.variables import VARIABLES, shape_of

FIELDS = ("scene", "axes", "sample", "phases", "lines", "skin", "figure", "most_scenes", "textures")
KIND = "texture.kind"
PHASES, LEAST_PHASES, MOST_PHASES = 256, 16, 1 << 16
LINES, MOST_LINES = 32, 4096
MOST_SCENES = 200_000
MOST_BYTES = 8 << 30  # of the result
FOLDER = Path(__file__).with_name("specs")


@dataclass(frozen=True, slots=True)
class StudySpec:
    """A checked study.

    scene: document of the scene that the axes change.
    axes: in the order in which they were written.
    sample: None: every combination.
    phases: solutions per period of the texture.
    lines: recorded lines.
    skin: whether what the receptors of the skin feel is recorded, too.
    figure: name of the figure that shows it; None for the usual one.
    textures: the section of a texture for each name that only this study has.
    """

    scene: dict[str, Any]
    axes: tuple[Axis, ...]
    sample: Sample | None
    phases: int
    lines: int
    skin: bool = False
    figure: str | None = None
    textures: dict[str, dict[str, Any]] = field(default_factory=dict)

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of scenes along each dimension of the result."""
        axes = self.axes
        return (self.sample.scenes(len(axes)),) if self.sample else tuple(len(axis.values) for axis in axes)

    @property
    def count(self) -> int:
        """Number of scenes."""
        return math.prod(self.shape)

    @property
    def listed(self) -> bool:
        """Whether the axes list the values of every scene."""
        return self.sample is not None and self.sample.kind == POINTS

    def columns(self) -> dict[str, list[Any]]:
        """Return the value of every axis in every scene, in the order of their numbers."""
        if self.listed:
            return {axis.name: list(axis.values) for axis in self.axes}
        if self.sample is not None:
            drawn = self.sample.drawn(len(self.axes))
            return {axis.name: axis.at(part).tolist() for axis, part in zip(self.axes, drawn.T, strict=True)}
        places = np.unravel_index(np.arange(self.count), self.shape)
        return {
            axis.name: [axis.values[place] for place in along.tolist()]
            for axis, along in zip(self.axes, places, strict=True)
        }

    def document(self) -> dict[str, Any]:
        """Return the spec as JSON, with numbers in SI."""
        axes: dict[str, Any] = {axis.name: list(axis.values) for axis in self.axes}
        if self.sample is not None and not self.listed:
            spacing = {True: "log", False: "linear"}
            axes = {
                one.name: {"from": one.values[0], "to": one.values[1], "spacing": spacing[one.log]} for one in self.axes
            }
        sample = None if self.sample is None else {"kind": POINTS} if self.listed else asdict(self.sample)
        asked: dict[str, Any] = {"phases": self.phases, "lines": self.lines, "skin": self.skin}
        if self.textures:
            asked["textures"] = self.textures
        return {"scene": self.scene, "axes": axes, "sample": sample, **asked}

    @property
    def key(self) -> str:
        """A hash of everything that decides its numbers."""
        return sha256(json.dumps(self.document(), sort_keys=True).encode()).hexdigest()


def scene_at(base: dict[str, Any], values: Mapping[str, Any], textures: Mapping[str, dict[str, Any]]) -> Scene:
    """Return the scene with the values of all axes. Raises SceneError where they are no scene.

    textures: as of the spec.
    """
    patch: dict[str, Any] = {}
    groups = {}
    for written, given in sorted(values.items(), key=lambda one: one[0] != KIND):  # its fields, then those of the axes
        own = textures.get(given) if written == KIND and isinstance(given, str) else None
        name, value = (written, given) if own is None else ("texture", own)
        *above, last = name.split(".")
        if above == [GROUPS]:
            groups[last] = float(given)
            continue
        inner = patch
        for part in above:
            inner = inner.setdefault(part, {})
        inner[last] = inner.get(last, {}) | deepcopy(value) if isinstance(value, dict) else value
    scene = parse_scene(merge_patch(base, patch))
    return with_groups(scene, groups) if groups else scene


def read_spec(document: object) -> StudySpec:
    """Return the study that `document` describes: a mapping, or JSON text. Raises SceneError with every fault found."""
    written = object_from_text(document) if isinstance(document, str | bytes) else document
    if not isinstance(written, Mapping):
        raise _refused("", written, f"an object with {', '.join(FIELDS)}", 'Write {"axes": {...}}.')
    for name in written:
        if name not in FIELDS:
            raise _refused(f"/{name}", written[name], f"one of {', '.join(FIELDS)}", "Check the spelling.")
    scene = scene_document(parse_scene({} if written.get("scene") is None else written["scene"]))
    axes, faults, sample = written.get("axes"), list[Fault](), read_sample(written.get("sample"))
    if not isinstance(axes, Mapping) or not axes:
        hint = 'Write, for example, {"texture.period": {"from": "0.1 mm", "to": "10 mm", "count": 50}}.'
        raise _refused("/axes", axes, "at least one field with its values", hint)
    found = []
    for name, values in axes.items():
        try:
            found.append(read_axis(str(name), values, sampled=sample is not None and sample.kind != POINTS))
        except SceneError as error:
            faults += error.faults
    if faults:
        raise SceneError(faults)
    _apart(found)
    if sample is not None and sample.kind == POINTS:
        sample = Sample(POINTS, _same_length(found), 0)
    phases = whole_number(written, "phases", PHASES, LEAST_PHASES, MOST_PHASES)
    if phases & (phases - 1):
        raise _refused("/phases", phases, "a power of two", f"Write {1 << phases.bit_length()}.")
    lines = whole_number(written, "lines", LINES, 1, MOST_LINES)
    skin = written.get("skin", False)
    if not isinstance(skin, bool):
        raise _refused("/skin", skin, "true or false", "Write true to record what the receptors feel.")
    figure = written.get("figure")
    if figure is not None and not isinstance(figure, str):
        raise _refused("/figure", figure, "the name of a figure", "Leave it out for the usual one.")
    spec = StudySpec(scene, tuple(found), sample, phases, lines, skin, figure, _textures(written.get("textures")))
    most = whole_number(written, "most_scenes", MOST_SCENES, 1, LARGEST)
    if spec.count > most:
        sizes = " x ".join(map(str, spec.shape))
        hint = f"Write fewer values, or most_scenes {spec.count} if you mean it."
        raise _refused("/axes", f"{sizes} = {spec.count} scenes", f"at most {most} scenes", hint)
    nbytes = 8 * spec.count * sum(math.prod(shape_of(one, lines)) for one in VARIABLES)
    if nbytes > MOST_BYTES:
        hint = "Write fewer scenes or fewer lines."
        raise _refused("/lines", lines, f"a result of at most {MOST_BYTES >> 30} GB; this has {nbytes >> 30}", hint)
    _words_fit(spec)
    return spec


def _textures(written: object) -> dict[str, dict[str, Any]]:
    """Return the textures that a study names."""
    if written is None:
        return {}
    if not isinstance(written, Mapping):
        raise _refused("/textures", written, "an object with a texture for each name", 'Write {"mine": {...}}.')
    for name, section in written.items():
        if name in kinds() or name in catalogue_names():
            raise _refused("/textures", name, "a name that no kind and no texture of the catalogue has", "Rename it.")
        if not isinstance(section, Mapping):
            raise _refused(f"/textures/{name}", section, "a texture", 'Write {"kind": "sinusoid", "period": "1 mm"}.')
    return {str(name): dict(section) for name, section in written.items()}


def _apart(axes: list[Axis]) -> None:
    """Refuse two axes that set the same field: one of them would be a false label."""
    owners: dict[str, str] = {}
    for axis in axes:
        for one in axis.fields:
            if one in owners:
                allowed = f"axes that set different fields; {one} is set twice"
                raise _refused(f"/axes/{axis.name}", axis.name, allowed, f"Leave it or {owners[one]} out.")
            owners[one] = axis.name


def _same_length(axes: list[Axis]) -> int:
    """Return the number of values of every axis; raises SceneError where they differ."""
    count = len(axes[0].values)
    for axis in axes:
        if len(axis.values) != count:
            hint = 'Write one value of each axis for every scene, or leave "sample" out for every combination.'
            allowed = f"{count} values, as {axes[0].name} has"
            raise _refused(f"/axes/{axis.name}", f"{len(axis.values)} values", allowed, hint)
    return count


def _words_fit(spec: StudySpec) -> None:
    """Refuse words, such as the names of textures, that no scene has, before anything is computed."""
    for name in spec.textures:
        try:
            scene_at(spec.scene, {KIND: name}, spec.textures)
        except SceneError as error:
            at = f"/textures/{name.replace('~', '~0').replace('/', '~1')}"
            faults = [replace(one, pointer=at + one.pointer.removeprefix("/texture")) for one in error.faults]
            raise SceneError(faults) from None
    for axis in spec.axes:
        for number, value in enumerate(axis.values):
            if isinstance(value, float | int):
                continue
            try:
                scene_at(spec.scene, {axis.name: value}, spec.textures)
            except SceneError as error:
                at = f"/axes/{axis.name}/{number}"
                raise SceneError([replace(one, pointer=at + one.pointer) for one in error.faults]) from None


def _refused(where: str, value: object, allowed: str, hint: str) -> SceneError:
    return SceneError([Fault(where, shown(value), allowed, hint)])


def ready_names() -> list[str]:
    """Return the names of the ready studies, sorted."""
    return sorted(path.stem for path in FOLDER.glob("*.json"))


def ready_text(name: str) -> str:
    """Return the spec `name`, one of `ready_names`, as JSON text."""
    return (FOLDER / f"{name}.json").read_text("utf-8")
