"""Import of a set of maps of a material: heights in metres, and what a scene needs to continue them below the pixel.

Stage   SURFACES, from files.
Model   In this order: choose and read the maps; find the height (`map_heights`), unless it is given; convert to metres
        with the width of the sample; cut a part; find how the spectrum goes on below the pixel (`map_continuation`). A
        set is one tile, so its ends join; a part has mirrored ends.
Source  The formats of the three libraries, as their documentation tells them (`map_names`).
Limits  The maps of a set have square pixels.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from synth.errors import Fault, InvalidRequest
from synth.scene.quantity import Dimension, show_quantity
from synth.surfaces.measurement.import_options import ImportOptions
from synth.surfaces.measurement.import_report import ImportedSurface, refusals_of_a_scene, report_of
from synth.surfaces.measurement.import_units import LEAVE, option_fault
from synth.surfaces.measurement.map_continuation import continuation, fields_of
from synth.surfaces.measurement.map_heights import FoundHeights, of_both, of_normals
from synth.surfaces.readers.map_names import DISPLACEMENT, NORMAL, PACKED, ROUGHNESS
from synth.surfaces.readers.map_set import MapSet, opened_set
from synth.surfaces.readers.material_maps import alpha_of, displacement, slopes
from synth.surfaces.readers.surface_file import FEWEST_POINTS, Heights, SurfaceFile

LEFT_OUT_SHOWN = 8  # names in a note


def import_maps(path: Path, options: ImportOptions, name: str, folder: Path | None) -> ImportedSurface:
    """Return the surface of the set at `path`; the arguments are those of `import_surface`."""
    with opened_set(path, folder) as found:
        _check(options, found)
        heights, file = _heights(found, options)
        role = ROUGHNESS if ROUGHNESS in found.maps else PACKED
        wanted = options.slope is None and options.hurst is None and role in found.maps
        alpha = alpha_of(found.maps[role], role) if wanted else None
    pixel = options.pixel[0] if options.pixel else (options.width or 0.0) / heights.heights.shape[1]
    metres = heights.heights * (pixel if options.height is None else options.height)
    metres, ends = _part(metres, pixel, options)
    metres -= np.mean(metres)
    synthetic, notes = continuation(metres, pixel, ends, options, alpha)
    report = report_of(file, options, (None, None), metres, (pixel, pixel)) | {
        "missing": {"points": 0, "rule": "refuse"}
    }
    names = {role: one.name for role, one in found.maps.items()}
    report |= {
        "file": name,
        "maps": names | {"green": heights.green or None, "left_out": list(found.left_out)},
        "residual": heights.residual,
        "synthetic": synthetic,
        "texture": {"ends": ends} | (fields_of(synthetic) if synthetic else {}),
    }
    report["notes"] += [*heights.notes, *notes, *_left_out(found)]
    imported = ImportedSurface(metres, (pixel, pixel), report)
    report["notes"] += refusals_of_a_scene(imported)
    return imported


def _check(options: ImportOptions, found: MapSet) -> None:
    """Raise InvalidRequest for options that a set does not have, and for those that it needs."""
    faults: list[Fault] = []
    usual = ImportOptions()
    for name in ("unit", "resample", "level", "missing"):
        if getattr(options, name) != getattr(usual, name):
            faults.append(option_fault(name, str(getattr(options, name)), "nothing for a set of maps", LEAVE))
    if (options.width is None) == (options.pixel is None):
        value = "nothing" if options.width is None else "width and pixel"
        hint = 'Write the width of the sample that the maps show, as its library tells it, such as "2 m".'
        faults.append(option_fault("width", value, "a length: no map states its size", hint))
    if options.pixel is not None and len(set(options.pixel)) > 1:
        faults.append(option_fault("pixel", "two lengths", "square pixels", "Write one length."))
    if options.slope is not None and options.hurst is not None:
        hint = "Leave one out: each determines the other."
        faults.append(option_fault("hurst", f"{options.hurst:g}", "slope or hurst, not both", hint))
    if DISPLACEMENT in found.maps and NORMAL not in found.maps and options.height is None:
        hint = 'Write the height between black and white, such as "5 mm", or add the normal map of the set.'
        faults.append(option_fault("height", "nothing", "a length: a displacement map has no height of its own", hint))
    if DISPLACEMENT not in found.maps and options.height is not None:
        hint = f"{LEAVE} The slopes of a normal map give its heights."
        faults.append(option_fault("height", "a length", "nothing: the set has no displacement map", hint))
    if faults:
        raise InvalidRequest(faults)


def _heights(found: MapSet, options: ImportOptions) -> tuple[FoundHeights, SurfaceFile]:
    """Return the heights in pixels, or, with a height that is given, from 0 to 1; and the set as one file."""
    depth = displacement(found.maps[DISPLACEMENT]) if DISPLACEMENT in found.maps else None
    normal = found.maps.get(NORMAL)
    if depth is not None and (normal is None or options.height is not None):
        span = depth.full_scale or float(np.ptp(depth.heights)) or 1.0
        heights = FoundHeights(depth.heights / span, "", 0.0, None)
        return heights, replace(depth, layout=f"{depth.layout}, with the height that is given", spacing=None)
    assert normal is not None, "a set has one of the two"
    of_slopes, file = slopes(normal)
    notes = [one for one in file.notes if "residual" not in one]
    if depth is None:
        heights = of_normals(of_slopes, normal.green)
        layout = f"a normal map, with green pointing {heights.green}"
        notes.append(
            f"No heights have {100.0 * heights.curl:.2g} % of its slopes (rms), the residual of the integration"
        )
    else:
        heights = of_both(depth.heights, of_slopes, normal.green)
        layout = f"{depth.layout}, with the height that its normal map gives (green pointing {heights.green})"
        assert heights.residual is not None
        notes = [
            *depth.notes,
            f"The displacement map leaves {100.0 * heights.residual:.2g} % of the normals' slopes (rms)",
        ]
    read = replace(depth or file, layout=layout, notes=tuple(dict.fromkeys(notes)), spacing=None, slopes=None)
    return heights, read


def _part(heights: Heights, pixel: float, options: ImportOptions) -> tuple[Heights, str]:
    """Return the square in the middle with the side `part`, or all heights; and how their ends continue."""
    if options.part is None:
        return heights, "join"
    count, most = round(options.part / pixel), min(heights.shape)
    if not FEWEST_POINTS <= count <= most:
        low, high = (show_quantity(float(f"{n * pixel:.4g}"), Dimension.LENGTH) for n in (FEWEST_POINTS, most))
        value = show_quantity(options.part, Dimension.LENGTH)
        raise InvalidRequest([option_fault("part", value, f"{low} to {high}", "Write a side within the sample.")])
    rows, columns = ((size - count) // 2 for size in heights.shape)
    return heights[rows : rows + count, columns : columns + count].copy(), "mirror"


def _left_out(found: MapSet) -> list[str]:
    names = [Path(name).name for name in found.left_out]
    if not names:
        return []
    more = f" and {len(names) - LEFT_OUT_SHOWN} more" if len(names) > LEFT_OUT_SHOWN else ""
    return [f"Not used: {', '.join(names[:LEFT_OUT_SHOWN])}{more}"]
