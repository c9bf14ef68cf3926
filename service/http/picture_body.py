"""The body of `POST /v1/picture`: a scene, and how finely it is drawn."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from service.problems import Problem, of, refused
from synth.errors import AskedWrong, Fault, SceneError, shown
from synth.scene.scene import Scene, object_from_text, parse_scene

FIELDS = ("scene", "points", "phases")


def read_picture(text: bytes) -> tuple[Scene, int | None, int | None]:
    """Return scene, points and phases that the body of a picture asks for, None where it does not say.

    Raises Problem where the body makes no sense, SceneError with pointers into the body where its scene does not.
    """
    try:
        document = object_from_text(text)
    except SceneError as error:
        problem = of(error)
        raise Problem("request-refused", problem.detail, problem.faults) from error
    unknown = [name for name in document if name not in FIELDS]
    if unknown:
        raise refused("", shown(unknown[0]), f"the fields {', '.join(FIELDS)}", "Leave it out.")
    return _scene(document.get("scene", {})), _whole(document, "points"), _whole(document, "phases")


def _scene(document: Any) -> Scene:
    if not isinstance(document, dict):
        raise refused("/scene", shown(document), "a scene, an object", "Write {} for the default.", "scene-refused")
    try:
        return parse_scene(document)
    except SceneError as error:
        raise SceneError([replace(fault, pointer="/scene" + fault.pointer) for fault in error.faults]) from error


def _whole(document: dict[str, object], name: str) -> int | None:
    value = document.get(name)
    whole = int(value) if isinstance(value, float) and value.is_integer() else value  # JSON Schema: 32.0 is an integer
    if whole is not None and (isinstance(whole, bool) or not isinstance(whole, int)):
        raise AskedWrong([Fault(f"/{name}", shown(value), "a whole number", f"Leave {name} out for the default.")])
    return whole
