"""`ridgewave compare SCENE RECORDING...`: sets measured vibrations beside the model's, line by line."""

from __future__ import annotations

import argparse
import math
from pathlib import Path
from typing import Any

from clients.command_line.exit_codes import DONE, invalid_request
from clients.command_line.printing import print_json, print_table, warn
from clients.command_line.scene_argument import read_scene

SHOWN = 16  # lines in the table


def run(arguments: argparse.Namespace) -> int:
    """Carry out the command; raises InvalidRequest, CannotRender, OSError."""
    from synth.study.comparison import compared
    from synth.study.recordings import quantity_of, read_recording

    if arguments.output is not None:
        from clients.study_figures import check_figure

        check_figure(None, [arguments.output])
    scene, made = read_scene(arguments), []
    for path in arguments.recordings:
        recording = read_recording(
            Path(path), column=arguments.column, channel=arguments.channel, rate=arguments.rate, scale=arguments.scale
        )
        quantity = quantity_of(recording, arguments.quantity)
        if not quantity:
            hint = "Write --quantity acceleration, velocity, displacement or tangential_force."
            invalid_request("--quantity", "none", "the quantity of a recording that does not say it", hint)
        values, told = recording.values, recording.warnings
        made.append(
            compared(scene, values, recording.rate, quantity, recording.name, scaled=recording.scaled, told=told)
        )
    if arguments.output is not None:
        from clients.compare_figure import draw

        draw(made, Path(arguments.output))
    if arguments.json:
        print_json([one.document() for one in made])
        return DONE
    for one in made:
        for text in one.warnings:
            warn(f"{one.name}: {text}")
        print_table(_title(one), ("n", "Hz", "measured", "model", "difference"), _rows(one))
    return DONE


def _title(one: Any) -> str:
    speed = "no line is found" if one.speed is None else f"{1e3 * one.speed:.4g} mm/s fits"
    gain = "" if one.gain is None else f", scale not known: one gain of {one.gain:+.1f} dB"
    return f"{one.name}: {speed} (stated {1e3 * one.stated_speed:.4g} mm/s){gain}"


def _rows(one: Any) -> list[tuple[str, ...]]:
    rows: list[tuple[str, ...]] = []
    for line in one.lines[:SHOWN]:
        measured = line.measured
        word = f"{measured.amplitude:.3g}" if measured.found else "mains" if measured.mains else "not found"
        model = "" if math.isnan(line.model) else f"{line.model:.3g}"
        difference = "" if line.difference is None else f"{line.difference:+.2f} dB"
        rows.append((str(measured.number), f"{measured.frequency:.5g}", word, model, difference))
    return rows
