"""The service's view of the store: each key has an owner, and scenes may use what their owner has imported.

Model: an owner is a name, or the SHA-256 of a key without one; "" where no key is required. The command line on the
    same machine is "" too. A surface is private: its address is of use only to an owner who has imported it too. A key
    that gets a name brings its textures to the owner of that name, when the service starts.
"""

from __future__ import annotations

import logging
from typing import Any

from service.operations.owners import owner_without_name, owners, owners_of_keys
from service.operations.settings import Settings
from service.store.data_folder import data_folder
from service.store.store import Quota, Store
from synth.errors import CannotRender
from synth.scene.scene import Scene, parse_scene
from synth.scene.text import object_from_text

log = logging.getLogger("ridgewave.service")


class OwnedTextures:
    """The stored textures, with the owners and quotas of the settings."""

    def __init__(self, settings: Settings) -> None:
        self.store = Store(data_folder(settings.data_folder))
        self.quota = Quota(settings.textures_per_key, settings.texture_bytes_per_key)
        self._keys = owners_of_keys(settings)
        self._owners = owners(settings)

    def adopt(self) -> None:
        """Give each owner with a name what its keys imported before they had the name."""
        for key, owner in self._keys.items():
            former = owner_without_name(key)
            if owner == former:
                continue
            try:
                adopted = self.store.adopt(former, owner)
            except CannotRender as error:
                log.error("the textures of a key of %s do not belong to %s yet: %s", owner, owner, error.reason)
                continue
            if adopted:
                log.info("%d textures of a key of %s now belong to %s", adopted, owner, owner)

    def owner(self, key: int | None) -> str:
        """Return the owner of a request. key: number of its owner, None without keys."""
        return "" if key is None else self._owners[key]

    def has(self, key: int | None, address: str) -> bool:
        """Return whether the owner with number `key` has imported the surface with `address`."""
        return self.store.has(self.owner(key), address)

    def named(self, document: Any, key: int | None) -> Any:
        """Return the `document` of a scene, whole or partial, with a name of `key` replaced by its surface.

        Raises SceneError for the address of a surface that the owner has not imported.
        """
        return self.store.owned(document, self.owner(key))

    def scene(self, text: bytes, key: int | None) -> Scene:
        """Return the scene in JSON `text`, which may name what `key` has imported. Raises SceneError."""
        return parse_scene(self.named(object_from_text(text), key))
