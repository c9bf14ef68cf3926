"""Change a scene with a partial scene.

Stage: 1 (SCENE).
Model: a JSON merge patch (RFC 7396). A field that the patch names is replaced. Null deletes a field, which then has
its default. Objects are merged field by field. In addition, some fields displace others:
- Naming `finger.kind`, `texture.kind`, `scan.stroke` or `scan.trajectory` replaces the whole section, because the
  fields of another kind have no meaning there.
- Naming `scan.speed` or `scan.load` replaces a scan that is a stroke or a trajectory. The scan becomes constant.
- An amplitude displaces a roughness, and a roughness an amplitude, in finger and texture. The same applies to other
  pairs of texture fields that write one value in two ways (`texture_registry.alternatives`).
- `output.channels` displaces `quantity` and `full_scale`. A `quantity` displaces `channels`, and displaces the full
  scale if the quantity changes.
A field that is set to null displaces nothing. Where `effects` is "auto", a patch of one effect leaves the others so.
Limits: the result is not checked; `parse_scene` checks it.
"""

from __future__ import annotations

from collections.abc import Mapping

from synth.errors import Fault, SceneError
from synth.scene.effects_section import in_full
from synth.scene.output_section import FULL_BAND, Output
from synth.scene.texture_registry import alternatives

Document = dict[str, object]

_RIDGES = {"ridge_amplitude", "roughness"}


def merge_patch(document: Mapping[str, object], patch: Mapping[str, object]) -> Document:
    """Return a new document: `document` merged with `patch`. Raises SceneError if `patch` is nested too deeply."""
    kept: Document = dict(document)
    if isinstance(patch.get("effects"), Mapping):
        kept["effects"] = in_full(kept.get("effects"))
    for section, change in patch.items():
        present = kept.get(section)
        if isinstance(change, Mapping) and isinstance(present, Mapping):
            kept[section] = _displaced(section, present, {k for k, v in change.items() if v is not None}, change)
    try:
        return _merged(kept, patch)
    except RecursionError as error:
        fault = Fault("", "JSON that is nested too deeply", "a partial scene", "A scene needs four levels.")
        raise SceneError([fault]) from error


def scene_before_bands(document: Mapping[str, object]) -> Document:
    """Return a scene of an earlier version in today's form, so that it gives the same samples.

    In earlier versions a scene without a bandwidth had the full band.
    """
    output = document.get("output")
    if output is None:
        return {**document, "output": {"bandwidth": FULL_BAND}}
    if not isinstance(output, Mapping) or output.get("bandwidth") is not None:
        return dict(document)
    return {**document, "output": {**output, "bandwidth": FULL_BAND}}


def _merged(target: object, patch: Mapping[str, object]) -> Document:
    """Return the merge of RFC 7396, section 2, for a patch that is an object."""
    result: Document = dict(target) if isinstance(target, Mapping) else {}
    for name, change in patch.items():
        if change is None:
            result.pop(name, None)
        elif isinstance(change, Mapping):
            result[name] = _merged(result.get(name), change)
        else:
            result[name] = change
    return result


def _displaced(
    section: str, present: Mapping[str, object], named: set[str], change: Mapping[str, object]
) -> Mapping[str, object]:
    """Return the present section without the fields that the named fields of the change displace."""
    given = {name for name, value in present.items() if value is not None}
    if section in ("finger", "texture") and "kind" in named:
        return {}
    if section == "scan":
        moves = named & {"stroke", "trajectory"}
        stops = named & {"speed", "load"} and given & {"stroke", "trajectory"}
        return {} if moves or stops else present
    gone: set[str] = set()
    if section == "finger":
        gone = _RIDGES if _RIDGES & named else set()
    elif section == "texture":
        gone = set().union(*map(alternatives, named))
    elif section == "output" and "channels" in named:
        gone = {"quantity", "full_scale"}
    elif section == "output" and "quantity" in named:
        quantity = present.get("quantity") or Output.model_fields["quantity"].default
        gone = {"channels"} if change["quantity"] == quantity else {"channels", "full_scale"}
    return {name: value for name, value in present.items() if name not in gone}
