"""The textures that the user of this machine has imported, for the command line and Python: those of the owner "".

Limits: the folder is that of RIDGEWAVE_DATA_FOLDER or of the platform. A service without keys that has the same folder
    shows the same textures.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from service.store.data_folder import folder_of_environment
from service.store.store import Store
from service.store.stored_texture import StoredTexture
from synth.errors import SceneError
from synth.scene.array_values import is_array
from synth.scene.catalogue import CatalogueEntry


def own_store() -> Store:
    """Return the user's store."""
    return Store(folder_of_environment(), tells_folder=True)


def texture_named(name: str) -> CatalogueEntry | StoredTexture:
    """Return the texture called `name`, of the catalogue or imported. If there is none, raise SceneError."""
    return own_store().entry("", name)


def with_imported(document: Any) -> Any:
    """Return the `document` of a scene, whole or partial, with the name of a texture replaced by its surface.

    Scenes of this process can then use the user's surfaces.
    """
    from synth.surfaces.surface_data import add_source

    store = own_store()
    add_source(store.surface)
    return store.named(document, "")


def study_with_imported(document: dict[str, Any]) -> dict[str, Any]:
    """Return the spec of a study with the user's textures under the names that its axis `texture.kind` has.

    Raises SceneError with a pointer into the spec for a name that is nearly one of them.
    """
    axes, named, found = document.get("axes"), document.get("textures") or {}, {}
    kinds: Any = axes.get("texture.kind") if isinstance(axes, Mapping) else None
    kinds = kinds.tolist() if is_array(kinds) else kinds
    if not isinstance(kinds, list | tuple) or not isinstance(named, Mapping):
        return document
    for number, one in enumerate(kinds):
        try:
            texture = with_imported({"texture": {"kind": one}})["texture"]
        except SceneError as error:
            faults = [replace(fault, pointer=f"/axes/texture.kind/{number}") for fault in error.faults]
            raise SceneError(faults) from None
        if texture != {"kind": one}:
            found[one] = texture
    return document | {"textures": found | dict(named)}
