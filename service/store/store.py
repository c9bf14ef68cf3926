"""The store of imported textures: names of owners, and surfaces by their content.

Model: a surface is stored once, under its address. A texture is a name of an owner that points to a surface. Each call
    reads or changes the database (`texture_database`) once.
"""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from service.store.stored_texture import StoredTexture
from service.store.texture_database import UNREADABLE, TextureDatabase
from service.store.texture_names import NAME, check_name, is_built_in, numbered
from synth.errors import CannotRender, Fault, NameTaken, SceneError, shown
from synth.scene.catalogue import CatalogueEntry, catalogue_names, lookup

if TYPE_CHECKING:  # a list of textures needs neither numpy nor scenes
    from synth.surfaces.surface_data import SurfaceData

COLUMNS = "name, address, kind, report, created"  # of a row of the table textures


class StoreFull(CannotRender):
    """The owner's quota has no room for the texture."""


@dataclass(frozen=True, slots=True)
class Quota:
    """What one owner may keep: how many textures, and bytes of surfaces. None: no bound."""

    textures: int | None = None
    bytes: int | None = None


@dataclass(frozen=True, slots=True)
class Store:
    """The store in `folder`. Stores of the same folder are equal.

    tells_folder: whether errors name the folder.
    """

    folder: Path
    tells_folder: bool = field(default=False, compare=False)

    @property
    def _database(self) -> TextureDatabase:
        return TextureDatabase(self.folder, self.tells_folder)

    def keep(
        self, owner: str, name: str, surface: SurfaceData, kind: str, report: Mapping[str, Any], quota: Quota
    ) -> StoredTexture:
        """Keep `surface` as `name` of `owner`; keeping the same surface again changes nothing, or mends a damaged row.

        Raises InvalidRequest for a name that is not allowed, NameTaken, StoreFull, and CannotRender for a full disk.
        """
        import numpy as np

        check_name(name)
        heights = np.ascontiguousarray(surface.heights, "<f4")
        shape, spacing = json.dumps(surface.heights.shape), json.dumps(surface.spacing)
        with self._database.writing() as database:
            known = _row(database, owner, name)
            if known is not None and known.address != surface.address:
                raise NameTaken(f"a texture called {name} exists already. Choose another name, or delete it first.")
            database.execute(  # the same again, unless the surface is damaged: an import mends it
                "INSERT OR REPLACE INTO surfaces VALUES (?, ?, ?, ?)",
                (surface.address, shape, spacing, heights.data.cast("B")),
            )
            if known is None:
                database.execute(
                    "INSERT INTO textures (owner, name, address, kind, report) VALUES (?, ?, ?, ?, ?)",
                    (owner, name, surface.address, kind, json.dumps(report)),
                )
                _check_quota(database, owner, quota)
            kept = _row(database, owner, name)
        assert kept is not None
        return kept

    def textures(self, owner: str) -> list[StoredTexture]:
        """Return the textures of `owner`, by name."""
        with self._database.reading() as database:
            rows = database.execute(f"SELECT {COLUMNS} FROM textures WHERE owner = ? ORDER BY name", (owner,))
            return [_texture(row) for row in rows]

    def find(self, owner: str, name: str) -> StoredTexture | None:
        """Return the texture `name` of `owner`, or None."""
        if not NAME.fullmatch(name):
            return None
        with self._database.reading() as database:
            return _row(database, owner, name)

    def newest(self, kind: str, most: int) -> list[StoredTexture]:
        """Return the newest `most` textures of a kind and all owners, the newest first; each surface once."""
        query = (
            "SELECT name, address, kind, report, max(created) FROM textures WHERE kind = ? GROUP BY address "
            "ORDER BY max(created) DESC, max(rowid) DESC LIMIT ?"
        )
        with self._database.reading() as database:
            return [_texture(row) for row in database.execute(query, (kind, most))]

    def rename(self, owner: str, name: str, new: str) -> StoredTexture | None:
        """Rename the texture `name` of `owner`; None if there is none. Raises InvalidRequest, NameTaken."""
        check_name(new)
        with self._database.writing() as database:
            if _row(database, owner, name) is None:
                return None
            if new != name and _row(database, owner, new) is not None:
                raise NameTaken(f"a texture called {new} exists already. Choose another name, or delete it first.")
            database.execute("UPDATE textures SET name = ? WHERE owner = ? AND name = ?", (new, owner, name))
            return _row(database, owner, new)

    def adopt(self, former: str, owner: str) -> int:
        """Give the textures of `former` to `owner`; return their number. Without any, nothing is written.

        A texture whose name `owner` has for another surface gets a number after its name.
        """
        if not self.textures(former):
            return 0
        with self._database.writing() as database:
            rows = database.execute("SELECT name, address FROM textures WHERE owner = ?", (former,)).fetchall()
            for name, address in rows:
                known = _row(database, owner, name)
                if known is not None and known.address == address:
                    database.execute("DELETE FROM textures WHERE owner = ? AND name = ?", (former, name))
                    continue
                free = next(
                    new
                    for new in numbered(name)
                    if _row(database, owner, new) is None and (new == name or _row(database, former, new) is None)
                )
                change = "UPDATE textures SET owner = ?, name = ? WHERE owner = ? AND name = ?"
                database.execute(change, (owner, free, former, name))
        return len(rows)

    def has(self, owner: str, address: str) -> bool:
        """Return whether a texture of `owner` has the surface with `address`."""
        with self._database.reading() as database:
            query = "SELECT 1 FROM textures WHERE owner = ? AND address = ?"
            return database.execute(query, (owner, address)).fetchone() is not None

    def delete(self, owner: str, name: str) -> bool:
        """Delete the texture `name` of `owner`, and its surface unless another texture has it; return if it existed."""
        with self._database.writing() as database:
            found = database.execute("DELETE FROM textures WHERE owner = ? AND name = ?", (owner, name)).rowcount
            database.execute("DELETE FROM surfaces WHERE address NOT IN (SELECT address FROM textures)")
        return found > 0

    def surface(self, address: str) -> SurfaceData | None:
        """Return the surface with `address`, or None. The last few stay in memory."""
        return _cached_surface(self._database, address)

    def named(self, document: Any, owner: str) -> Any:
        """Return the `document` of a scene, whole or partial, with a name of `owner` replaced by its surface.

        A name that is no kind, and neither in the catalogue nor in the store, stays; the scene is then refused. Raises
        SceneError if the nearest known name is that of a texture of `owner`.
        """
        texture = document.get("texture") if isinstance(document, Mapping) else None
        name = texture.get("kind") if isinstance(texture, Mapping) else None
        if not isinstance(texture, Mapping) or not isinstance(name, str) or is_built_in(name):
            return document
        found = self.find(owner, name)
        if found is None:
            self._check_misspelt(name, owner)
            return document
        given = {field: value for field, value in texture.items() if field != "kind"}
        return {**document, "texture": {**found.texture, **given}}

    def owned(self, document: Any, owner: str) -> Any:
        """Return what `named` does. Raises SceneError too if `owner` has no texture with the surface of `document`.

        An address that nobody has is refused in the same words, so that nobody can find out which addresses exist.
        """
        texture = document.get("texture") if isinstance(document, Mapping) else None
        address = texture.get("surface") if isinstance(texture, Mapping) else None
        if isinstance(address, str) and not self.has(owner, address):
            allowed = "the address of a surface that you have imported here"
            raise SceneError([Fault("/texture/surface", shown(address), allowed, "Import its file here first.")])
        return self.named(document, owner)

    def entry(self, owner: str, name: str) -> CatalogueEntry | StoredTexture:
        """Return the texture `name` of the catalogue or of `owner`; raises SceneError with the nearest name."""
        if name in catalogue_names():
            return lookup(name)
        found = self.find(owner, name)
        return lookup(name, [texture.name for texture in self.textures(owner)]) if found is None else found

    def _check_misspelt(self, name: str, owner: str) -> None:
        """Raise SceneError if the known name nearest to `name` is that of a texture of `owner`."""
        from synth.scene.rules import nearest
        from synth.scene.texture_registry import kinds

        own = [texture.name for texture in self.textures(owner)]
        near = nearest(name, [*kinds(), *catalogue_names(), *own])
        if near in own:
            allowed = "a kind of texture, a name from the catalogue, or the name of an imported texture"
            raise SceneError([Fault("/texture/kind", shown(name), allowed, f'Write "{near}".')])


