"""SURFACES: finger and texture as height profiles, one file per kind of texture. `profile` is their common interface.

Stage   SURFACES: between SCENE and the contact. The contact reads heights from a profile and never depends on its kind.
Model   h_texture(x - p) - h_finger(x) replaces the two cosines of eq. 2. The phase is theta = p / period, in turns.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from synth.response_cache import kept
from synth.scene.texture_registry import kinds
from synth.surfaces.profile import Profile

if TYPE_CHECKING:  # not at run time: a scene imports the kinds while it is being declared
    from synth.scene.scene import Scene
    from synth.scene.texture_section import Texture


def profile_of(scene: Scene) -> Profile:
    """Return the texture of `scene`. Profiles are kept with their tables and bounds (`PARTS`)."""
    return met_by(scene, _made(scene.texture))


def met_by(scene: Scene, profile: Profile) -> Profile:
    """Return `profile`, as an area if it is a line on which the finger of `scene` is turned."""
    if not scene.scan.turned:
        return profile
    from synth.scene.line_scan import turned_on_line
    from synth.surfaces.grooves import Grooves

    return Grooves(profile) if turned_on_line(scene) else profile


@kept
def _made(texture: Texture) -> Profile:
    profile: Profile = kinds()[texture.kind].make(texture.values())
    return profile
