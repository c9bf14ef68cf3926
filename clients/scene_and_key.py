"""The address, the scene and the key of a request, as both Python clients send them."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from typing import Any
from urllib.parse import urlsplit

from synth.errors import Fault, InvalidRequest, shown

LONGEST_LABEL = 63  # characters of a part of a host name (RFC 1035); resolvers raise other errors for longer ones


def checked_url(name: str, url: str, schemes: tuple[str, str], example: str) -> str:
    """Return `url`; raises InvalidRequest unless it has one of `schemes`, a host, and a valid port if it has one.

    name: of the argument. example: a valid address.
    """
    try:
        parts = urlsplit(url) if isinstance(url, str) else urlsplit("")
        labels = (parts.hostname or "").removesuffix(".").split(".")
        plain = re.fullmatch(r"[^\x00-\x20]+", str(url)) and not parts.fragment
        valid = plain and parts.scheme in schemes and all(0 < len(label) <= LONGEST_LABEL for label in labels)
        valid = valid and parts.port != 0
    except ValueError:
        valid = False
    if not valid:
        allowed = f"an address that begins with {schemes[0]}:// or {schemes[1]}://"
        raise InvalidRequest([Fault("/" + name, shown(url), allowed, f"Write {example}.")])
    return url


def scene_to_send(scene: Any) -> dict[str, Any]:
    """Return the JSON document of a scene: a mapping, a `synth.Scene`, or None for the default scene."""
    if scene is None:
        return {}
    if isinstance(scene, Mapping):
        return dict(scene)
    from synth.scene.scene import Scene as CheckedScene
    from synth.scene.scene import scene_document

    if isinstance(scene, CheckedScene):
        return scene_document(scene)
    raise InvalidRequest([Fault("", shown(scene), "a scene", 'Write {} or {"texture": {"period": "1 mm"}}.')])


def change_to_send(partial: Any) -> Mapping[str, Any]:
    """Return a partial scene; raises InvalidRequest unless it is a mapping that JSON can hold."""
    if not isinstance(partial, Mapping):
        hint = 'Write {"scan": {"load": "0.2 N"}}, for example.'
        raise InvalidRequest([Fault("", shown(partial), "a partial scene", hint)])
    json_text(partial)
    return partial


def json_text(document: Mapping[str, Any]) -> str:
    """Return a request as JSON text; raises InvalidRequest for a scene that JSON cannot hold."""
    try:
        return json.dumps(document, allow_nan=False, separators=(",", ":"))
    except (TypeError, ValueError, RecursionError) as error:
        hint = 'Write finite numbers, or strings with a unit such as "0.8 mm".'
        raise InvalidRequest(
            [Fault("", "something that is not JSON", "JSON without NaN and infinity", hint)]
        ) from error


def checked_key(key: str) -> str:
    """Return `key`; raises InvalidRequest, which does not show the key, if a header cannot hold it."""
    if not (isinstance(key, str) and re.fullmatch(r"[\x21-\x7e]+", key)):
        raise InvalidRequest(
            [Fault("/key", "(not shown)", "visible ASCII characters", "Write one of the service's keys.")]
        )
    return key