def _texture(row: tuple[str, str, str, str, str]) -> StoredTexture:
    name, address, kind, report, created = row
    try:
        return StoredTexture(name, address, kind, json.loads(report), created)
    except ValueError as error:
        raise CannotRender(UNREADABLE) from error


def _row(database: sqlite3.Connection, owner: str, name: str) -> StoredTexture | None:
    query = f"SELECT {COLUMNS} FROM textures WHERE owner = ? AND name = ?"
    row = database.execute(query, (owner, name)).fetchone()
    return None if row is None else _texture(row)


def _check_quota(database: sqlite3.Connection, owner: str, quota: Quota) -> None:
    """Raise StoreFull if the textures of `owner`, with a new one, are more than `quota` allows."""
    (count,) = database.execute("SELECT count(*) FROM textures WHERE owner = ?", (owner,)).fetchone()
    if quota.textures is not None and count > quota.textures:
        raise StoreFull(f"You have {quota.textures} textures, the most that are kept. Delete one first.")
    query = "SELECT coalesce(sum(length(heights)), 0) FROM surfaces WHERE address IN "
    (size,) = database.execute(f"{query} (SELECT address FROM textures WHERE owner = ?)", (owner,)).fetchone()
    if quota.bytes is not None and size > quota.bytes:
        raise StoreFull(f"Your textures would have {size} bytes, and {quota.bytes} are kept. Delete one first.")


def _read_surface(database: TextureDatabase, address: str) -> SurfaceData:
    import numpy as np

    from synth.surfaces.surface_data import SurfaceData

    with database.reading() as connection:
        query = "SELECT shape, spacing, heights FROM surfaces WHERE address = ?"
        row = connection.execute(query, (address,)).fetchone()
    if row is None:
        raise KeyError(address)
    shape, spacing, heights = row
    damaged = CannotRender(f"the surface {address[:12]} is damaged. Import it again.")
    try:
        found = SurfaceData(np.frombuffer(heights, "<f4").reshape(json.loads(shape)), tuple(json.loads(spacing)))
    except (ValueError, TypeError) as error:  # values of a damaged row do not fit each other
        raise damaged from error
    if found.address != address:
        raise damaged
    return found


def _cached_surface(database: TextureDatabase, address: str) -> SurfaceData | None:
    from synth.response_cache import kept

    try:
        return kept(_read_surface)(database, address)
    except KeyError:
        return None
