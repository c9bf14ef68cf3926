"""`ridgewave analyze SCENE`: what is felt of a steady scene, by the whole finger and by the receptors of its skin."""

from __future__ import annotations

import argparse

from clients.command_line.exit_codes import DONE
from clients.command_line.printing import print_json, print_table
from clients.command_line.scene_argument import read_scene


def run(arguments: argparse.Namespace) -> int:
    """Carry out the command; raises InvalidRequest, CannotRender, OSError."""
    from synth.study.skin_outcome import skin_felt

    felt = skin_felt(read_scene(arguments))
    if arguments.json:
        print_json(felt)
        return DONE
    rows = []
    for one in felt["receptors"]:
        level = "nothing" if one["level"] is None else f"{one['level']:.1f} dB"
        where = f"{1e3 * one['frequency']:.3g} mm" if one["receptor"] == "SA1" else f"{one['frequency']:.4g} Hz"
        rows.append((one["receptor"], f"{1e3 * one['depth']:g} mm", f"{one['strain']:.2e}", level, where))
    print_table("", ("receptor", "depth", "strain", "over threshold", "at"), rows)
    whole = felt["whole_finger_level"]
    told = [
        ("whole finger", "nothing" if whole is None else f"{whole:.1f} dB over its threshold"),
        ("intensity of vibration", f"{felt['intensity']:.3g} thresholds"),
        ("felt by", felt["felt_by"]),
    ]
    print_table("", ("felt", "value"), told)
    return DONE
