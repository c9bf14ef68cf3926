"""`ridgewave analyze SCENE`: what is felt of a steady scene, or of a recording, by the receptors of the skin."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from clients.command_line.exit_codes import DONE, invalid_request
from clients.command_line.printing import print_json, print_table, warn
from clients.command_line.scene_argument import check_unchanged, read_scene


def run(arguments: argparse.Namespace) -> int:
    """Carry out the command; raises InvalidRequest, CannotRender, OSError."""
    felt = _felt(arguments, arguments.scene)
    if arguments.beside is None:
        _print(felt, arguments.json)
        return DONE
    from synth.perception.discrimination import beside

    other = _felt(arguments, arguments.beside)
    found = beside(felt, other)
    if arguments.json:
        print_json({"first": felt, "second": other} | found)
        return DONE
    for name, one in ((arguments.scene, felt), (arguments.beside, other)):
        for text in one.get("warnings", []):
            warn(f"{name}: {text}")
        print_table(name, ("felt", "value"), _told(one))
    level, frequency = found["level_db"], found["frequency"]
    rows = [
        ("verdict", found["verdict"]),
        ("intensity", "one does not vibrate" if level is None else f"{level:+.1f} dB"),
        ("strongest line", "one does not vibrate" if frequency is None else f"{100.0 * frequency:+.0f} % in frequency"),
    ]
    print_table("the second beside the first", ("difference", "value"), rows)
    return DONE


def _print(felt: dict[str, Any], as_json: bool) -> None:
    if as_json:
        print_json(felt)
        return
    for text in felt.get("warnings", []):
        warn(text)
    rows = []
    for one in felt["receptors"]:
        level = "nothing" if one["level"] is None else f"{one['level']:.1f} dB"
        where = f"{1e3 * one['frequency']:.3g} mm" if one["receptor"] == "SA1" else f"{one['frequency']:.4g} Hz"
        row = (one["receptor"], f"{1e3 * one['depth']:g} mm", f"{one['strain']:.2e}", f"{one['drive']:.2e} /s")
        rows.append((*row, level, where, str(one["components"])))
    print_table("", ("receptor", "depth", "strain", "drive", "over threshold", "at", "components"), rows)
    print_table("", ("felt", "value"), _told(felt))


def _told(felt: dict[str, Any]) -> list[tuple[str, str]]:
    whole = felt["whole_finger_level"]
    rows = [
        ("whole finger", "nothing" if whole is None else f"{whole:.1f} dB over its threshold"),
        ("intensity of vibration", f"{felt['intensity']:.3g} thresholds"),
    ]
    if "spatial_variation" in felt:
        rows.append(("spatial variation", f"{felt['spatial_variation']:.3g} thresholds"))
    return [*rows, ("felt by", felt["felt_by"])]


def _felt(arguments: argparse.Namespace, source: str) -> dict[str, Any]:
    from synth.study.recordings import is_recording, read_recording
    from synth.study.skin_outcome import skin_felt
    from synth.study.sound_outcome import sound_felt

    if not is_recording(source):
        for name in ("quantity", "rate", "scale", "column"):
            value = getattr(arguments, name)
            if value is not None and not is_recording(arguments.scene) and not is_recording(arguments.beside or ""):
                invalid_request(f"--{name}", str(value), "nothing with a scene", "Leave it out.")
        return skin_felt(read_scene(argparse.Namespace(**vars(arguments) | {"scene": source})))
    check_unchanged(arguments, "a recording")
    if arguments.everyday:
        invalid_request("--everyday", "true", "nothing with a recording", "Leave it out.")
    known = read_recording(
        Path(source), column=arguments.column, channel=arguments.channel, rate=arguments.rate, scale=arguments.scale
    )
    return sound_felt(known, arguments.quantity)
