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
    return _made(scene.texture)


@kept
def _made(texture: Texture) -> Profile:
    profile: Profile = kinds()[texture.kind].make(texture.values())
    return profile
