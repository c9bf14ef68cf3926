"""`ridgewave analyze SCENE`: what is felt of a steady scene, or of a recording, by the receptors of the skin."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from clients.command_line.exit_codes import DONE
from clients.command_line.printing import print_json, print_table
from clients.command_line.scene_argument import check_unchanged, read_scene


def run(arguments: argparse.Namespace) -> int:
    """Carry out the command; raises InvalidRequest, CannotRender, OSError."""
    felt = _felt(arguments)
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


def _felt(arguments: argparse.Namespace) -> dict[str, Any]:
    from synth.study.recordings import is_recording, read_recording
    from synth.study.skin_outcome import skin_felt
    from synth.study.sound_outcome import sound_felt

    if not is_recording(arguments.scene):
        return skin_felt(read_scene(arguments))
    check_unchanged(arguments, "a recording")
    known = read_recording(
        Path(arguments.scene), column=arguments.column, channel=arguments.channel, rate=arguments.rate,
        scale=arguments.scale,
    )  # fmt: skip
    return sound_felt(known, arguments.quantity)
