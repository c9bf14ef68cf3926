"""Reads the body of a request for a picture: a scene, and how finely it is drawn.

The pointers of faults point into the body, where the scene is the field `scene`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

from service.compute.area_picture import MOST_AREA
from service.problems import Problem, of, refused
from synth.errors import Fault, InvalidRequest, SceneError, shown
from synth.scene.scene import Scene, parse_scene
from synth.scene.text import object_from_text

PICTURE_FIELDS = ("scene", "points", "phases", "area")


def read_picture(
    text: bytes, scene_of: Callable[[object], Scene] = parse_scene
) -> tuple[Scene, int | None, int | None, int]:
    """Return the scene, points, phases and area in the body of a picture request.

    Points and phases are None where they are left out.

    scene_of: returns the scene of a document.
    Raises Problem for an invalid body, SceneError with pointers into the body for an invalid scene.
    """
    try:
        document = object_from_text(text)
    except SceneError as error:
        problem = of(error)
        raise Problem("request-refused", problem.detail, problem.faults) from error
    unknown = [name for name in document if name not in PICTURE_FIELDS]
    if unknown:
        raise refused("", shown(unknown[0]), f"the fields {', '.join(PICTURE_FIELDS)}", "Leave it out.")
    area = _whole_number(document, "area") or 0
    if not 0 <= area <= MOST_AREA:
        raise InvalidRequest([Fault("/area", shown(area), f"0 to {MOST_AREA}", "Leave area out for a line only.")])
    return (
        _picture_scene(document.get("scene", {}), scene_of),
        _whole_number(document, "points"),
        _whole_number(document, "phases"),
        area,
    )


def _picture_scene(document: Any, scene_of: Callable[[object], Scene]) -> Scene:
    if not isinstance(document, dict):
        raise refused("/scene", shown(document), "a scene, an object", "Write {} for the default.", "scene-refused")
    with scene_in_body():
        return scene_of(document)


@contextmanager
def scene_in_body() -> Iterator[None]:
    """Let the pointers of a SceneError point into the field `scene` of the body."""
    try:
        yield
    except SceneError as error:
        raise SceneError([replace(fault, pointer="/scene" + fault.pointer) for fault in error.faults]) from error


def _whole_number(document: dict[str, object], name: str) -> int | None:
    value = document.get(name)
    whole = int(value) if isinstance(value, float) and value.is_integer() else value  # JSON Schema: 32.0 is an integer
    if whole is not None and (isinstance(whole, bool) or not isinstance(whole, int)):
        raise InvalidRequest([Fault(f"/{name}", shown(value), "a whole number", f"Leave {name} out for the default.")])
    return whole
