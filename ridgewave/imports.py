"""Imports a measured surface into the user's own store, as `ridgewave import` does."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any


def import_texture(
    path: str | os.PathLike[str], *, name: str | None = None, dry_run: bool = False, **options: Any
) -> dict[str, Any]:
    """Read a file of measured heights, and keep it as a texture of this machine.

    path: a file as in docs/import.md. It is read in a process of its own: a damaged file can crash its reader.
    name: of the texture, for `texture.kind`; None: from the name of the file.
    dry_run: whether to report only, and keep nothing.
    options: those of `ridgewave import` without their dashes, such as unit="um", pixel="5 um", level="tilt".
    Returns {"name", "kept", "address", "report"}; docs/import.md describes the report.
    Raises InvalidRequest for an invalid file or option, and CannotRender (NameTaken for a name that exists). Nothing is
    then kept.

    Example:
        import numpy as np
        import ridgewave as rw
        np.save("comb.npy", 20e-6 * np.sin(np.arange(400) / 8))
        print(rw.import_texture("comb.npy", unit="m", pixel="10 um", dry_run=True)["report"]["peak_to_valley"])
    """
    from service.compute.import_process import read_here
    from service.store.own_textures import own_store
    from service.store.store import Quota
    from service.store.texture_names import check_name, name_from_file
    from synth.errors import Fault, InvalidRequest, shown
    from synth.surfaces.measurement.import_options import read_options

    if not isinstance(path, str | os.PathLike):
        hint = "Save the heights first, as with np.save, or write them in a scene as texture.heights or texture.rows."
        raise InvalidRequest([Fault("/file", shown(path), "the path of a file of heights", hint)])
    file = Path(path)
    read_options(options)
    chosen = name_from_file(file.name) if name is None else name
    check_name(chosen)
    found = read_here(file, options)
    if not dry_run:
        own_store().keep("", chosen, found.surface, found.report["kind"], found.report, Quota())
    return {"name": chosen, "kept": not dry_run, "address": found.surface.address, "report": found.report}
