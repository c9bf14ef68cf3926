"""SURFACES: finger and texture as height profiles, one kind a file (`profile` says what a profile can tell).

Stage   between SCENE and the contact, which asks a profile for its heights and never for its kind.
Model   h_texture(x - p) - h_finger(x) in the place of the two cosines of eq. 2; theta = p / period in turns.
"""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

from synth.scene.texture_registry import kind_of
from synth.surfaces.profile import Profile

if TYPE_CHECKING:  # a scene asks the kinds for their fields while it is being declared
    from synth.scene.scene import Scene
    from synth.scene.surface_sections import Texture


def profile_of(scene: Scene) -> Profile:
    """Return the texture of `scene`; of the last few scenes it is kept, with what it found out about itself."""
    return _made(scene.texture)


@lru_cache(maxsize=16)
def _made(texture: Texture) -> Profile:
    profile: Profile = kind_of(texture.kind).make(texture.values())
    return profile
