"""`ridgewave import FILE`: reports what is in a file of heights, and keeps it as a texture."""

from __future__ import annotations

import argparse
import base64
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from clients.command_line.exit_codes import DONE, invalid_request
from clients.command_line.printing import print_json, print_table, say
from service.compute.import_process import read_here
from service.store.own_textures import own_store
from service.store.store import Quota
from service.store.texture_names import check_name, name_from_file
from synth.encode.part_file import write_whole
from synth.scene.quantity import Dimension, show_quantity
from synth.surfaces.measurement.import_options import READERS, read_options


def run(arguments: argparse.Namespace) -> int:
    """Carry out the command; raises InvalidRequest, CannotRender, OSError."""
    given = {name: getattr(arguments, name) for name in READERS}
    read_options(given)
    name = arguments.name or name_from_file(arguments.file)
    check_name(name)
    if arguments.picture is not None and Path(arguments.picture).suffix != ".png":
        invalid_request("--picture", arguments.picture, "a file name that ends in .png", "Write OUT.png.")
    found = read_here(Path(arguments.file), given)
    if arguments.picture is not None:
        write_whole(Path(arguments.picture), base64.b64decode(found.picture))
    kept = None
    if not arguments.dry_run:
        kept = own_store().keep("", name, found.surface, found.report["kind"], found.report, Quota())
    result = {"name": name, "kept": kept is not None, "address": found.surface.address, "report": found.report}
    if arguments.json:
        print_json(result)
        return DONE
    print_table("", ("surface", "value"), report_rows(found.report))
    for note in found.report["notes"]:
        print(f"Note: {note}.")
    say(f"kept as {name}" if kept else f"nothing was kept: without --dry-run it becomes the texture {name}")
    return DONE


def report_rows(report: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Return the report of an import as rows of a table."""
    stated = "stated by the file" if report["unit_stated_by_file"] else "given"
    unit = "" if report["unit"] is None else f"{report['unit']}, {stated}"
    missing = report["missing"]
    rule = {"refuse": "", "fill": ", filled from their neighbours", "crop": ", cut away"}[missing["rule"]]
    rows = [
        ("file", report["file"]),
        *_map_rows(report.get("maps")),
        ("read as", f"{report['format']}: {report['layout']}"),
        *_reading_rows(report["reading"]),
        ("channel", report["channel"]),
        ("size", " x ".join(_length(size, "mm") for size in report["size"])),
        ("points", " x ".join(map(str, report["points"]))),
        ("rows", "the first has the least y" if len(report["points"]) > 1 else ""),
        ("spacing", " x ".join(_length(step) for step in report["spacing"])),
        ("unit of x", report["unit_of_x"] or ""),
        ("unit of the heights", unit),
        ("Rq, rms height", _length(report["rq"])),
        ("Ra, mean height", _length(report["ra"])),
        ("peak to valley", _length(report["peak_to_valley"])),
        (
            "rms slope",
            ", ".join(f"{slope:.4g} along {axis}" for slope, axis in zip(report["rms_slope"], "xy", strict=False)),
        ),
        ("form removed", report["level"]),
        ("missing points", f"{missing['points']}{rule if missing['points'] else ''}"),
    ]
    return [(name, value) for name, value in rows if value]


def _map_rows(maps: Mapping[str, Any] | None) -> list[tuple[str, str]]:
    """Return which files of a set of maps were read."""
    roles = () if maps is None else ("displacement", "normal", "roughness", "packed")
    return [(f"{role} map", maps[role]) for role in roles if maps and role in maps]


def _reading_rows(reading: Mapping[str, Any] | None) -> list[tuple[str, str]]:
    """Return how a text was read: its encoding, and each column with its unit."""
    if reading is None:
        return []
    decimal = {".": "decimal points", ",": "decimal commas"}[reading["decimal_sign"]]
    separated = f", separated by {reading['separator']}" if reading["separator"] else ""
    columns = [
        f"{column['name'] or 'column ' + str(number)}: {column['read_as']}"
        + (f" in {column['unit']}" if column["unit"] else "")
        for number, column in enumerate(reading["columns"], 1)
    ]
    return [("text", f"{reading['encoding']}{separated}, {decimal}"), ("columns", "; ".join(columns))]


def _length(value: float, unit: str = "") -> str:
    if unit == "mm":
        return f"{value * 1e3:.6g} mm"
    return show_quantity(float(f"{value:.4g}"), Dimension.LENGTH)
