"""The service's view of the store: the keys are its owners, and scenes may name what their key has imported.

Model: an owner is the SHA-256 of a key, so that the database holds no key; "" where no key is required. The command
    line on the same machine is "" too.
"""

from __future__ import annotations

from hashlib import sha256
from typing import Any

from service.operations.settings import Settings
from service.store.data_folder import data_folder
from service.store.store import Quota, Store
from synth.scene.scene import Scene, parse_scene
from synth.scene.text import object_from_text


class OwnedTextures:
    """The stored textures, with the owners and quotas of the settings."""

    def __init__(self, settings: Settings) -> None:
        self.store = Store(data_folder(settings.data_folder))
        self.quota = Quota(settings.textures_per_key, settings.texture_bytes_per_key)
        self._owners = tuple(sha256(key.encode()).hexdigest() for key in settings.api_keys)

    def owner(self, key: int | None) -> str:
        """Return the owner of a request. key: number of its key, None without keys."""
        return "" if key is None else self._owners[key]

    def named(self, document: Any, key: int | None) -> Any:
        """Return the `document` of a scene, whole or partial, with a name of `key` replaced by its surface."""
        return self.store.named(document, self.owner(key))

    def scene(self, text: bytes, key: int | None) -> Scene:
        """Return the scene in JSON `text`, which may name what `key` has imported. Raises SceneError."""
        return parse_scene(self.named(object_from_text(text), key))
