"""`ridgewave table SCENE -o NAME.safetensors`: writes the response table of a scene, for other programs."""

from __future__ import annotations

import argparse
from pathlib import Path

from clients.command_line.exit_codes import DONE, invalid_request
from clients.command_line.output_file import replaces
from clients.command_line.printing import print_json, print_table, say
from clients.command_line.progress import Waiting
from clients.command_line.scene_argument import read_scene
from synth.encode.part_file import write_whole

ENDING = ".safetensors"


def run(arguments: argparse.Namespace) -> int:
    """Carry out the command; raises InvalidRequest, CannotRender, OSError."""
    from synth.plan.scene_table import table_of_scene
    from synth.response.table_file import table_bytes

    path = Path(arguments.output)
    if path.suffix != ENDING or path.is_dir():
        invalid_request("--output", arguments.output, f"a file name that ends in {ENDING}", "Write NAME.safetensors.")
    scene = read_scene(arguments)
    replaced = replaces(path, arguments.no_clobber)
    with Waiting("making the table", arguments.progress):
        table = table_of_scene(scene)
        content = table_bytes(table)
        write_whole(path, content)
    errors = {name: table.error.largest_reported(name) for name in ("displacement", "velocity", "acceleration")}
    result = {
        "path": str(path),
        "replaced": replaced,
        "hash": table.hash,
        "bytes": len(content),
        "rows": len(table.loads),
        "harmonics": table.harmonics,
        "band_hz": table.band,
        "covered_n": list(table.covered),
        "largest_error": errors,
    }
    if arguments.json:
        print_json(result)
    else:
        low, high = table.covered
        rows = [
            ("file", f"{path}, {len(content)} bytes"),
            ("hash", table.hash),
            ("rows of load", f"{len(table.loads)}, from {low:g} to {high:g} N"),
            ("harmonics", f"{table.harmonics}, in full up to {table.band:g} Hz"),
            *((f"largest error of {name}", f"{error:.2g} of the peak-to-peak") for name, error in errors.items()),
        ]
        print_table("", ("table", "value"), rows)
        if replaced:
            say(f"replaced {path}, which existed; --no-clobber keeps existing files")
    return DONE
