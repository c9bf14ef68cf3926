"""SCENE: a finger, a texture, a scan, effects, and the requested output, checked and frozen, in SI units.

Stage: 1 (SCENE). All later stages take a `Scene` and do not check it again.
Model: a scene is written as JSON. A number is in SI units and text has its unit; null or absent means the default. The
files named after the sections declare the fields; docs/scene.md describes them for users.
Limits: an invalid document is refused with all of its faults at once (the first 100).
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Annotated, Any, BinaryIO, NoReturn

from pydantic import Field, ValidationError

from synth.errors import Fault, SceneError, shown
from synth.scene.catalogue import catalogue_names, lookup
from synth.scene.effects_section import Effects, FrozenMapping, declaration, lowest_load, misplaced
from synth.scene.finger_section import Finger
from synth.scene.output_section import Accuracy, Channel, Output
from synth.scene.point_columns import in_order
from synth.scene.rules import MOST_FAULTS, Fields, Quantity, Refusal
from synth.scene.scan_section import Scan
from synth.scene.section import Section, inner_section, plain, rule_of, section_schema
from synth.scene.sound_scene import CALLED, HEAD_BYTES, document_in_sound, is_sound
from synth.scene.text import json_text, object_from_text, pointer
from synth.scene.texture_registry import with_files
from synth.scene.texture_section import Texture
from synth.scene.trajectory import CLOCK, LOWEST_LOAD, since

GROUPS = "synth.contact.groups"  # of a later stage, which a scene loads when it is asked for them


class Scene(Section):
    """A scene: the surfaces that touch, their motion, and the requested output."""

    finger: Finger = Field(default=Finger(), description="The finger that touches the sample.")
    texture: Texture = Field(default=Texture(), description="The sample under the finger.")
    scan: Scan = Field(default=Scan(), description="Motion and load of the finger.")
    effects: Annotated[FrozenMapping, Effects()] = Field(
        default=FrozenMapping(),
        description="Physical causes beyond the contact, by name. An absent one is not simulated.",
    )
    output: Output = Field(default=Output(), description="Quantity, rate, number and scale of the samples.")
    accuracy: Accuracy = Field(default=Accuracy(), description="The permitted error of the samples.")

    def __init__(self, **sections: Any) -> None:
        """Read the sections, as `parse_scene` reads a mapping. Raises SceneError."""
        context = {LOWEST_LOAD: lowest_load(sections.get("effects"))}
        try:
            self.__pydantic_validator__.validate_python(sections, self_instance=self, context=context)
        except ValidationError as error:
            raise SceneError(list(_faults(error))) from None

    # Without this mark pydantic would also call __init__ for `model_validate`, and its SceneError would end that check.
    __init__.__pydantic_base_init__ = True  # type: ignore[attr-defined]

    def json_text(self) -> str:
        """Return the scene as JSON text, with numbers in SI, which `from_json` and every command read back."""
        return json.dumps(self.document(), allow_nan=False)

    @classmethod
    def from_json(cls, text: str | bytes) -> Scene:
        """Return the scene that JSON `text` describes. Raises SceneError."""
        if not isinstance(text, str | bytes | bytearray | memoryview):
            hint = "Write the text itself, such as Path(...).read_text(). rw.parse_scene takes mappings and paths."
            raise SceneError([Fault("", shown(text), "JSON text", hint)])
        return parse_scene_text(text)

    @classmethod
    def from_groups(cls, scene: object = None, **groups: float) -> Scene:
        """Return `scene` with given dimensionless groups of eq. 7; the other fields are kept.

        scene: None for the default; a scene, a mapping, or a name of the catalogue.
        groups: some or all of ridges (tau), period_ratio (Lambda), amplitude_ratio (A) and load (W), each above 0.
        Raises SceneError for other names, numbers out of range, and surfaces other than ridges on a sinusoid.
        Source: Fagiani & Barbieri (2016), eqs 6 and 7.

        Example: rw.Scene.from_groups(ridges=20, period_ratio=1.6, amplitude_ratio=0.5, load=1.2).groups
        """
        found: Scene = import_module(GROUPS).with_groups(parse_scene({} if scene is None else scene), groups)
        return found

    @property
    def groups(self) -> dict[str, float] | None:
        """The groups ridges, period_ratio, amplitude_ratio and load of eq. 7; None for a smooth finger."""
        found = import_module(GROUPS).Groups.of_scene(self)
        return None if found is None else dict(zip(import_module(GROUPS).NAMES, found.numbers, strict=True))

    @classmethod
    def conflicts(cls, given: Fields) -> list[Refusal]:
        """Refuse effects that need another kind of finger."""
        effects = given.get("effects")
        return list(misplaced(effects, _kind(given, "finger", "comb"))) if isinstance(effects, Mapping) else []


def _kind(given: Fields, section: str, default: str) -> str:
    """Return the kind of a section as given, or `default`."""
    kind = _written(given, section).get("kind")
    return kind if isinstance(kind, str) else default


def _written(given: Fields, section: str) -> Mapping[str, Any]:
    """Return a section as a mapping of its fields, which may be invalid."""
    found = given.get(section)
    written = found.document() if isinstance(found, Section) else found
    return written if isinstance(written, Mapping) else {}


Document = Mapping[str, Any]
SceneLike = Scene | Mapping[str, Any] | str | os.PathLike[str]
FILE_ENDINGS = (".json", ".wav", ".flac")  # of files that hold a scene
LARGEST_BYTES = 64 * 2**20  # a trajectory of one day at 10 Hz is 40 MB of text; a larger file is not a scene


def scene_from(source: SceneLike) -> Scene:
    """Return the scene that `source` is or names.

    source: a Scene (returned unchanged), a mapping as in docs/scene.md, the path of a JSON file, or a catalogue name.
        The heights of a texture may be in a file of this machine.
    Raises SceneError, which lists every fault, and OSError if a file cannot be read.
    """
    if isinstance(source, Scene):
        return source
    if isinstance(source, str | os.PathLike):
        source = document_of(source)
    return parse_scene(with_files(source))


def document_of(source: str | os.PathLike[str], named: Callable[[str], Document] | None = None) -> dict[str, object]:
    """Return the document of a JSON or sound file, or of a texture's name. Raises SceneError, OSError.

    A sound file of ridgewave has the scene that it was rendered from, or the recording.

    named: returns the document of a name, or raises SceneError; None looks the name up in the catalogue.

    A string is a catalogue name if the catalogue has it. It is also treated as a name if it contains no folder, does
    not end as a file of a scene does, and no such file exists.
    """
    if isinstance(source, str):
        _refuse_text(source)
    path = Path(source)
    looks_like_a_name = path.suffix.lower() not in FILE_ENDINGS and len(path.parts) == 1 and not path.exists()
    if isinstance(source, str) and (source in catalogue_names() or looks_like_a_name):
        return dict(lookup(source).document if named is None else named(source))
    try:
        with path.open("rb") as file:
            return _read(file, path)
    except FileNotFoundError:
        _refuse(path, "a file that exists", "Check the path.")
    except IsADirectoryError:
        _refuse(path, CALLED, "This is a folder. Name a file in it.")


def _refuse_text(source: str) -> None:
    """Refuse text that is JSON, or nothing, where the name of a texture or a file is expected."""
    allowed = "the name of a texture, or the path of a file"
    if not source.strip():
        raise SceneError([Fault("/scene", shown(source), allowed, "Write {} for the default scene.")])
    if source.lstrip().startswith(("{", "[")) and not os.path.exists(source):
        hint = "This is JSON text: save it as a file, or in Python use rw.Scene.from_json(text) or json.loads(text)."
        raise SceneError([Fault("/scene", shown(source), allowed, hint)])


def _read(file: BinaryIO, path: Path) -> dict[str, object]:
    text = file.read(HEAD_BYTES)
    if is_sound(text):
        return document_in_sound(file, str(path))
    text += file.read(LARGEST_BYTES + 1 - len(text))
    if len(text) > LARGEST_BYTES:
        _refuse(path, f"a JSON file of at most {LARGEST_BYTES} bytes", "Is this a scene?")
    return object_from_text(text)


def _refuse(path: Path, allowed: str, hint: str) -> NoReturn:
    raise SceneError([Fault("/scene", shown(str(path)), allowed, hint)])


def parse_scene(document: object) -> Scene:
    """Return the scene that `document` describes.

    document: a mapping, or a catalogue name.
    Raises SceneError, which lists every fault of the document.
    """
    if isinstance(document, Scene):
        return document
    if isinstance(document, str):
        document = lookup(document).document
    effects = document.get("effects") if isinstance(document, Mapping) else None
    document = _with_own_duration(document)
    try:
        return Scene.model_validate(document, context={LOWEST_LOAD: lowest_load(effects)})
    except ValidationError as error:
        raise SceneError(list(_faults(error))) from None


def _with_own_duration(document: object) -> object:
    """Return a document in which a recording without `output.duration` lasts from its first point to its last.

    A document that cannot be read is returned unchanged, and refused later.
    """
    if not isinstance(document, Mapping):
        return document
    points = _written(dict(document), "scan").get("trajectory")
    if points is None:
        return document
    output = document.get("output")
    given = {} if output is None else output
    if not isinstance(given, Mapping) or given.get("duration") is not None:
        return document
    try:
        points = in_order(points)
        length = since(CLOCK.read(points[0][0]), CLOCK.read(points[-1][0]))
    except (TypeError, ValueError, LookupError):
        return document
    rule = rule_of(Output, "duration")
    assert isinstance(rule, Quantity)
    return {**document, "output": {**given, "duration": min(max(length, rule.low), rule.high)}}


def parse_scene_text(text: str | bytes) -> Scene:
    """Return the scene that JSON `text` describes.

    Raises SceneError as `parse_scene` does, and if the text is not a JSON object or has the same field twice.
    """
    return parse_scene(object_from_text(text))


def channel_count(scene: Scene) -> int:
    """Return the number of channels of `scene`, including those that its effects add."""
    return len(scene.output.channel_list) + sum(declaration(name).added(scene.effects[name]) for name in scene.effects)


def scene_document(scene: Scene) -> dict[str, Any]:
    """Return the complete document of `scene`, with numbers in SI. `parse_scene` reads it back to an equal scene."""
    return scene.document()


def scene_text(scene: Scene) -> bytes:
    """Return the complete document of `scene` as compact JSON."""
    return json_text(scene_document(scene))


def scene_schema() -> dict[str, Any]:
    """Return the JSON Schema (2020-12) of a scene: description, default, unit (`x-unit`) and range of each field."""
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "ridgewave scene",
        **section_schema(Scene),
    }


@dataclass(frozen=True, slots=True)
class FieldLine:
    """One field, for documentation: dotted path, description, SI unit, default and range, all as text."""

    path: str
    description: str
    unit: str
    default: str
    allowed: str


def scene_fields() -> tuple[FieldLine, ...]:
    """Return a line for every field that holds a value. The path of a field of `channels` contains `[]`."""
    return (*_lines(Scene, ""), *_lines(Channel, "output.channels[]."))


def _lines(section: type[Section], above: str) -> Iterator[FieldLine]:
    for name, field in section.model_fields.items():
        inner = inner_section(section, name)
        if inner is not None:
            yield from _lines(inner, f"{above}{name}.")
        else:
            rule = rule_of(section, name)
            default = plain(field.default)
            shown_default = "null" if default is None else rule.show(default)
            yield FieldLine(above + name, field.description or "", rule.unit, shown_default, rule.allowed)


def _faults(error: ValidationError) -> Iterator[Fault]:
    lines = error.errors(include_url=False)
    for line in lines[:MOST_FAULTS]:
        context: Mapping[str, str] = line["ctx"]
        yield Fault(pointer(*line["loc"]), _shown(line["input"]), context["allowed"], context["hint"])
    if len(lines) > MOST_FAULTS:
        hint = "Correct the faults above first."
        yield Fault("", f"more than {MOST_FAULTS} faults", "a scene without faults", hint)


def _shown(value: object) -> str:
    if value is None or isinstance(value, bool):
        return {None: "null", True: "true", False: "false"}[value]
    try:
        return shown(value)
    except (RecursionError, ValueError):  # nested too deeply, or a whole number of thousands of digits
        return f"{type(value).__name__} too large to show"
